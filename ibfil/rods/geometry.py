"""From nodes and frames to tangents, strains and spacing: everything the forces are made of.

r' and r'' by the stencils of mesh.py; e3 = r'/|r'| (Eq. 15), e2 = e3 x e1; O1 = -e2.r'', O2 = e1.r'', O3 = psi/ds (Eq.
39 has its sine).
"""

from __future__ import annotations

import numpy as np

from ..linalg.compiled import njit
from ..linalg.vectors import NOT_NEGATIVE, at, cross, dot, plus, put, scaled
from .frame import transported
from .mesh import Mesh

# Columns of a configuration's table: vectors of three, then numbers.
R, E1, E2, E3, R_S, R_SS, EDGE = range(0, 21, 3)
METRIC, O1, O2, O3, LENGTH = range(21, 26)
_COLUMNS = 26


class Configuration:
    """One configuration of n nodes. Half-node values are indexed by segment and zero where there is no segment.

    It is one ``table`` (n, 26), a row a node: compiled functions take one array in place of eleven, whose handing over
    would cost more than the work on them. Its attributes are views of the columns.
    """

    __slots__ = ("table",)

    def __init__(self, table: np.ndarray) -> None:
        self.table = table

    @classmethod
    def of(cls, **parts: np.ndarray) -> Configuration:
        """A configuration from all its attributes by name."""
        out = cls(np.empty((len(parts["r"]), _COLUMNS)))
        for name, part in parts.items():
            getattr(out, name)[:] = part
        return out

    r = property(lambda self: self.table[:, R : R + 3], doc="(n, 3) positions")
    e1 = property(lambda self: self.table[:, E1 : E1 + 3], doc="(n, 3) first director")
    e2 = property(lambda self: self.table[:, E2 : E2 + 3], doc="(n, 3) e3 x e1")
    e3 = property(lambda self: self.table[:, E3 : E3 + 3], doc="(n, 3) unit tangent r'/|r'|")
    r_s = property(lambda self: self.table[:, R_S : R_S + 3], doc="(n, 3) r'")
    r_ss = property(lambda self: self.table[:, R_SS : R_SS + 3], doc="(n, 3) r''")
    edge = property(lambda self: self.table[:, EDGE : EDGE + 3], doc="(n, 3) d = r_{i+1} - r_i")
    metric = property(lambda self: self.table[:, METRIC], doc="(n,) |r'|")
    bend = property(lambda self: self.table[:, O1 : O2 + 1], doc="(n, 2) O1 = -e2.r'', O2 = e1.r''")
    twist = property(lambda self: self.table[:, O3], doc="(n,) O3 at half nodes, psi/ds")
    length = property(lambda self: self.table[:, LENGTH], doc="(n,) |d|; 1 where there is no segment")


@njit(cache=True, error_model="numpy")
def _derive(mesh, g):
    """Writes r', r'', |r'| and the unit tangents (Eq. 15), from the positions in the table through the stencils."""
    for i in range(g.shape[0]):
        r_s, r_ss = at(mesh.c1, i, 0), at(mesh.c2, i, 0)
        first = mesh.first[i] & NOT_NEGATIVE
        for k in range(mesh.w1.shape[1]):
            r = at(g, first + k, R)
            r_s = plus(r_s, mesh.w1[i, k], r)
            r_ss = plus(r_ss, mesh.w2[i, k], r)
        metric = np.sqrt(dot(r_s, r_s))
        put(g, i, R_S, r_s)
        put(g, i, R_SS, r_ss)
        put(g, i, E3, (r_s[0] / metric, r_s[1] / metric, r_s[2] / metric))
        g[i, METRIC] = metric


@njit(cache=True, error_model="numpy")
def _complete(joined, ds, g):
    """Writes what follows from these and e1: e2 and the curvatures O1 = -e2.r'', O2 = e1.r'' of every node, and of

    every segment d, |d| and O3 = psi/ds, psi the turn of e1 about the rod (Eq. 39 has its sine):

    tan psi = (e2_a.e1_b - e2_b.e1_a)/(e1_a.e1_b + e2_a.e2_b)

    An e1 that is carried from e3_a to e3_b without spin (Eq. 41) has psi = 0.
    """
    n = g.shape[0]
    for i in range(n):
        e1, r_ss = at(g, i, E1), at(g, i, R_SS)
        e2 = cross(at(g, i, E3), e1)
        put(g, i, E2, e2)
        g[i, O1], g[i, O2] = -dot(e2, r_ss), dot(e1, r_ss)
    for i in range(n):
        if joined[i]:
            edge = plus(at(g, i + 1, R), -1.0, at(g, i, R))
            put(g, i, EDGE, edge)
            g[i, LENGTH] = np.sqrt(dot(edge, edge))
            e1, e2, e1_b, e2_b = at(g, i, E1), at(g, i, E2), at(g, i + 1, E1), at(g, i + 1, E2)
            sine = dot(plus(e2, 1.0, e2_b), plus(e1_b, -1.0, e1))  # small differences keep their digits
            g[i, O3] = np.arctan2(sine, dot(e1, e1_b) + dot(e2, e2_b)) / ds[i]
        else:
            put(g, i, EDGE, (0.0, 0.0, 0.0))
            g[i, LENGTH], g[i, O3] = 1.0, 0.0


