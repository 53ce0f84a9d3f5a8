"""The Stokes solve by FFTs of only those lines that the filaments' bounding box touches.

Forces live in the box and velocities are wanted there, so of the three passes of a transform the first needs the lines
through the box's cross-section, the second those through its last axis, and only the third all of them. The whole grid
is never in memory, and it is the same operator to round-off. Axes are ordered by the box: its longest, A, is first
(real to complex), its thinnest, C, is last; vectors have their components in the order (C, B, A).

The third pass, forth, projection and back, is one linear map from the box's planes to themselves, for each pair of wave
numbers (k_B, k_A). In a thin box it is a sum over planes with tabulated coefficients,

    u_a(z) = sum_z' T_ab(z - z') f_b(z'),     T_ab(d) = inverse transform along C of (eta k^2)^-1 (1 - k k/|k|^2)_ab

and in a thick one FFTs of blocks of lines, padded and cut while they are in cache. Counts decide.
"""

from __future__ import annotations

import numpy as np

from ..linalg.compiled import njit
from .fft import ESTIMATED, plan, useful_threads
from .fftw import pyfftw
from .periodic_grid import Grid
from .spectral import StokesSymbol, project
from .spreading import interpolate, spread

_CACHE = 2**20  # bytes of a block of the third pass: what stays near the processor
_ROOM = 4  # extents are rounded up to this, so that plans serve while the filaments move


def extent(occupied: np.ndarray) -> tuple[int, int]:
    """Start and length of the shortest run of a periodic axis that holds all ``occupied`` (n,) cells."""
    n = len(occupied)
    at = np.nonzero(occupied)[0]
    gaps = np.diff(np.append(at, at[0] + n))
    widest = int(np.argmax(gaps))
    start = int(at[(widest + 1) % len(at)])
    return start, int(n - gaps[widest] + 1)


def bounding_box(base: np.ndarray, points: int, cells: np.ndarray) -> tuple[list[int], list[int]]:
    """First cell and number of cells, per axis, of the box that holds the stencils (first index ``base`` (n, 3))."""
    runs = [run_of_cells(base[:, axis], points, int(n)) for axis, n in enumerate(cells)]
    return [start for start, _ in runs], [size for _, size in runs]


