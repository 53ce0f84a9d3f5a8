"""`ibfil stability`: which settings are stable and right."""
