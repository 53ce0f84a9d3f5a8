"""The Jacobian of the torque-free force (force.py), by the chain rule, in band form."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..elastic_force import Moment
from ..geometry import Configuration
from ..linearization import twist_slope
from ..mesh import Mesh
from .bisectors import Bisectors, after, before, dot, outer, skew
from .force import bending_flux, kink, tension


class Rods(NamedTuple):
    """Rods as their Jacobian needs them: mesh, axial stiffness (n,), unknowns a node, and nodes that a row looks at."""

    mesh: Mesh
    stretching: np.ndarray
    unknowns: int
    width: int


class Jacobian:
    """The chain rule, node by node and segment by segment, on (force, torque) rows of four.

    Every quantity at a node changes with dr'' (through the stencil), with ds (through du of the segments beside it),
    and with its turn dpsi = dphi + (e3 x old).de3/(1 + old.e3); each flux with the two nodes beside it, and with dd.
    """

    def __init__(self, rods: Rods, g: Configuration, start: Configuration, moment: Moment, least: float) -> None:
        self.mesh, self.g, self.m3 = rods.mesh, g, moment.twist
        self.m, self.w = rods.unknowns, rods.width
        self.b = Bisectors(rods.mesh, g.r)
        n = len(g.r)
        self.matrix = np.zeros((n, self.m, (2 * self.w + 1) * self.m))
        along = dot(g.e3, g.r_ss)[:, None]
        o2 = np.stack([-g.e2, g.e1], axis=1)  # dO_a on dr''
        o1 = np.stack([along * g.e2, -along * g.e1], axis=1)  # on de3
        oa = np.stack([g.bend[:, 1], -g.bend[:, 0]], axis=1)  # on dpsi
        m2, m1 = (np.einsum("iab,ibc->iac", moment.bend_slope, o) for o in (o2, o1))
        ma = np.einsum("iab,ib->ia", moment.bend_slope, oa)
        k1, k2 = moment.bend[:, 0], moment.bend[:, 1]
        self.across = (np.eye(3) - outer(g.e3, g.e3)) / g.metric[:, None, None]
        self.turn = np.cross(g.e3, start.e3) / (1 + dot(g.e3, start.e3))[:, None]
        # Q and M as vectors: their parts on dr'', de3, dpsi
        swing = k1[:, None] * g.e2 - k2[:, None] * g.e1
        self.q = (
            outer(g.e2, m2[:, 0]) - outer(g.e1, m2[:, 1]),
            outer(g.e2, m1[:, 0]) - outer(g.e1, m1[:, 1]) - outer(g.e3, swing),
            ma[:, :1] * g.e2 - ma[:, 1:] * g.e1 - k1[:, None] * g.e1 - k2[:, None] * g.e2,
        )
        bent = k1[:, None] * g.e1 + k2[:, None] * g.e2
        self.vector = (
            outer(g.e1, m2[:, 0]) + outer(g.e2, m2[:, 1]),
            outer(g.e1, m1[:, 0]) + outer(g.e2, m1[:, 1]) - outer(g.e3, bent),
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
            self._source(kink(rods.mesh, self.b.u), bent)

    def _segments(self, rods: Rods, moment: Moment, least: float) -> None:
        """The part of each flux on its own dd: 1/|d|, du in the twist term, tension."""
        g, b = self.g, self.b
        pulled = np.maximum(tension(self.mesh, g, moment, rods.stretching), least) / self.mesh.ds
        direct = outer(b.u, b.u) * (rods.stretching / b.length)[:, None, None]
        direct = direct + pulled[:, None, None] * np.eye(3)
        direct -= outer(bending_flux(g, moment), b.u) / b.length[:, None, None]
        rigid = (np.eye(3) - outer(b.u, b.u)) / b.length[:, None, None]  # du = rigid dd
        self.rigid = rigid
        spin = skew(after(g.r_s) - g.r_s) * (self.m3 / b.length)[:, None, None]
        direct -= spin @ rigid
        rows = np.zeros((len(g.r), 4, 3))
        rows[:, :3] = direct
        self._on_gap(rows, 0)

    def _side(self, side: int, moment: Moment) -> None:
        """The part of the flux at i - 1/2 (side 0) or i + 1/2 (side 1) that comes through node i."""
        g, mesh, b, n = self.g, self.mesh, self.b, len(self.g.r)
        shift = (lambda x: x) if side else before
        sign, there = (-1.0, b.has_right) if side else (1.0, b.has_left)
        inv, half = shift(1.0 / b.length), shift(0.5 * g.edge / mesh.ds[:, None])
        inv = np.where(there, inv, 0.0)
        half = np.where(there[:, None], half, 0.0)
        second, slope, spin = np.zeros((n, 4, 3)), np.zeros((n, 4, 3)), np.zeros((n, 4))
        second[:, :3] = sign * inv[:, None, None] * self.q[0] - outer(half, self.p[0])
        slope[:, :3] = sign * inv[:, None, None] * self.q[1] - outer(half, self.p[1])
        spin[:, :3] = sign * inv[:, None] * self.q[2] - half * self.p[2][:, None]
        if self.m == 4:
            e1, e2, e3 = (after(e) if side else before(e) for e in (g.e1, g.e2, g.e3))
            turned = twist_slope((g.e1, g.e2, g.e3), (e1, e2, e3))
            c = sign * np.where(there, shift(moment.twist_slope / mesh.ds), 0.0)
            lever = np.cross(b.u, after(b.s) - b.s) / b.length[:, None]
            lever = np.column_stack([shift(lever), np.ones(n)]) * c[:, None]
            slope += outer(lever, turned)
            spin += lever
        slope += outer(spin, self.turn)
        bisector = slope @ self.across
        bisector[:, :3] += sign * (shift(self.m3) * inv)[:, None, None] * skew(shift(b.u))
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
        jump = (self.m3 - before(self.m3))[:, None] * self.g.e3
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
        row[:, 3] = np.einsum("ic,icd->id", bent, before(self.rigid))
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
        self._on_gap_left(rows @ self.b.on_left @ before(self.rigid), shift)

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
