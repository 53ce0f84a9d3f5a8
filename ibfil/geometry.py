"""From nodes and frames to tangents, strains and spacing: everything the forces are made of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from .rods import Mesh


class Geometry(NamedTuple):
    """One configuration of n nodes. Half-node arrays are indexed by segment and zero where there is no segment."""

    r: np.ndarray  # (n, 3) positions
    e1: np.ndarray  # (n, 3) first director
    e2: np.ndarray  # (n, 3) e3 x e1
    e3: np.ndarray  # (n, 3) unit tangent r'/|r'|
    speed: np.ndarray  # (n,) |r'|
    d1: np.ndarray  # (n, 3) r'
    d2: np.ndarray  # (n, 3) r''
    bend: np.ndarray  # (n, 2) O1 = -e2.r'', O2 = e1.r''
    twist: np.ndarray  # (n,) O3 at half nodes, Eq. 39
    gap: np.ndarray  # (n, 3) d = r_{i+1} - r_i
    length: np.ndarray  # (n,) |d|


@njit(cache=True)
def tangents(mesh: Mesh, r):
    """Unit tangents (n, 3) of the stencils, Eq. 15; NaN where r' vanishes."""
    n, p = mesh.w1.shape
    e3 = np.empty((n, 3))
    for i in range(n):
        x, y, z = mesh.c1[i, 0], mesh.c1[i, 1], mesh.c1[i, 2]
        for k in range(p):
            j, w = mesh.first[i] + k, mesh.w1[i, k]
            x += w * r[j, 0]
            y += w * r[j, 1]
            z += w * r[j, 2]
        f = 1.0 / np.sqrt(x * x + y * y + z * z)
        e3[i, 0], e3[i, 1], e3[i, 2] = f * x, f * y, f * z
    return e3


@njit(cache=True)
def measure(mesh: Mesh, r, e1):
    """Strains and spacing of the configuration r, e1 (n, 3); e1 is taken as normal to the stencils' tangents.

    O1 = -e2.r'' and O2 = e1.r'' at nodes; O3 = (e2_i + e2_{i+1}).(e1_{i+1} - e1_i)/(2 ds) at half nodes (Eq. 39).
    """
    n, p = mesh.w1.shape
    e2, e3, d1, d2 = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    speed, bend = np.empty(n), np.empty((n, 2))
    for i in range(n):
        x, y, z = mesh.c1[i, 0], mesh.c1[i, 1], mesh.c1[i, 2]
        u, v, w = mesh.c2[i, 0], mesh.c2[i, 1], mesh.c2[i, 2]
        for k in range(p):
            j, a, b = mesh.first[i] + k, mesh.w1[i, k], mesh.w2[i, k]
            x += a * r[j, 0]
            y += a * r[j, 1]
            z += a * r[j, 2]
            u += b * r[j, 0]
            v += b * r[j, 1]
            w += b * r[j, 2]
        q = np.sqrt(x * x + y * y + z * z)
        d1[i, 0], d1[i, 1], d1[i, 2] = x, y, z
        d2[i, 0], d2[i, 1], d2[i, 2] = u, v, w
        speed[i] = q
        x, y, z = x / q, y / q, z / q
        e3[i, 0], e3[i, 1], e3[i, 2] = x, y, z
        a0, a1, a2 = e1[i, 0], e1[i, 1], e1[i, 2]
        b0, b1, b2 = y * a2 - z * a1, z * a0 - x * a2, x * a1 - y * a0
        e2[i, 0], e2[i, 1], e2[i, 2] = b0, b1, b2
        bend[i, 0] = -(b0 * u + b1 * v + b2 * w)
        bend[i, 1] = a0 * u + a1 * v + a2 * w
    twist, gap, length = np.zeros(n), np.zeros((n, 3)), np.ones(n)
    for i in range(n - 1):
        if mesh.joined[i]:
            s, o = 0.0, 0.0
            for c in range(3):
                g = r[i + 1, c] - r[i, c]
                gap[i, c] = g
                s += g * g
                o += (e2[i, c] + e2[i + 1, c]) * (e1[i + 1, c] - e1[i, c])
            length[i] = np.sqrt(s)
            twist[i] = o / (2.0 * mesh.ds[i])
    return Geometry(r, e1, e2, e3, speed, d1, d2, bend, twist, gap, length)
