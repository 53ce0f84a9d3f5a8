"""How fast a scene is driven, in radians per time: what the automatic step and the dimensionless groups rest on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from . import assemble
from .assemble_loads import triple
from .expressions import Expression
from .loads import BodyForce, Dead, Follower, Place
from .timescales import angular_rate

if TYPE_CHECKING:
    from .case_filament import End, Filament
    from .simulation import Simulation


def cycles(simulation: Simulation) -> list[float]:
    """The rates of all that is prescribed to change in time: strains, spins, moving ends, loads, the flow."""
    case, end = simulation.case, simulation.case.time.end
    rates = []
    for filament in case.filaments.values():
        s = np.linspace(0.0, filament.length, 101)
        for expression in (*filament.curvature, filament.twist_rate, *_internal(filament)):
            if "t" in expression.variables:
                rates.append(angular_rate(partial(expression.bind("s", "t"), s), end))
        for held in (filament.start, filament.finish):
            rates += _of_end(held, end)
    if any("t" in e.variables for f in case.filaments.values() for e in _of_loads(f)):
        rates.append(angular_rate(partial(_applied, simulation), end))
    flow = assemble.flow(case)
    if flow is not None and any("t" in e.variables for e in case.fluid.flow or ()):
        rates.append(angular_rate(partial(flow, simulation.start.r), end))
    return [rate for rate in rates if rate > 0]


def pushes(simulation: Simulation) -> list[float]:
    """The rates of what pushes without a period: a turn is the time in which it moves a rod by its own length.

    A force F does that in zeta L^2/F, a flow in L over its change along the rod.
    """
    case, rates = simulation.case, []
    times = np.linspace(0.0, case.time.end, 101)
    slowest = min(simulation.drag(f) * f.length**2 for f in case.filaments.values())
    for load in simulation.mechanics.loads:
        if isinstance(load, (Follower, Dead, Place, BodyForce)):
            size = max(float(np.linalg.norm(_force(simulation, load, t), axis=1).sum()) for t in times)
            rates.append(2 * np.pi * size / slowest)
    flow = assemble.flow(case)
    if flow is not None:
        for name, filament in case.filaments.items():
            r = simulation.start.r[simulation.nodes(name)]
            size = max(float(np.linalg.norm(np.ptp(flow(r, t), axis=0))) for t in times)
            rates.append(2 * np.pi * size / filament.length)
    return [rate for rate in rates if rate > 0]


def _internal(filament: Filament) -> Iterable[Expression]:
    loads = filament.loads
    return () if loads is None or loads.internal_moment is None else loads.internal_moment


def _of_end(end: End, horizon: float) -> Iterator[float]:
    """The rates of a spin, a turn, a place that is prescribed."""
    times = np.linspace(0.0, horizon, 1001)
    if end.spin is not None:
        spin = end.spin.bind("t")
        yield max(abs(float(spin(t))) for t in times)
    if end.angle is not None:
        angle = end.angle.bind("t")
        yield float(np.max(np.abs(np.gradient([float(angle(t)) for t in times], times))))
    if end.moves is not None and any("t" in e.variables for e in end.moves):
        yield angular_rate(triple(end.moves, "t"), horizon)


def _of_loads(filament: Filament) -> Iterator[Expression]:
    """All expressions in the external loads of a filament."""
    for end in (filament.start, filament.finish):
        yield from (*(end.force or ()), *(end.moment or ()), *([end.follower] if end.follower else ()))
    loads = filament.loads
    if loads is not None:
        yield from (*(loads.force or ()), *(loads.body_force or ()), *(loads.moment or ()))
        if loads.tether is not None and loads.tether.to != "initial":
            yield from loads.tether.to


def _force(simulation: Simulation, load, time: float) -> np.ndarray:
    """What a load puts on the nodes of the start shape (n, 3)."""
    force = np.zeros((len(simulation.start.r), simulation.mechanics.unknowns))
    load.add_force(simulation.start, time, force)
    return force[:, :3]


def _applied(simulation: Simulation, time: float) -> np.ndarray:
    """All loads on the nodes of the start shape (n, m)."""
    force = np.zeros((len(simulation.start.r), simulation.mechanics.unknowns))
    for load in simulation.mechanics.loads:
        load.add_force(simulation.start, time, force)
    return force
