"""The shapes that filaments begin with."""
