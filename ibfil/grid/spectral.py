"""The symbol of the Stokes solve on the modes of a periodic field, as arrays and in place; half a curl, a curl.

The solve, mode by mode:  u = (alpha + eta k^2)^-1 (1 - k k/|k|^2) f.  At the Nyquist wave number of an even axis the
derivative's k is zero (a real field has none there) while k^2 keeps its value: zeroing both costs 4.7 % in the
self-mobility of a 3-point kernel. The mean mode is zero: a uniform back pressure carries any net force.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..linalg.compiled import njit


class StokesSymbol:
    """The symbol as arrays over all modes, from wave numbers of derivatives and true squares along each axis.

    ``total`` is alpha + eta k^2, infinite for the mean mode; ``alpha`` (density over time) is zero in Stokes flow.
    """

    def __init__(
        self, waves: Sequence[np.ndarray], squares: Sequence[np.ndarray], viscosity: float, alpha: float = 0.0
    ) -> None:
        (kx, ky, kz), (sx, sy, sz) = waves, squares
        self.k = (kx[:, None, None], ky[None, :, None], kz[None, None, :])
        self.total = alpha + viscosity * (sx[:, None, None] + sy[None, :, None] + sz[None, None, :])
        self.total[0, 0, 0] = np.inf
        self.square = self.k[0] ** 2 + self.k[1] ** 2 + self.k[2] ** 2

    def solenoidal(self, a: int, b: int) -> np.ndarray:
        """(1 - k k/|k|^2)_ab: what of a force along b drives a flow along a."""
        square = np.where(self.square == 0, np.inf, self.square)
        return float(a == b) - self.k[a] * self.k[b] / square

    def twice_curled(self, a: int, b: int) -> np.ndarray:
        """(|k|^2 - k k)_ab."""
        return float(a == b) * self.square - self.k[a] * self.k[b]


@njit(cache=True, inline="always")
def solenoidal(u, v, w, a, b, c, square):
    """(1 - k k/|k|^2) (u, v, w) of one mode, k = (a, b, c)."""
    p = (a * u + b * v + c * w) / square if square != 0.0 else 0.0
    return u - a * p, v - b * p, w - c * p


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
                u, v, w = solenoidal(u, v, w, a, b, c, square)
                modes[0, i, j, k] = f * u
                modes[1, i, j, k] = f * v
                modes[2, i, j, k] = f * w
    if sx[0] + sy[0] + sz[0] == 0.0:  # the mean mode is among these
        for c in range(3):
            modes[c, 0, 0, 0] = 0.0
            modes[c, 0, 0, 1] = 0.0


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def project_root(modes, kx, ky, kz, sx, sy, sz, viscosity, scale):
    """In place: scale (eta k^2)^-1/2 (1 - k k/|k|^2), with the mean mode zero; arguments as for ``project``."""
    nx, ny, nz = modes.shape[1:]
    for i in range(nx):
        for j in range(ny):
            a, b, s = kx[i], ky[j], sx[i] + sy[j]
            d = a * a + b * b
            for k in range(nz):
                c, total = kz[k], viscosity * (s + sz[k])
                f = scale / np.sqrt(total) if total != 0.0 else 0.0
                u, v, w = solenoidal(modes[0, i, j, k], modes[1, i, j, k], modes[2, i, j, k], a, b, c, d + c * c)
                modes[0, i, j, k], modes[1, i, j, k], modes[2, i, j, k] = f * u, f * v, f * w


@njit(cache=True)
def half_curl(source, kx, ky, kz, target):
    """Adds 1/2 i k x ``source`` to ``target``, both modes (3, nx, ny, nz//2 + 1)."""
    _, nx, ny, nz = source.shape
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                x, y, z = source[0, i, j, k], source[1, i, j, k], source[2, i, j, k]
                target[0, i, j, k] += 0.5j * (ky[j] * z - kz[k] * y)
                target[1, i, j, k] += 0.5j * (kz[k] * x - kx[i] * z)
                target[2, i, j, k] += 0.5j * (kx[i] * y - ky[j] * x)


@njit(cache=True)
def curl(modes, kx, ky, kz):
    """i k x the first three of ``modes`` (6, nx, ny, nz//2 + 1), into the others."""
    nx, ny, nz = modes.shape[1:]
    for i in range(nx):
        for j in range(ny):
            a, b = kx[i], ky[j]
            for k in range(nz):
                c = kz[k]
                u, v, w = modes[0, i, j, k], modes[1, i, j, k], modes[2, i, j, k]
                modes[3, i, j, k] = complex(c * v.imag - b * w.imag, b * w.real - c * v.real)
                modes[4, i, j, k] = complex(a * w.imag - c * u.imag, c * u.real - a * w.real)
                modes[5, i, j, k] = complex(b * u.imag - a * v.imag, a * v.real - b * u.real)
