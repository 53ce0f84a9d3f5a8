"""The nodes of a scene on a grid whose planes are shared: each process has those whose kernels touch its planes.

A node near the border of two processes is with both, and each spreads to, and looks at, its own planes only. The
value at a node comes back plane by plane, (n, P, v), each plane from the one process that has it, and is summed over
the planes on process 0: so its last bits do not depend on where the borders are.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..grid.spreading import Stencil
from ..linalg.compiled import njit
from .division import Division


class SharedNodes:
    """Stencils of the nodes that this process has; all processes call together, process 0 with the nodes of all.

    ``planes`` is the division of the grid's ``cells`` along the first axis.
    """

    def __init__(self, comm: Any, planes: Division, cells: int) -> None:
        self._comm, self._planes, self._cells = comm, planes, cells
        self._order = np.empty(0, np.int64)  # of process 0: the nodes of each process, one process after the other
        self._counts = np.zeros(comm.size, np.int64)
        self._total = 0
        self.mine = Stencil(np.empty((0, 3), np.int64), np.empty((0, 3, 1)))
        self.touched = np.empty(0, np.int64)  # planes of the grid that any node touches, in order

    def place(self, stencil: Stencil | None) -> None:
        """Gives each process the stencils that it needs of all (n nodes), which process 0 has."""
        comm, points = self._comm, 0
        if stencil is not None:
            self._total, points = len(stencil.base), stencil.weights.shape[2]
            touched = [self._touched(stencil.base[:, 0], points, rank) for rank in range(comm.size)]
            self._order, self._counts = np.concatenate(touched), np.array([len(nodes) for nodes in touched])
            cells = stencil.base[:, :1] + np.arange(points)
            self.touched = np.unique(cells % self._cells)
        points, self.touched = comm.bcast((points, self.touched))
        base, weights = (None, None) if stencil is None else (stencil.base, stencil.weights)
        self._counts = comm.bcast(self._counts)
        self.mine = Stencil(self._dealt(base, (3,), np.int64), self._dealt(weights, (3, points), np.float64))

    def _touched(self, first: np.ndarray, points: int, rank: int) -> np.ndarray:
        """The nodes with kernels of ``points`` cells from ``first`` (n,) that touch the planes of a process."""
        count = self._planes.count(rank)
        ahead = (first - self._planes.starts[rank]) % self._cells
        return np.nonzero((ahead < count) | (ahead + points > self._cells))[0]

    def _dealt(self, values: np.ndarray | None, shape: tuple[int, ...], number: type) -> np.ndarray:
        """The part of this process of ``values`` (n, *shape) that process 0 has."""
        comm, each = self._comm, int(np.prod(shape))
        out: np.ndarray = np.empty((int(self._counts[comm.rank]), *shape), number)
        sent: np.ndarray | None = None if values is None else np.ascontiguousarray(values[self._order], number)
        comm.Scatterv([sent, self._counts * each] if sent is not None else None, out)
        return out

    def spread(self, vectors: np.ndarray | None, fields: int, real: np.ndarray) -> None:
        """Puts ``vectors`` (n, fields) of all nodes, which process 0 has, onto the planes (fields, nx/P, ny, nz)."""
        mine = self._dealt(vectors, (fields,), np.float64)
        real[:fields] = 0.0
        first = self._planes.starts[self._comm.rank]
        for k in range(0, fields, 3):
            _spread(*self.mine, mine[:, k : k + 3], real[k : k + 3], first, self._cells)

    def felt(self, fields: int, real: np.ndarray) -> np.ndarray:
        """The values (n, fields) at all nodes of the planes' fields, on process 0; nothing on the others."""
        comm, (base, weights), first = self._comm, self.mine, self._planes.starts[self._comm.rank]
        points = weights.shape[2]
        found = np.zeros((len(base), points, fields))
        for k in range(0, fields, 3):
            _interpolate(base, weights, real[k : k + 3], first, self._cells, found[:, :, k : k + 3])
        if comm.rank:
            comm.Gatherv(found, None)
            return np.empty((0, fields))
        come = np.empty((len(self._order), points, fields))
        comm.Gatherv(found, [come, self._counts * points * fields])
        out, ends = np.zeros((self._total, points, fields)), np.cumsum(self._counts)
        for start, end in zip(ends - self._counts, ends, strict=True):
            out[self._order[start:end]] += come[start:end]
        return out.sum(axis=1)


@njit(cache=True)
def _spread(base, weights, force, field, first, nx):
    """As ``spread`` of grid/spreading.py, onto the planes of nx from ``first`` on that field (3, .., ny, nz) is of."""
    n, _, p = weights.shape
    planes, ny, nz = field.shape[1:]
    for q in range(n):
        for i in range(p):
            x = (base[q, 0] + i - first) % nx
            if x >= planes:
                continue
            for j in range(p):
                y = (base[q, 1] + j) % ny
                w = weights[q, 0, i] * weights[q, 1, j]
                for k in range(p):
                    z = (base[q, 2] + k) % nz
                    v = w * weights[q, 2, k]
                    field[0, x, y, z] += v * force[q, 0]
                    field[1, x, y, z] += v * force[q, 1]
                    field[2, x, y, z] += v * force[q, 2]


@njit(cache=True)
def _interpolate(base, weights, field, first, nx, out):
    """Adds to out (n, P, 3) the share of each of those planes in a node's value."""
    n, _, p = weights.shape
    planes, ny, nz = field.shape[1:]
    for q in range(n):
        for i in range(p):
            x = (base[q, 0] + i - first) % nx
            if x >= planes:
                continue
            for j in range(p):
                y = (base[q, 1] + j) % ny
                w = weights[q, 0, i] * weights[q, 1, j]
                for k in range(p):
                    z = (base[q, 2] + k) % nz
                    v = w * weights[q, 2, k]
                    out[q, i, 0] += v * field[0, x, y, z]
                    out[q, i, 1] += v * field[1, x, y, z]
                    out[q, i, 2] += v * field[2, x, y, z]
