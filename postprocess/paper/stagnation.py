"""Linear stability of a straight rod at a stagnation point: u = gamma (-x, y, 0), the rod along x.

With zeta_par = zeta_perp/2, lengths in L and h(x, t) the displacement across the rod,

    h_t/gamma = h + x h' + [ -h'''' + T h'' ]/mu,   T = mu (x^2 - 1/4)/4,   mu = zeta_perp gamma L^4/A
    h'' = h''' = 0 at both ends

by Chebyshev collocation. Two modes are the rod's drift (1) and its turning (2); the others are bending. With
Lambda = mu/(4 pi^4) (Eq. 58) they begin to grow at 0.393, 1.9, 4.5 ...
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eig


def chebyshev(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,) on [-1, 1] and the matrix (n, n) of the first derivative."""
    x = np.cos(np.pi * np.arange(n) / (n - 1))
    c = np.where((np.arange(n) == 0) | (np.arange(n) == n - 1), 2.0, 1.0) * (-1.0) ** np.arange(n)
    gaps = x[:, None] - x[None, :] + np.eye(n)
    d = np.outer(c, 1 / c) / gaps
    return x, d - np.diag(d.sum(axis=1))


def growth(mu: float, n: int = 48) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Growth rates over gamma, largest first (k,), the modes (n, k), and the points x/L (n,)."""
    x, d = chebyshev(n)
    x, d = 0.5 * x, 2.0 * d
    d2 = d @ d
    tension = 0.25 * mu * (x**2 - 0.25)
    right = np.eye(n) + x[:, None] * d + (-d2 @ d2 + tension[:, None] * d2) / mu
    left = np.eye(n)
    for row, condition in ((0, d2[0]), (1, (d2 @ d)[0]), (n - 2, (d2 @ d)[-1]), (n - 1, d2[-1])):
        right[row], left[row] = condition, 0.0
    rates, modes = eig(right, left)
    good = np.isfinite(rates) & (np.abs(rates) < 1e6)
    rates, modes = rates[good], modes[:, good]
    order = np.argsort(-rates.real)
    return rates[order].real, modes[:, order].real, x


def bending_rates(mu: float) -> np.ndarray:
    """Growth rates over gamma of the bending modes, by number of the mode: even and odd ones in turn."""
    rates, modes, _ = growth(mu)
    odd = np.array([abs(m @ m[::-1] + m @ m) < 1e-3 * (m @ m) for m in modes.T])
    even_rates, odd_rates = (_without(rates[which], rigid) for which, rigid in ((~odd, 1.0), (odd, 2.0)))
    return np.array([r for pair in zip(even_rates, odd_rates, strict=False) for r in pair])


def _without(rates: np.ndarray, rigid: float) -> np.ndarray:
    """All rates but the one that is the rigid motion's."""
    return np.delete(rates, np.argmin(np.abs(rates - rigid)))


def threshold(mode: int, low: float, high: float) -> float:
    """mu at which the bending mode of that number (0, 1, ...) neither grows nor decays. Raises ValueError."""
    from scipy.optimize import brentq

    return float(brentq(lambda mu: bending_rates(mu)[mode], low, high, xtol=1e-6))
