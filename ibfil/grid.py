"""The periodic grid: where its points are, its wave numbers, and the Stokes solve by FFT.

Points lie at x_j = (j - n // 2) h on each axis, so the box is centred on the origin and a grid point is at the
origin. Positions are unwrapped; indices are taken modulo the number of cells.

The solve, mode by mode:  u = (alpha + eta k^2)^-1 (1 - k k/|k|^2) f.  At the Nyquist wave number of an even axis the
derivative's k is zero (a real field has none there) while k^2 keeps its value: zeroing both costs 4.7 % in the
self-mobility of a 3-point kernel. The mean mode is zero: a uniform back pressure carries any net force.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit


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


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def project(modes, kx, ky, kz, sx, sy, sz, alpha, viscosity, scale):
    """In place: scale (alpha + eta k^2)^-1 (1 - k k/|k|^2), with the mean mode zero.

    ``modes`` (3, nx, ny, 2 (nz//2 + 1)) are complex modes seen as pairs of reals, and so ``kz``, ``sz`` come twice
    each: the multipliers are real, and the loop over plain reals is what compilers turn into vector code, as long as
    no division may raise (``error_model``) and zeros are a choice, not a branch.
    """
    nx, ny, nz = modes.shape[1:]
    for i in range(nx):
        for j in range(ny):
            a, b = kx[i], ky[j]
            s, d = alpha + viscosity * (sx[i] + sy[j]), a * a + b * b
            for k in range(nz):
                c = kz[k]
                square, total = d + c * c, s + viscosity * sz[k]
                u, v, w = modes[0, i, j, k], modes[1, i, j, k], modes[2, i, j, k]
                f = scale / total if total != 0.0 else 0.0
                p = (a * u + b * v + c * w) / square if square != 0.0 else 0.0
                modes[0, i, j, k] = f * (u - a * p)
                modes[1, i, j, k] = f * (v - b * p)
                modes[2, i, j, k] = f * (w - c * p)
    if sx[0] + sy[0] + sz[0] == 0.0:  # the mean mode is among these
        for c in range(3):
            modes[c, 0, 0, 0] = 0.0
            modes[c, 0, 0, 1] = 0.0


@njit(cache=True)
def spread(base, weights, force, field):
    """Adds force (n, 3) to field (3, nx, ny, nz) with the weights; divide by the cell's volume for a density."""
    n, _, p = weights.shape
    nx, ny, nz = field.shape[1:]
    for q in range(n):
        for i in range(p):
            x = (base[q, 0] + i) % nx
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
def interpolate(base, weights, field):
    """The values (n, 3) of field (3, nx, ny, nz) at the nodes: the transpose of ``spread``."""
    n, _, p = weights.shape
    nx, ny, nz = field.shape[1:]
    out = np.zeros((n, 3))
    for q in range(n):
        for i in range(p):
            x = (base[q, 0] + i) % nx
            for j in range(p):
                y = (base[q, 1] + j) % ny
                w = weights[q, 0, i] * weights[q, 1, j]
                for k in range(p):
                    z = (base[q, 2] + k) % nz
                    v = w * weights[q, 2, k]
                    out[q, 0] += v * field[0, x, y, z]
                    out[q, 1] += v * field[1, x, y, z]
                    out[q, 2] += v * field[2, x, y, z]
    return out
