"""Transforms of fields that fill half of the box along each axis, and are wanted there: the padding of convolutions.

Forth, lines along the last axis are needed through a quarter of the box, those along the second through half of it, and
only those along the first through all; back, the same in reverse. That is 7 of the 12 parts that whole transforms take.
"""

from __future__ import annotations

import numpy as np

from .fft import plan, useful_threads
from .fftw import pyfftw


class PaddedTransform:
    """Forward and backward transforms of ``real`` (fields, nx, ny, nz) and ``modes`` (fields, nx, ny, nz//2 + 1).

    ``real`` is zero beyond the first half along each axis; what ``backward`` leaves there is of no use. Neither keeps
    its source, and the normalisation 1/(nx ny nz) is the caller's.
    """

    def __init__(self, cells: tuple[int, int, int], threads: int = 1, fields: int = 3) -> None:
        nx, ny, nz = cells
        self.real = pyfftw.zeros_aligned((fields, nx // 2, ny // 2, nz))
        self.modes = pyfftw.zeros_aligned((fields, nx, ny, nz // 2 + 1), dtype=complex)
        self.size = nx * ny * nz
        threads = useful_threads(self.size, threads)
        hx, hy = nx // 2, ny // 2
        self._pad = (self.modes[:, :hx, hy:], self.modes[:, hx:])
        self._forward, self._backward = [], []
        for real, modes in zip(self.real, self.modes, strict=True):
            thin, half = modes[:hx, :hy], modes[:hx]
            self._forward += [
                plan(real, thin, (2,), "FFTW_FORWARD", threads),
                plan(half, half, (1,), "FFTW_FORWARD", threads),
                plan(modes, modes, (0,), "FFTW_FORWARD", threads),
            ]
            self._backward += [
                plan(modes, modes, (0,), "FFTW_BACKWARD", threads),
                plan(half, half, (1,), "FFTW_BACKWARD", threads),
                plan(thin, real, (2,), "FFTW_BACKWARD", threads),
            ]
        self.real[:] = 0.0
        self.modes[:] = 0.0

    def forward(self, fields: int = 3) -> np.ndarray:
        """``modes`` of the first ``fields`` of ``real``."""
        for part in self._pad:
            part[:fields] = 0.0
        for one in self._forward[: 3 * fields]:
            one.execute()
        return self.modes

    def backward(self, fields: int = 3) -> np.ndarray:
        """``real`` of the first ``fields`` of ``modes``, times the number of cells."""
        for one in self._backward[: 3 * fields]:
            one.execute()
        return self.real
