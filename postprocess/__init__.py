"""Scripts that read run files and draw; no part of the package, and not in the wheel."""
