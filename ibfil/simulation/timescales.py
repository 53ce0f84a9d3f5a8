"""How fast things happen in a scene: what drives it, relaxation times, and the automatic step.

How fast a scene is driven, in radians per time, is what the automatic step and the dimensionless groups rest on:
`forcing_rates` of what is prescribed to change in time, `load_rates` of what has no period.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..assembly.loads import triple
from ..case.walk import expressions
from ..timestepping.stability_limit import explicit_limit
from ..timestepping.step_control import AdaptiveStep, FixedStep, StepControl

if TYPE_CHECKING:
    from ..case.filament import End, Filament
    from .model import Model

POINTS_A_PERIOD = 25
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


def forcing_rates(model: Model) -> list[float]:
    """The rates of all that is prescribed to change in time: strains, spins, moving ends, loads, the flow."""
    case, end, rates = model.case, model.case.time.end, []
    for filament in case.filaments.values():
        s = np.linspace(0.0, filament.length, 101)
        for path, expression in expressions(filament):
            if _is_strain(path) and "t" in expression.variables:
                rates.append(angular_rate(partial(expression.bind("s", "t"), s), end))
        for held in (filament.start, filament.finish):
            rates += _rates_of_end(held, end)
    if any(_is_load(path) and "t" in e.variables for f in case.filaments.values() for path, e in expressions(f)):
        rates.append(angular_rate(partial(_applied, model), end))
    flow = model.fluid_model.flow
    if flow is not None and any("t" in e.variables for e in case.fluid.flow or ()):
        rates.append(angular_rate(partial(flow, model.rods.start.r), end))
    return [rate for rate in rates if rate > 0]


def _is_strain(path: str) -> bool:
    """Whether a formula of a filament is of its preferred strains, or a moment that stands with them."""
    return path.startswith(("curvature.", "twist_rate", "loads.internal_moment."))


def _is_load(path: str) -> bool:
    """Whether it is of an external load, on an end or along the rod; the motion of an end is none."""
    if path.startswith(("start.", "finish.")):
        return path.split(".")[1] not in ("moves", "spin", "angle")
    return path.startswith("loads.") and not _is_strain(path)


def load_rates(model: Model) -> list[float]:
    """The rates of what pushes without a period: a turn is the time in which it moves a rod by its own length.

    A force F does that in zeta L^2/F, a flow in L over its change along the rod.
    """
    case, rates, fluid = model.case, [], model.fluid_model
    times = np.linspace(0.0, case.time.end, 101)
    slowest = min(fluid.drag(f) * f.length**2 for f in case.filaments.values())
    for load in model.rods.system.loads:
        if load.drives:
            size = max(float(np.linalg.norm(_force(model, load, t), axis=1).sum()) for t in times)
            rates.append(2 * np.pi * size / slowest)
    if fluid.flow is not None:
        for name, filament in case.filaments.items():
            r = model.rods.start.r[model.nodes(name)]
            size = max(float(np.linalg.norm(np.ptp(fluid.flow(r, t), axis=0))) for t in times)
            rates.append(2 * np.pi * size / filament.length)
    return [rate for rate in rates if rate > 0]


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


def _force(model: Model, load, time: float) -> np.ndarray:
    """The force (n, 3) of a load on the nodes of the start shape."""
    force = np.zeros((len(model.rods.s), model.rods.system.unknowns))
    load.add_force(model.rods.start, time, force)
    return force[:, :3]


def _applied(model: Model, time: float) -> np.ndarray:
    """All loads on the nodes of the start shape (n, m)."""
    force = np.zeros((len(model.rods.s), model.rods.system.unknowns))
    for load in model.rods.system.loads:
        load.add_force(model.rods.start, time, force)
    return force


# --- how long things take -----------------------------------------------------------------------------------------


def softest(filament: Filament) -> float:
    """The smallest bending modulus along a filament."""
    s = np.linspace(0.0, filament.length, 11)
    return min(float(np.min(a.bind("s", "t")(s, 0.0))) for a in filament.bending)


def bending_time(drag: float, length: float, bending: float, start: str, finish: str) -> float:
    """Relaxation time of the slowest bending mode, zeta L^4/(A beta^4)."""
    return drag * length**4 / (bending * _SLOWEST[tuple(sorted((start, finish)))])  # type: ignore[index]


def slowest_bending(model: Model) -> float:
    """Relaxation time of the slowest bending mode of any filament."""
    filaments, drag = model.case.filaments.values(), model.fluid_model.drag
    return max(bending_time(drag(f), f.length, softest(f), f.start.end, f.finish.end) for f in filaments)


def stretch_by_kicks(model: Model, dt: float) -> float:
    """How much longer than at rest thermal kicks leave a filament on average in steps of dt; the most of all."""
    assert model.case.thermal is not None
    energy, drag = model.case.thermal.energy, model.fluid_model.drag
    filaments = model.case.filaments.values()
    return max(thermal_stretch(energy, drag(f), softest(f), f.length, f.nodes, dt) for f in filaments)


def implicit_step(forcing_rates: list[float], load_rates: list[float], slowest: float) -> float:
    """1/25 of the shortest period that drives the rods, by `forcing_rates` and `load_rates` (radians per time).

    Where nothing changes in time, no longer than 1/25 of the slowest bending time either: the rods go to rest in that.
    """
    rates = forcing_rates + load_rates if forcing_rates else [*load_rates, 2 * np.pi / slowest]
    return float(2 * np.pi / max(rates) / POINTS_A_PERIOD)


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


# --- the step -----------------------------------------------------------------------------------------------------


def control(model: Model) -> StepControl:
    """How the steps of a scene are chosen: equal ones, or by their error."""
    step, time = first_step(model), model.case.time
    if time.tolerance is None:
        return FixedStep(step, 2.0 if model.stepper.order == 2 else np.inf)
    rate = 2 * np.pi / (POINTS_A_PERIOD * step)
    return AdaptiveStep(time.tolerance, rate, time.end, time.order, model.rods.system.length)


def first_step(model: Model) -> float:
    """The step of the case; where it is automatic, what the speeds of the scene ask for."""
    time, rods = model.case.time, model.rods
    if not time.automatic:
        return float(time.step)

    def limit() -> float:
        return explicit_limit(rods.system, model.inner, rods.start, 0.0)

    if time.explicit:
        return 0.5 * limit()
    slowest = slowest_bending(model)
    step = implicit_step(forcing_rates(model), load_rates(model), slowest)
    if model.noise is not None:
        # The trapezoid forgets its stiffest mode in dt^2/(2 limit): no later than the softest is forgotten.
        step = min(step, float(np.sqrt(2 * limit() * slowest)))
        while stretch_by_kicks(model, step) > STRETCH:
            step *= 0.9
    return step
