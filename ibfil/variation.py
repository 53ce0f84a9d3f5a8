"""How forces that follow the rod change with it: from tangents, curvatures and turns into a band matrix by node.

A load writes its derivative in the quantities it is made of; here they are traced to displacements. With the tangents
``old`` of the step's start (holonomy as in ``elasticity.stiffness``):

    de3 = (1 - e3 e3) dr'/|r'|,   dpsi = dphi + (e3 x old).de3/(1 + old.e3)
    de1 = -(e1.de3) e3 + e2 dpsi,   de2 = -(e2.de3) e3 - e1 dpsi
"""

from __future__ import annotations

import numpy as np

from .geometry import Geometry
from .rods import Mesh


class Variation:
    """A band matrix (n, m, (2 w + 1) m) being filled, at the configuration ``shape`` reached from ``start``.

    In each method ``nodes`` (k,) are the nodes whose quantity varies, ``rows`` (k, m, 3) or (k, m) its factor, and the
    result goes to the rows of the nodes ``nodes + shift``. Rows of forces come first, the torque (m = 4) last.
    """

    def __init__(self, mesh: Mesh, shape: Geometry, start: Geometry, matrix: np.ndarray) -> None:
        self.mesh, self.shape, self.start, self.matrix = mesh, shape, start, matrix
        self.m = matrix.shape[1]
        self._w = (matrix.shape[2] // self.m - 1) // 2

    def _add(self, rows: np.ndarray, columns: np.ndarray, values: np.ndarray) -> None:
        """values (k, p, m, 3) into node rows (k,) and node columns (k, p)."""
        offset = (columns - rows[:, None] + self._w) * self.m
        at = offset[:, :, None, None] + np.arange(3)
        self.matrix[rows[:, None, None, None], np.arange(self.m)[:, None], at] += values

    def position(self, nodes: np.ndarray, rows: np.ndarray, shift: int = 0) -> None:
        """rows dr"""
        self._add(nodes + shift, nodes[:, None], rows[:, None])

    def stencil(self, nodes: np.ndarray, rows: np.ndarray, weights: np.ndarray, shift: int = 0) -> None:
        """rows times the derivative with the stencil ``weights`` (k, p): dr' or dr''."""
        columns = self.mesh.first[nodes][:, None] + np.arange(weights.shape[1])
        self._add(nodes + shift, columns, weights[:, :, None, None] * rows[:, None])

    def curvature(self, nodes: np.ndarray, rows: np.ndarray, shift: int = 0) -> None:
        """rows dr''"""
        self.stencil(nodes, rows, self.mesh.w2[nodes], shift)

    def tangent(self, nodes: np.ndarray, rows: np.ndarray, shift: int = 0) -> None:
        """rows de3"""
        self.stencil(nodes, rows @ self.across(nodes), self.mesh.w1[nodes], shift)

    def across(self, nodes: np.ndarray) -> np.ndarray:
        """(1 - e3 e3)/|r'| (k, 3, 3)."""
        e3 = self.shape.e3[nodes]
        return (np.eye(3) - e3[:, :, None] * e3[:, None, :]) / self.shape.speed[nodes][:, None, None]

    def turn(self, nodes: np.ndarray, rows: np.ndarray, shift: int = 0) -> None:
        """rows (k, m) dpsi"""
        e3, old = self.shape.e3[nodes], self.start.e3[nodes]
        swing = np.cross(e3, old) / (1.0 + np.einsum("ij,ij->i", e3, old))[:, None]
        self.tangent(nodes, rows[:, :, None] * swing[:, None, :], shift)
        if self.m == 4:
            column = (self._w - shift) * 4 + 3
            self.matrix[nodes + shift, :, column] += rows

    def directors(self, nodes: np.ndarray, parts: np.ndarray, rows: np.ndarray, shift: int = 0) -> None:
        """rows (k, m, 3) times the change of the vectors p1 e1 + p2 e2 + p3 e3, ``parts`` (k, 3)."""
        e1, e2, e3 = (e[nodes] for e in (self.shape.e1, self.shape.e2, self.shape.e3))
        p1, p2, p3 = (parts[:, c : c + 1] for c in range(3))
        bent = p1 * e1 + p2 * e2
        change = p3[:, :, None] * np.eye(3) - e3[:, :, None] * bent[:, None, :]
        self.tangent(nodes, rows @ change, shift)
        self.turn(nodes, np.einsum("kmc,kc->km", rows, p1 * e2 - p2 * e1), shift)
