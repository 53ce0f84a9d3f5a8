"""How forces that follow the rod change with it: from tangents, curvatures and turns into a stiffness by node.

A load writes its derivative in the quantities it is made of; here they are traced to displacements. With the tangents
``old`` of the step's start (holonomy as in elastic_jacobian.py):

    de3 = (1 - e3 e3) dr'/|r'|,   dpsi = dphi + (e3 x old).de3/(1 + old.e3)
    de1 = -(e1.de3) e3 + e2 dpsi,   de2 = -(e2.de3) e3 - e1 dpsi
"""

from __future__ import annotations

import numpy as np

from ..linalg.stiffness import Pairs, Stiffness, no_pairs
from .geometry import Configuration
from .mesh import Mesh

Shift = int | np.ndarray


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products (k, 1) of vectors (k, 3)."""
    return np.sum(a * b, axis=1)[:, None]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b of vectors (3,) or (k, 3): several times as fast as NumPy's where there are few."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def force_rows(rows: np.ndarray, unknowns: int) -> np.ndarray:
    """Rows (k, 3, ...) of forces, with a row of no torque where rods twist."""
    if unknowns == 3:
        return rows
    return np.concatenate([rows, np.zeros_like(rows[:, :1])], axis=1)


def twist_slope(node: tuple[np.ndarray, ...], other: tuple[np.ndarray, ...]) -> np.ndarray:
    """+- the derivative (k, 3) of a segment's twist by e3 of one of its nodes: + for the second, - for the first.

    Frames e1, e2, e3 (k, 3) of both; the formula is in elastic_jacobian.py.
    """
    (e1, e2, e3), (f1, f2, _) = node, other
    c, s, p, q = _dot(e1, f1) + _dot(e2, f2), _dot(e1, f2) - _dot(e2, f1), _dot(e3, f1), _dot(e3, f2)
    squared = np.maximum(c * c + s * s, np.finfo(float).tiny)
    out: np.ndarray = ((c * p + s * q) * e2 + (s * p - c * q) * e1) / squared
    return out


class Linearization:
    """A stiffness being filled, at the configuration ``configuration`` reached from ``start``.

    ``matrix`` (n, m, (2 w + 1) m) is its band; pairs of nodes that are coupled beyond it are gathered beside.

    In each method ``nodes`` (k,) are the nodes whose quantity varies, ``rows`` (k, m, 3) or (k, m) its factor, and the
    result goes to the rows of the nodes ``nodes + shift``; no node comes twice with the same shift. Rows of forces come
    first, the torque (m = 4) last. ``definite``: what may make the matrix indefinite is to be left out.
    """

    def __init__(
        self, mesh: Mesh, configuration: Configuration, start: Configuration, matrix: np.ndarray, definite: bool = False
    ) -> None:
        self.mesh, self.configuration, self.start, self.matrix = mesh, configuration, start, matrix
        self.definite = definite
        self._pairs: list[Pairs] = []
        self.m = matrix.shape[1]
        self._w = (matrix.shape[2] // self.m - 1) // 2

    def _add(self, rows: np.ndarray, columns: np.ndarray, values: np.ndarray) -> None:
        """values (k, p, m, 3) into node rows (k,) and node columns (k, p)."""
        offset = (columns - rows[:, None] + self._w) * self.m
        at = offset[:, :, None, None] + np.arange(3)
        self.matrix[rows[:, None, None, None], np.arange(self.m)[:, None], at] += values

    def couple(self, rows: np.ndarray, columns: np.ndarray, blocks: np.ndarray) -> None:
        """blocks (l, 3, 3) times dr of any nodes ``columns`` (l,), to the forces on any nodes ``rows`` (l,)."""
        own = rows == columns
        middle = self.matrix.reshape(*self.matrix.shape[:2], -1, self.m)[:, :, self._w, :3]
        np.add.at(middle, rows[own], force_rows(blocks[own], self.m))
        beside, whole = ~own, np.zeros((np.count_nonzero(~own), self.m, self.m))
        whole[:, :3, :3] = blocks[beside]
        self._pairs.append(Pairs(rows[beside], columns[beside], whole))

    @property
    def stiffness(self) -> Stiffness:
        """The stiffness that was filled."""
        if not self._pairs:
            return Stiffness(self.matrix, no_pairs(self.m))
        return Stiffness(self.matrix, Pairs(*(np.concatenate(column) for column in zip(*self._pairs, strict=True))))

    def position(self, nodes: np.ndarray, rows: np.ndarray, shift: Shift = 0) -> None:
        """rows dr"""
        self._add(nodes + shift, nodes[:, None], rows[:, None])

    def stencil(self, nodes: np.ndarray, rows: np.ndarray, weights: np.ndarray, shift: Shift = 0) -> None:
        """rows times the derivative with the stencil ``weights`` (k, p): dr' or dr''."""
        columns = self.mesh.first[nodes][:, None] + np.arange(weights.shape[1])
        self._add(nodes + shift, columns, weights[:, :, None, None] * rows[:, None])

    def curvature(self, nodes: np.ndarray, rows: np.ndarray, shift: Shift = 0) -> None:
        """rows dr''"""
        self.stencil(nodes, rows, self.mesh.w2[nodes], shift)

    def tangent(self, nodes: np.ndarray, rows: np.ndarray, shift: Shift = 0) -> None:
        """rows de3"""
        self.stencil(nodes, rows @ self.across(nodes), self.mesh.w1[nodes], shift)

    def across(self, nodes: np.ndarray) -> np.ndarray:
        """(1 - e3 e3)/|r'| (k, 3, 3)."""
        e3 = self.configuration.e3[nodes]
        return (np.eye(3) - e3[:, :, None] * e3[:, None, :]) / self.configuration.metric[nodes][:, None, None]

    def _swing(self, nodes: np.ndarray) -> np.ndarray:
        """The derivative of psi with respect to e3 (k, 3)."""
        e3, old = self.configuration.e3[nodes], self.start.e3[nodes]
        return cross(e3, old) / (1.0 + _dot(e3, old))

    def _spin(self, nodes: np.ndarray, rows: np.ndarray, shift: Shift) -> None:
        """rows (k, m) dphi"""
        if self.m == 4:
            column = (self._w - shift) * 4 + 3
            self.matrix[nodes + shift, :, column] += rows

    def twist(self, half: np.ndarray, rows: np.ndarray, shift: Shift = 0) -> None:
        """rows (k, m) times dO3 of the half nodes ``half`` (k,), each after the node of its number (`twist_slope`)."""
        a, b = half, half + 1
        here, after = (
            tuple(e[nodes] for e in (self.configuration.e1, self.configuration.e2, self.configuration.e3))
            for nodes in (a, b)
        )
        rows = rows / self.mesh.ds[half][:, None]
        self.tangent(a, -rows[:, :, None] * (twist_slope(here, after) + self._swing(a))[:, None], shift)
        self.tangent(b, rows[:, :, None] * (twist_slope(after, here) + self._swing(b))[:, None], shift - 1)
        self._spin(a, -rows, shift)
        self._spin(b, rows, shift - 1)

    def nonlocal_twist(self, unit_responses: np.ndarray, factors: np.ndarray) -> None:
        """The part of M3 that comes from the twist of the half nodes before and after, by ``factors`` (n, 2).

        ``unit_responses`` (n, 2, m) are the forces of a unit M3 at each half node on the nodes before and after it.
        """
        for k, step in ((0, -1), (1, 1)):
            half = np.nonzero(factors[:, k])[0]
            for side in (0, 1):
                rows = unit_responses[half, side] * factors[half, k][:, None]
                self.twist(half + step, rows, side - step)

    def directors(self, nodes: np.ndarray, parts: np.ndarray, rows: np.ndarray, shift: Shift = 0) -> None:
        """rows (k, m, 3) times the change of the vectors p1 e1 + p2 e2 + p3 e3, ``parts`` (k, 3)."""
        e1, e2, e3 = (e[nodes] for e in (self.configuration.e1, self.configuration.e2, self.configuration.e3))
        p1, p2, p3 = (parts[:, c : c + 1] for c in range(3))
        bent = p1 * e1 + p2 * e2
        change = p3[:, :, None] * np.eye(3) - e3[:, :, None] * bent[:, None, :]
        spin = p1 * e2 - p2 * e1
        self.tangent(nodes, rows @ (change + spin[:, :, None] * self._swing(nodes)[:, None]), shift)
        self._spin(nodes, (rows @ spin[:, :, None])[:, :, 0], shift)
