"""The sub-cell-averaged mobility: what the grid would give if it did not notice where a node lies in its cell.

A stated approximation (ib_numerics.md, section 1), as good as the grid method is translation-invariant. The correlation
of two nodes' weights is replaced by its mean over the places of the pair in a cell, a function of their separation. On
each axis

    cbar_f[m] = mean over x of sum_{i - j = m} w_i(x + f) w_j(x),     Gbar(b + f) = sum_m cbar_f[m] G(b + m)

which is tabulated at half cells and interpolated with cubic polynomials: 64 terms a pair, whatever the kernel.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .kernels import Kernel

REFINED = 2  # table points a cell
_PLACES = 16  # in a cell, that the mean is taken over
_RIM = 2  # points below zero separation that cubic interpolation reaches, and one to spare


def correlations(kernel: Kernel) -> np.ndarray:
    """cbar_f[m] (REFINED, 2 P + 1) for separations of f = 0 and 1/2 cells, m from -P to P."""
    p = kernel.points
    out = np.zeros((REFINED, 2 * p + 1))
    x = (np.arange(_PLACES) + 0.5) / _PLACES
    for k in range(REFINED):
        places = np.stack([x + k / REFINED, x, np.zeros_like(x)], axis=1)
        base, weights = kernel.stencil(places)
        for a in range(_PLACES):
            for i in range(p):
                for j in range(p):
                    m = base[a, 0] + i - base[a, 1] - j
                    out[k, m + p] += weights[a, 0, i] * weights[a, 1, j] / _PLACES
    return out


def table(response: np.ndarray, kernel: Kernel) -> np.ndarray:
    """Gbar on one octant at half cells, with a rim, as (x, y, z, 6), of the grid's response G (6, nx, ny, nz)."""
    c, p = correlations(kernel), kernel.points
    out = response
    for axis in range(3):
        n = response.shape[axis + 1]
        cells = np.arange(-_RIM, n // 2 + _RIM + 1)
        parts = []
        for k in range(REFINED):
            terms = (c[k, m + p] * np.take(out, (cells + m) % n, axis=axis + 1) for m in range(-p, p + 1))
            parts.append(sum(terms))
        stacked = np.stack(parts, axis=axis + 2)
        shape = list(out.shape)
        shape[axis + 1] = REFINED * len(cells)
        out = stacked.reshape(shape)
    return np.ascontiguousarray(np.moveaxis(out, 0, 3))


@njit(cache=True)
def mobility(table, cells, coordinates, slip):
    """The matrix (n, 3, n, 3) between nodes at ``coordinates`` (n, 3), in cells, with the slip on its diagonal."""
    n = coordinates.shape[0]
    out = np.empty((n, 3, n, 3))
    weights, corner, sign = np.empty((3, 4)), np.empty(3, np.int64), np.empty(3)
    sums = np.empty(6)
    for a in range(n):
        for b in range(a, n):
            for axis in range(3):
                d = coordinates[a, axis] - coordinates[b, axis]
                d -= cells[axis] * np.floor(d / cells[axis] + 0.5)
                sign[axis] = -1.0 if d < 0.0 else 1.0
                x = abs(d) * REFINED
                first = int(np.floor(x))
                f = x - first
                corner[axis] = first - 1 + _RIM * REFINED
                weights[axis, 0] = -f * (f - 1.0) * (f - 2.0) / 6.0
                weights[axis, 1] = (f + 1.0) * (f - 1.0) * (f - 2.0) / 2.0
                weights[axis, 2] = -(f + 1.0) * f * (f - 2.0) / 2.0
                weights[axis, 3] = (f + 1.0) * f * (f - 1.0) / 6.0
            sums[:] = 0.0
            for i in range(4):
                for j in range(4):
                    for k in range(4):
                        w = weights[0, i] * weights[1, j] * weights[2, k]
                        for c in range(6):
                            sums[c] += w * table[corner[0] + i, corner[1] + j, corner[2] + k, c]
            xy, xz, yz = sign[0] * sign[1] * sums[3], sign[0] * sign[2] * sums[4], sign[1] * sign[2] * sums[5]
            for x in range(3):
                out[a, x, b, x] = out[b, x, a, x] = sums[x]
            out[a, 0, b, 1] = out[b, 0, a, 1] = out[a, 1, b, 0] = out[b, 1, a, 0] = xy
            out[a, 0, b, 2] = out[b, 0, a, 2] = out[a, 2, b, 0] = out[b, 2, a, 0] = xz
            out[a, 1, b, 2] = out[b, 1, a, 2] = out[a, 2, b, 1] = out[b, 2, a, 1] = yz
        for x in range(3):
            out[a, x, a, x] += slip[a]
    return out
