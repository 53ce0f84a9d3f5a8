"""Points of grids: a lattice, and the periodic grid with its wave numbers.

Points of the periodic grid lie at x_j = (j - n // 2) h on each axis, so the box is centred on the origin and a point is
at the origin. Positions are unwrapped; indices are taken modulo the number of cells.
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


class Lattice:
    """Points of cubic cells: ``cells`` (3,) along each axis, ``spacing`` h, ``origin`` (3,) of index (0, 0, 0)."""

    def __init__(self, cells: Sequence[int], spacing: float, origin: np.ndarray) -> None:
        self.cells, self.spacing, self.origin = np.array(cells, np.int64), spacing, origin

    def points(self) -> np.ndarray:
        """Places (nx ny nz, 3) of the grid points."""
        axes = [start + self.spacing * np.arange(n) for start, n in zip(self.origin, self.cells, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


class Grid(Lattice):
    """A periodic ``box`` (3,) of cubic cells."""

    def __init__(self, box: Sequence[float], cells: Sequence[int]) -> None:
        self.box = np.array(box, float)
        spacing = float(self.box[0] / cells[0])
        super().__init__(cells, spacing, -(np.array(cells, np.int64) // 2) * spacing)

    def coordinates(self, r: np.ndarray) -> np.ndarray:
        """Positions (n, 3) in units of the spacing, from grid index (0, 0, 0)."""
        return r / self.spacing + self.cells // 2

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
