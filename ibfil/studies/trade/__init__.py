"""`ibfil trade`: error against the time it takes."""
