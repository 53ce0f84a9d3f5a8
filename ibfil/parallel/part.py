"""The share of a process in a periodic grid: planes of points, rows of modes, and the nodes that touch its planes."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..grid.periodic_grid import Grid
from ..grid.slab_fft import Block
from ..grid.spectral import half_curl, project
from ..grid.spreading import Stencil
from .nodes import SharedNodes
from .transform import SharedTransform


class GridPart:
    """The part of one process in a grid of ``box`` (3,) and ``cells`` (3,), and in each of its solves.

    ``vectors`` of a node go through the grid: its force, and with two its torque. All processes call a method
    together; what it takes of nodes process 0 has, and gets.
    """

    def __init__(
        self,
        comm: Any,
        box: tuple[float, ...],
        cells: tuple[int, int, int],
        vectors: int = 1,
        threads: int = 1,
        fields: int = 3,
        number: type = np.float64,
    ) -> None:
        self._comm, self.grid, self.vectors = comm, Grid(box, cells), vectors
        self.transform = SharedTransform(comm, cells, max(fields, 3 * vectors), threads, number)
        self.nodes = SharedNodes(comm, self.transform.planes, cells[0])
        self.rows = self.transform.rows.rows(comm.rank)
        (kx, ky, kz), (sx, sy, sz) = self.grid.wave_numbers()
        self._k = (kx, ky[self.rows], kz)
        self._waves = (np.repeat(kz, 2), sx, sy[self.rows], np.repeat(sz, 2))
        self._scale = 1.0 / (self.transform.size * self.grid.spacing**3)

    def place(self, stencil: Stencil | None) -> None:
        """Gives each process the nodes that touch its planes."""
        self.nodes.place(stencil)

    def half_curl(self, block: Block, source: np.ndarray, target: np.ndarray) -> None:
        """Adds half a curl of ``source`` to ``target``, both of a block's shape."""
        kx, ky, kz = self._k
        half_curl(source, kx, ky[block.j : block.j + 1], kz, target)

    def velocity(self, viscosity: float, alpha: float, vectors: np.ndarray | None) -> np.ndarray:
        """Velocities at nodes that ``vectors`` (n, 3 v) on them drive, and half the vorticities where v = 2."""
        t, fields = self.transform, 3 * self.vectors
        self.nodes.spread(vectors, fields, t.real)
        u = t.multiply(fields, partial(self._solve, viscosity, alpha), self.nodes.touched)
        return self.nodes.felt(fields, u)

    def _solve(self, viscosity: float, alpha: float, block: Block) -> None:
        """From the modes of forces, and of torques, in the block to those of velocities, and half their curl."""
        kx, ky, _ = self._k
        kz, sx, sy, sz = self._waves
        row, flow = slice(block.j, block.j + 1), block.modes[:3]
        if self.vectors == 2:
            self.half_curl(block, block.modes[3:], flow)
        project(flow.view(float), kx, ky[row], kz, sx, sy[row], sz, alpha, viscosity, self._scale)
        if self.vectors == 2:
            block.modes[3:] = 0.0
            self.half_curl(block, flow, block.modes[3:])
