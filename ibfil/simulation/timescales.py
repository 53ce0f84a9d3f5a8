"""How long things take in a scene: what pushes rods by their length, relaxation, thermal kicks.

How fast what is prescribed changes is found in driving/, and the step that follows from both in steps.py.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .body_rates import body_rate

if TYPE_CHECKING:
    from ..case.filament import Filament
    from .driving.drivers import Drivers
    from .model import Model

MOST_TIMES = 200  # at which a load that changes is looked at
# beta^4 of the slowest bending mode of a rod: relaxation time zeta L^4/(A beta^4).
_SLOWEST = {
    ("free", "free"): 500.564,
    ("clamped", "free"): 12.36236,
    ("free", "hinged"): 237.721,
    ("hinged", "hinged"): 97.409,
    ("clamped", "hinged"): 237.721,
    ("clamped", "clamped"): 500.564,
}


# --- what pushes --------------------------------------------------------------------------------------------------


def load_rate(model: Model, drivers: Drivers) -> float:
    """The rate, in radians a time, of what pushes the rods: a turn is the time in which it moves one by its length.

    A force F does that in zeta L^2/F, or where the rod is heavy in sqrt(2 m L^2/F), a flow in L over its change along
    the rod. Of all filaments the largest; 0 where nothing pushes.
    """
    loads = [load for load in model.rods.system.loads if load.drives]
    flow, rods, rate = model.fluid_model.flow, model.rods, 0.0
    of_bodies = max(body_rate(model, time) for time in _some(drivers)) if rods.bodies else 0.0
    if not loads and flow is None:
        return of_bodies
    drag = {id(filament): model.fluid_model.drag(filament) * filament.length**2 for filament in rods.filaments}
    mass = {id(filament): 2 * mean_mass(filament) * filament.length**2 for filament in rods.filaments}
    for time in _some(drivers):
        force = np.zeros((rods.count, rods.system.unknowns))
        for load in loads:
            load.add_force(rods.nodes_at_start, time, force)
        size = np.linalg.norm(force[:, :3], axis=1)
        velocity = None if flow is None else flow(rods.start.r, time)
        for filament, where in zip(rods.filaments, rods.nodes, strict=True):
            total = float(size[where].sum())
            heavy = (total / mass[id(filament)]) ** 0.5 if mass[id(filament)] else np.inf
            rate = max(rate, min(total / drag[id(filament)], heavy))
            if velocity is not None:
                rate = max(rate, float(np.linalg.norm(np.ptp(velocity[where], axis=0))) / filament.length)
    return max(2 * np.pi * rate, of_bodies)


def _some(drivers: Drivers) -> np.ndarray:
    """Times at which what pushes is looked at: the start alone where nothing changes."""
    times = drivers.telling_times if drivers.drives else np.zeros(1)
    return times[:: -(-len(times) // MOST_TIMES)]


# --- how long things take -----------------------------------------------------------------------------------------


def softest(filament: Filament) -> float:
    """The smallest bending modulus along a filament."""
    s = np.linspace(0.0, filament.length, 11)
    return min(float(np.min(a.bind("s", "t")(s, 0.0))) for a in filament.bending)


def bending_time(drag: float, length: float, bending: float, start: str, finish: str) -> float:
    """Relaxation time of the slowest bending mode, zeta L^4/(A beta^4)."""
    return drag * length**4 / (bending * _SLOWEST[tuple(sorted((start, finish)))])  # type: ignore[index]


def slowest_bending(model: Model) -> float:
    """Relaxation time of the slowest bending mode of any filament; where it oscillates, the time of one radian."""
    return max(_slowest(f, model.fluid_model.drag(f)) for f in model.rods.different)


def _slowest(filament: Filament, drag: float) -> float:
    own = bending_time(drag, filament.length, softest(filament), filament.start.support, filament.finish.support)
    return own if filament.mass is None else float(1.0 / np.min(np.abs(bending_roots(filament, drag))))


def mean_mass(filament: Filament) -> float:
    """The mass per length of a filament, its mean; zero where it has none."""
    if filament.mass is None:
        return 0.0
    return float(np.mean(filament.mass.bind("s")(np.linspace(0.0, filament.length, 101))))


def bending_roots(filament: Filament, drag: float) -> np.ndarray:
    """The rates s (2,) of the slowest bending of a filament with mass, m s^2 + zeta s + zeta/(its bending time) = 0."""
    own = bending_time(drag, filament.length, softest(filament), filament.start.support, filament.finish.support)
    return np.roots([mean_mass(filament), drag, drag / own])


def seen(rate: complex, dt: float, order: int) -> complex:
    """The rate that e^(rate t) has in steps of dt, by Euler or by BDF2: 3/2 - 2/x + 1/(2 x^2) = rate dt."""
    z = complex(rate * dt)
    x = 1.0 / (1.0 - z) if order == 1 else (2.0 + np.sqrt(1.0 + 2.0 * z)) / (3.0 - 2.0 * z)
    return complex(np.log(x) / dt)


def inertial_time(model: Model) -> float:
    """The shortest time in which inertia shows: a radian of the slowest bending where it oscillates, else m/zeta."""
    times = [np.inf]
    for filament in model.rods.different:
        if filament.mass is not None:
            drag = model.fluid_model.drag(filament)
            roots = bending_roots(filament, drag)
            times.append(1.0 / abs(roots[0]) if roots[0].imag else mean_mass(filament) / drag)
    return float(min(times))
