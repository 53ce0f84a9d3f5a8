"""From a case to its fluid."""
