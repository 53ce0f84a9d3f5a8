"""The periodic grid: where its points are, and its wave numbers.

Points lie at x_j = (j - n // 2) h on each axis, so the box is centred on the origin and a grid point is at the
origin. Positions are unwrapped; indices are taken modulo the number of cells.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def smooth(n: int) -> bool:
    """Whether n has no prime factors but 2, 3 and 5: sizes that FFTs like."""
    for p in (2, 3, 5):
        while n % p == 0:
            n //= p
    return n == 1


def cells_for(box: Sequence[float], largest: float) -> tuple[int, int, int] | None:
    """Cells of the largest spacing not above ``largest`` for which every axis has a smooth number of them.

    None where no spacing within 20 % does.
    """
    n = max(1, int(np.ceil(box[0] / largest * (1 - 1e-12))))
    while box[0] / n >= 0.8 * largest:
        counts = [side * n / box[0] for side in box]
        whole = [round(c) for c in counts]
        if all(abs(c - k) < 1e-9 * k and smooth(k) for c, k in zip(counts, whole, strict=True)):
            return whole[0], whole[1], whole[2]
        n += 1
    return None


class Grid:
    """A periodic box (3,) of cubic cells: ``cells`` (3,), ``spacing`` h, ``origin`` of grid index (0, 0, 0)."""

    def __init__(self, box: Sequence[float], cells: Sequence[int]) -> None:
        self.cells = np.array(cells, np.int64)
        self.box = np.array(box, float)
        self.spacing = float(self.box[0] / self.cells[0])
        self.origin = -(self.cells // 2) * self.spacing

    def coordinates(self, r: np.ndarray) -> np.ndarray:
        """Positions (n, 3) in units of the spacing, from grid index (0, 0, 0)."""
        return r / self.spacing + self.cells // 2

    def points(self) -> np.ndarray:
        """Places (nx ny nz, 3) of the grid points."""
        axes = [start + self.spacing * np.arange(n) for start, n in zip(self.origin, self.cells, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    def wave_numbers(self) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """For each axis the wave numbers of derivatives, and the true k^2; the last axis is halved (real fields)."""
        ks, squares = [], []
        for axis, n in enumerate(self.cells):
            frequencies = np.fft.rfftfreq if axis == 2 else np.fft.fftfreq
            k = 2 * np.pi * frequencies(int(n), self.spacing)
            squares.append(k * k)
            if n % 2 == 0:
                k = k.copy()
                k[n // 2] = 0.0
            ks.append(k)
        return ks, squares
