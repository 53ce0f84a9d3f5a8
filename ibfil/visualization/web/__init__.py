"""Pages of a run for a browser."""
