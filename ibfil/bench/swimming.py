"""A tail of 41 nodes with a head in it, a sphere of 65 markers, against the same tail without."""

from __future__ import annotations

from ..case.reading import parse_case
from ..simulation.simulation import Simulation
from .timing import Row, against

_TAIL = """
[filament.tail]
length = 1.0
nodes = 41
bending = 1.0
stretching = 1e4
curvature = ["6*sin(2*pi*(s - t))", 0]
shape = {{ kind = "relaxed" }}
anchor = "start"
align = "tangent"
position = [0.145, 0, 0]
{end}
[fluid]
model = "stokes"
viscosity = 1.0
{space}
method = "table"
[time]
end = 1.0
step = 0.01
[output]
every = 1.0
"""
_HEAD = """start = { end = "body", body = "head" }
[body.head]
shape = { kind = "sphere", radius = 0.145 }
"""
_SPACES = {
    "free space": 'box = "free"\nspacing = 0.03125',
    "64^3": "box = [2, 2, 2]\ncells = [64, 64, 64]",
}


def _begun(space: str, end: str) -> Simulation:
    simulation = Simulation(parse_case(_TAIL.format(space=space, end=end), "bench"))
    simulation.advance(0.03, lambda: None)
    return simulation


def heads() -> list[Row]:
    """One implicit step by the table, in free space and in a box, against that of the tail, and against its own floor.

    The floor is the mobility of all nodes and markers, and LAPACK taking the markers out: the tail and its head have
    6.6 times the pairs of the tail alone.
    """
    return [row for name, space in _SPACES.items() for row in _head(name, space)]


def _head(name: str, space: str) -> list[Row]:
    cell, alone = _begun(space, _HEAD), _begun(space, "")
    immersed, now = cell.fluid.immersed, cell.state_now.configuration  # type: ignore[attr-defined]
    nodes, p = immersed.all_nodes(now.r, now.e3), immersed.shells.unknowns(len(now.r))
    piece = f"tail of 41 nodes and head of 65 markers, implicit step by table, {name}"

    def step() -> None:
        cell.attempt(0.01)

    return [
        against(piece, step, "the tail alone", lambda: alone.attempt(0.01), 3.0),
        against(piece, step, "its pairs and LAPACK", lambda: immersed.rigid(nodes, now.r, now.e3, 0.0, p), None),
    ]
