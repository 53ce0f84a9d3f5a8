"""Schemes in time, the control of the step's length, stability limits, thermal steps."""
