"""Rotations by their vectors: axis times angle, in radians; matrices act on columns."""

from __future__ import annotations

import numpy as np

from ..linalg.compiled import njit

_SMALL = 1e-4  # radians: below, the series to fourth order is exact to round-off


@njit(cache=True)
def _made(vector, one, two):
    """1 + one k + two k k (3, 3), k the cross matrix of a vector (3,)."""
    x, y, z = vector
    out = np.empty((3, 3))
    out[0, 0], out[0, 1], out[0, 2] = 1 - two * (y * y + z * z), two * x * y - one * z, two * x * z + one * y
    out[1, 0], out[1, 1], out[1, 2] = two * x * y + one * z, 1 - two * (x * x + z * z), two * y * z - one * x
    out[2, 0], out[2, 1], out[2, 2] = two * x * z - one * y, two * y * z + one * x, 1 - two * (x * x + y * y)
    return out


@njit(cache=True)
def rotation(vector):
    """The matrix (3, 3) of a rotation vector (3,): Rodrigues' formula."""
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if angle < _SMALL:
        return _made(vector, 1 - angle**2 / 6, 0.5 - angle**2 / 24)
    return _made(vector, np.sin(angle) / angle, (1 - np.cos(angle)) / angle**2)


def vector_of(matrix: np.ndarray) -> np.ndarray:
    """The rotation vector (3,) of a matrix (3, 3), its angle at most pi."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(matrix).as_rotvec()


@njit(cache=True)
def turning(vector):
    """How a rotation turns further, in the lab, as its vector (3,) changes: the matrix J (3, 3) of dw = J dvector.

    The left Jacobian of the exponential: rotation(v + dv) = rotation(J dv) rotation(v).
    """
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if angle < _SMALL:
        return _made(vector, 0.5 - angle**2 / 24, 1 / 6 - angle**2 / 120)
    return _made(vector, (1 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3)


@njit(cache=True)
def turned(vector, axes):
    """Axes (3, 3), in columns, turned by a rotation vector (3,): orthonormal to round-off, which must not build up."""
    matrix = rotation(vector)
    out = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                out[i, j] += matrix[i, k] * axes[k, j]
    x, y = out[:, 0], out[:, 1]
    x /= np.sqrt(x[0] ** 2 + x[1] ** 2 + x[2] ** 2)
    y -= (y[0] * x[0] + y[1] * x[1] + y[2] * x[2]) * x
    y /= np.sqrt(y[0] ** 2 + y[1] ** 2 + y[2] ** 2)
    out[0, 2] = x[1] * y[2] - x[2] * y[1]
    out[1, 2] = x[2] * y[0] - x[0] * y[2]
    out[2, 2] = x[0] * y[1] - x[1] * y[0]
    return out