@njit(cache=True)
def _moved(mesh: Mesh, start, y, g):
    """Fills the table g; returns the smallest 1 + e3.e3' and its node."""
    n, m = y.shape
    for i in range(n):
        put(g, i, R, plus(at(start, i, R), 1.0, at(y, i, 0)))
    _derive(mesh, g)
    least, where = 2.0, 0
    for i in range(n):
        e1, one = transported(at(start, i, E1), at(start, i, E3), at(g, i, E3), y[i, 3] if m == 4 else 0.0)
        if one < least or one != one:
            least, where = one, i
        put(g, i, E1, e1)
    _complete(mesh.joined, mesh.ds, g)
    return least, where


@njit(cache=True)
def _replace(first, last, held, y, out):
    """Shifts nodes first .. last of ``out`` so that held ends are where y has them, or else the mean of the nodes."""
    off = plus(at(y, last, 0), -1.0, at(out, last, 0))
    if not held[first] and not held[last]:
        off = (0.0, 0.0, 0.0)
        for i in range(first, last + 1):
            off = plus(off, 1.0 / (last + 1 - first), plus(at(y, i, 0), -1.0, at(out, i, 0)))
    for i in range(first, last + 1):
        if not held[first]:
            put(out, i, 0, plus(at(out, i, 0), 1.0, off))
        elif held[last]:
            put(out, i, 0, plus(at(out, i, 0), (i - first) / (last - first), off))


@njit(cache=True, error_model="numpy")
def _turned(joined, start, held, y):
    out = y.copy()
    first = 0
    for i in range(y.shape[0]):
        if joined[i]:
            edge = at(start, i, EDGE)
            new = plus(edge, 1.0, plus(at(y, i + 1, 0), -1.0, at(y, i, 0)))
            change = plus(scaled(start[i, LENGTH] / np.sqrt(dot(new, new)), new), -1.0, edge)
            put(out, i + 1, 0, plus(at(out, i, 0), 1.0, change))
        else:
            _replace(first, i, held, y, out)
            first = i + 1
    return out


def turned(mesh: Mesh, start: Configuration, held: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Displacements (n, m) that turn every segment as y (n, m) does and leave it as long as it is in ``start``.

    The nodes' mean, or those ends that are ``held`` (n,), are where y has them; between two of these the rest is shared
    out along the filament.
    """
    return _turned(mesh.joined, start.table, held, y)


def _placed(mesh: Mesh, r: np.ndarray) -> np.ndarray:
    """A table of nodes at r (n, 3), as far as it follows from that."""
    table = np.empty((len(r), _COLUMNS))
    table[:, R : R + 3] = r
    _derive(mesh, table)
    return table


def tangents(mesh: Mesh, r: np.ndarray) -> np.ndarray:
    """Unit tangents (n, 3) of the stencils at r (n, 3), Eq. 15; NaN where r' vanishes."""
    return _placed(mesh, r)[:, E3 : E3 + 3].copy()


def measure(mesh: Mesh, r: np.ndarray, e1: np.ndarray) -> Configuration:
    """Strains and spacing of the configuration r, e1 (n, 3); e1 is taken as normal to the stencils' tangents."""
    table = _placed(mesh, r)
    table[:, E1 : E1 + 3] = e1
    _complete(mesh.joined, mesh.ds, table)
    return Configuration(table)


def moved(mesh: Mesh, start: Configuration, y: np.ndarray) -> tuple[Configuration, float, int]:
    """The configuration displaced by y (n, m) from ``start``, e1 carried along (Eq. 41) and, where m = 4, turned.

    Also the smallest 1 + e3.e3' met, and its node: near zero a tangent has all but reversed.
    """
    table = np.empty((len(y), _COLUMNS))
    least, where = _moved(mesh, start.table, y, table)
    return Configuration(table), least, where
