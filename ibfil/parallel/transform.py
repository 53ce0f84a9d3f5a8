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
from typing import Any, NamedTuple

import numpy as np

from ..grid.fft import learn, modes_of, plan, useful_threads, wisdom
from ..grid.fftw import pyfftw
from ..grid.slab_fft import Block
from .division import Division


class _Cut(NamedTuple):
    """The planes (k,) of the grid that are transformed; those of this process, as it counts them; what is sent of them.

    ``parts`` are the rows of each process, in what is sent; then numbers to send to, and to receive from, each.
    """

    planes: np.ndarray
    mine: list[int]
    parts: list[np.ndarray]
    in_planes: list[int]
    in_rows: list[int]


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
        self._all = self._cut(np.arange(nx))
        self._last = self._all

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

    def _cut(self, planes: np.ndarray) -> _Cut:
        """The parts that are sent where only these ``planes`` (k,), in order, are looked at, or not zero."""
        comm, (_, _, own, half) = self._comm, self.modes.shape
        counts = [int(count) for count in np.diff(np.searchsorted(planes, self.planes.starts))]
        mine = planes[(planes >= self.planes.starts[comm.rank]) & (planes < self.planes.starts[comm.rank + 1])]
        ends = [len(mine) * half * start for start in self.rows.starts]  # my planes, the rows of each process
        pieces = zip(self.rows.counts, pairwise(ends), strict=True)
        parts = [self._sent[a:b].reshape(len(mine), count, half) for count, (a, b) in pieces]
        sizes = [len(mine) * half * count for count in self.rows.counts]
        local = (mine - self.planes.starts[comm.rank]).tolist()
        return _Cut(planes, local, parts, sizes, [own * half * count for count in counts])

    def _of(self, planes: np.ndarray | None) -> _Cut:
        """The same; that of the last ones is kept."""
        if planes is None:
            return self._all
        if self._last.planes is not planes:
            self._last = self._cut(planes)
        return self._last

    def blocks(self, fields: int, planes: np.ndarray | None = None) -> Iterator[Block]:
        """All modes of this process of the first ``fields`` of ``real``, one row after the other; the room is reused.

        A block's ``j`` counts from the first row of this process. All points beyond ``planes``, where some are given,
        count as zero.
        """
        cut, forward = self._of(planes), self._along[fields][0]
        for field in range(fields):
            self._to_rows(field, cut)
        room = self._room[:fields]
        for j in range(self.modes.shape[2]):
            if len(cut.planes) < len(room[0]):
                room[:] = 0.0
                room[:, cut.planes, 0] = self.modes[:fields, : len(cut.planes), j]
            else:
                room[:, :, 0] = self.modes[:fields, :, j]
            forward.execute()
            yield Block(room, 0, j)

    def from_blocks(self, fields: int, fill: Callable[[Block], None], planes: np.ndarray | None = None) -> np.ndarray:
        """The first ``fields`` of ``real``, times the cells, of modes that ``fill`` puts into each row's block.

        Where ``planes`` are given only those are found, and the others have no meaning.
        """
        cut = self._of(planes)
        for j in range(self.modes.shape[2]):
            fill(Block(self._room[:fields], 0, j))
            self._put_back(fields, j, cut)
        return self._planes_of(fields, cut)

    def multiply(self, fields: int, symbol: Callable[[Block], None], planes: np.ndarray | None = None) -> np.ndarray:
        """The first ``fields`` of ``real``, times the cells, after ``symbol`` is applied to each row's block."""
        cut = self._of(planes)
        for block in self.blocks(fields, planes):
            symbol(block)
            self._put_back(fields, block.j, cut)
        return self._planes_of(fields, cut)

    def _put_back(self, fields: int, j: int, cut: _Cut) -> None:
        """The row j of what is sent back, transformed along x, from the modes in the room."""
        self._along[fields][1].execute()
        if len(cut.planes) < self._room.shape[1]:
            self.modes[:fields, : len(cut.planes), j] = self._room[:fields, cut.planes, 0]
        else:
            self.modes[:fields, :, j] = self._room[:fields, :, 0]

    def _planes_of(self, fields: int, cut: _Cut) -> np.ndarray:
        for field in range(fields):
            self._to_planes(field, cut)
        return self.real

    def forward(self, fields: int, into: np.ndarray | None = None) -> np.ndarray:
        """``modes`` of the first ``fields`` of ``real``, or ``into`` another array like them; ``modes`` are lost."""
        to = self.modes if into is None else into
        for block in self.blocks(fields):
            to[:fields, :, block.j] = block.modes[:, :, 0]
        return to

    def backward(self, fields: int, planes: np.ndarray | None = None) -> np.ndarray:
        """``real`` of the first ``fields`` of ``modes``, which are lost, times the number of cells; or ``planes``."""

        def kept(block: Block) -> None:
            block.modes[:, :, 0] = self.modes[:fields, :, block.j]

        return self.from_blocks(fields, kept, planes)

    def _to_rows(self, field: int, cut: _Cut) -> None:
        """From the planes of a field, by FFTs in them, to the rows of its modes."""
        rows = [self.rows.rows(r) for r in range(self._comm.size)]
        for i, plane in enumerate(cut.mine):
            self._plane[:] = self.real[field, plane]
            self._forth.execute()
            for part, to in zip(cut.parts, rows, strict=True):
                part[i] = self._plane_modes[to]
        self._comm.Alltoallv([self._sent, cut.in_planes], [self.modes[field], cut.in_rows])

    def _to_planes(self, field: int, cut: _Cut) -> None:
        """The way back."""
        rows = [self.rows.rows(r) for r in range(self._comm.size)]
        self._comm.Alltoallv([self.modes[field], cut.in_rows], [self._sent, cut.in_planes])
        for i, plane in enumerate(cut.mine):
            for part, come in zip(cut.parts, rows, strict=True):
                self._plane_modes[come] = part[i]
            self._back.execute()
            self.real[field, plane] = self._plane
