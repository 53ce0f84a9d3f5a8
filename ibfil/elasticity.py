"""Eq. 44 of the paper, corrected: the nodal force of a Kirchhoff rod, and its exact Jacobian.

The force through the face between nodes i and i + 1, with M3 at the half node (derivations.md, section 2):

    F_{i+1/2} = (Q_{i+1} - Q_i)/ds + M3_{i+1/2} (X_i + X_{i+1})/2 + F'3 d/ds
    Q = e3 x M = M1 e2 - M2 e1,     X = r' x r''
    F'3 = EA (1 - ds/|d|) - (P_i + P_{i+1})/2,     P = M1 O1 + M2 O2

    nodal force   f_i   = F_{i+1/2} - F_{i-1/2}                                    (Eq. 44)
    twist torque  tau_i = M3_{i+1/2} - M3_{i-1/2} + Lc (O1 M2 - O2 M1)_i           (Eq. 36, corrected)

Misprints of the paper that stand corrected here: the sign of the twist term (Eq. 18, 21-24, 29, 30, 33, 44: printed
``- O1``), the tension (Eq. 20: ``EA (1 - ds/|d|)``, no factor ds) and the source of Eq. 36-38 (``O1 M2 - O2 M1``, which
holds for every law and for moduli that vary along s). Both are differences of fluxes, so the forces sum to zero to
round-off for any moment whatever.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from .geometry import Geometry
from .rods import Mesh


class Moment(NamedTuple):
    """What a law makes of the strains: moments and their derivatives. Zero, both, at ends that carry none."""

    bend: np.ndarray  # (n, 2) M1, M2 at nodes
    bend_slope: np.ndarray  # (n, 2, 2) dM_a/dO_b
    twist: np.ndarray  # (n,) M3 at half nodes
    twist_slope: np.ndarray  # (n,) dM3/dO3


@njit(cache=True)
def _cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def nodal_force(mesh: Mesh, g: Geometry, moment: Moment, stretching, force):
    """Eq. 44: adds the elastic force on each node, (n, 3), and where ``force`` is (n, 4) the twist torque.

    ``stretching`` (n,) is EA at half nodes. The force is the rod's on the fluid.
    """
    n, m = force.shape
    before, after = np.empty(3), np.empty(3)
    for i in range(n - 1):
        if not mesh.joined[i]:
            continue
        ds, m3, j = mesh.ds[i], moment.twist[i], i + 1
        p = 0.0
        for a in range(2):
            p += 0.5 * (moment.bend[i, a] * g.bend[i, a] + moment.bend[j, a] * g.bend[j, a])
        tension = stretching[i] * (1.0 - ds / g.length[i]) - p
        if m3 != 0.0:
            _cross(g.d1[i], g.d2[i], before)
            _cross(g.d1[j], g.d2[j], after)
        else:
            before[:] = 0.0
            after[:] = 0.0
        for c in range(3):
            q = moment.bend[j, 0] * g.e2[j, c] - moment.bend[j, 1] * g.e1[j, c]
            q -= moment.bend[i, 0] * g.e2[i, c] - moment.bend[i, 1] * g.e1[i, c]
            flux = (q + tension * g.gap[i, c]) / ds + 0.5 * m3 * (before[c] + after[c])
            force[i, c] += flux
            force[j, c] -= flux
        if m == 4:
            force[i, 3] += m3
            force[j, 3] -= m3
    if m == 4:
        for i in range(n):
            force[i, 3] += mesh.volume[i] * (
                g.bend[i, 0] * moment.bend[i, 1] - g.bend[i, 1] * moment.bend[i, 0]
            )


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def stiffness(mesh: Mesh, g: Geometry, moment: Moment, stretching, old, clip, unit, reach, matrix):
    """The exact Jacobian of ``nodal_force``, added to ``matrix`` (n, m, (2 w + 1) m): node rows, columns from i - w.

    The unknowns of a node are its displacement and, where m = 4, the angle by which e1 is turned about the tangent
    after it was carried (Eq. 41) from the tangents ``old`` (n, 3). So with dpsi = dphi + (e3 x old).de3/(1 + old.e3),

        de1 = -(e1.de3) e3 + e2 dpsi,   de2 = -(e2.de3) e3 - e1 dpsi,   e_a.de3 = e_a.dr'/|r'|
        dO1 = -e2.dr'' + (e3.r'')(e2.dr')/|r'| + O2 dpsi,   dO2 = e1.dr'' - (e3.r'')(e1.dr')/|r'| - O1 dpsi

    Every node changes the flux on its left and on its right; each is written as a matrix on dr'', one on dr', one on
    dpsi, and goes through the stencils into the rows on either side. ``clip``: the compressive part of F'3 is left
    out of the matrix (never of the force), which makes a single linear solve robust.

    ``unit`` and ``reach`` are tuples of m and of p m entries: their lengths are known when this is compiled, so that
    the inner loops become straight vector code.
    """
    n, m = matrix.shape[0], len(unit)
    w = (matrix.shape[2] // m - 1) // 2
    p = len(reach) // m
    left, right = np.zeros(len(reach)), np.zeros(len(reach))
    second, slope, spin = np.empty((2, 4, 3)), np.empty((2, 4, 3)), np.empty((2, 4))
    o2, o1, oa = np.empty((2, 3)), np.empty((2, 3)), np.empty(2)
    m2, m1, ma = np.empty((2, 3)), np.empty((2, 3)), np.empty(2)
    pp, ps, turn, x, y = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    source = np.empty((2, 3))
    for i in range(n):
        e1, e2, e3, r1, r2 = g.e1[i], g.e2[i], g.e3[i], g.d1[i], g.d2[i]
        b1, b2 = g.bend[i, 0], g.bend[i, 1]
        k1, k2 = moment.bend[i, 0], moment.bend[i, 1]
        q = 1.0 / g.speed[i]
        along = (e3[0] * r2[0] + e3[1] * r2[1] + e3[2] * r2[2]) * q
        _cross(e3, old[i], turn)
        one = 1.0 + old[i, 0] * e3[0] + old[i, 1] * e3[1] + old[i, 2] * e3[2]
        oa[0], oa[1] = b2, -b1
        for c in range(3):
            turn[c] *= q / one
            o2[0, c], o2[1, c] = -e2[c], e1[c]
            o1[0, c], o1[1, c] = along * e2[c], -along * e1[c]
        for a in range(2):
            s0, s1 = moment.bend_slope[i, a, 0], moment.bend_slope[i, a, 1]
            ma[a] = s0 * oa[0] + s1 * oa[1]
            for c in range(3):
                m2[a, c] = s0 * o2[0, c] + s1 * o2[1, c]
                m1[a, c] = s0 * o1[0, c] + s1 * o1[1, c]
        # dP = dM.O + M.dO
        pa = ma[0] * b1 + k1 * oa[0] + ma[1] * b2 + k2 * oa[1]
        for c in range(3):
            pp[c] = m2[0, c] * b1 + k1 * o2[0, c] + m2[1, c] * b2 + k2 * o2[1, c]
            ps[c] = m1[0, c] * b1 + k1 * o1[0, c] + m1[1, c] * b2 + k2 * o1[1, c]
        for side in range(2):  # 0: the flux at i - 1/2, 1: the flux at i + 1/2
            h = i - 1 + side
            if h < 0 or not mesh.joined[h]:
                second[side] = 0.0
                slope[side] = 0.0
                spin[side] = 0.0
                continue
            sign = 1.0 if side == 0 else -1.0
            inv, m3 = 1.0 / mesh.ds[h], moment.twist[h]
            for a in range(3):
                da = 0.5 * g.gap[h, a]
                tw = (k1 * e1[a] + k2 * e2[a]) * sign
                spin[side, a] = inv * (sign * (ma[0] * e2[a] - ma[1] * e1[a]) - tw - da * pa)
                for c in range(3):
                    # dQ = dM1 e2 - dM2 e1 - e3 [M1 (e2.dr') - M2 (e1.dr')]/|r'| - (M1 e1 + M2 e2) dpsi
                    dq2 = m2[0, c] * e2[a] - m2[1, c] * e1[a]
                    dq1 = m1[0, c] * e2[a] - m1[1, c] * e1[a] - e3[a] * q * (k1 * e2[c] - k2 * e1[c])
                    second[side, a, c] = inv * (sign * dq2 - da * pp[c])
                    slope[side, a, c] = inv * (sign * dq1 - da * ps[c])
            if m3 != 0.0:
                # M3 dX/2,  dX = r' x dr'' - r'' x dr'
                for v, f, into in ((r1, 0.5 * m3, second[side]), (r2, -0.5 * m3, slope[side])):
                    into[0, 1] -= f * v[2]
                    into[0, 2] += f * v[1]
                    into[1, 0] += f * v[2]
                    into[1, 2] -= f * v[0]
                    into[2, 0] -= f * v[1]
                    into[2, 1] += f * v[0]
            if m == 4:
                _twist_flux(g, moment.twist_slope[h] * inv, h, side, second[side], slope[side], spin[side], x, y)
        if m == 4:
            # Lc d(O1 M2 - O2 M1)
            lc = mesh.volume[i]
            sa = lc * (oa[0] * k2 + b1 * ma[1] - oa[1] * k1 - b2 * ma[0])
            for c in range(3):
                source[0, c] = lc * (o2[0, c] * k2 + b1 * m2[1, c] - o2[1, c] * k1 - b2 * m2[0, c])
                source[1, c] = lc * (o1[0, c] * k2 + b1 * m1[1, c] - o1[1, c] * k1 - b2 * m1[0, c]) + sa * turn[c]
            matrix[i, 3, w * 4 + 3] += sa
        for side in range(2):
            for a in range(m):
                for c in range(3):
                    slope[side, a, c] += spin[side, a] * turn[c]
        here = (mesh.first[i] - i + w) * m
        before, after = i > 0 and mesh.joined[i - 1], mesh.joined[i]
        for a in range(m):
            for k in range(p):
                u, v = mesh.w2[i, k], mesh.w1[i, k]
                for c in range(3):
                    left[k * m + c] = second[0, a, c] * u + slope[0, a, c] * v
                    right[k * m + c] = second[1, a, c] * u + slope[1, a, c] * v
            row = matrix[i, a]
            for k in range(len(reach)):
                row[here + k] += right[k] - left[k]
            if before:
                row = matrix[i - 1, a]
                for k in range(len(reach)):
                    row[here + m + k] += left[k]
            if after:
                row = matrix[i + 1, a]
                for k in range(len(reach)):
                    row[here - m + k] -= right[k]
        if m == 4:
            for k in range(p):
                for c in range(3):
                    matrix[i, 3, here + 4 * k + c] += source[0, c] * mesh.w2[i, k] + source[1, c] * mesh.w1[i, k]
        if m == 4:
            for a in range(4):
                matrix[i, a, w * 4 + 3] += spin[1, a] - spin[0, a]
                if i > 0 and mesh.joined[i - 1]:
                    matrix[i - 1, a, (w + 1) * 4 + 3] += spin[0, a]
                if mesh.joined[i]:
                    matrix[i + 1, a, (w - 1) * 4 + 3] -= spin[1, a]
    _tension_stiffness(mesh, g, moment, stretching, clip, matrix)


@njit(cache=True)
def _twist_flux(g, c_over_ds, h, side, second, slope, spin, x, y):
    """The part of the two twist fluxes at h + 1/2 (force and torque) that comes through dO3, from one of its nodes.

    dO3_{h+1/2} = 1/(2 ds) { [-(e3_a.e1_b) e2_a + (e2_b.e3_a) e1_a].dr'_a/|r'_a|
                           + [-(e2_a.e3_b) e1_b + (e3_b.e1_a) e2_b].dr'_b/|r'_b|
                           + (e1_a.e1_b + e2_a.e2_b)(dpsi_b - dpsi_a) },     a = h, b = h + 1
    """
    a, b = h, h + 1
    t1, t2, cc = 0.0, 0.0, 0.0
    for c in range(3):
        cc += g.e1[a, c] * g.e1[b, c] + g.e2[a, c] * g.e2[b, c]
        if side == 1:
            t1 -= g.e3[a, c] * g.e1[b, c]
            t2 += g.e2[b, c] * g.e3[a, c]
        else:
            t1 += g.e3[b, c] * g.e1[a, c]
            t2 -= g.e2[a, c] * g.e3[b, c]
    i = a if side == 1 else b
    f = 0.5 * c_over_ds
    if side == 1:
        cc = -cc
    _cross(g.d1[a], g.d2[a], x)
    _cross(g.d1[b], g.d2[b], y)
    for r in range(4):
        row = f if r == 3 else 0.5 * f * (x[r] + y[r])
        if r == 3:
            second[3, 0] = second[3, 1] = second[3, 2] = 0.0
            slope[3, 0] = slope[3, 1] = slope[3, 2] = 0.0
            spin[3] = 0.0
        for c in range(3):
            slope[r, c] += row * (t1 * g.e2[i, c] + t2 * g.e1[i, c]) / g.speed[i]
        spin[r] += row * cc


@njit(cache=True)
def _tension_stiffness(mesh, g, moment, stretching, clip, matrix):
    """d(F'3 d/ds) = [ (EA/|d|) u u^T + (F'3/ds) 1 ] d(dr),  u = d/|d|  (the part through P is in ``stiffness``)."""
    n, m = matrix.shape[:2]
    w = (matrix.shape[2] // m - 1) // 2
    for i in range(n - 1):
        if not mesh.joined[i]:
            continue
        j, ds, length = i + 1, mesh.ds[i], g.length[i]
        f = stretching[i] * (1.0 - ds / length)
        for a in range(2):
            f -= 0.5 * (moment.bend[i, a] * g.bend[i, a] + moment.bend[j, a] * g.bend[j, a])
        f = (max(f, 0.0) if clip else f) / ds
        axial = stretching[i] / length**3
        for a in range(3):
            for c in range(3):
                b = axial * g.gap[i, a] * g.gap[i, c] + (f if a == c else 0.0)
                matrix[i, a, w * m + c] -= b
                matrix[i, a, (w + 1) * m + c] += b
                matrix[j, a, w * m + c] -= b
                matrix[j, a, (w - 1) * m + c] += b
