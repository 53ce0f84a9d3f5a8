"""The exact Jacobian of the nodal force, Eq. 44, as a band matrix by node.

The flux through every face is first written as it follows the two nodes beside it, by dr'', dr' and dphi; these then
go through the stencils of the nodes (elastic_force.py has the flux, and the names).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..linalg.compiled import njit
from ..linalg.vectors import NOT_NEGATIVE, at, cross, dot, mix, plus, scaled
from .elastic_force import Moment
from .geometry import E1, E2, E3, EDGE, LENGTH, METRIC, O1, O2, R_S, R_SS, Configuration
from .mesh import Mesh

_FIRST = np.int64(0)  # numba compiles a function of a bare 0 once more than that of any index


class _Node(NamedTuple):
    """The quantities of one node that the stiffness needs, in registers.

    With x = dr'' - l dr', l = (e3.r'')/|r'|, and dpsi the turn of e1 about e3: dM1 = m1.x + m1_psi dpsi, and so on.
    """

    e1: tuple[float, float, float]
    e2: tuple[float, float, float]
    e3: tuple[float, float, float]
    r_s: tuple[float, float, float]
    r_ss: tuple[float, float, float]
    short: float  # 1/|r'|
    along: float  # l
    turn: tuple[float, float, float]  # dpsi = dphi + turn.dr'
    moment: tuple[float, float]  # M1, M2
    m1: tuple[float, float, float]
    m2: tuple[float, float, float]
    p: tuple[float, float, float]
    m1_psi: float
    m2_psi: float
    p_psi: float


class _Row(NamedTuple):
    """A number as it follows one node: second.dr'' + slope.dr' + psi dphi."""

    second: tuple[float, float, float]
    slope: tuple[float, float, float]
    psi: float


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _node(g, bend, bend_slope, old, i):
    """How node i changes: dO1 = -e2.x + O2 dpsi, dO2 = e1.x - O1 dpsi; the law's slopes; dP = O.dM + M.dO."""
    e1, e2, e3, r_s, r_ss = at(g, i, E1), at(g, i, E2), at(g, i, E3), at(g, i, R_S), at(g, i, R_SS)
    o1, o2, m1, m2 = g[i, O1], g[i, O2], bend[i, 0], bend[i, 1]
    s11, s12, s21, s22 = bend_slope[i, 0, 0], bend_slope[i, 0, 1], bend_slope[i, 1, 0], bend_slope[i, 1, 1]
    x1, x2 = mix(-s11, e2, s12, e1), mix(-s21, e2, s22, e1)
    t1, t2 = s11 * o2 - s12 * o1, s21 * o2 - s22 * o1
    p = plus(plus(mix(o1, x1, o2, x2), -m1, e2), m2, e1)
    p_psi = o1 * t1 + o2 * t2 + m1 * o2 - m2 * o1
    short, before = 1.0 / g[i, METRIC], at(old, i, E3)
    turn = scaled(short / (1.0 + dot(before, e3)), cross(e3, before))
    return _Node(e1, e2, e3, r_s, r_ss, short, short * dot(e3, r_ss), turn, (m1, m2), x1, x2, p, t1, t2, p_psi)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _flux(a, f, edge, c):
    """Component c of f Q - P gap/2 as it follows node ``a``.

    dQ = e2 dM1 - e1 dM2 - e3 [M1 (e2.dr') - M2 (e1.dr')]/|r'| - (M1 e1 + M2 e2) dpsi
    """
    b1, b2, b3, half = f * a.e1[c], f * a.e2[c], f * a.e3[c] * a.short, -0.5 * edge[c]
    second = plus(mix(b2, a.m1, -b1, a.m2), half, a.p)
    psi = b2 * (a.m1_psi - a.moment[1]) - b1 * (a.m2_psi + a.moment[0]) + half * a.p_psi
    slope = plus(mix(-a.along, second, psi, a.turn), -b3 * a.moment[0], a.e2)
    return _Row(second, plus(slope, b3 * a.moment[1], a.e1), psi)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _twist(a, b, f):
    """f dO3 ds as it follows node ``a`` of a segment, ``b`` the other one; f is negative where a comes first.

    dO3 = 1/ds { dpsi_b - dpsi_a + [(c p + s q) e2 + (s p - c q) e1].(-+ dr'/|r'|)/(c^2 + s^2) of either },
    c = e1.e1_b + e2.e2_b,  s = e1.e2_b - e2.e1_b,  p = e3.e1_b,  q = e3.e2_b,      b the other one
    """
    c, s = dot(a.e1, b.e1) + dot(a.e2, b.e2), dot(a.e1, b.e2) - dot(a.e2, b.e1)
    p, q = dot(a.e3, b.e1), dot(a.e3, b.e2)
    k = f * a.short / (c * c + s * s)
    slope = mix(k * (c * p + s * q), a.e2, k * (s * p - c * q), a.e1)
    return _Row((0.0, 0.0, 0.0), plus(slope, f, a.turn), f)


