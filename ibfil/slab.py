"""Transforms between all modes and the planes of the grid that nodes touch: a third to a half of what whole ones take.

Forces live on those planes, and velocities are wanted there: FFTs in the other two axes are needed for them only, and
along the first axis everywhere. A slab that is the whole grid is no dearer than a whole transform.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pyfftw

from .grid import interpolate, spread
from .pruned import run_of_cells
from .transforms import VectorTransform, useful_threads

if TYPE_CHECKING:
    from .immersed import Nodes

_KEPT = 4  # sizes of slabs whose plans are kept, as rods move to and fro


class _Planes(NamedTuple):
    """Room for so many planes: (3, planes, ny, nz), and their modes in the last two axes."""

    real: np.ndarray
    modes: np.ndarray
    forward: pyfftw.FFTW
    backward: pyfftw.FFTW


class Slab:
    """Works on the modes of ``whole``, its first three components, in place."""

    def __init__(self, whole: VectorTransform, threads: int = 1) -> None:
        self.whole, self._threads = whole, threads
        self._modes = whole.modes[:3]
        self._along = {d: self._plan(self._modes, self._modes, (1,), d) for d in ("FFTW_FORWARD", "FFTW_BACKWARD")}
        self._kept: dict[int, _Planes] = {}
        self._modes[:] = 0.0

    def _plan(self, source: np.ndarray, to: np.ndarray, axes: tuple[int, ...], direction: str) -> pyfftw.FFTW:
        flags = ("FFTW_MEASURE", "FFTW_DESTROY_INPUT")
        threads = useful_threads(source.size, self._threads)
        return pyfftw.FFTW(
            source, to, axes=axes, direction=direction, flags=flags, threads=threads, planning_timelimit=20.0
        )

    def _planes(self, count: int) -> _Planes:
        found = self._kept.pop(count, None)
        if found is None:
            _, _, ny, half = self._modes.shape
            real = pyfftw.zeros_aligned((3, count, ny, self.whole.real.shape[3]))
            modes = pyfftw.zeros_aligned((3, count, ny, half), dtype=complex)
            plans = self._plan(real, modes, (2, 3), "FFTW_FORWARD"), self._plan(modes, real, (2, 3), "FFTW_BACKWARD")
            found = _Planes(real, modes, *plans)
        self._kept = dict([*self._kept.items(), (count, found)][-_KEPT:])
        return found

    def _of(self, nodes: Nodes) -> tuple[_Planes, np.ndarray, list[tuple[slice, slice]]]:
        """The planes that nodes touch, the nodes' first indices in them, and which of the grid's they are, in parts."""
        n = self.whole.real.shape[1]
        start, count = run_of_cells(nodes.base[:, 0], nodes.weights.shape[2], n)
        base = nodes.base.copy()
        base[:, 0] = (base[:, 0] - start) % n
        first = min(count, n - start)
        parts = [(slice(start, start + first), slice(0, first)), (slice(0, count - first), slice(first, count))]
        return self._planes(count), base, parts

    def put(self, nodes: Nodes, vectors: np.ndarray) -> None:
        """Leaves in the modes those of vectors (n, 3) spread to the grid."""
        planes, base, parts = self._of(nodes)
        planes.real[:] = 0.0
        spread(base, nodes.weights, vectors, planes.real)
        planes.forward.execute()
        self._modes[:] = 0.0
        for there, here in parts:
            self._modes[:, there] = planes.modes[:, here]
        self._along["FFTW_FORWARD"].execute()

    def take(self, nodes: Nodes) -> np.ndarray:
        """What nodes feel (n, 3) of the field that has the modes, which are lost."""
        planes, base, parts = self._of(nodes)
        self._along["FFTW_BACKWARD"].execute()
        for there, here in parts:
            planes.modes[:, here] = self._modes[:, there]
        planes.backward.execute()
        return interpolate(base, nodes.weights, planes.real)
