"""Blocks of m x m numbers, m = 3 or 4, as tuples of rows: they stay in registers where small arrays do not.

The arithmetic is written out for both sizes. The length of a tuple is known when a function is compiled, so what is
for the other size is not compiled at all; ``unit`` is any tuple of m entries and says which size is meant.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def _row(a, i, r, c, unit):
    if len(unit) == 3:
        return a[i, r, c], a[i, r, c + 1], a[i, r, c + 2]
    return a[i, r, c], a[i, r, c + 1], a[i, r, c + 2], a[i, r, c + 3]


@njit(cache=True)
def take(a, i, c, unit):
    """The block of ``a`` (n, m, columns) in row i from column c."""
    if len(unit) == 3:
        return _row(a, i, 0, c, unit), _row(a, i, 1, c, unit), _row(a, i, 2, c, unit)
    return _row(a, i, 0, c, unit), _row(a, i, 1, c, unit), _row(a, i, 2, c, unit), _row(a, i, 3, c, unit)


@njit(cache=True)
def put(a, i, c, block):
    """Writes a block into row i of ``a`` (n, m, columns) from column c."""
    for r in range(len(block)):
        for k in range(len(block)):
            a[i, r, c + k] = block[r][k]


@njit(cache=True, fastmath={"contract"})
def _less_row(s, f, u):
    """s - f u for one row: s and f (m,), u (m, m)."""
    if len(s) == 3:
        return (
            s[0] - f[0] * u[0][0] - f[1] * u[1][0] - f[2] * u[2][0],
            s[1] - f[0] * u[0][1] - f[1] * u[1][1] - f[2] * u[2][1],
            s[2] - f[0] * u[0][2] - f[1] * u[1][2] - f[2] * u[2][2],
        )
    return (
        s[0] - f[0] * u[0][0] - f[1] * u[1][0] - f[2] * u[2][0] - f[3] * u[3][0],
        s[1] - f[0] * u[0][1] - f[1] * u[1][1] - f[2] * u[2][1] - f[3] * u[3][1],
        s[2] - f[0] * u[0][2] - f[1] * u[1][2] - f[2] * u[2][2] - f[3] * u[3][2],
        s[3] - f[0] * u[0][3] - f[1] * u[1][3] - f[2] * u[2][3] - f[3] * u[3][3],
    )


@njit(cache=True)
def less(s, f, u):
    """The block s - f u."""
    if len(s) == 3:
        return _less_row(s[0], f[0], u), _less_row(s[1], f[1], u), _less_row(s[2], f[2], u)
    return _less_row(s[0], f[0], u), _less_row(s[1], f[1], u), _less_row(s[2], f[2], u), _less_row(s[3], f[3], u)


@njit(cache=True, fastmath={"contract"})
def _dot(f, x):
    if len(f) == 3:
        return f[0] * x[0] + f[1] * x[1] + f[2] * x[2]
    return f[0] * x[0] + f[1] * x[1] + f[2] * x[2] + f[3] * x[3]


@njit(cache=True)
def times(f, x):
    """The vector f x of a block and a vector (m,)."""
    if len(x) == 3:
        return _dot(f[0], x), _dot(f[1], x), _dot(f[2], x)
    return _dot(f[0], x), _dot(f[1], x), _dot(f[2], x), _dot(f[3], x)
