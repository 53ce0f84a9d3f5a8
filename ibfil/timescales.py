"""What happens how fast in a scene: periods, relaxation times, the explicit limit, and the automatic step."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .fluid import Fluid, Held
from .geometry import Geometry
from .mechanics import Mechanics

_POINTS_A_PERIOD = 25
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


def bending_time(drag: float, length: float, bending: float, start: str, finish: str) -> float:
    """Relaxation time of the slowest bending mode, zeta L^4/(A beta^4)."""
    return drag * length**4 / (bending * _SLOWEST[tuple(sorted((start, finish)))])  # type: ignore[index]


def implicit_step(rates: list[float], slowest: float) -> float:
    """1/25 of the shortest period of what drives the rods (radians per time each), else of the slowest bending time."""
    driven = [rate for rate in rates if rate > 0]
    period = 2 * np.pi / max(driven) if driven else slowest
    return float(period / _POINTS_A_PERIOD)


def explicit_limit(rods: Mechanics, fluid: Fluid, shape: Geometry, time: float, iterations: int = 200) -> float:
    """2/rho(M K): the largest stable step of forward Euler at this configuration, by power iteration.

    K is the exact Jacobian, M the fluid's; stops when the estimate has settled to 0.1 %.
    """
    from . import banded

    force, inner = rods.forces(shape, time)
    matrix = rods.stiffness(shape, shape, inner, time, False)
    response = fluid.response(shape.r, shape.e3, time, 1.0)
    held = Held(rods.ends.index, np.zeros(rods.ends.index.size))
    zero = np.zeros_like(force)
    rest = response.forced(zero, held, zero).move
    x = np.random.default_rng(0).standard_normal(force.shape)
    x.ravel()[held.at] = 0.0
    radius = 0.0
    for _ in range(iterations):
        x /= np.linalg.norm(x)
        y = response.forced(banded.multiply(matrix, x), held, zero).move - rest
        new = float(np.linalg.norm(y))
        if new == 0.0:
            return np.inf
        settled, radius, x = abs(new - radius) < 1e-4 * new, new, y
        if settled:
            break
    return 2.0 / radius
