"""A case that is played in a browser."""