@njit(cache=True)
def _unit(c):
    return 1.0 if c == 0 else 0.0, 1.0 if c == 1 else 0.0, 1.0 if c == 2 else 0.0


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _twisted(a, m3, x, twist, c):
    """Component c of M3 (X_i + X_{i+1})/2 as it follows node ``a``: dX = r' x dr'' - r'' x dr'; ``x`` the mean X."""
    i, j = (c + 1) % 3, (c + 2) % 3
    u, v, h = _unit(i), _unit(j), 0.5 * m3
    second, slope = mix(h * a.r_s[i], v, -h * a.r_s[j], u), mix(h * a.r_ss[j], u, -h * a.r_ss[i], v)
    return _Row(second, plus(slope, x[c], twist.slope), x[c] * twist.psi)


class Stencils(NamedTuple):
    """The stencils of r'' and r' at nodes i - 1, i and i + 1, side by side for the row of node i."""

    start: np.ndarray  # (n,) the first node of any of them
    reach: np.ndarray  # (n,) how many nodes they take in together
    weights: np.ndarray  # (n, most, 6) r'' and r' of i - 1, then of i, then of i + 1; zero across a gap between rods


def stencils(mesh: Mesh) -> Stencils:
    """The mesh's stencils, three by three."""
    n, p = mesh.w1.shape
    every, first = np.arange(n), mesh.first
    joined = np.concatenate([[False], mesh.joined[: n - 1], [False]])  # each node with the one before, and n with none
    beside = [(k, np.nonzero(there)[0]) for k, there in ((-1, joined[:-1]), (0, every >= 0), (1, joined[1:]))]
    start, end = first.copy(), first.copy()
    for k, i in beside:
        start[i], end[i] = np.minimum(start[i], first[i + k]), np.maximum(end[i], first[i + k])
    reach = end + p - start
    weights = np.zeros((n, reach.max(), 6))
    for k, i in beside:
        at = (first[i + k] - start[i])[:, None] + np.arange(p)
        weights[i[:, None], at, 2 * (k + 1)] = mesh.w2[i + k]
        weights[i[:, None], at, 2 * (k + 1) + 1] = mesh.w1[i + k]
    return Stencils(start, reach, weights)


@njit(cache=True, inline="always")
def _triple(flux, i, side, c, k):
    return flux[i, side, c, k], flux[i, side, c, k + 1], flux[i, side, c, k + 2]


