"""The variant of Eq. 44 whose nodal forces and twist torques have no net torque, at any spacing, to round-off.

Eq. 44 conserves force exactly and torque only to O(strain) where the rod is unevenly stretched. Here (rods/README.md)
the tangent is the bisector of the neighbouring segments, and the fluxes hold the true distances:

    u = d/|d|,  s_i = (u_{i-1/2} + u_{i+1/2})/(1 + u_{i-1/2}.u_{i+1/2}),  s_1 = u_{3/2}, s_N = u_{N-1/2},  e3 = s/|s|
    F_{i+1/2} = [Q_{i+1} - Q_i + M3_{i+1/2} u x (s_{i+1} - s_i)]/|d| + F'3 d/ds,     Q = M1 e2 - M2 e1
    tau_i     = |s_i| (M3_{i+1/2} - M3_{i-1/2}) - (u_{i+1/2} - u_{i-1/2}).M_i

so u.s = 1 on either side of a node, and the sum of r x f and of tau e3 vanishes term by term. At a clamp s = T/(u.T).
It differs from Eq. 44 at second order. NumPy throughout: it is an option, not the hot path.
"""

from __future__ import annotations

import numpy as np

from ..linalg.stiffness import Stiffness
from .base import TangentReversed
from .elastic_force import Moment
from .frame import transport
from .geometry import Configuration
from .linearization import Linearization, Shift, twist_slope
from .mesh import Mesh
from .system import RodSystem


def _before(values: np.ndarray) -> np.ndarray:
    """The value of the segment on the left of each node."""
    return np.concatenate([np.zeros_like(values[:1]), values[:-1]])


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, :, None] * b[:, None, :]


