"""The largest stable step of forward Euler, 2/rho(M K)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..fluids.base import Fluid
from ..linalg.constraints import Prescribed
from ..rods.geometry import Configuration
from ..rods.system import RodSystem

_SETTLED = 0.01  # of the explicit limit, where it depends on the step itself


def explicit_limit(
    system: RodSystem, fluid: Fluid, configuration: Configuration, time: float, iterations: int = 1000
) -> float:
    """2/rho(M K): the largest stable step of forward Euler at this configuration, by power iteration.

    K is the exact Jacobian, M the fluid's. Stops when an iteration changes the estimate by 1e-5: with the stiffest
    modes close together, some hundreds of iterations, it is then within 1 %. A fluid with inertia moves the more the
    longer the step is, up to Stokes flow: then it is the step dt with dt = 2/rho(M(dt) K), which errs on the safe side.
    Infinite where no force answers to a move, and where a force or the flow has no value, which a step then tells.
    """
    force, inner = system.forces(configuration, time)
    matrix = system.stiffness(configuration, configuration, inner, time)
    held = Prescribed(system.ends.index, np.zeros(system.ends.index.size))
    zero = np.zeros_like(force)
    x = np.random.default_rng(0).standard_normal(force.shape)
    x.ravel()[held.at] = 0.0
    dt, last = 1.0, 0.0
    while True:
        response = fluid.response(configuration.r, configuration.e3, time, dt)
        rest = response.forced(zero, held, zero).move
        if not np.isfinite(rest).all():
            return np.inf

        def moved(x: np.ndarray, response=response, rest=rest, dt=dt) -> np.ndarray:
            return (response.forced(matrix.times(x), held, zero).move - rest) / dt

        if last and abs(float(np.linalg.norm(moved(x / np.linalg.norm(x)))) - last) < _SETTLED * last:
            return 2.0 / last
        last, x = _radius(moved, x, iterations)
        if last == 0.0 or not np.isfinite(last):
            return np.inf
        dt = float(np.sqrt(dt * 2.0 / last)) if dt != 1.0 else 2.0 / last


def _radius(moved: Callable[[np.ndarray], np.ndarray], x: np.ndarray, iterations: int) -> tuple[float, np.ndarray]:
    """The largest eigenvalue of a linear map, and what it stretches so; from x."""
    radius = 0.0
    for _ in range(iterations):
        x = x / np.linalg.norm(x)
        y = moved(x)
        new = float(np.linalg.norm(y))
        if new == 0.0 or not np.isfinite(new):
            return new, x
        settled, radius, x = abs(new - radius) < 1e-5 * new, new, y
        if settled:
            break
    return radius, x
