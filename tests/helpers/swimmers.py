"""Cells that beat, of a sphere and a tail each, side by side on a grid."""

from __future__ import annotations

from collections.abc import Sequence

from ibfil.case.reading import parse_case
from ibfil.simulation.simulation import Simulation

BOX = 'model = "stokes"\nbox = [2.4, 2.4, 2.4]\ncells = [48, 48, 48]'
FREE = 'model = "stokes"\nbox = "free"\nspacing = 0.05'
WALL = FREE + '\nwall = "no-slip"'
INERTIAL = BOX.replace('"stokes"', '"navier-stokes"') + "\ndensity = 10.0"

_CELL = """
[filament.tail{k}]
length = 0.8
nodes = {nodes}
bending = 1.0
twisting = 1.0
stretching = 1e3
radius = 0.02
curvature = ["5*sin(2*pi*s/0.8 - 2*pi*t + {phase})", 0]
position = [{end}, {y}, {z}]
anchor = "start"
start = {{ end = "body", body = "head{k}"{motor} }}
[body.head{k}]
shape = {{ kind = "sphere", radius = 0.15 }}
position = [{x}, {y}, {z}]
"""

_FLUID = """
[fluid]
{fluid}
kernel = "bspline4"
viscosity = 1.3
[time]
end = 1.0
step = 0.02
[output]
every = 0.02
"""


def swimmers(places: Sequence[tuple[float, float, float]], fluid: str, more: str = "", nodes: int = 9) -> str:
    """The case of cells with heads at ``places``, no two in phase; a motor turns the tail of the second.

    ``fluid`` are the first keys of [fluid], ``more`` further tables.
    """
    motor = ", motor = { spin = 4.0 }"
    cells = [
        _CELL.format(k=k, x=x, y=y, z=z, end=x + 0.15, nodes=nodes, phase=0.7 * k, motor=motor if k == 1 else "")
        for k, (x, y, z) in enumerate(places)
    ]
    return "".join(cells) + more + _FLUID.format(fluid=fluid)


def simulated(places: Sequence[tuple[float, float, float]], fluid: str, more: str = "") -> Simulation:
    """The simulation of it."""
    return Simulation(parse_case(swimmers(places, fluid, more), "swimmers"))