@njit(cache=True, inline="always")
def _add(row, flux, i, side, c):
    """Adds to component c of the flux right of node i as it follows its left (side 0) or right (1) node."""
    for k in range(3):
        flux[i, side, c, k] += row.second[k]
        flux[i, side, c, 3 + k] += row.slope[k]
    flux[i, side, c, 6] += row.psi


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _bending_fluxes(joined, rest, g, bend, bend_slope, old, flux):
    """Adds how f Q - P d/2 of every segment changes to ``flux`` (n, 2, m, 7)."""
    after = _node(g, bend, bend_slope, old, _FIRST)
    for i in range(flux.shape[0] - 1):
        here, after = after, _node(g, bend, bend_slope, old, i + 1)
        if joined[i]:
            f = 1.0 / rest[i]
            edge = scaled(f, at(g, i, EDGE))
            for c in range(3):
                _add(_flux(here, -f, edge, c), flux, i, 0, c)
                _add(_flux(after, f, edge, c), flux, i, 1, c)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _twist_fluxes(joined, rest, g, bend, bend_slope, twist, twist_slope, old, flux):
    """Adds how M3 (X_i + X_{i+1})/2 and, to the torques, M3 of every segment change."""
    after = _node(g, bend, bend_slope, old, _FIRST)
    for i in range(flux.shape[0] - 1):
        here, after = after, _node(g, bend, bend_slope, old, i + 1)
        if joined[i]:
            f, x = twist_slope[i] / rest[i], mix(0.5, cross(here.r_s, here.r_ss), 0.5, cross(after.r_s, after.r_ss))
            left, right = _twist(here, after, -f), _twist(after, here, f)
            for c in range(3):
                _add(_twisted(here, twist[i], x, left, c), flux, i, 0, c)
                _add(_twisted(after, twist[i], x, right, c), flux, i, 1, c)
            _add(left, flux, i, 0, 3)
            _add(right, flux, i, 1, 3)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _rows(stencils: Stencils, flux, matrix):
    """Adds F_{i+1/2} - F_{i-1/2} to row i of ``matrix`` (n, m, 2 w + 1, m): flux[i + 1] less flux[i].

    They follow three nodes, i - 1 by p, i by q and i + 1 by r, through the stencils of these.
    """
    n, m, nodes = matrix.shape[:3]
    w, weights = nodes // 2, stencils.weights
    for i in range(n):
        start = (stencils.start[i] - i + w) & NOT_NEGATIVE
        for c in range(m):
            p0, p1, p2 = scaled(-1.0, _triple(flux, i, 0, c, 0))
            p3, p4, p5 = scaled(-1.0, _triple(flux, i, 0, c, 3))
            q0, q1, q2 = plus(_triple(flux, i + 1, 0, c, 0), -1.0, _triple(flux, i, 1, c, 0))
            q3, q4, q5 = plus(_triple(flux, i + 1, 0, c, 3), -1.0, _triple(flux, i, 1, c, 3))
            r0, r1, r2 = _triple(flux, i + 1, 1, c, 0)
            r3, r4, r5 = _triple(flux, i + 1, 1, c, 3)
            for j in range(stencils.reach[i]):
                u0, u1, u2 = weights[i, j, 0], weights[i, j, 1], weights[i, j, 2]
                u3, u4, u5 = weights[i, j, 3], weights[i, j, 4], weights[i, j, 5]
                matrix[i, c, start + j, 0] += p0 * u0 + p3 * u1 + q0 * u2 + q3 * u3 + r0 * u4 + r3 * u5
                matrix[i, c, start + j, 1] += p1 * u0 + p4 * u1 + q1 * u2 + q4 * u3 + r1 * u4 + r4 * u5
                matrix[i, c, start + j, 2] += p2 * u0 + p5 * u1 + q2 * u2 + q5 * u3 + r2 * u4 + r5 * u5
            if m == 4:
                matrix[i, c, w - 1, 3] -= flux[i, 0, c, 6]
                matrix[i, c, w, 3] += flux[i + 1, 0, c, 6] - flux[i, 1, c, 6]
                matrix[i, c, w + 1, 3] += flux[i + 1, 1, c, 6]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _tension(joined, rest, g, bend, stretching, least, matrix):
    """Adds d(F'3 d/ds) = [ (EA/|d|) u u^T + (F'3/ds) 1 ] d(dr),  u = d/|d|; the part through P is in the fluxes."""
    w = matrix.shape[2] // 2
    for i in range(matrix.shape[0] - 1):
        if not joined[i]:
            continue
        j, ds, length, edge = i + 1, rest[i], g[i, LENGTH], at(g, i, EDGE)
        p = bend[i, 0] * g[i, O1] + bend[i, 1] * g[i, O2] + bend[j, 0] * g[j, O1] + bend[j, 1] * g[j, O2]
        tension = stretching[i] * (1.0 - ds / length) - 0.5 * p
        tension = (least if tension < least else tension) / ds
        axial = stretching[i] / length**3
        for a in range(3):
            for c in range(3):
                b = axial * edge[a] * edge[c] + (tension if a == c else 0.0)
                matrix[i, a, w, c] -= b
                matrix[i, a, w + 1, c] += b
                matrix[j, a, w, c] -= b
                matrix[j, a, w - 1, c] += b


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _twist_sources(mesh: Mesh, g, bend, bend_slope, old, matrix):
    """Adds how Lc (O1 M2 - O2 M1) of every node changes to the rows of torques."""
    w = matrix.shape[2] // 2
    for i in range(matrix.shape[0]):
        a, lc, o1, o2 = _node(g, bend, bend_slope, old, i), mesh.volume[i], g[i, O1], g[i, O2]
        m1, m2 = a.moment
        second = plus(plus(mix(lc * o1, a.m2, -lc * o2, a.m1), -lc * m2, a.e2), -lc * m1, a.e1)
        psi = lc * (o1 * a.m2_psi - o2 * a.m1_psi + m2 * o2 + m1 * o1)
        slope = mix(-a.along, second, psi, a.turn)
        for k in range(mesh.w1.shape[1]):
            d = mix(mesh.w2[i, k], second, mesh.w1[i, k], slope)
            for c in range(3):
                matrix[i, 3, mesh.first[i] + k - i + w, c] += d[c]
        matrix[i, 3, w, 3] += psi


