"""The mobility of nodes above a no-slip plane, pair by pair: that of free space, and each node with each image.

With weights w that are folded at the plane (wall.py), z_i = b_z + i the heights of a node's points, and the tables T0,
T1, T2 and t of grid/wall_tables.py,

    M_pq = sum_m c_x c_y c_z G(b_p - b_q + m)
         + sum_{m_x, m_y, n} c_x[m_x] c_y[m_y] ( e0[n] T0 + e1[n] T1 + e2[n] (T2, +-t) )(X, Y, b_pz + b_qz + n)

    e0[n] = sum_{i + j = n} w_i w_j,     e1[n] = sum w_i w_j (z_j - z_i),     e2[n] = sum w_i w_j z_i z_j

p the field, q the source. All pairs of free space come first and all images after them: each table by itself stays near
the processor. Where a pair is beyond a table its closed form is summed: over all heights, and along the plane over two
points as far from the middle as the second moments say.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...grid.far_pairs import is_far, moments
from ...grid.free_space import REACH
from ...grid.wall_tables import HIGH, image, oseen
from ...linalg.compiled import njit
from ...linalg.vectors import NOT_NEGATIVE
from .. import mobility_table
from ..mobility_table import Octant, plane_sums

_ELEVEN = (0,) * 11


class Walled(NamedTuple):
    """The tables of free space and of images (x, y, z and part), with 1/(eta h) in both and in ``scale``."""

    free: Octant
    images: np.ndarray
    scale: float


class Workspace(NamedTuple):
    """Of a pair: correlations along the plane, sums over heights, over planes, parts; xx yy zz xy zx zy xz yz."""

    c: np.ndarray
    e: np.ndarray
    acc: np.ndarray
    parts: np.ndarray
    sums: np.ndarray


def _workspace(points: int) -> Workspace:
    terms = 2 * points - 1
    return Workspace(np.empty((2, terms)), np.empty((3, terms)), np.empty(11 * terms), np.empty(11), np.empty(8))


@njit(cache=True, inline="always")
def _correlate(base, weights, a, b, space, points):
    """Correlations along the plane of the pair a, b, and sums over its heights."""
    p, c, e = len(points), space.c, space.e
    for axis in range(2):
        u, v = (b, a) if base[a, axis] < base[b, axis] else (a, b)  # mirrored: seen from the other node
        for m in range(2 * p - 1):
            c[axis, m] = 0.0
        for i in range(len(points)):
            for j in range(len(points)):
                c[axis, i - j + p - 1] += weights[u, axis, i] * weights[v, axis, j]
    for n in range(2 * p - 1):
        e[0, n] = e[1, n] = e[2, n] = 0.0
    for i in range(len(points)):
        for j in range(len(points)):
            z, q = base[a, 2] + i, base[b, 2] + j
            w = weights[a, 2, i] * weights[b, 2, j]
            e[0, i + j] += w
            e[1, i + j] += w * (q - z)
            e[2, i + j] += w * z * q


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _tabulated(table, base, weights, a, b, space, unit, points):
    """The image's part of the pair a, b into ``sums``, by the table."""
    _correlate(base, weights, a, b, space, points)
    x, y = base[a, 0] - base[b, 0], base[a, 1] - base[b, 1]
    sx, sy = (-1.0 if x < 0 else 1.0), (-1.0 if y < 0 else 1.0)
    z = 11 * ((base[a, 2] + base[b, 2]) & NOT_NEGATIVE)
    plane_sums(table, (abs(x) & NOT_NEGATIVE, abs(y) & NOT_NEGATIVE, z), space.c, space.acc, unit, points)
    e, acc, parts, sums = space.e, space.acc, space.parts, space.sums
    for k in range(len(unit)):
        parts[k] = 0.0
    for n in range(2 * len(points) - 1):
        for k in range(4):
            parts[k] += e[0, n] * acc[11 * n + k]
        for k in range(4, 6):
            parts[k] += e[1, n] * acc[11 * n + k]
        for k in range(6, 11):
            parts[k] += e[2, n] * acc[11 * n + k]
    sums[0], sums[1], sums[2] = parts[0] + parts[6], parts[1] + parts[7], parts[2] + parts[6] + parts[7]
    sums[3] = sx * sy * (parts[3] + parts[8])
    sums[4], sums[5] = sx * (parts[4] + parts[9]), sy * (parts[5] + parts[10])
    sums[6], sums[7] = sx * (parts[4] - parts[9]), sy * (parts[5] - parts[10])


