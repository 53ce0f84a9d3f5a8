"""Spreading nodal forces to the grid and interpolating its fields at nodes: S and J of Eq. 45, adjoint."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..linalg.compiled import njit


class Stencil(NamedTuple):
    """Where n nodes are on the grid: first index along each axis (n, 3), and weights from there on (n, 3, P)."""

    base: np.ndarray
    weights: np.ndarray


def mirrored(stencil: Stencil) -> Stencil:
    """Stencils of the images of nodes in the plane z = 0."""
    base, weights = stencil.base.copy(), stencil.weights.copy()
    base[:, 2] = 1 - weights.shape[2] - base[:, 2]
    weights[:, 2] = weights[:, 2, ::-1]
    return Stencil(base, weights)


@njit(cache=True)
def spread(base, weights, force, field):
    """Adds force (n, 3) to field (3, nx, ny, nz) with the weights; divide by the cell's volume for a density."""
    n, _, p = weights.shape
    nx, ny, nz = field.shape[1:]
    for q in range(n):
        for i in range(p):
            x = (base[q, 0] + i) % nx
            for j in range(p):
                y = (base[q, 1] + j) % ny
                w = weights[q, 0, i] * weights[q, 1, j]
                for k in range(p):
                    z = (base[q, 2] + k) % nz
                    v = w * weights[q, 2, k]
                    field[0, x, y, z] += v * force[q, 0]
                    field[1, x, y, z] += v * force[q, 1]
                    field[2, x, y, z] += v * force[q, 2]


@njit(cache=True)
def interpolate(base, weights, field):
    """The values (n, 3) of field (3, nx, ny, nz) at the nodes: the transpose of ``spread``."""
    n, _, p = weights.shape
    nx, ny, nz = field.shape[1:]
    out = np.zeros((n, 3))
    for q in range(n):
        for i in range(p):
            x = (base[q, 0] + i) % nx
            for j in range(p):
                y = (base[q, 1] + j) % ny
                w = weights[q, 0, i] * weights[q, 1, j]
                for k in range(p):
                    z = (base[q, 2] + k) % nz
                    v = w * weights[q, 2, k]
                    out[q, 0] += v * field[0, x, y, z]
                    out[q, 1] += v * field[1, x, y, z]
                    out[q, 2] += v * field[2, x, y, z]
    return out
