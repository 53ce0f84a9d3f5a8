"""Eleven rods of 100 nodes that are bound to each other, against the same rods without links.

Nine lie round two, as the doublets of an axoneme do. Eleven bound pairs of 99 elements each, 1089 couplings.
"""

from __future__ import annotations

import math

import numpy as np

from ..case.reading import parse_case
from ..linalg.stiffness import Stiffness, no_pairs
from ..simulation.simulation import Simulation
from .timing import Row, against

_ROD = """
[filament.r{k}]
length = 1.0
nodes = {nodes}
derivative = {order}
bending = 1.0
twisting = 1.0
stretching = 1e4
radius = 0.01
position = [0, {y}, {z}]
start = {{ end = "clamped" }}
finish = {{ force = [0, 0.1, 0] }}
"""
_BIND = """
[link.l{k}]
kind = "bind"
filaments = ["r{one}", "r{other}"]
shear = 4e3
normal = 1e5
"""
_REST = """
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = 1.0
step = 1e-3
[output]
every = 1.0
"""


def _text(nodes: int, order: int, linked: bool) -> str:
    places = [(0.1 * math.cos(2 * math.pi * k / 9), 0.1 * math.sin(2 * math.pi * k / 9)) for k in range(9)]
    places += [(-0.03, 0.0), (0.03, 0.0)]
    pairs = [(k, (k + 1) % 9) for k in range(9)] + [(9, 10), (10, 0)]
    text = "".join(_ROD.format(k=k, nodes=nodes, order=order, y=y, z=z) for k, (y, z) in enumerate(places))
    if linked:
        text += "".join(_BIND.format(k=k, one=one, other=other) for k, (one, other) in enumerate(pairs))
    return text + _REST


def _begun(nodes: int, order: int, linked: bool) -> Simulation:
    simulation = Simulation(parse_case(_text(nodes, order, linked), "bench"))
    simulation.advance(3e-3, lambda: None)
    return simulation


def _stiffness(simulation: Simulation) -> tuple[Stiffness, np.ndarray]:
    """The matrix of a correction, and its right side (n, m)."""
    system, now = simulation.system, simulation.state_now
    force, inner = system.forces(now.configuration, now.time)
    return system.stiffness(now.configuration, now.configuration, inner, now.time), force


def _solve(simulation: Simulation, stiffness: Stiffness, force: np.ndarray) -> None:
    """One correction: factors and solution."""
    now, held, zero = simulation.state_now, simulation.system.held(0.0, 0.0), np.zeros(force.shape)
    response = simulation.fluid.response(now.configuration.r, now.configuration.e3, now.time, 1e-3)
    response.implicit(force, stiffness.copy(), held, zero, zero)


def linked(order: int, bars: tuple[float | None, float | None], nodes: int = 100) -> list[Row]:
    """One correction and one implicit step, of derivatives of an ``order``; bars for each."""
    bound, apart = (_begun(nodes, order, with_links) for with_links in (True, False))
    (whole, force), size = _stiffness(bound), f"11 x {nodes}, order {order}"
    band = Stiffness(_stiffness(apart)[0].band, no_pairs(bound.system.unknowns))
    solved = against(
        f"RFT, factors and solution of {len(bound.rods.links) * (nodes - 1)} couplings, {size}",
        lambda: _solve(bound, whole, force),
        "band without links",
        lambda: _solve(apart, band, force),
        bars[0],
    )
    stepped = against(
        f"RFT, implicit step with links, {size}",
        lambda: bound.attempt(1e-3),
        "the same without links",
        lambda: apart.attempt(1e-3),
        bars[1],
    )
    return [solved, stepped]
