"""How forces follow the tangents of clamped ends, where these turn: the columns that stand beside the stiffness.

At a clamp r' = T and r'' = W2 r + slope T (mesh.py). So a change of T is felt as dr' = dT, dr'' = slope dT there, which
is a stencil of one node: the kernels of the Jacobian do the rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..rods import elastic_jacobian
from ..rods.elastic_force import Moment
from ..rods.geometry import Configuration
from ..rods.linearization import Linearization, Shift
from ..rods.mesh import Mesh

_REACH = 2  # nodes to either side whose forces feel a tangent, by the law's nonlocal twist


class EndTangents:
    """The columns of the tangents at clamped ends, ``nodes`` (k,)."""

    def __init__(self, mesh: Mesh, nodes: np.ndarray) -> None:
        n = len(mesh.ds)
        w1, w2 = np.zeros((n, 1)), np.zeros((n, 1))
        w1[nodes, 0] = 1.0
        for i in nodes:
            c = int(np.argmax(np.abs(mesh.c1[i])))
            w2[i, 0] = mesh.c2[i, c] / mesh.c1[i, c]
        self.nodes, self._n, self.slope = nodes, n, w2[nodes, 0]
        self._mesh = mesh._replace(first=np.arange(n), w1=w1, w2=w2)
        self._stencils = elastic_jacobian.stencils(self._mesh)

    def turned(self, mesh: Mesh, tangents: Sequence[np.ndarray]) -> Mesh:
        """The rods' mesh with these tangents (3,) at the ends."""
        c1, c2 = mesh.c1.copy(), mesh.c2.copy()
        for node, slope, tangent in zip(self.nodes, self.slope, tangents, strict=True):
            c1[node], c2[node] = tangent, slope * tangent
        return mesh._replace(c1=c1, c2=c2)

    def begin(self, configuration: Configuration, start: Configuration, m: int) -> Linearization:
        """Columns to be filled: by ``elastic``, and by loads as they fill a stiffness."""
        matrix = np.zeros((self._n, m, (2 * _REACH + 1) * m))
        return _Columns(self._mesh, configuration, start, matrix)

    def elastic(self, columns: Linearization, moment: Moment) -> None:
        """Adds those of the elastic force."""
        configuration, start, matrix = columns.configuration, columns.start, columns.matrix
        elastic_jacobian.through_stencils(self._mesh, self._stencils, configuration, start, moment, matrix)

    def of(self, columns: Linearization) -> list[np.ndarray]:
        """The forces (n, m, 3) by the tangent of each end, from what was filled."""
        out, m = [], columns.m
        for i in self.nodes:
            block = np.zeros((self._n, m, 3))
            for row in range(max(0, i - _REACH), min(self._n, i + _REACH + 1)):
                at = (i - row + _REACH) * m
                block[row] = columns.matrix[row, :, at : at + 3]
            out.append(block)
        return out


class _Columns(Linearization):
    """The part that follows tangents and curvatures; that of places and turns stands in the stiffness."""

    def position(self, nodes: np.ndarray, rows: np.ndarray, shift: Shift = 0) -> None:
        """Nothing."""

    def couple(self, rows: np.ndarray, columns: np.ndarray, blocks: np.ndarray) -> None:
        """Nothing."""

    def _spin(self, nodes: np.ndarray, rows: np.ndarray, shift: Shift) -> None:
        """Nothing."""
