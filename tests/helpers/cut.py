"""A run that is cut, and goes on from its state."""

from __future__ import annotations

import numpy as np

from ibfil.case.schema import Case
from ibfil.simulation.simulation import Simulation


def assert_same_bits(case: Case, half: float, end: float) -> None:
    """Where a run goes on from the state of one that was cut at ``half``, its rods are those of an uncut one."""
    whole, cut, again = Simulation(case), Simulation(case), Simulation(case)
    for until in (half, end):
        whole.advance(until, lambda: None)
    cut.advance(half, lambda: None)
    again.restore(cut.state())
    again.advance(end, lambda: None)
    assert np.array_equal(again.configuration.table, whole.configuration.table)
