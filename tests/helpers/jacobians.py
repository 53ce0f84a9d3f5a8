"""Holding a stiffness against differences of the force."""

from __future__ import annotations

import numpy as np

from ibfil.rods.system import RodSystem


def numerical_jacobian(rods: RodSystem, start, y: np.ndarray, h: float = 1e-6) -> np.ndarray:
    """Central differences of the forces with respect to the displacements y (n, m) from ``start``."""
    n, m = y.shape
    out = np.zeros((n, m, n, m))
    for j in range(n):
        for c in range(m):
            ahead, behind = y.copy(), y.copy()
            ahead[j, c] += h
            behind[j, c] -= h
            difference = rods.forces(rods.move(start, ahead), 0.0)[0] - rods.forces(rods.move(start, behind), 0.0)[0]
            out[:, :, j, c] = difference / (2 * h)
    return out


def assert_exact_jacobian(rods: RodSystem, start, y: np.ndarray) -> None:
    """Each of the four blocks (force, torque) x (position, turn) to 1e-7 of its largest entry.

    Central differences with h = 1e-6 err by h^2 f'''/6 and eps f/h: some 1e-9 of the largest entry here.
    """
    shape = rods.move(start, y)
    _, moment = rods.forces(shape, 0.0)
    exact = rods.stiffness(shape, start, moment, 0.0).dense()
    numerical = numerical_jacobian(rods, start, y)
    for rows in (slice(0, 3), slice(3, 4)):
        for columns in (slice(0, 3), slice(3, 4)):
            a, b = exact[:, rows][..., columns], numerical[:, rows][..., columns]
            if b.size:
                assert np.abs(a - b).max() < 1e-7 * np.abs(b).max()
