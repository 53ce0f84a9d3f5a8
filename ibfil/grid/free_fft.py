"""Velocities at nodes in free space by FFTs of the nodes' own box: a convolution with the exact response.

The points that nodes push and feel lie in a box of B cells. A periodic convolution on m = 2 B cells or more an axis,
with the response laid out evenly (a part that is odd: oddly), is the one of free space there, and nothing is truncated
(Hockney 1970, Methods Comput. Phys. 9, 135). Its transform is one of cosines and sines over m/2 + 1 distances an axis:

    G^ = c c c,    G_xy^ = -s s c,    R_x^ = -i s c c,    W as G          u^ = G^ f^ + R^ x T^,   w^ = R^ x f^ + W^ T^
"""

from __future__ import annotations

import numpy as np
from scipy.fft import dct, dst

from ..linalg.compiled import njit
from .free_space import ODD, PARTS, response
from .padded_fft import PaddedTransform
from .spreading import interpolate, spread

ROOM = 4  # extents are rounded up to this, so that plans serve while the nodes move


def padded(extent: int) -> int:
    """The cells of a transform for nodes whose stencils take up so many."""
    from .periodic_grid import smooth

    n = -(-extent // ROOM) * ROOM
    while not smooth(n):
        n += ROOM
    return 2 * n


def symbols(parts: int, cells: tuple[int, int, int]) -> np.ndarray:
    """The transforms (parts, nx/2 + 1, ny/2 + 1, nz/2 + 1) of the response, h = eta = 1; of R without the -i."""
    out = response(parts, tuple(n // 2 + 1 for n in cells))
    for part, odd in zip(out, ODD, strict=False):
        for axis in range(3):
            part[:] = sines(part, axis) if axis in odd else dct(part, type=1, axis=axis)
        if len(odd) == 2:
            part *= -1.0
    return out


def sines(values: np.ndarray, axis: int) -> np.ndarray:
    """The transform of what is odd along an axis of three, without its -i; zero where that begins and ends."""
    out = np.zeros_like(values)
    inner = tuple(slice(1, -1) if a == axis else slice(None) for a in range(3))
    out[inner] = dst(values[inner], type=1, axis=axis)
    return out


class FreeSolve:
    """Velocities at the nodes in free space; plans and symbols belong to the extents of the nodes' box.

    With two ``vectors`` torques go with the forces, and half the vorticity comes with the velocity.
    """

    def __init__(self, spacing: float, viscosity: float, vectors: int = 1, threads: int = 1) -> None:
        self._scales = 1.0 / (viscosity * spacing ** np.arange(1.0, 4.0))  # of G, R and W
        self._vectors, self._threads = vectors, threads
        self.cells: tuple[int, int, int] = (0, 0, 0)

    def _prepare(self, cells: tuple[int, int, int]) -> None:
        parts = PARTS[self._vectors]
        self.transform = PaddedTransform(cells, self._threads, fields=3 * self._vectors)
        scales = np.repeat(self._scales, (6, 3, 6))[:parts] / self.transform.size
        self._symbols = symbols(parts, cells) * scales[:, None, None, None]
        if self._vectors == 1:  # real, and complex modes are seen as pairs of reals
            self._symbols = np.repeat(self._symbols, 2, axis=3)
        self.cells = cells

    def velocity(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocities (n, 3 v) at nodes with stencils (base, weights), of forces (n, 3 v); v = 2: torques too."""
        start = base.min(axis=0)
        extents = base.max(axis=0) - start + weights.shape[2]
        x, y, z = (padded(int(extent)) for extent in extents)
        if self.cells != (x, y, z):
            self._prepare((x, y, z))
        t, local, vectors = self.transform, base - start, range(0, 3 * self._vectors, 3)
        t.real[:] = 0.0
        for v in vectors:
            spread(local, weights, np.ascontiguousarray(force[:, v : v + 3]), t.real[v : v + 3])
        t.through(self._convolved)
        return np.hstack([interpolate(local, weights, t.real[v : v + 3]) for v in vectors])

    def _convolved(self, modes: np.ndarray, first: int) -> None:
        """Modes, from ``first`` on along the second axis, times the symbols, in place."""
        if self._vectors == 1:
            _convolve(modes.view(float), first, self.cells[1], self._symbols)
        else:
            _convolve_torques(modes, first, self.cells[1], self._symbols)


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _convolve(f, first, ny, symbols):
    """u_a = G_ab f_b in place on modes (3, nx, ny, 2 (nz/2 + 1)) seen as pairs of reals; symbols likewise."""
    _, nx, lines, nz = f.shape
    for i in range(nx):
        p, sx = (i, 1.0) if 2 * i <= nx else (nx - i, -1.0)
        for j in range(lines):
            q, sy = (first + j, 1.0) if 2 * (first + j) <= ny else (ny - first - j, -1.0)
            sxy = sx * sy
            for k in range(nz):
                u, v, w = f[0, i, j, k], f[1, i, j, k], f[2, i, j, k]
                xy, xz, yz = sxy * symbols[3, p, q, k], sx * symbols[4, p, q, k], sy * symbols[5, p, q, k]
                f[0, i, j, k] = symbols[0, p, q, k] * u + xy * v + xz * w
                f[1, i, j, k] = xy * u + symbols[1, p, q, k] * v + yz * w
                f[2, i, j, k] = xz * u + yz * v + symbols[2, p, q, k] * w


@njit(cache=True)
def _convolve_torques(f, first, ny, symbols):
    """u = G f + R x T, w = R x f + W T in place on modes (6, nx, ny, nz/2 + 1)."""
    _, nx, lines, nz = f.shape
    for i in range(nx):
        p, sx = (i, 1.0) if 2 * i <= nx else (nx - i, -1.0)
        for j in range(lines):
            q, sy = (first + j, 1.0) if 2 * (first + j) <= ny else (ny - first - j, -1.0)
            for k in range(nz):
                s = symbols[:, p, q, k]
                u, v, w = f[0, i, j, k], f[1, i, j, k], f[2, i, j, k]
                a, b, c = f[3, i, j, k], f[4, i, j, k], f[5, i, j, k]
                x, y, z = -1j * sx * s[6], -1j * sy * s[7], -1j * s[8]
                xy, xz, yz = sx * sy * s[3], sx * s[4], sy * s[5]
                f[0, i, j, k] = s[0] * u + xy * v + xz * w + y * c - z * b
                f[1, i, j, k] = xy * u + s[1] * v + yz * w + z * a - x * c
                f[2, i, j, k] = xz * u + yz * v + s[2] * w + x * b - y * a
                xy, xz, yz = sx * sy * s[12], sx * s[13], sy * s[14]
                f[3, i, j, k] = s[9] * a + xy * b + xz * c + y * w - z * v
                f[4, i, j, k] = xy * a + s[10] * b + yz * c + z * u - x * w
                f[5, i, j, k] = xz * a + yz * b + s[11] * c + x * v - y * u
