"""The response of free space to a force, or a torque, on one cell: one table for all kernels, spacings and viscosities.

Free space is the limit of the periodic grid for an endless box at a fixed spacing: the same kernels and the same band
limit, with h = eta = 1

    G(j) = (2 pi)^-3 int over |k_a| < pi of e^{i k.j} (1 - k k/k^2)/k^2 d3k            (1)

for whole distances j. It is an average of |f^(k)|^2 with a symbol that is nowhere negative, so a mobility made of it is
positive semi-definite. Hasimoto's screening (1959, J. Fluid Mech. 5, 317) takes the singularity off the symbol: with
q = k^2/(4 xi^2), E = erf(xi r)/r and D = (2 xi/sqrt(pi)) e^{-xi^2 r^2},

    G = [(E + D) 1 + (E - D) x x/r^2]/(8 pi) + (2 pi)^-3 int e^{i k.j} (k^2 1 - k k) g,      g = [1 - (1 + q) e^-q]/k^4

and g is entire, so that Gauss-Legendre points find the integral to round-off. xi is such that e^-q is round-off on the
zone's faces, where (1) ends and the first part does not. A torque acts as half a curl (fluids/torque_coupling.py):

    R = 1/2 i k of the symbol 1/k^2:      u = R x T,   1/2 curl u = R x F
    W = 1/4 (k^2 - k k)/k^2:              1/2 curl u = W T

Pairs of nodes (fluids/spaces/free.py) and convolutions (free_fft.py) are both made of these numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from .. import cache

PARTS = {
    1: 6,
    2: 15,
}  # of a response by vectors a node: G xx yy zz xy xz yz; and with them R x y z, W xx yy zz xy xz yz
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
ODD = (  # the axes along which each part is odd
    *((), (), (), (0, 1), (0, 2), (1, 2)),
    *((0,), (1,), (2,)),
    *((), (), (), (0, 1), (0, 2), (1, 2)),
)
REACH = 48  # distances 0 .. REACH - 1 on each axis are in the octant; farther pairs are in far_pairs.py
RIM = 5  # and so many more: a pair of the widest kernels, of 6 points, sums over distances so much larger and smaller
_XI = np.pi / 12.2
_SERIES = (1 / 2, -1 / 3, 1 / 8, -1 / 30, 1 / 144, -1 / 840, 1 / 5760)  # of [1 - (1 + q) e^-q]/q^2
# Of distances alike on all axes these parts are others with their axes exchanged: the part, and the axes in its order.
_XX, _XY = {1: (1, 0, 2), 2: (2, 1, 0)}, {1: (0, 2, 1), 2: (2, 0, 1)}
_EXCHANGED = {
    first + k: (first, axes)
    for first, kind in ((0, _XX), (3, _XY), (6, _XX), (9, _XX), (12, _XY))
    for k, axes in kind.items()
}


def response(parts: int, sizes: tuple[int, ...], extra: int = 34) -> np.ndarray:
    """The parts (parts, nx, ny, nz) at distances 0 .. nx - 1 along x, and so on; h = eta = 1.

    ceil(pi n/4) + ``extra`` Gauss-Legendre points an axis leave 1e-15.
    """
    out, smooth, screened = np.empty((parts, *sizes)), _Smooth(sizes, extra), _Screened(sizes)
    for part in range(parts):
        if len(set(sizes)) == 1 and part in _EXCHANGED:
            source, axes = _EXCHANGED[part]
            out[part] = out[source].transpose(axes)
        else:
            out[part] = smooth.part(part) + screened.part(part)
    return out


@lru_cache(maxsize=2)
def _cube(parts: int) -> np.ndarray:
    """Those of the octant; not to be written to. The same for all scenes, and kept in the user's cache."""
    sizes = (REACH + RIM,) * 3
    key = {"free space": parts, "sizes": sizes, "versions": [np.__version__, code := cache.code(Path(__file__).parent)]}
    out = cache.table(key, lambda: response(parts, sizes)) if code else response(parts, sizes)
    out.flags.writeable = False
    return out


def octant(parts: int, rim: int) -> np.ndarray:
    """The octant of distances below REACH, with a rim on both sides of it: (x, y, z, part); h = eta = 1."""
    j = np.arange(-rim, REACH + rim)
    out = _cube(parts)[:, np.abs(j)[:, None, None], np.abs(j)[:, None], np.abs(j)]
    for part, odd in zip(out, ODD, strict=False):
        for axis in odd:
            part *= _along(np.sign(j), axis)
    return np.moveaxis(out, 0, 3)


