"""Transforms of fields that fill half of the box along each axis, and are wanted there: the padding of convolutions.

Forth, lines along the last axis are needed through a quarter of the box, those along the second through half of it, and
only those along the first through all; back, the same in reverse. That is 7 of the 12 parts that whole transforms take.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .fft import plan, useful_threads
from .fftw import pyfftw

_CACHE = 2**18  # bytes of a block


class PaddedTransform:
    """Transforms of ``real`` (fields, nx/2, ny/2, nz) to modes (fields, nx, ny, nz//2 + 1), and back.

    ``real`` is to be zero beyond the first half of its last axis; what is left there after is of no use. The
    normalisation 1/(nx ny nz) is the caller's.
    """

    def __init__(self, cells: tuple[int, int, int], threads: int = 1, fields: int = 3) -> None:
        nx, ny, nz = cells
        self.real = pyfftw.zeros_aligned((fields, nx // 2, ny // 2, nz))
        self.modes = pyfftw.zeros_aligned((fields, nx, ny, nz // 2 + 1), dtype=complex)
        self.size = nx * ny * nz
        threads = useful_threads(self.size, threads)
        hx, hy = nx // 2, ny // 2
        thin, half = self.modes[:, :hx, :hy], self.modes[:, :hx]
        self._pad = (self.modes[:, :hx, hy:], self.modes[:, hx:])
        self._into = (
            plan(self.real, thin, (3,), "FFTW_FORWARD", threads),
            plan(half, half, (2,), "FFTW_FORWARD", threads),
        )
        self._out = (
            plan(half, half, (2,), "FFTW_BACKWARD", threads),
            plan(thin, self.real, (3,), "FFTW_BACKWARD", threads),
        )
        lines = max(1, _CACHE // (16 * fields * nx * (nz // 2 + 1)))
        self._blocks = []
        for first in range(0, ny, lines):
            block = self.modes[:, :, first : first + lines]
            plans = (plan(block, block, (1,), way, threads) for way in ("FFTW_FORWARD", "FFTW_BACKWARD"))
            self._blocks.append((first, block, *plans))
        self.real[:] = 0.0
        self.modes[:] = 0.0

    def through(self, work: Callable[[np.ndarray, int], None]) -> np.ndarray:
        """``real`` there and back, times the number of cells; on the way ``work`` has all modes, a block at a time.

        Blocks are (fields, nx, k, nz//2 + 1), of modes from a number on along the second axis, and near the processor.
        """
        for part in self._pad:
            part[:] = 0.0
        for one in self._into:
            one.execute()
        for first, block, forward, backward in self._blocks:
            forward.execute()
            work(block, first)
            backward.execute()
        for one in self._out:
            one.execute()
        return self.real
