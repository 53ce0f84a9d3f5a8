"""The driving of a scene in time: how fast, with which period, and where it jumps."""