def _along(values: np.ndarray, axis: int) -> np.ndarray:
    """Values (n,) as an array of three axes that changes along one of them."""
    return np.expand_dims(values, tuple(a for a in range(3) if a != axis))


class _Smooth:
    """(2 pi)^-3 int e^{i k.j} over the zone, of the symbols with g, of which nothing is singular."""

    def __init__(self, sizes: Sequence[int], extra: int) -> None:
        self._cosines, self._sines, k = [], [], []
        for axis, n in enumerate(sizes):
            node, weight = np.polynomial.legendre.leggauss(int(np.ceil(0.25 * np.pi * n)) + extra)
            angle = np.outer(np.arange(n), 0.5 * np.pi * (node + 1.0))
            self._cosines.append(np.cos(angle) * 0.5 * weight)
            self._sines.append(np.sin(angle) * 0.5 * weight)
            k.append(_along(0.5 * np.pi * (node + 1.0), axis))
        self._k, self._square = k, k[0] ** 2 + k[1] ** 2 + k[2] ** 2
        q = self._square / (4 * _XI**2)
        g = np.where(q < 0.02, np.polynomial.polynomial.polyval(q, _SERIES), (1.0 - (1.0 + q) * np.exp(-q)) / q**2)
        self._g = g / (16 * _XI**4)

    def part(self, part: int) -> np.ndarray:
        """Cosines, on odd axes sines, in place of exponentials: i k_a becomes -k_a, and -k_a k_b becomes k_a k_b."""
        symbol = self._symbol(part)
        for axis in range(3):
            matrix = self._sines[axis] if axis in ODD[part] else self._cosines[axis]
            symbol = np.moveaxis(np.tensordot(matrix, symbol, axes=(1, axis)), 0, axis)
        return symbol

    def _symbol(self, part: int) -> np.ndarray:
        k, square = self._k, self._square
        if 6 <= part < 9:
            return -0.5 * self._g * square * k[part - 6]
        a, b = PAIRS[part % 9]
        tensor = square - k[a] ** 2 if a == b else k[a] * k[b]
        return self._g * tensor if part < 6 else 0.25 * self._g * square * tensor


class _Screened:
    """The rest in closed form; phi = [E + D/2]/(4 pi) is the potential that R and W are derivatives of.

    R_a = 1/2 phi' x_a/r,      W_ab = 1/4 [-(phi'' + phi'/r) d_ab + (phi'' - phi'/r) x_a x_b/r^2]
    4 pi phi'/r = (D - E)/r^2 - xi^2 D,      4 pi phi'' = 2 (E - D)/r^2 - 3 xi^2 D + 2 xi^4 r^2 D
    """

    def __init__(self, sizes: Sequence[int]) -> None:
        from scipy.special import erf

        self._x = x = [_along(np.arange(float(n)), axis) for axis, n in enumerate(sizes)]
        self._square = square = x[0] ** 2 + x[1] ** 2 + x[2] ** 2
        square[0, 0, 0] = 1.0  # and the limits there below
        D = 2 * _XI / np.sqrt(np.pi) * np.exp(-square * _XI**2)
        E = erf(_XI * np.sqrt(square)) / np.sqrt(square)
        D[0, 0, 0] = E[0, 0, 0] = 2 * _XI / np.sqrt(np.pi)
        self._E, self._D = E, D

    def part(self, part: int) -> np.ndarray:
        E, D, square = self._E, self._D, self._square
        if part < 6:
            return self._tensor(part, E + D, E - D) / (8 * np.pi)
        first = (D - E) / square - _XI**2 * D
        second = 2 * (E - D) / square - 3 * _XI**2 * D + 2 * _XI**4 * square * D
        first[0, 0, 0] = second[0, 0, 0] = -5 / 3 * _XI**2 * D[0, 0, 0]
        if part < 9:
            return first * self._x[part - 6] / (8 * np.pi)
        return self._tensor(part - 9, -(second + first), second - first) / (16 * np.pi)

    def _tensor(self, pair: int, same: np.ndarray, along: np.ndarray) -> np.ndarray:
        """same d_ab + along x_a x_b/r^2."""
        a, b = PAIRS[pair]
        tensor = along * self._x[a] * self._x[b] / self._square
        return tensor + same if a == b else tensor
