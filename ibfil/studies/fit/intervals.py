"""Intervals of fitted parameters, which of them the data settle, and how long noise remembers. No runs, no files.

Tracked points are not independent of each other, so the noise is taken by blocks of frames (a sandwich, clustered):

    H = (J'J)^-1,   C = H (sum_b g_b g_b' + J_o'J_o) H,   g_b = J_b' r_b sqrt(m/(m-1)),   t of m - 1 degrees

with J the Jacobian of the residuals r of points, J_o of observables (in their standard errors), m blocks b. With
q = 1 + 2 sum of the residuals' autocorrelation in time, to where it falls below 0.05, a block is 2 q - 1 frames: one
where nothing is remembered. A direction along which J is nothing but the error of its differences is free.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

LEVEL = 0.95
_FEW = 4  # blocks; below, points are taken as independent, and that is told
_END = 0.05  # of the autocorrelation
_NOTHING = 1e-6  # of the largest singular value: what differences of 1e-3 leave
_WIDE = 100.0  # a standard error that is as good as none, of logarithms


@dataclass(frozen=True)
class Spread:
    """Covariance (p, p) of parameters, and the half-width of an interval in standard errors.

    ``white``: the covariance were all points independent. ``blocks``: 0 where they were taken so.
    """

    covariance: np.ndarray
    white: np.ndarray
    factor: float
    blocks: int
    frames_a_block: int

    @property
    def half(self) -> np.ndarray:
        """Half-widths (p,)."""
        return self.factor * np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> np.ndarray:
        """Correlations (p, p)."""
        size = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(size, size)


def memory(residuals: np.ndarray) -> float:
    """How many frames residuals (frames, k), each k a series in time, remember: 1 + 2 sum of the autocorrelation."""
    frames = len(residuals)
    power = float(np.mean(residuals**2))
    total = 1.0
    for lag in range(1, frames // 2):
        now = float(np.mean(residuals[lag:] * residuals[:-lag])) / power if power > 0 else 0.0
        if now < _END:
            break
        total += 2.0 * now
    return total


def spread(
    jacobians: Sequence[np.ndarray], residuals: Sequence[np.ndarray], observables: np.ndarray, remembered: float
) -> Spread:
    """The spread of the parameters from J (n, p) and r (n,) of each time, and J of observables (k, p)."""
    from scipy.stats import norm, t

    p = observables.shape[1]
    every = np.concatenate([*jacobians, observables])
    inverse, free = _inverse(every)
    if not jacobians:
        return Spread(inverse + free, inverse + free, float(norm.ppf(0.5 + LEVEL / 2)), 0, 0)
    count = sum(len(one) for one in residuals)
    degrees = max(count + len(observables) - p, 1)
    variance = sum(float(one @ one) for one in residuals) / degrees
    # Points have the variance found here, observables the one they came with.
    own = sum(j.T @ j for j in jacobians)
    white = inverse @ (variance * own + observables.T @ observables) @ inverse + free
    size = int(np.clip(round(2 * remembered - 1), 1, max(len(residuals) // _FEW, 1)))
    groups = np.array_split(np.arange(len(residuals)), max(len(residuals) // size, 1))
    m = len(groups)
    if m < max(_FEW, p + 1):
        return Spread(white, white, float(t.ppf(0.5 + LEVEL / 2, degrees)), 0, size)
    pulls = np.array([sum(jacobians[i].T @ residuals[i] for i in group) for group in groups])
    middle = pulls.T @ pulls * m / (m - 1) + observables.T @ observables
    return Spread(inverse @ middle @ inverse + free, white, float(t.ppf(0.5 + LEVEL / 2, m - 1)), m, size)


def _inverse(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(J'J)^-1 (p, p) on the directions that J (n, p) tells of, and a covariance without an end on the others."""
    _, sizes, directions = np.linalg.svd(jacobian, full_matrices=False)
    told = sizes > _NOTHING * max(float(sizes[0]), 1e-300)
    known, free = directions[told] / sizes[told][:, None], directions[~told] * _WIDE
    return known.T @ known, free.T @ free


def moved(jacobian: np.ndarray, change: np.ndarray) -> np.ndarray:
    """How far the least squares moves (p,) where the residuals change (n,), to first order; J (n, p)."""
    return np.asarray(-_inverse(jacobian)[0] @ jacobian.T @ change)


def weakest(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The singular values (p,) of J (n, p), largest first, and the direction (p,) of the least."""
    _, sizes, directions = np.linalg.svd(jacobian, full_matrices=False)
    return sizes, directions[-1] * (1.0 if directions[-1][np.argmax(np.abs(directions[-1]))] > 0 else -1.0)
