"""Velocities at nodes above a no-slip plane by FFTs of the nodes' own box, which reaches down to the plane.

A sum over heights z + z' is a convolution with what is turned upside down, and so a product with the mode of -k_z:
with the response of free space G and the tables T of images (wall_tables.py), transformed along all axes, f' = z' f,
and f~ the modes of f at -k_z,

    P = G f + (T0xx f~x + T0xy f~y + T1x f~'z,  T0xy f~x + T0yy f~y + T1y f~'z,  T0zz f~z + T1x f~'x + T1y f~'y)
    Q = (T2xx f~'x + T2xy f~'y - tx f~'z - T1x f~z,  ...,  T2zz f~'z + tx f~'x + ty f~'y - T1x f~x - T1y f~y)
    u = P + z Q

Heights stand in the weights of the nodes, so f' and z Q need no field of their own kind. Axes of fields are (z, y, x).
"""

from __future__ import annotations

import numpy as np
from scipy.fft import dct, fft

from ..linalg.compiled import njit
from .free_fft import FreeSolve, padded, sines, symbols
from .padded_fft import PaddedTransform
from .spreading import Stencil, interpolate, mirrored, spread
from .wall_tables import ODD, images


def image_symbols(cells: tuple[int, int, int]) -> np.ndarray:
    """The transforms (11, mz, my/2 + 1, mx/2 + 1) of images, h = eta = 1; of odd parts without the -i of an axis."""
    mz, my, mx = cells
    x, y, z = np.arange(mx // 2 + 1.0), np.arange(my // 2 + 1.0), np.arange(float(mz))
    out = np.empty((len(ODD), mz, my // 2 + 1, mx // 2 + 1), complex)
    table = images(x, y[:, None], z[:, None, None])
    for part, odd in enumerate(ODD):
        real = table[part]
        for axis, name in ((2, 0), (1, 1)):  # x is the last axis here, and the first of the parts' names
            real = sines(real, axis) if name in odd else dct(real, type=1, axis=axis)
        out[part] = fft(-real if len(odd) == 2 else real, axis=0)
    return out


class WallSolve:
    """Velocities at the nodes above the plane; plans and symbols belong to the extents of the nodes' box."""

    def __init__(self, spacing: float, viscosity: float, threads: int = 1) -> None:
        self._scale, self._threads = 1.0 / (viscosity * spacing), threads
        self.cells: tuple[int, int, int] = (0, 0, 0)

    def _prepare(self, cells: tuple[int, int, int]) -> None:
        self.transform = PaddedTransform(cells, self._threads, fields=6)
        scale = self._scale / self.transform.size
        mz, my, mx = cells
        free = np.moveaxis(symbols(6, (mx, my, mz)), 3, 1)  # (part, z, x, y)
        # Parts are last: they are read together.
        self._free = np.ascontiguousarray(np.moveaxis(np.swapaxes(free, 2, 3) * scale, 0, 3))
        self._images = np.ascontiguousarray(np.moveaxis(image_symbols(cells) * scale, 0, 3))
        self.cells = cells

    def velocity(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocities (n, 3) at nodes with folded stencils (base, weights), of their forces (n, 3)."""
        points = weights.shape[2]
        start = base.min(axis=0) * [1, 1, 0]
        x, y, z = (padded(int(extent)) for extent in base.max(axis=0) - start + points)
        if self.cells != (z, y, x):
            self._prepare((z, y, x))
        t, local = self.transform, np.ascontiguousarray((base - start)[:, ::-1])
        plain = np.ascontiguousarray(weights[:, ::-1])
        raised = plain.copy()
        raised[:, 0] *= base[:, 2:] + np.arange(points)
        t.real[:] = 0.0
        spread(local, plain, force, t.real[:3])
        spread(local, raised, force, t.real[3:])
        t.through(self._convolved)
        return interpolate(local, plain, t.real[:3]) + interpolate(local, raised, t.real[3:])

    def _convolved(self, modes: np.ndarray, first: int) -> None:
        """Modes of f and f', from ``first`` on along the second axis, into those of P and Q, in place."""
        _convolve(modes, first, self.cells[1], self._free, self._images)


@njit(cache=True, inline="always", fastmath={"contract", "reassoc", "nsz"})
def _reflect(t, sx, sy, f, g):
    """P and Q less G f, of the modes f, g of forces at -k_z; t (11,) are symbols, sx and sy the signs of k_x, k_y."""
    x, y, z = f
    u, v, w = g
    xy, zxy = sx * sy * t[3], sx * sy * t[8]
    a, b, c, d = -1j * sx * t[4], -1j * sy * t[5], -1j * sx * t[9], -1j * sy * t[10]
    p = (t[0] * x + xy * y + a * w, xy * x + t[1] * y + b * w, t[2] * z + a * u + b * v)
    q = (
        t[6] * u + zxy * v - c * w - a * z,
        zxy * u + t[7] * v - d * w - b * z,
        (t[6] + t[7]) * w + c * u + d * v - a * x - b * y,
    )
    return p, q


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _convolve(f, first, ny, free, images):
    nz, lines, nx = f.shape[1:]
    for i in range(nz // 2 + 1):
        other = (nz - i) % nz
        for j in range(lines):
            row, sy = (first + j, 1.0) if 2 * (first + j) <= ny else (ny - first - j, -1.0)
            for k in range(nx):
                here = (f[0, i, j, k], f[1, i, j, k], f[2, i, j, k]), (f[3, i, j, k], f[4, i, j, k], f[5, i, j, k])
                there = (
                    (f[0, other, j, k], f[1, other, j, k], f[2, other, j, k]),
                    (f[3, other, j, k], f[4, other, j, k], f[5, other, j, k]),
                )
                t, g = images[i, row, k], free[i, row, k]
                for up in (True, False):
                    at, sz = (i, 1.0) if up else (other, -1.0)
                    source, own = (there[0], here[0]) if up else (here[0], there[0])
                    lifted = there[1] if up else here[1]
                    p, q = _reflect(t if up else np.conj(t), 1.0, sy, source, lifted)
                    xy, xz, yz = sy * g[3], sz * g[4], sy * sz * g[5]
                    f[0, at, j, k] = g[0] * own[0] + xy * own[1] + xz * own[2] + p[0]
                    f[1, at, j, k] = xy * own[0] + g[1] * own[1] + yz * own[2] + p[1]
                    f[2, at, j, k] = xz * own[0] + yz * own[1] + g[2] * own[2] + p[2]
                    f[3, at, j, k], f[4, at, j, k], f[5, at, j, k] = q


class MirrorSolve:
    """Velocities at the nodes above a plane without friction: in free space, each node with its image."""

    def __init__(self, free: FreeSolve) -> None:
        self._free = free

    def velocity(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocities (n, 3) at nodes with stencils (base, weights), of their forces (n, 3)."""
        image = mirrored(Stencil(base, weights))
        pushes = np.concatenate([force, force * [1.0, 1.0, -1.0]])
        both = np.concatenate([base, image.base]), np.concatenate([weights, image.weights])
        return self._free.velocity(*both, pushes)[: len(base)]
