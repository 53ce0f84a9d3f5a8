"""The shipped swimmer, and how fast it swims."""

from __future__ import annotations

import numpy as np

from ibfil.case.library import find
from ibfil.case.reading import read_case
from ibfil.observables.time_series import trapezoid_weights
from ibfil.simulation.simulation import Simulation

PERIOD = 2 * np.pi / 10
IN_FREE_SPACE = ("fluid.box=free", "fluid.cells=absent", "fluid.spacing=0.025")


def swims(*changes: str) -> float:
    """Speed along x of the shipped swimmer over its second and third period."""
    case = read_case(find("swimmer_stokes"), ["output.grid_every=absent", "output.grid_stride=absent", *changes])
    simulation, middle = Simulation(case), []
    weights = trapezoid_weights(simulation.arclength)
    for k in (1, 2, 3):
        simulation.advance(k * PERIOD, lambda: None)
        middle.append(weights @ simulation.configuration.r / weights.sum())
    return float((middle[2] - middle[0])[0] / (2 * PERIOD))
