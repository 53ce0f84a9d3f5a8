"""The exact mobility of nodes in a fluid on a grid, without the grid (fluids/README.md).

Weights of a node are products over the axes, so the velocity that a unit force at node q gives node p is

    M_pq = sum_m c_x[m_x] c_y[m_y] c_z[m_z] G(b_p - b_q + m),    c[m] = sum_{i - j = m} w_p[i] w_q[j]

with G the grid's response to a unit force on one cell. It is the operator J L^-1 S itself, to round-off, and its cost
does not depend on the number of cells. G is even or odd along each axis, so one octant is stored, with a rim as wide
as a kernel: a pair is mirrored into the octant instead of each of its terms.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..grid.far_pairs import far_pair, is_far, moments
from ..grid.periodic_grid import Grid
from ..grid.spectral import StokesSymbol
from ..linalg.compiled import njit
from ..linalg.vectors import NOT_NEGATIVE

ALL = 2**62  # a reach that no pair is beyond
COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
_SIX = (0,) * 6
IN_ANY_ORDER = {"contract", "reassoc", "nsz"}  # sums may be taken so: what numba calls fastmath


def point_response(grid: Grid, viscosity: float, alpha: float = 0.0) -> np.ndarray:
    """G (6, nx, ny, nz): velocity from a unit force on cell 0, components xx, yy, zz, xy, xz, yz.

    Unit force: density 1/h^3 on that cell. ``alpha`` (density over time) is zero in Stokes flow.
    """
    from scipy.fft import irfftn

    symbol = StokesSymbol(*grid.wave_numbers(), viscosity, alpha)
    total, out = symbol.total * grid.spacing**3, np.empty((6, *grid.cells))
    for c, (a, b) in enumerate(COMPONENTS):
        out[c] = irfftn(symbol.solenoidal(a, b) / total, s=tuple(grid.cells), axes=(0, 1, 2))
    return out


class Octant(NamedTuple):
    """The octant of a response that every pair of nodes can be mirrored into.

    ``values`` (x, y, z and part) have a rim of a kernel's points less one; distances are taken modulo ``cells`` (3,).
    Pairs whose indices differ by ``reach`` or more on an axis are no part of it, in free space, but Oseen's tensor:
    G, R and W of it times ``scales`` (3,). Where the fluid is periodic ``reach`` is beyond all of them.
    """

    values: np.ndarray
    cells: np.ndarray
    reach: int = ALL
    scales: np.ndarray = np.ones(3)


def octant(response: np.ndarray, points: int, number: type = np.float64) -> Octant:
    """The octant of a response (k, nx, ny, nz) on a periodic grid, for kernels of so many points."""
    rim = points - 1
    axes = [np.arange(-rim, n // 2 + rim + 1) % n for n in response.shape[1:]]
    cut = response[:, axes[0][:, None, None], axes[1][None, :, None], axes[2][None, None, :]]
    table = np.ascontiguousarray(np.moveaxis(cut, 0, 3))
    return Octant(table.reshape(*table.shape[:2], -1).astype(number), np.array(response.shape[1:], np.int64))


@njit(cache=True, inline="always")
def plane_sums(table, corner, c, acc, unit, points):
    """The sums over x and y into ``acc`` (k terms,).

    Written so that the compiler takes neighbours in ``acc`` together. Up to four points it unrolls both sums, and keeps
    each in a register until it is whole; beyond, only that over x.
    """
    p = len(points)
    terms, length = 2 * p - 1, len(unit) * (2 * p - 1)
    at_x, at_y, at_z = corner
    if p <= 4:
        for k in range(length):
            plane = 0.0
            for j in range(2 * p - 1):
                line = 0.0
                for i in range(2 * p - 1):
                    line += c[0, i] * table[at_x + i, at_y + j, at_z + k]
                plane += c[1, j] * line
            acc[k] = plane
    else:
        for k in range(length):
            acc[k] = 0.0
        for j in range(terms):
            for k in range(length):
                line = 0.0
                for i in range(2 * p - 1):
                    line += c[0, i] * table[at_x + i, at_y + j, at_z + k]
                acc[k] += c[1, j] * line


@njit(cache=True, inline="always")
def sum_pair(octant, base, weights, a, b, c, acc, sums, unit, points):
    """All components of the octant for the pair a, b into ``sums`` (k,), the first six of them M_ab: xx .. yz.

    ``c`` (3, 2 P - 1) and ``acc`` (k (2 P - 1),) are room to work in, ``unit`` and ``points`` tuples of k and of P
    entries: what the compiler knows of k and P. Returns the signs (3,) of the mirrored axes, for components beyond the
    sixth. Arrays are indexed in full in every loop, and the whole is in line: a view of one costs more than the
    arithmetic, and a call, which counts references to all of them, a seventh of it.
    """
    p, parts = len(points), len(unit)
    corner = (0, 0, 0)
    sign = (1.0, 1.0, 1.0)
    for axis in range(3):
        n = octant.cells[axis]
        d = (base[a, axis] - base[b, axis]) % n
        mirrored = d > n // 2
        u, v = (b, a) if mirrored else (a, b)  # seen from the other node the axis points the other way
        for m in range(2 * p - 1):
            c[axis, m] = 0.0
        for i in range(len(points)):
            for j in range(len(points)):
                c[axis, i - j + p - 1] += weights[u, axis, i] * weights[v, axis, j]
        at, s = (n - d, -1.0) if mirrored else (d, 1.0)
        at &= NOT_NEGATIVE
        if axis == 0:
            corner, sign = (at, 0, 0), (s, 1.0, 1.0)
        elif axis == 1:
            corner, sign = (corner[0], at, 0), (sign[0], s, 1.0)
        else:
            corner, sign = (corner[0], corner[1], parts * at), (sign[0], sign[1], s)
    plane_sums(octant.values, corner, c, acc, unit, points)
    for x in range(parts):
        total = 0.0
        for k in range(2 * p - 1):
            total += c[2, k] * acc[parts * k + x]
        sums[x] = total
    sums[3] *= sign[0] * sign[1]
    sums[4] *= sign[0] * sign[2]
    sums[5] *= sign[1] * sign[2]
    return sign


@njit(cache=True, inline="always")
def sum_any(octant, base, weights, centres, a, b, c, acc, sums, unit, points):
    """The same of pairs near and far; ``centres`` are the moments of the nodes' weights (grid/far_pairs.py).

    They are None where no pair is far, and what is for these is not compiled.
    """
    if centres is not None:  # noqa: SIM102  what is asked of None alone the compiler leaves out
        if is_far(base, a, b, octant.reach):
            far_pair(centres[0], centres[1], a, b, octant.scales, sums)
            return 1.0, 1.0, 1.0
    return sum_pair(octant, base, weights, a, b, c, acc, sums, unit, points)


@njit(cache=True, fastmath=IN_ANY_ORDER)
def _pairs(octant, base, weights, centres, slip, rows, columns, points):
    terms = 2 * len(points) - 1
    c, acc, sums = np.empty((3, terms)), np.empty(6 * terms), np.empty(6)
    out = np.empty((rows.size, 3, columns.size, 3))
    for i in range(rows.size):
        for j in range(columns.size):
            a, b = rows[i], columns[j]
            sum_any(octant, base, weights, centres, a, b, c, acc, sums, _SIX, points)
            for x in range(3):
                out[i, x, j, x] = sums[x] + (slip[a] if a == b else 0.0)
            out[i, 0, j, 1] = out[i, 1, j, 0] = sums[3]
            out[i, 0, j, 2] = out[i, 2, j, 0] = sums[4]
            out[i, 1, j, 2] = out[i, 2, j, 1] = sums[5]
    return out


@njit(cache=True, fastmath=IN_ANY_ORDER)
def _mobility(octant, base, weights, centres, slip, points):
    n, terms = weights.shape[0], 2 * len(points) - 1
    c, acc, sums = np.empty((3, terms)), np.empty(6 * terms), np.empty(6)
    out = np.empty((n, 3, n, 3))
    for a in range(n):
        for b in range(a, n):
            sum_any(octant, base, weights, centres, a, b, c, acc, sums, _SIX, points)
            for x in range(3):
                out[a, x, b, x] = out[b, x, a, x] = sums[x]
            out[a, 0, b, 1] = out[b, 0, a, 1] = out[a, 1, b, 0] = out[b, 1, a, 0] = sums[3]
            out[a, 0, b, 2] = out[b, 0, a, 2] = out[a, 2, b, 0] = out[b, 2, a, 0] = sums[4]
            out[a, 1, b, 2] = out[b, 1, a, 2] = out[a, 2, b, 1] = out[b, 2, a, 1] = sums[5]
        for x in range(3):
            out[a, x, a, x] += slip[a]
    return out


def _centres(octant: Octant, base: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """The moments of the nodes' weights, where pairs may be far; None where the fluid is periodic."""
    return None if octant.reach == ALL else moments(base, weights)


def pairs(
    octant: Octant, base: np.ndarray, weights: np.ndarray, slip: np.ndarray, rows: np.ndarray, columns: np.ndarray
) -> np.ndarray:
    """The mobility (len(rows), 3, len(columns), 3) between nodes, with slip[i] added on the diagonal of node i.

    ``base`` (n, 3) and ``weights`` (n, 3, P) are the nodes' stencils.
    """
    centres = _centres(octant, base, weights)
    return _pairs(octant, base, weights, centres, slip, rows, columns, (0,) * weights.shape[2])


def mobility(octant: Octant, base: np.ndarray, weights: np.ndarray, slip: np.ndarray) -> np.ndarray:
    """The whole matrix (n, 3, n, 3) of the nodes, symmetric to the last bit, with the slip on its diagonal."""
    centres = _centres(octant, base, weights)
    return _mobility(octant, base, weights, centres, slip, (0,) * weights.shape[2])
