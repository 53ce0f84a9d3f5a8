"""Three-vectors as tuples of numbers, for compiled loops over nodes: they stay in registers where slices do not.

A function that takes arrays is put in line before types are known (``inline="always"``): a call would cost an atomic
count of references for every array.
"""

from __future__ import annotations

from .compiled import njit

# An index that may be negative is wrapped at every use, and a loop over it is not vectorised. Masked with this, one
# that is not negative anyway is known to be so by the compiler too.
NOT_NEGATIVE = 0x7FFFFFFF


@njit(cache=True, inline="always")
def at(a, i, c):
    """The vector in row i of ``a`` (n, columns) from column c."""
    return a[i, c], a[i, c + 1], a[i, c + 2]


@njit(cache=True, inline="always")
def put(a, i, c, v):
    """Writes a vector into row i of ``a`` (n, columns) from column c."""
    a[i, c], a[i, c + 1], a[i, c + 2] = v[0], v[1], v[2]


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
