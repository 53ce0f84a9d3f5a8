"""Rotations by their vectors: axis times angle, in radians; matrices act on columns."""

from __future__ import annotations

import numpy as np

from ..rods.loads import cross_matrix

_SMALL = 1e-4  # radians: below, the series to fourth order is exact to round-off


def rotation(vector: np.ndarray) -> np.ndarray:
    """The matrix (3, 3) of a rotation vector (3,): Rodrigues' formula."""
    angle, k = float(np.linalg.norm(vector)), cross_matrix(vector)
    if angle < _SMALL:
        return np.eye(3) + (1 - angle**2 / 6) * k + (0.5 - angle**2 / 24) * k @ k
    return np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle**2 * k @ k


def vector_of(matrix: np.ndarray) -> np.ndarray:
    """The rotation vector (3,) of a matrix (3, 3), its angle at most pi."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(matrix).as_rotvec()


def turning(vector: np.ndarray) -> np.ndarray:
    """How a rotation turns further, in the lab, as its vector (3,) changes: the matrix J (3, 3) of dw = J dvector.

    The left Jacobian of the exponential: rotation(v + dv) = rotation(J dv) rotation(v).
    """
    angle, k = float(np.linalg.norm(vector)), cross_matrix(vector)
    if angle < _SMALL:
        return np.eye(3) + (0.5 - angle**2 / 24) * k + (1 / 6 - angle**2 / 120) * k @ k
    return np.eye(3) + (1 - np.cos(angle)) / angle**2 * k + (angle - np.sin(angle)) / angle**3 * k @ k


def orthonormal(matrix: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) next to a matrix that is one but for round-off, which must not build up over many steps."""
    x = matrix[:, 0] / np.linalg.norm(matrix[:, 0])
    y = matrix[:, 1] - (matrix[:, 1] @ x) * x
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])