@njit(cache=True)
def _stiffness(joined, rest, stencils: Stencils, g, bend, bend_slope, stretching, old, least, flux, matrix):
    """The stiffness but for what is special to rods that twist; ``flux`` comes with what M3 adds to it, or zeros."""
    _bending_fluxes(joined, rest, g, bend, bend_slope, old, flux[1:])
    _rows(stencils, flux, matrix)
    _tension(joined, rest, g, bend, stretching, least, matrix)


def stiffness(
    mesh: Mesh,
    stencils: Stencils,
    g: Configuration,
    start: Configuration,
    moment: Moment,
    stretching: np.ndarray,
    least: float,
    matrix: np.ndarray,
) -> None:
    """Adds the exact Jacobian of ``nodal_force`` to ``matrix`` (n, m, (2 w + 1) m) of zeros: columns from node i - w.

    The unknowns of a node are its displacement from ``start`` and, where m = 4, the angle by which e1 is turned about
    the tangent after it was carried (Eq. 41). So with dpsi = dphi + (e3 x old).de3/(1 + old.e3), old = e3 of ``start``,

        de1 = -(e1.de3) e3 + e2 dpsi,   de2 = -(e2.de3) e3 - e1 dpsi,   e_a.de3 = e_a.dr'/|r'|
        dO1 = -e2.x + O2 dpsi,   dO2 = e1.x - O1 dpsi,   x = dr'' - (e3.r'') dr'/|r'|

    The flux through every face is first written as it follows the two nodes beside it, by dr'', dr' and dphi; these
    then go through the stencils of the nodes. F'3 below ``least`` stands in the matrix as ``least``: -inf for the exact
    Jacobian, 0 to leave compression out of the geometric stiffness (never out of the force).
    """
    n, m, columns = matrix.shape
    flux, by_node = np.zeros((n + 1, 2, m, 7)), matrix.reshape(n, m, columns // m, m)
    what = g.table, moment.bend, moment.bend_slope
    if m == 4:
        _twist_fluxes(mesh.joined, mesh.ds, *what, moment.twist, moment.twist_slope, start.table, flux[1:])
        _twist_sources(mesh, *what, start.table, by_node)
    _stiffness(mesh.joined, mesh.ds, stencils, *what, stretching, start.table, least, flux, by_node)


def through_stencils(
    mesh: Mesh, stencils: Stencils, g: Configuration, start: Configuration, moment: Moment, matrix: np.ndarray
) -> None:
    """Adds the part of it that goes through r' and r'', by any stencils of these, to ``matrix`` (n, m, (2 w + 1) m)."""
    n, m, columns = matrix.shape
    flux, by_node = np.zeros((n + 1, 2, m, 7)), matrix.reshape(n, m, columns // m, m)
    what = g.table, moment.bend, moment.bend_slope
    if m == 4:
        _twist_fluxes(mesh.joined, mesh.ds, *what, moment.twist, moment.twist_slope, start.table, flux[1:])
        _twist_sources(mesh, *what, start.table, by_node)
    _bending_fluxes(mesh.joined, mesh.ds, *what, start.table, flux[1:])
    _rows(stencils, flux, by_node)
