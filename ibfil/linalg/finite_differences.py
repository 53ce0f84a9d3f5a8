"""Weights of derivatives on uneven points, inside a rod and at its clamped ends."""

from __future__ import annotations

import numpy as np


def weights(x: np.ndarray, at: float, order: int) -> np.ndarray:
    """Weights (len(x),) of the ``order``-th derivative at ``at`` of the polynomial through the points ``x``."""
    scale = np.max(np.abs(x - at))
    powers = np.vander((x - at) / scale, increasing=True).T
    right = np.zeros(len(x))
    right[order] = float(np.prod(np.arange(1, order + 1))) / scale**order
    return np.linalg.solve(powers, right)


def clamped_weights(x: np.ndarray) -> tuple[np.ndarray, float]:
    """Weights of r'' at ``x[0]``: on three nodes, and on the slope there. Exact for cubics (rods/README.md).

    Even spacing: (-7 r1 + 8 r2 - r3 - 6 ds T)/(2 ds^2).
    """
    scale = np.max(np.abs(x - x[0]))
    u = (x - x[0]) / scale
    # One column for each unknown weight: r1, r2, r3, slope; one row for each of 1, x, x^2, x^3.
    rows = np.zeros((4, 4))
    rows[:, :3] = np.vander(u, 4, increasing=True).T
    rows[1, 3] = 1.0
    w = np.linalg.solve(rows, np.array([0.0, 0.0, 2.0, 0.0]))
    return w[:3] / scale**2, float(w[3] / scale)


def ghost_weights(x: np.ndarray) -> tuple[np.ndarray, float]:
    """Weights of r'' at ``x[0]``, as ``clamped_weights``, by a ghost node: 2 (r2 - r1 - ds T)/ds^2, twice the error.

    But with it and stencils of order 2 the stiffness of a clamped rod is symmetric, which equipartition needs.
    """
    ds = x[1] - x[0]
    return np.array([-2.0, 2.0, 0.0]) / ds**2, -2.0 / float(ds)