@njit(cache=True)
def _closed(base, weights, centres, a, b, scale, free, sums):
    """The image's part in closed form, and with it Oseen's tensor where ``free``."""
    first, second = centres
    x, y = first[a, 0] - first[b, 0], first[a, 1] - first[b, 1]
    dx, dy = np.sqrt(second[a, 0] + second[b, 0]), np.sqrt(second[a, 1] + second[b, 1])
    sums[:] = 0.0
    for i in range(weights.shape[2]):
        for j in range(weights.shape[2]):
            weight = 0.25 * scale * weights[a, 2, i] * weights[b, 2, j]
            if weight != 0.0:
                p, q = float(base[a, 2] + i), float(base[b, 2] + j)
                for sx in (-1.0, 1.0):
                    for sy in (-1.0, 1.0):
                        image(x + sx * dx, y + sy * dy, p, q, weight, sums)
                        if free:
                            oseen(x + sx * dx, y + sy * dy, p - q, weight, sums)


@njit(cache=True, inline="always")
def _image(walled, base, weights, centres, a, b, space, unit, points):
    """The image's part of the pair a, b into ``sums``; whether all of the pair is there."""
    far = is_far(base, a, b, REACH)
    if far or base[a, 2] + base[b, 2] >= HIGH:
        _closed(base, weights, centres, a, b, walled.scale, far, space.sums)
    else:
        _tabulated(walled.images, base, weights, a, b, space, unit, points)
    if a == b:
        space.sums[4:] = 0.0  # odd, and so nothing but round-off
    return far


@njit(cache=True, inline="always")
def _put(out, i, j, sums, free):
    """Adds the image's part of a pair to what is there, or puts it in its place."""
    if not free:
        for x in range(3):
            for y in range(3):
                out[i, x, j, y] = 0.0
    for x in range(3):
        out[i, x, j, x] += sums[x]
    out[i, 0, j, 1] += sums[3]
    out[i, 1, j, 0] += sums[3]
    out[i, 2, j, 0] += sums[4]
    out[i, 2, j, 1] += sums[5]
    out[i, 0, j, 2] += sums[6]
    out[i, 1, j, 2] += sums[7]


@njit(cache=True)
def _add_all(out, walled, base, weights, space, unit, points):
    n, centres = weights.shape[0], moments(base, weights)
    for a in range(n):
        for b in range(a, n):
            far = _image(walled, base, weights, centres, a, b, space, unit, points)
            _put(out, a, b, space.sums, not far)
            if a != b:
                for x in range(3):
                    for y in range(3):
                        out[b, y, a, x] = out[a, x, b, y]


@njit(cache=True)
def _add_pairs(out, walled, base, weights, rows, columns, space, unit, points):
    centres = moments(base, weights)
    for i in range(rows.size):
        for j in range(columns.size):
            far = _image(walled, base, weights, centres, rows[i], columns[j], space, unit, points)
            _put(out, i, j, space.sums, not far)


def mobility(walled: Walled, base: np.ndarray, weights: np.ndarray, slip: np.ndarray) -> np.ndarray:
    """The whole matrix (n, 3, n, 3) of nodes, symmetric to the last bit, with the slip (n,) on its diagonal."""
    out, points = mobility_table.mobility(walled.free, base, weights, slip), weights.shape[2]
    _add_all(out, walled, base, weights, _workspace(points), _ELEVEN, (0,) * points)
    return out


def pairs(
    walled: Walled, base: np.ndarray, weights: np.ndarray, slip: np.ndarray, rows: np.ndarray, columns: np.ndarray
) -> np.ndarray:
    """The mobility (len(rows), 3, len(columns), 3) between nodes, with slip[i] on the diagonal of node i."""
    points = weights.shape[2]
    out = mobility_table.pairs(walled.free, base, weights, slip, rows, columns)
    _add_pairs(out, walled, base, weights, rows, columns, _workspace(points), _ELEVEN, (0,) * points)
    return out