def _skew(v: np.ndarray) -> np.ndarray:
    """The matrices (n, 3, 3) of v x."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return out - np.swapaxes(out, 1, 2)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", a, b)


class _Bisectors:
    """u (n, 3) at half nodes, s (n, 3) at nodes, and how s changes with u on the left and on the right (n, 3, 3)."""

    def __init__(self, mesh: Mesh, r: np.ndarray) -> None:
        n = len(r)
        joined = mesh.joined
        self.edge = np.zeros((n, 3))
        self.edge[:-1] = np.where(joined[:-1, None], np.diff(r, axis=0), 0.0)
        self.length = np.where(joined, np.sqrt(_dot(self.edge, self.edge)), 1.0)
        self.u = self.edge / self.length[:, None]
        left, right = _before(self.u), self.u
        self.has_left, self.has_right = np.append(False, joined[:-1]), joined
        inner = self.has_left & self.has_right
        c = np.where(inner, 1.0 + _dot(left, right), 1.0)
        self.least = float(np.min(c))
        c = np.maximum(c, 1e-12)
        self.s = (left + right) / c[:, None]
        one = np.broadcast_to(np.eye(3), (n, 3, 3)) / c[:, None, None]
        scale = np.where(inner, 1.0 / c, 0.0)[:, None, None]
        self.on_left = one - scale * _outer(self.s, right)
        self.on_right = one - scale * _outer(self.s, left)
        clamped = mesh.c1.any(axis=1)
        if clamped.any():
            t, u = mesh.c1[clamped], (left + right)[clamped]
            s = t / _dot(t, u)[:, None]
            self.s[clamped] = s
            self.on_left[clamped] = self.on_right[clamped] = -_outer(s, s)
        self.size = np.sqrt(_dot(self.s, self.s))
        self.e3 = self.s / self.size[:, None]
        # What the tangent does at a clamp is prescribed, to the last bit.
        self.e3[clamped] = mesh.c1[clamped]


def measure(mesh: Mesh, r: np.ndarray, e1: np.ndarray) -> Configuration:
    """Strains about the bisectors; ``r_s`` holds s, ``metric`` its size. ``e1`` (n, 3) is taken as normal to them."""
    b = _Bisectors(mesh, r)
    columns = mesh.first[:, None] + np.arange(mesh.w2.shape[1])
    r_ss = np.einsum("ik,ikc->ic", mesh.w2, r[columns]) + mesh.c2
    e2 = np.cross(b.e3, e1)
    bend = np.stack([-_dot(e2, r_ss), _dot(e1, r_ss)], axis=1)
    twist = np.zeros(len(r))
    sine, cosine = _dot(e2[:-1] + e2[1:], e1[1:] - e1[:-1]), _dot(e1[:-1], e1[1:]) + _dot(e2[:-1], e2[1:])
    twist[:-1] = np.arctan2(sine, cosine) / mesh.ds[:-1]
    return Configuration.of(
        r=r,
        e1=e1,
        e2=e2,
        e3=b.e3,
        metric=b.size,
        r_s=b.s,
        r_ss=r_ss,
        bend=bend,
        twist=np.where(mesh.joined, twist, 0.0),
        edge=b.edge,
        length=b.length,
    )


def _next(values: np.ndarray) -> np.ndarray:
    """The value at the node on the right of each segment."""
    return np.concatenate([values[1:], np.zeros_like(values[:1])])


class TorqueFree(RodSystem):
    """Mechanics with the torque-free force."""

    def start(self, r: np.ndarray, e1: np.ndarray) -> Configuration:
        """The configuration r (n, 3) with e1 (n, 3) made normal to the bisectors."""
        e3 = _Bisectors(self.mesh, r).e3
        normal = e1 - _dot(e1, e3)[:, None] * e3
        return measure(self.mesh, r, normal / np.sqrt(_dot(normal, normal))[:, None])

    def move(self, start: Configuration, y: np.ndarray) -> Configuration:
        """The configuration displaced by y (n, m) from ``start``, e1 carried along and turned."""
        r = start.r + y[:, :3]
        b = _Bisectors(self.mesh, r)
        turn = np.ascontiguousarray(y[:, 3]) if self.unknowns == 4 else np.zeros(len(r))
        e1, least = transport(start.e1, start.e3, b.e3, turn)
        if not min(least, b.least) > 0.02:
            along = 1.0 + _dot(start.e3, b.e3)
            raise TangentReversed(int(np.argmin(along)), float(np.min(along)))
        return measure(self.mesh, r, e1)

    def _tension(self, g: Configuration, moment: Moment, stretching: np.ndarray) -> np.ndarray:
        p = _dot(moment.bend, g.bend)
        return stretching * (1 - self.mesh.ds / g.length) - 0.5 * (p + _next(p))

    def elastic(self, configuration: Configuration, moment: Moment, stretching: np.ndarray) -> np.ndarray:
        """Nodal forces (n, 3), or with the twist torque (n, 4), for given moments and axial stiffness (n,)."""
        mesh = self.mesh
        force = np.zeros((len(configuration.r), self.unknowns))
        flux = self._bending_flux(configuration, moment)
        flux += (self._tension(configuration, moment, stretching) / mesh.ds)[:, None] * configuration.edge
        flux[~mesh.joined] = 0.0
        force[:, :3] = flux - _before(flux)
        if self.unknowns == 4:
            u = configuration.edge / configuration.length[:, None]
            force[:, 3] = configuration.metric * (moment.twist - _before(moment.twist)) - _dot(
                self._kink(u), self._vector(configuration, moment)
            )
        return force

    def _kink(self, u: np.ndarray) -> np.ndarray:
        """u_{i+1/2} - u_{i-1/2}, with the tangent of a clamp in place of the segment that is not there."""
        return u - _before(u) + np.where(self.mesh.joined, -1.0, 1.0)[:, None] * self.mesh.c1

    def _vector(self, g: Configuration, moment: Moment) -> np.ndarray:
        """M1 e1 + M2 e2 (n, 3)."""
        return moment.bend[:, :1] * g.e1 + moment.bend[:, 1:] * g.e2

    def _bending_flux(self, g: Configuration, moment: Moment) -> np.ndarray:
        """[Q_{i+1} - Q_i + M3 u x (s_{i+1} - s_i)]/|d| (n, 3)."""
        q = moment.bend[:, :1] * g.e2 - moment.bend[:, 1:] * g.e1
        turn = np.cross(g.edge, _next(g.r_s) - g.r_s) * (moment.twist / g.length)[:, None]
        return (_next(q) - q + turn) / g.length[:, None]

    def _stiffness(
        self, configuration: Configuration, start: Configuration, moment: Moment, time: float, least: float
    ) -> Stiffness:
        """The Jacobian of ``forces``, with tensions not below ``least``."""
        matrix = _Jacobian(self, configuration, start, moment, least).matrix
        return self._loaded(_BisectorLinearization(self.mesh, configuration, start, matrix, least == 0.0), time)


class _BisectorLinearization(Linearization):
    """Tangents are those of bisectors: they change with the segments beside a node, not with a stencil."""

    def tangent(self, nodes: np.ndarray, rows: np.ndarray, shift: Shift = 0) -> None:
        """rows de3, de3 = (1 - e3 e3) ds/|s|."""
        b = _Bisectors(self.mesh, self.configuration.r)
        on_s = rows @ self.across(nodes)
        rigid = (np.eye(3) - _outer(b.u, b.u)) / b.length[:, None, None]
        shift = np.broadcast_to(shift, nodes.shape)
        for has, change, segment in ((b.has_right, b.on_right, 0), (b.has_left, b.on_left, -1)):
            ok = has[nodes]
            at, to = nodes[ok], shift[ok]
            part = on_s[ok] @ change[at] @ rigid[at + segment]
            self.position(at + segment + 1, part, to - segment - 1)
            self.position(at + segment, -part, to - segment)


class _Jacobian:
    """The chain rule, node by node and segment by segment, on (force, torque) rows of four.

    Every quantity at a node changes with dr'' (through the stencil), with ds (through du of the segments beside it),
    and with its turn dpsi = dphi + (e3 x old).de3/(1 + old.e3); each flux with the two nodes beside it, and with dd.
    """

    def __init__(self, rods: TorqueFree, g: Configuration, start: Configuration, moment: Moment, least: float) -> None:
        self.mesh, self.g, self.m3 = rods.mesh, g, moment.twist
        self.m, self.w = rods.unknowns, rods.profile.width
        self.b = _Bisectors(rods.mesh, g.r)
        n = len(g.r)
        self.matrix = np.zeros((n, self.m, (2 * self.w + 1) * self.m))
        along = _dot(g.e3, g.r_ss)[:, None]
        o2 = np.stack([-g.e2, g.e1], axis=1)  # dO_a on dr''
        o1 = np.stack([along * g.e2, -along * g.e1], axis=1)  # on de3
        oa = np.stack([g.bend[:, 1], -g.bend[:, 0]], axis=1)  # on dpsi
        m2, m1 = (np.einsum("iab,ibc->iac", moment.bend_slope, o) for o in (o2, o1))
        ma = np.einsum("iab,ib->ia", moment.bend_slope, oa)
        k1, k2 = moment.bend[:, 0], moment.bend[:, 1]
        self.across = (np.eye(3) - _outer(g.e3, g.e3)) / g.metric[:, None, None]
        self.turn = np.cross(g.e3, start.e3) / (1 + _dot(g.e3, start.e3))[:, None]
        # Q and M as vectors: their parts on dr'', de3, dpsi
        swing = k1[:, None] * g.e2 - k2[:, None] * g.e1
        self.q = (
            _outer(g.e2, m2[:, 0]) - _outer(g.e1, m2[:, 1]),
            _outer(g.e2, m1[:, 0]) - _outer(g.e1, m1[:, 1]) - _outer(g.e3, swing),
            ma[:, :1] * g.e2 - ma[:, 1:] * g.e1 - k1[:, None] * g.e1 - k2[:, None] * g.e2,
        )
        bent = k1[:, None] * g.e1 + k2[:, None] * g.e2
        self.vector = (
            _outer(g.e1, m2[:, 0]) + _outer(g.e2, m2[:, 1]),
            _outer(g.e1, m1[:, 0]) + _outer(g.e2, m1[:, 1]) - _outer(g.e3, bent),
            ma[:, :1] * g.e1 + ma[:, 1:] * g.e2 + swing,
        )
        self.p = tuple(
            np.einsum("ia...,ia->i...", dm, g.bend) + np.einsum("ia...,ia->i...", do, moment.bend)
            for dm, do in ((m2, o2), (m1, o1), (ma, oa))
        )
        self._segments(rods, moment, least)
        for side in (0, 1):
            self._side(side, moment)
        if self.m == 4:
            self._source(rods._kink(self.b.u), bent)

    def _segments(self, rods: TorqueFree, moment: Moment, least: float) -> None:
        """The part of each flux on its own dd: 1/|d|, du in the twist term, tension."""
        g, b = self.g, self.b
        tension = rods._tension(g, moment, rods.stretching)
        tension = np.maximum(tension, least) / self.mesh.ds
        direct = _outer(b.u, b.u) * (rods.stretching / b.length)[:, None, None]
        direct = direct + tension[:, None, None] * np.eye(3)
        direct -= _outer(rods._bending_flux(g, moment), b.u) / b.length[:, None, None]
        rigid = (np.eye(3) - _outer(b.u, b.u)) / b.length[:, None, None]  # du = rigid dd
        self.rigid = rigid
        spin = _skew(_next(g.r_s) - g.r_s) * (self.m3 / b.length)[:, None, None]
        direct -= spin @ rigid
        rows = np.zeros((len(g.r), 4, 3))
        rows[:, :3] = direct
        self._on_gap(rows, 0)

    def _side(self, side: int, moment: Moment) -> None:
        """The part of the flux at i - 1/2 (side 0) or i + 1/2 (side 1) that comes through node i."""
        g, mesh, b, n = self.g, self.mesh, self.b, len(self.g.r)
        shift = (lambda x: x) if side else _before
        sign, there = (-1.0, b.has_right) if side else (1.0, b.has_left)
        inv, half = shift(1.0 / b.length), shift(0.5 * g.edge / mesh.ds[:, None])
        inv = np.where(there, inv, 0.0)
        half = np.where(there[:, None], half, 0.0)
        second, slope, spin = np.zeros((n, 4, 3)), np.zeros((n, 4, 3)), np.zeros((n, 4))
        second[:, :3] = sign * inv[:, None, None] * self.q[0] - _outer(half, self.p[0])
        slope[:, :3] = sign * inv[:, None, None] * self.q[1] - _outer(half, self.p[1])
        spin[:, :3] = sign * inv[:, None] * self.q[2] - half * self.p[2][:, None]
        if self.m == 4:
            e1, e2, e3 = (_next(e) if side else _before(e) for e in (g.e1, g.e2, g.e3))
            turned = twist_slope((g.e1, g.e2, g.e3), (e1, e2, e3))
            c = sign * np.where(there, shift(moment.twist_slope / mesh.ds), 0.0)
            lever = np.cross(b.u, _next(b.s) - b.s) / b.length[:, None]
            lever = np.column_stack([shift(lever), np.ones(n)]) * c[:, None]
            slope += _outer(lever, turned)
            spin += lever
        slope += _outer(spin, self.turn)
        bisector = slope @ self.across
        bisector[:, :3] += sign * (shift(self.m3) * inv)[:, None, None] * _skew(shift(b.u))
        self._spread(second, bisector, spin, side)

    def _spread(self, second, bisector, spin, side: int) -> None:
        """A flux on one side of its node into the rows of both nodes beside the segment."""
        size = self.b.size
        rows = [(0, -1.0), (-1, 1.0)] if side == 0 else [(0, 1.0), (1, -1.0)]
        for shift, sign in rows:
            factor = np.full((len(size), 4), sign)
            factor[:, 3] *= np.roll(size, -shift)
            f = factor[:, :, None]
            self._on_stencil(f * second, shift)
            self._on_bisector(f * bisector, shift)
            if self.m == 4:
                self._add(factor * spin, shift, 0, 3)

    def _source(self, kink: np.ndarray, bent: np.ndarray) -> None:
        """The torque's part that is no flux: (M3_{i+1/2} - M3_{i-1/2}) d|s| - du.M - kink.dM."""
        n = len(kink)
        second, slope, spin = (-np.einsum("ia,ia...->i...", kink, part) for part in self.vector)
        slope = slope + spin[:, None] * self.turn
        jump = (self.m3 - _before(self.m3))[:, None] * self.g.e3
        row = np.zeros((n, 4, 3))
        row[:, 3] = second
        self._on_stencil(row, 0)
        row[:, 3] = np.einsum("ic,icd->id", slope, self.across) + jump
        self._on_bisector(row, 0)
        column = np.zeros((n, 4))
        column[:, 3] = spin
        self._add(column, 0, 0, 3)
        row[:, 3] = -np.einsum("ic,icd->id", bent, self.rigid)
        self._on_gap_right(row, 0)
        row[:, 3] = np.einsum("ic,icd->id", bent, _before(self.rigid))
        self._on_gap_left(row, 0)

    # -- into the band -------------------------------------------------------------------------------------------

    def _add(self, values: np.ndarray, shift: int, columns: np.ndarray | int, part: int) -> None:
        """values (n, 4[, 3]) of node i into row i + shift, column node i + columns, from component ``part``."""
        n, m, w = len(self.g.r), self.m, self.w
        i = np.arange(n)
        row, at = i + shift, i + columns
        ok = (row >= 0) & (row < n) & values.reshape(n, -1).any(axis=1)
        offset = ((at - row + w) * m + part)[ok]
        if values.ndim == 2:
            self.matrix[row[ok], :, offset] += values[ok][:, :m]
            return
        for c in range(3):
            self.matrix[row[ok], :, offset + c] += values[ok][:, :m, c]

    def _on_stencil(self, rows: np.ndarray, shift: int) -> None:
        """rows dr''"""
        for k in range(self.mesh.w2.shape[1]):
            self._add(rows * self.mesh.w2[:, k, None, None], shift, self.mesh.first + k - np.arange(len(rows)), 0)

    def _on_bisector(self, rows: np.ndarray, shift: int) -> None:
        """rows ds, through du of the segments beside the node."""
        self._on_gap_right(rows @ self.b.on_right @ self.rigid, shift)
        self._on_gap_left(rows @ self.b.on_left @ _before(self.rigid), shift)

    def _on_gap_right(self, rows: np.ndarray, shift: int) -> None:
        rows = np.where(self.b.has_right[:, None, None], rows, 0.0)
        self._add(rows, shift, 1, 0)
        self._add(-rows, shift, 0, 0)

    def _on_gap_left(self, rows: np.ndarray, shift: int) -> None:
        rows = np.where(self.b.has_left[:, None, None], rows, 0.0)
        self._add(rows, shift, 0, 0)
        self._add(-rows, shift, -1, 0)

    def _on_gap(self, rows: np.ndarray, shift: int) -> None:
        """A flux that depends on its own segment, into the rows of the two nodes beside it."""
        self._on_gap_right(rows, shift)
        self._on_gap_right(-rows, shift + 1)
