"""The case file: read, checked, and all its faults reported at once."""
