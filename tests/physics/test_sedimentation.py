"""A straight rod that sinks in a periodic box, against cylinders: the radius and the length that the grid gives it.

Tirado & Garcia de la Torre, J. Chem. Phys. 71, 2581 (1979): mobilities of a cylinder of length l, radius a, p = l/2a.
Hasimoto, J. Fluid Mech. 5, 317 (1959): what the images of a cubic box of side B take, -2.837297/(6 pi eta B).
"""

from __future__ import annotations

import numpy as np
import pytest

from ibfil import parse_case
from ibfil.grid.kernels import KERNELS
from ibfil.simulation.simulation import Simulation

BOX, CELLS, VISCOSITY, WEIGHT = 4.0, 96, 0.7, 0.3
SCENE = f"""
[filament.rod]
length = 1.0
nodes = 25
bending = 10
stretching = 4000
loads = {{ weight = [0, 0, {-WEIGHT}] }}
[fluid]
model = "stokes"
viscosity = {VISCOSITY}
box = [{BOX}, {BOX}, {BOX}]
cells = [{CELLS}, {CELLS}, {CELLS}]
[time]
end = 0.02
step = 0.01
[output]
every = 0.02
"""


def cylinder(length: float, radius: float, along: bool) -> float:
    """The speed at which it sinks under a force of WEIGHT, along its axis or across, in the box."""
    p = length / (2 * radius)
    if along:
        free = (np.log(p) - 0.207 + 0.980 / p - 0.133 / p**2) / (2 * np.pi * length)
    else:
        free = (np.log(p) + 0.839 + 0.185 / p + 0.233 / p**2) / (4 * np.pi * length)
    return WEIGHT / VISCOSITY * (free - 2.837297 / (6 * np.pi * BOX))


@pytest.mark.parametrize("along", [False, True])
def test_a_rod_sinks_as_a_cylinder_of_the_line_radius_whose_ends_reach_a_radius_further(along):
    direction = ["filament.rod.direction=[0, 0, 1]", "filament.rod.normal=[1, 0, 0]"] if along else []
    simulation = Simulation(parse_case(SCENE, "rod.toml", direction))
    simulation.advance(0.02, lambda: None)
    velocity = simulation.snapshot().filaments["rod"].velocity
    s = simulation.arclength
    found = -np.trapezoid(velocity[:, 2], s)
    radius = KERNELS["peskin4"].line_radius * BOX / CELLS
    assert found == pytest.approx(cylinder(1.0 + 2 * radius, radius, along), rel=0.02)
    assert found < 0.95 * cylinder(1.0, radius, along)  # as long as its line it would sink faster
