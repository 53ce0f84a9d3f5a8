"""FFTs of fields that processes share: planes of points across the first axis, rows of modes across the second.

    points (nx/P, ny, nz)  --FFTs in the planes-->  (nx/P, ny, nz//2 + 1)  --all to all-->  (nx, ny/P, nz//2 + 1)
    --FFTs along x, one row of y at a time-->  modes

A plane and a row are transformed by plans of their own, which are the same for every process and every number of them:
the modes have the same bits however the grid is shared. Each number is sent once a transform, in one message a pair of
processes and component.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from ..grid.fft import learn, modes_of, plan, useful_threads, wisdom
from ..grid.fftw import pyfftw
from ..grid.slab_fft import Block
from .division import Division


class SharedTransform:
    """This process's part of ``fields`` real fields on a grid of ``cells``, and of their modes; all call together.

    ``fields`` is 3 or more, and 3 or all of them are transformed at a time.
    ``real`` (fields, nx/P, ny, nz) are the planes, ``modes`` (fields, nx, ny/P, nz//2 + 1) the rows. Process 0 plans,
    and the others take its plans; ``comm`` is the MPI communicator, ``number`` the type of ``real``.
    """

    def __init__(
        self, comm: Any, cells: tuple[int, int, int], fields: int = 3, threads: int = 1, number: type = np.float64
    ) -> None:
        nx, ny, nz = cells
        self._comm, self.cells, self.size = comm, cells, nx * ny * nz
        self.planes, self.rows = Division.of(nx, comm.size), Division.of(ny, comm.size)
        mine, own, half, kind = self.planes.count(comm.rank), self.rows.count(comm.rank), nz // 2 + 1, modes_of(number)
        self.real = pyfftw.zeros_aligned((fields, mine, ny, nz), dtype=number)
        self.modes = pyfftw.zeros_aligned((fields, nx, own, half), dtype=kind)
        self._sent = pyfftw.zeros_aligned(mine * ny * half, dtype=kind)
        ends = [mine * half * start for start in self.rows.starts]  # in it: my planes, the rows of each process
        self._parts = [self._sent[a:b].reshape(mine, -1, half) for a, b in pairwise(ends)]
        self._in_planes = [mine * half * count for count in self.rows.counts]
        self._in_rows = [own * half * count for count in self.planes.counts]

        self._plane = pyfftw.zeros_aligned((ny, nz), dtype=number)
        self._plane_modes = pyfftw.zeros_aligned((ny, half), dtype=kind)
        self._room = pyfftw.zeros_aligned((fields, nx, 1, half), dtype=kind)
        if comm.rank == 0:
            self._plan(threads)
        known = comm.bcast(wisdom() if comm.rank == 0 else None)
        if comm.rank > 0:
            learn(known)
            self._plan(threads)

    def _plan(self, threads: int) -> None:
        few = useful_threads(self._plane.size, threads)
        self._forth = plan(self._plane, self._plane_modes, (0, 1), "FFTW_FORWARD", few)
        self._back = plan(self._plane_modes, self._plane, (0, 1), "FFTW_BACKWARD", few)
        few = useful_threads(self._room.size, threads)
        self._along = {
            count: [plan(room, room, (1,), d, few) for d in ("FFTW_FORWARD", "FFTW_BACKWARD")]
            for count, room in ((n, self._room[:n]) for n in {3, len(self._room)})
        }

    def blocks(self, fields: int) -> Iterator[Block]:
        """All modes of this process of the first ``fields`` of ``real``, one row after the other; the room is reused.

        A block's ``j`` counts from the first row of this process.
        """
        for field in range(fields):
            self._to_rows(field)
        forward = self._along[fields][0]
        for j in range(self.modes.shape[2]):
            self._room[:fields, :, 0] = self.modes[:fields, :, j]
            forward.execute()
            yield Block(self._room[:fields], 0, j)

    def from_blocks(self, fields: int, fill: Callable[[Block], None]) -> np.ndarray:
        """The first ``fields`` of ``real``, times the cells, of modes that ``fill`` puts into each row's block."""
        for j in range(self.modes.shape[2]):
            fill(Block(self._room[:fields], 0, j))
            self._put_back(fields, j)
        return self._planes_of(fields)

    def multiply(self, fields: int, symbol: Callable[[Block], None]) -> np.ndarray:
        """The first ``fields`` of ``real``, times the cells, after ``symbol`` is applied to each row's block."""
        for block in self.blocks(fields):
            symbol(block)
            self._put_back(fields, block.j)
        return self._planes_of(fields)

    def _put_back(self, fields: int, j: int) -> None:
        """The row j of ``modes``, transformed along x, from the modes in the room."""
        self._along[fields][1].execute()
        self.modes[:fields, :, j] = self._room[:fields, :, 0]

    def _planes_of(self, fields: int) -> np.ndarray:
        for field in range(fields):
            self._to_planes(field)
        return self.real

    def forward(self, fields: int, into: np.ndarray | None = None) -> np.ndarray:
        """``modes`` of the first ``fields`` of ``real``, or ``into`` another array like them; ``modes`` are lost."""
        to = self.modes if into is None else into
        for block in self.blocks(fields):
            to[:fields, :, block.j] = block.modes[:, :, 0]
        return to

    def backward(self, fields: int) -> np.ndarray:
        """``real`` of the first ``fields`` of ``modes``, which are lost, times the number of cells."""

        def kept(block: Block) -> None:
            block.modes[:, :, 0] = self.modes[:fields, :, block.j]

        return self.from_blocks(fields, kept)

    def _to_rows(self, field: int) -> None:
        """From the planes of a field, by FFTs in them, to the rows of its modes."""
        rows = [self.rows.rows(r) for r in range(self._comm.size)]
        for i, points in enumerate(self.real[field]):
            self._plane[:] = points
            self._forth.execute()
            for part, to in zip(self._parts, rows, strict=True):
                part[i] = self._plane_modes[to]
        self._comm.Alltoallv([self._sent, self._in_planes], [self.modes[field], self._in_rows])

    def _to_planes(self, field: int) -> None:
        """The way back."""
        rows = [self.rows.rows(r) for r in range(self._comm.size)]
        self._comm.Alltoallv([self.modes[field], self._in_rows], [self._sent, self._in_planes])
        for i, points in enumerate(self.real[field]):
            for part, come in zip(self._parts, rows, strict=True):
                self._plane_modes[come] = part[i]
            self._back.execute()
            points[:] = self._plane
