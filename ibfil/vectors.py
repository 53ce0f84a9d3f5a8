"""Three-vectors as tuples of numbers, for compiled loops over nodes: they stay in registers where slices do not."""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def at(a, i):
    """The vector ``a[i]`` of an array (n, 3)."""
    return a[i, 0], a[i, 1], a[i, 2]


@njit(cache=True)
def put(a, i, v):
    """Writes the vector into ``a[i]``."""
    a[i, 0], a[i, 1], a[i, 2] = v[0], v[1], v[2]


@njit(cache=True, fastmath={"contract"})
def dot(a, b):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, fastmath={"contract"})
def cross(a, b):
    """The vector a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, fastmath={"contract"})
def scaled(f, a):
    """The vector f a."""
    return f * a[0], f * a[1], f * a[2]


@njit(cache=True, fastmath={"contract"})
def plus(a, f, b):
    """The vector a + f b."""
    return a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]


@njit(cache=True, fastmath={"contract"})
def mix(f, a, g, b):
    """The vector f a + g b."""
    return f * a[0] + g * b[0], f * a[1] + g * b[1], f * a[2] + g * b[2]
