"""What happens how fast in a scene: what drives it, relaxation times, the explicit limit, and the automatic step.

How fast a scene is driven, in radians per time, is what the automatic step and the dimensionless groups rest on:
`cycles` of what is prescribed to change in time, `pushes` of what has no period.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from . import assemble_fluid, banded
from .assemble_loads import triple
from .expressions import Expression
from .fluid import Fluid, Held
from .geometry import Geometry
from .loads import BodyForce, DeadForce, Follower, ForceField
from .mechanics import Mechanics

if TYPE_CHECKING:
    from .case_filament import End, Filament
    from .simulation import Simulation

POINTS_A_PERIOD = 25
CELLS, INERTIAL = 0.125, 0.5  # see crossing
_SETTLED = 0.01  # of the explicit limit, where it depends on the step itself
STRETCH = 1e-3  # what thermal kicks may leave of it with the automatic step
# beta^4 of the slowest bending mode of a rod: relaxation time zeta L^4/(A beta^4).
_SLOWEST = {
    ("free", "free"): 500.564,
    ("clamped", "free"): 12.36236,
    ("free", "hinged"): 237.721,
    ("hinged", "hinged"): 97.409,
    ("clamped", "hinged"): 237.721,
    ("clamped", "clamped"): 500.564,
}


def angular_rate(value: Callable[[float], np.ndarray], end: float) -> float:
    """How fast a prescribed quantity changes, in radians per time: largest rate over half the range.

    For a sinusoid that is its angular frequency. Zero for a constant. Sampled at 400 times in [0, end].
    """
    times = np.linspace(0.0, end, 400)
    h = 1e-7 * end
    samples = np.array([np.broadcast_to(value(t), np.shape(value(0.0))) for t in times]).reshape(400, -1)
    with np.errstate(invalid="ignore"):  # what has no value at some time is told when the run comes to it
        change = np.array([np.ravel(value(t + h)) - np.ravel(value(t)) for t in times[:-1]]) / h
    size = 0.5 * float(np.max(np.ptp(samples, axis=0)))
    fastest = float(np.max(np.abs(change)))
    return fastest / size if size > 0 else 0.0


def wave_number(value: Callable[[np.ndarray], np.ndarray], s: np.ndarray) -> float:
    """2 pi over the wavelength of a prescribed curvature along s, by the same rule; zero where it is constant."""
    fine = np.linspace(s[0], s[-1], 2001)
    samples = np.broadcast_to(value(fine), fine.shape)
    size = 0.5 * float(np.ptp(samples))
    return float(np.max(np.abs(np.gradient(samples, fine)))) / size if size > 1e-12 else 0.0


def cycles(simulation: Simulation) -> list[float]:
    """The rates of all that is prescribed to change in time: strains, spins, moving ends, loads, the flow."""
    case, end = simulation.case, simulation.case.time.end
    rates = []
    for filament in case.filaments.values():
        s = np.linspace(0.0, filament.length, 101)
        for expression in (*filament.curvature, filament.twist_rate, *_in_internal_moment(filament)):
            if "t" in expression.variables:
                rates.append(angular_rate(partial(expression.bind("s", "t"), s), end))
        for held in (filament.start, filament.finish):
            rates += _rates_of_end(held, end)
    if any("t" in e.variables for f in case.filaments.values() for e in _in_loads(f)):
        rates.append(angular_rate(partial(_applied, simulation), end))
    flow = assemble_fluid.flow(case)
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
        if isinstance(load, (Follower, DeadForce, ForceField, BodyForce)):
            size = max(float(np.linalg.norm(_force(simulation, load, t), axis=1).sum()) for t in times)
            rates.append(2 * np.pi * size / slowest)
    flow = assemble_fluid.flow(case)
    if flow is not None:
        for name, filament in case.filaments.items():
            r = simulation.start.r[simulation.nodes(name)]
            size = max(float(np.linalg.norm(np.ptp(flow(r, t), axis=0))) for t in times)
            rates.append(2 * np.pi * size / filament.length)
    return [rate for rate in rates if rate > 0]


def _in_internal_moment(filament: Filament) -> Iterable[Expression]:
    loads = filament.loads
    return () if loads is None or loads.internal_moment is None else loads.internal_moment


def _rates_of_end(end: End, horizon: float) -> Iterator[float]:
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


def _in_loads(filament: Filament) -> Iterator[Expression]:
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


# --- how long things take -----------------------------------------------------------------------------------------


def softest(filament: Filament) -> float:
    """The smallest bending modulus along a filament."""
    s = np.linspace(0.0, filament.length, 11)
    return min(float(np.min(a.bind("s", "t")(s, 0.0))) for a in filament.bending)


def bending_time(drag: float, length: float, bending: float, start: str, finish: str) -> float:
    """Relaxation time of the slowest bending mode, zeta L^4/(A beta^4)."""
    return drag * length**4 / (bending * _SLOWEST[tuple(sorted((start, finish)))])  # type: ignore[index]


def implicit_step(cycles: list[float], pushes: list[float], slowest: float) -> float:
    """1/25 of the shortest period of what drives the rods, by the rates (radians per time) of `cycles` and `pushes`.

    Where nothing changes in time, no longer than 1/25 of the slowest bending time either: the rods go to rest in that.
    """
    rates = cycles + pushes if cycles else [*pushes, 2 * np.pi / slowest]
    return float(2 * np.pi / max(rates) / POINTS_A_PERIOD)


def crossing(reynolds: float) -> float:
    """Cells that the fastest fluid may cross in an automatic step, by a cell's own Reynolds number rho u h/eta.

    As a rod passes a point of the grid, fluid without inertia follows at once; with it the velocity there is stepped
    through the passing, so this goes from 1 to CELLS around INERTIAL. Set to errors of about 1e-3 L in two periods of
    the swimmer with its fastest node at Re 7 to 880; 25 steps a period, 0.4 cells, make 3e-3 L of them at Re 88, a
    speed wrong by 9 %, and none at Re 880: the run fails.
    """
    return (INERTIAL + CELLS * reynolds) / (INERTIAL + reynolds)


def thermal_stretch(energy: float, drag: float, bending: float, length: float, nodes: int, dt: float) -> float:
    """How much longer than at rest kicks of thermal energy leave a rod on average, in steps dt of the trapezoid.

    A linear step turns a segment by an angle a and lengthens it by a^2/2; the next takes that back as much again, so
    that half of it stands: a quarter of the mean of a^2. Modes q of the lattice, of rate lam = A q^4/zeta, move by
    <dy^2> = 2 kT/(A q^4) lam dt/(1 + lam dt/2) in each of two directions. Zero as dt is.
    """
    spacing = length / (nodes - 1)
    q = 2.0 * np.sin(0.5 * np.pi * np.arange(1, nodes) / (nodes - 1)) / spacing
    rate = bending * q**4 / drag * dt
    return float(energy / (bending * length) * np.sum(rate / (1.0 + 0.5 * rate) / q**2))


def explicit_limit(rods: Mechanics, fluid: Fluid, shape: Geometry, time: float, iterations: int = 1000) -> float:
    """2/rho(M K): the largest stable step of forward Euler at this configuration, by power iteration.

    K is the exact Jacobian, M the fluid's. Stops when an iteration changes the estimate by 1e-5: with the stiffest
    modes close together, some hundreds of iterations, it is then within 1 %. A fluid with inertia moves the more the
    longer the step is, up to Stokes flow: then it is the step dt with dt = 2/rho(M(dt) K), which errs on the safe side.
    """
    force, inner = rods.forces(shape, time)
    matrix = rods.stiffness(shape, shape, inner, time)
    held = Held(rods.ends.index, np.zeros(rods.ends.index.size))
    zero = np.zeros_like(force)
    x = np.random.default_rng(0).standard_normal(force.shape)
    x.ravel()[held.at] = 0.0
    dt, last = 1.0, 0.0
    while True:
        response = fluid.response(shape.r, shape.e3, time, dt)
        rest = response.forced(zero, held, zero).move

        def moved(x: np.ndarray, response=response, rest=rest, dt=dt) -> np.ndarray:
            return (response.forced(banded.multiply(matrix, x), held, zero).move - rest) / dt

        if last and abs(float(np.linalg.norm(moved(x / np.linalg.norm(x)))) - last) < _SETTLED * last:
            return 2.0 / last
        last, x = _radius(moved, x, iterations)
        if last == 0.0:
            return np.inf
        dt = float(np.sqrt(dt * 2.0 / last)) if dt != 1.0 else 2.0 / last


def _radius(moved: Callable[[np.ndarray], np.ndarray], x: np.ndarray, iterations: int) -> tuple[float, np.ndarray]:
    """The largest eigenvalue of a linear map, and what it stretches so; from x."""
    radius = 0.0
    for _ in range(iterations):
        x = x / np.linalg.norm(x)
        y = moved(x)
        new = float(np.linalg.norm(y))
        if new == 0.0:
            return 0.0, x
        settled, radius, x = abs(new - radius) < 1e-5 * new, new, y
        if settled:
            break
    return radius, x