def run_of_cells(first: np.ndarray, points: int, n: int) -> tuple[int, int]:
    """First cell and number of cells of the run, on a periodic axis of n, that holds stencils from ``first`` (n,)."""
    occupied = np.zeros(n, bool)
    occupied[(first[:, None] + np.arange(points)) % n] = True
    start, size = extent(occupied)
    size = -(-size // _ROOM) * _ROOM
    return (start, size) if size < n else (0, n)


def is_thin(planes: int, cells: int) -> bool:
    """Whether sums over ``planes`` of an axis of ``cells`` are cheaper than FFTs of its lines; from counts."""
    return planes * planes < 0.4 * cells * np.log2(cells)


class PrunedSolve:
    """Velocities at the nodes, (n, 3), by pruned transforms; plans and buffers belong to the extents of the box."""

    def __init__(self, grid: Grid, viscosity: float, threads: int = 1) -> None:
        self.grid, self.viscosity, self._threads = grid, viscosity, threads
        self._passes: dict[tuple[tuple[int, ...], tuple[int, ...]], _Passes] = {}

    def velocity(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocity (n, 3) that forces (n, 3) with stencils (base, weights) drive at their own nodes."""
        starts, sizes = bounding_box(base, weights.shape[2], self.grid.cells)
        order = tuple(int(a) for a in np.argsort(sizes, kind="stable"))  # C, B, A
        key = order, tuple(sizes)
        if key not in self._passes:
            self._passes = {key: _Passes(self.grid, self.viscosity, order, tuple(sizes), self._threads)}
        local = (base - np.array(starts)) % self.grid.cells
        back = np.argsort(order)
        u = self._passes[key].velocity(
            np.ascontiguousarray(local[:, order]),
            np.ascontiguousarray(weights[:, order]),
            np.ascontiguousarray(force[:, order]),
        )
        return u[:, back]


class _Passes:
    """Plans and buffers for one order of axes and one size of the box."""

    def __init__(
        self, grid: Grid, viscosity: float, order: tuple[int, ...], sizes: tuple[int, ...], threads: int
    ) -> None:
        nc, nb, na = (int(grid.cells[a]) for a in order)
        ec, eb, _ = (sizes[a] for a in order)
        half = na // 2 + 1
        self._eb = eb
        self.real = pyfftw.zeros_aligned((3, ec, eb, na))
        self._modes = pyfftw.empty_aligned((3, ec, eb, half), dtype=complex)
        self._wide = pyfftw.zeros_aligned((nb, ec, 3, half), dtype=complex)
        self._first = _plan(self.real, self._modes, 3, "FFTW_FORWARD", threads)
        self._last = _plan(self._modes, self.real, 3, "FFTW_BACKWARD", threads)
        self._second = [_plan(self._wide, self._wide, 0, d, threads) for d in ("FFTW_FORWARD", "FFTW_BACKWARD")]
        waves = _ordered_waves(grid, order)
        scale = 1.0 / (nb * na * grid.spacing**3)
        self._third: _Planes | _Lines
        if is_thin(ec, nc):
            self._third = _Planes(*waves, ec, viscosity, scale)
        else:
            self._third = _Lines(*waves, self._wide.shape, viscosity, scale / nc, threads)

    def velocity(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """All arguments and the answer with the axes (C, B, A)."""
        self.real[:] = 0.0
        spread(base, weights, force, self.real)
        self._first.execute()
        eb = self._eb
        self._wide[:eb] = self._modes.transpose(2, 1, 0, 3)
        self._wide[eb:] = 0.0
        self._second[0].execute()
        self._third.apply(self._wide)
        self._second[1].execute()
        self._modes[:] = self._wide[:eb].transpose(2, 1, 0, 3)
        self._last.execute()
        return interpolate(base, weights, self.real)


def _plan(source: np.ndarray, to: np.ndarray, axis: int, direction: str, threads: int) -> pyfftw.FFTW:
    """Estimated: the box changes as rods move, and to measure its plans anew would take longer than they gain."""
    return plan(source, to, (axis,), direction, useful_threads(source.size, threads), ESTIMATED)


class _Planes:
    """The third pass of a thin box: sums over its planes."""

    def __init__(self, ks: list[np.ndarray], squares: list[np.ndarray], planes: int, viscosity: float, scale: float):
        symbol = StokesSymbol(ks, squares, viscosity)
        self.table = np.empty((symbol.total.shape[1], planes, 6, 2 * symbol.total.shape[2]))
        # CC, BB, AA, CB, CA, BA; what is odd in k_C comes out imaginary and odd in the distance
        for c, (a, b) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
            line = np.fft.ifft(scale * symbol.solenoidal(a, b) / symbol.total, axis=0)[:planes]
            part = line.imag if c in (3, 4) else line.real
            self.table[:, :, c] = np.repeat(np.moveaxis(part, 0, 1), 2, axis=2)

    def apply(self, wide: np.ndarray) -> None:
        """In place on (nb, planes, 3, half), complex. Along C, i is taken out, so that all coefficients are real."""
        wide[:, :, 0] *= -1j
        wide.view(float)[:] = _sum_planes(wide.view(float), self.table)
        wide[:, :, 0] *= 1j


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _sum_planes(f, table):
    """u_a(z) = sum_z' T_ab(z - z') f_b(z') for each k_B; T_CB and T_CA are odd in z - z'."""
    rows, planes, _, length = f.shape
    out = np.zeros_like(f)
    for r in range(rows):
        for z in range(planes):
            for y in range(planes):
                d = abs(z - y)
                s = 1.0 if z > y else -1.0
                for k in range(length):
                    odd = table[r, d, 3, k] * f[r, y, 1, k] + table[r, d, 4, k] * f[r, y, 2, k]
                    out[r, z, 0, k] += table[r, d, 0, k] * f[r, y, 0, k] + s * odd
                for k in range(length):
                    even = table[r, d, 1, k] * f[r, y, 1, k] + table[r, d, 5, k] * f[r, y, 2, k]
                    out[r, z, 1, k] += even - s * table[r, d, 3, k] * f[r, y, 0, k]
                for k in range(length):
                    even = table[r, d, 2, k] * f[r, y, 2, k] + table[r, d, 5, k] * f[r, y, 1, k]
                    out[r, z, 2, k] += even - s * table[r, d, 4, k] * f[r, y, 0, k]
    return out


class _Lines:
    """The third pass of a thick box: FFTs of blocks of lines, padded and cut."""

    def __init__(
        self,
        ks: list[np.ndarray],
        squares: list[np.ndarray],
        shape: tuple[int, ...],
        viscosity: float,
        scale: float,
        threads: int,
    ) -> None:
        nb, self._planes, _, half = shape
        nc = len(ks[0])
        rows = max(1, min(nb, _CACHE // (3 * nc * half * 16)))
        while nb % rows:
            rows -= 1
        self._rows, self._viscosity, self._scale = rows, viscosity, scale
        self._block = pyfftw.zeros_aligned((3, nc, rows, half), dtype=complex)
        self._ffts = [_plan(self._block, self._block, 1, d, threads) for d in ("FFTW_FORWARD", "FFTW_BACKWARD")]
        self._k = [ks[0], ks[1], np.repeat(ks[2], 2)]
        self._s = [squares[0], squares[1], np.repeat(squares[2], 2)]

    def apply(self, wide: np.ndarray) -> None:
        """In place on (nb, planes, 3, half), complex."""
        k, s, planes = self._k, self._s, self._planes
        for start in range(0, len(wide), self._rows):
            rows = slice(start, start + self._rows)
            self._block[:, :planes] = wide[rows].transpose(2, 1, 0, 3)
            self._block[:, planes:] = 0.0
            self._ffts[0].execute()
            reals = self._block.view(float)
            project(reals, k[0], k[1][rows], k[2], s[0], s[1][rows], s[2], 0.0, self._viscosity, self._scale)
            self._ffts[1].execute()
            wide[rows] = self._block[:, :planes].transpose(2, 1, 0, 3)


def _ordered_waves(grid: Grid, order: tuple[int, ...]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Wave numbers and squares in the order (C, B, A), A halved."""
    ordered = Grid([grid.box[a] for a in order], [int(grid.cells[a]) for a in order])
    return ordered.wave_numbers()
