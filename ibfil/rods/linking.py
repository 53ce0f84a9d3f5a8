"""Linking number, writhe and twist of closed rods: Lk = Wr + Tw.

Both are Gauss integrals, which for polygons are sums over pairs of segments, exact (Klenin & Langowski, Biopolymers 54,
307, 2000): with the solid angle Omega_ij under which the segments of a pair see each other, its sign that of their
crossing,

    Lk(a, b) = sum_ij Omega_ij/(4 pi),      Wr(a) = sum_{i != j} Omega_ij/(4 pi)

The linking number is that of the polygon of the nodes and of the one beside it along e1. It is a whole number, to
the square root of round-off as the arcsines are. Tw = Lk - Wr; the sum of O3 ds is that to order ds^2 only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..linalg.compiled import njit

BESIDE = 1e-2  # of the shortest segment: how far beside the rod the second polygon is


class Linking(NamedTuple):
    """The numbers of a closed rod."""

    linking: int
    writhe: float

    @property
    def twist(self) -> float:
        """Turns of e1 about the tangent."""
        return self.linking - self.writhe


@njit(cache=True, inline="always")
def _normal(a, b):
    """a x b of length one; zero where they are along each other."""
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    size = np.sqrt(x * x + y * y + z * z)
    if size == 0.0:
        return 0.0, 0.0, 0.0
    return x / size, y / size, z / size


@njit(cache=True, inline="always")
def _less(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(cache=True, inline="always")
def _angle(a, b):
    return np.arcsin(min(1.0, max(-1.0, a[0] * b[0] + a[1] * b[1] + a[2] * b[2])))


@njit(cache=True)
def _solid_angle(a, b, c, d):
    """Omega of the segment from a to b and that from c to d, points (3,)."""
    ac, ad, bc, bd = _less(c, a), _less(d, a), _less(c, b), _less(d, b)
    one, two, three, four = _normal(ac, ad), _normal(ad, bd), _normal(bd, bc), _normal(bc, ac)
    size = _angle(one, two) + _angle(two, three) + _angle(three, four) + _angle(four, one)
    along, other = _less(b, a), _less(d, c)
    x, y, z = (
        other[1] * along[2] - other[2] * along[1],
        other[2] * along[0] - other[0] * along[2],
        other[0] * along[1] - other[1] * along[0],
    )
    side = x * ac[0] + y * ac[1] + z * ac[2]
    return size if side > 0.0 else -size if side < 0.0 else 0.0


@njit(cache=True)
def _linked(a, b):
    total = 0.0
    for i in range(len(a) - 1):
        for j in range(len(b) - 1):
            total += _solid_angle(a[i], a[i + 1], b[j], b[j + 1])
    return total / (4.0 * np.pi)


@njit(cache=True)
def _writhing(a):
    total = 0.0
    last = len(a) - 2
    for i in range(2, last + 1):
        for j in range(1 if i == last else 0, i - 1):  # the last segment and the first are neighbours
            total += _solid_angle(a[i], a[i + 1], a[j], a[j + 1])
    return total / (2.0 * np.pi)


def linked(a: np.ndarray, b: np.ndarray) -> float:
    """The linking number of two closed polygons (k + 1, 3), (l + 1, 3), whose last points are their first."""
    return float(_linked(np.ascontiguousarray(a), np.ascontiguousarray(b)))


def writhe(r: np.ndarray) -> float:
    """The writhe of a closed polygon (k + 1, 3)."""
    return float(_writhing(np.ascontiguousarray(r)))


def linking(r: np.ndarray, e1: np.ndarray) -> Linking:
    """The numbers of a closed rod with nodes r and directors e1, (N + 1, 3) both, the last node the first."""
    beside = BESIDE * float(np.min(np.linalg.norm(np.diff(r, axis=0), axis=1)))
    return Linking(round(linked(r, r + beside * e1)), writhe(r))
