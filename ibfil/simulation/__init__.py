"""The state of a run, and the one time loop."""
