"""Transforms between all modes and the planes of the grid that nodes touch: a third to a half of what whole ones take.

Forces live on those planes, and velocities are wanted there: FFTs in the planes are needed for them only, and across
them everywhere. That last transform is done for a block of lines at a time, together with what is to be done to the
block's modes, while they are near the processor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

from .fft import modes_of, plan, useful_threads
from .fftw import pyfftw
from .pruned_fft import run_of_cells
from .spreading import Stencil, interpolate, spread

_CACHE = 2**19  # bytes of a block
_KEPT = 4  # sizes of slabs whose plans are kept, as rods move to and fro


class Block(NamedTuple):
    """Modes (fields, a, b, nz//2 + 1) of a vector field or two, those from i and j on along the first two axes."""

    modes: np.ndarray
    i: int
    j: int


class _Planes(NamedTuple):
    """Room for the planes across an axis, (fields, nx, ny, nz) with as many of them; and for their modes."""

    real: np.ndarray
    modes: np.ndarray
    forward: pyfftw.FFTW
    backward: pyfftw.FFTW


class _Cut(NamedTuple):
    """The planes that nodes touch: across which axis, how many, from which on; and the nodes' first indices in them."""

    axis: int
    start: int
    planes: int
    base: np.ndarray

    def runs(self, n: int) -> list[tuple[slice, slice]]:
        """Which of the n planes of the grid they are, and which of the room's, in the one or two runs of the period."""
        first = min(self.planes, n - self.start)
        ahead, wrapped = slice(self.start, self.start + first), slice(0, self.planes - first)
        return [(ahead, slice(0, first)), (wrapped, slice(first, self.planes))][: 1 + (first < self.planes)]

    def across(self, field: np.ndarray) -> np.ndarray:
        """The field (fields, nx, ny, ..) with the axis that is cut as its third."""
        return field if self.axis == 1 else field.swapaxes(1, 2)


class SlabFFT:
    """Takes ``fields`` components of what nodes put onto a grid of ``cells`` to modes, and modes to what nodes feel.

    ``number`` is the type of the fields, double or single precision.
    """

    def __init__(
        self, cells: tuple[int, int, int], fields: int = 3, threads: int = 1, number: type = np.float64
    ) -> None:
        self._cells, self._fields, self._threads, self._number = cells, fields, threads, number
        self._planes: dict[tuple[int, int], _Planes] = {}
        self._lines = cache(self._make_lines)

    def _plan(self, source: np.ndarray, to: np.ndarray, axes: tuple[int, ...], direction: str) -> pyfftw.FFTW:
        return plan(source, to, axes, direction, useful_threads(source.size, self._threads))

    def _make_lines(self, axis: int) -> tuple[np.ndarray, pyfftw.FFTW, pyfftw.FFTW]:
        """Room for a block of lines along ``axis``, as many as divide the grid, and their transforms."""
        nx, ny, nz = self._cells
        other = (ny, nx)[axis]
        lines = max(1, min(other, _CACHE // (16 * self._fields * self._cells[axis] * (nz // 2 + 1))))
        while other % lines:
            lines -= 1
        shape = (nx, lines) if axis == 0 else (lines, ny)
        room = pyfftw.zeros_aligned((self._fields, *shape, nz // 2 + 1), dtype=modes_of(self._number))
        return room, *(self._plan(room, room, (1 + axis,), d) for d in ("FFTW_FORWARD", "FFTW_BACKWARD"))

    def _room(self, axis: int, count: int) -> _Planes:
        found = self._planes.pop((axis, count), None)
        if found is None:
            nx, ny, nz = self._cells
            shape = (self._fields, count, ny) if axis == 0 else (self._fields, nx, count)
            real = pyfftw.zeros_aligned((*shape, nz), dtype=self._number)
            modes = pyfftw.zeros_aligned((*shape, nz // 2 + 1), dtype=modes_of(self._number))
            axes = (2 - axis, 3)
            plans = self._plan(real, modes, axes, "FFTW_FORWARD"), self._plan(modes, real, axes, "FFTW_BACKWARD")
            found = _Planes(real, modes, *plans)
        self._planes = dict([*self._planes.items(), ((axis, count), found)][-_KEPT:])
        return found

    def _cut(self, nodes: Stencil) -> _Cut:
        """Across the first or the second axis, whichever has fewer planes that nodes touch."""
        points = nodes.weights.shape[2]
        runs = [run_of_cells(nodes.base[:, axis], points, self._cells[axis]) for axis in (0, 1)]
        axis = int(runs[1][1] < runs[0][1])
        start, count = runs[axis]
        base = nodes.base.copy()
        base[:, axis] = (base[:, axis] - start) % self._cells[axis]
        return _Cut(axis, start, count, base)

    def _blocks(self, axis: int, room: np.ndarray) -> Iterator[tuple[slice, Block]]:
        """Which lines they are, along the axis that is neither cut nor halved, and the block."""
        lines = room.shape[2 - axis]
        for first in range(0, self._cells[1 - axis], lines):
            yield slice(first, first + lines), Block(room, *((0, first) if axis == 0 else (first, 0)))

    def scatter(self, nodes: Stencil, vectors: np.ndarray) -> Iterator[Block]:
        """All modes of vectors (n, fields) spread to the grid, a block after the other."""
        cut = self._cut(nodes)
        planes, (room, forward, _) = self._room(cut.axis, cut.planes), self._lines(cut.axis)
        planes.real[:] = 0.0
        for k in range(0, self._fields, 3):
            spread(cut.base, nodes.weights, vectors[:, k : k + 3], planes.real[k : k + 3])
        planes.forward.execute()
        to, source = cut.across(room), cut.across(planes.modes)
        for lines, block in self._blocks(cut.axis, room):
            room[:] = 0.0
            for there, here in cut.runs(self._cells[cut.axis]):
                to[:, :, there] = source[:, lines, here]
            forward.execute()
            yield block

    def gather(self, nodes: Stencil, modes: Callable[[Block], None]) -> np.ndarray:
        """The values (n, fields) at the nodes of the field whose modes ``modes`` puts into each block."""
        cut = self._cut(nodes)
        planes, (room, _, backward) = self._room(cut.axis, cut.planes), self._lines(cut.axis)
        source, to = cut.across(room), cut.across(planes.modes)
        for lines, block in self._blocks(cut.axis, room):
            modes(block)
            backward.execute()
            for there, here in cut.runs(self._cells[cut.axis]):
                to[:, lines, here] = source[:, :, there]
        planes.backward.execute()
        felt = [interpolate(cut.base, nodes.weights, planes.real[k : k + 3]) for k in range(0, self._fields, 3)]
        return np.hstack(felt)
