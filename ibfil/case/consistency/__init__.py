"""Checks of what goes together in a case whose single values are all allowed."""
