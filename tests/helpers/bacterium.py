"""A sphere and a stiff helix, at rest as it is wound, which a motor turns about the axis through both."""

from __future__ import annotations

import numpy as np

from ibfil.case.reading import parse_case
from ibfil.simulation.simulation import Simulation

BOX = 'model = "stokes"\nbox = [2.4, 2.4, 2.4]\ncells = [48, 48, 48]'
WALL = 'model = "stokes"\nbox = "free"\nspacing = 0.05\nwall = "no-slip"'
FREE = 'model = "stokes"\nbox = "free"\nspacing = 0.05'

_CELL = """
[filament.tail]
length = {length}
nodes = {nodes}
bending = 1e4
twisting = 1e4
stretching = 1e6
radius = 0.02
shape = {{ kind = "helix", radius = 0.1, pitch = 0.6 }}
curvature = [{bend}, 0]
twist_rate = {twist}
position = [0.2, 0.1, {up}]
anchor = "start"
normal = [0, 0, -1]
start = {{ end = "body", body = "head", motor = {{ spin = 1.0, axis = [1, 0, 0] }} }}
[body.head]
shape = {{ kind = "sphere", radius = 0.2 }}
position = [0, 0, {up}]
"""

_ON_A_GRID = """
{cell}{more}
[fluid]
{fluid}
kernel = "bspline4"
viscosity = 1.3
[time]
end = 0.1
step = 0.02
[output]
every = 0.1
probes = [[0.5, 0.3, 0.1]]
[observe.heat]
kind = "dissipation"
"""


def cell(nodes: int, turns: float, up: float = 0.0) -> str:
    """The tables of the cell, its axis at the height ``up``."""
    r, c = 0.1, 0.6 / (2 * np.pi)
    length, q = float(2 * np.pi * turns * np.hypot(r, c)), r * r + c * c
    return _CELL.format(length=length, nodes=nodes, bend=r / q, twist=c / q, up=up)


def bacterium(fluid: str, nodes: int = 25, more: str = "", up: float = 0.0) -> Simulation:
    """It on a grid: ``fluid`` are the first keys of [fluid], ``more`` further tables."""
    return Simulation(parse_case(_ON_A_GRID.format(cell=cell(nodes, 1.5, up), more=more, fluid=fluid), "bacterium"))
