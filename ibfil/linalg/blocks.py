"""Blocks of m x m numbers, m = 3 or 4, as tuples of rows: they stay in registers where small arrays do not.

The arithmetic is written out for both sizes. The length of a tuple is known when a function is compiled, so what is
for the other size is not compiled at all; ``unit`` is any tuple of m entries and says which size is meant.
"""

from __future__ import annotations

from .compiled import njit

_SMALLEST = 1e-12  # a pivot, relative to what it is among


@njit(cache=True)
def _row(a, i, j, r, unit):
    if len(unit) == 3:
        return a[i, j, r, 0], a[i, j, r, 1], a[i, j, r, 2]
    return a[i, j, r, 0], a[i, j, r, 1], a[i, j, r, 2], a[i, j, r, 3]


@njit(cache=True)
def take(a, i, j, unit):
    """The block ``a[i, j]`` (m, m)."""
    if len(unit) == 3:
        return _row(a, i, j, 0, unit), _row(a, i, j, 1, unit), _row(a, i, j, 2, unit)
    return _row(a, i, j, 0, unit), _row(a, i, j, 1, unit), _row(a, i, j, 2, unit), _row(a, i, j, 3, unit)


@njit(cache=True)
def put(a, i, j, block):
    """Writes a block into ``a[i, j]``."""
    for r in range(len(block)):
        for c in range(len(block)):
            a[i, j, r, c] = block[r][c]


@njit(cache=True)
def part(x, i, unit):
    """The vector x[i] of x (n, m)."""
    if len(unit) == 3:
        return x[i, 0], x[i, 1], x[i, 2]
    return x[i, 0], x[i, 1], x[i, 2], x[i, 3]


@njit(cache=True)
def put_part(x, i, v):
    """Writes a vector into x[i]."""
    for k in range(len(v)):
        x[i, k] = v[k]


@njit(cache=True, fastmath={"contract"})
def _dot(f, x):
    if len(f) == 3:
        return f[0] * x[0] + f[1] * x[1] + f[2] * x[2]
    return f[0] * x[0] + f[1] * x[1] + f[2] * x[2] + f[3] * x[3]


@njit(cache=True)
def times(f, x):
    """The vector f x of a block and a vector."""
    if len(x) == 3:
        return _dot(f[0], x), _dot(f[1], x), _dot(f[2], x)
    return _dot(f[0], x), _dot(f[1], x), _dot(f[2], x), _dot(f[3], x)


@njit(cache=True, fastmath={"contract"})
def less_times(y, f, x):
    """The vector y - f x."""
    v = times(f, x)
    if len(y) == 3:
        return y[0] - v[0], y[1] - v[1], y[2] - v[2]
    return y[0] - v[0], y[1] - v[1], y[2] - v[2], y[3] - v[3]


@njit(cache=True, fastmath={"contract"})
def _row_product(f, u):
    """f u for one row f (m,) and a block."""
    if len(f) == 3:
        return (
            f[0] * u[0][0] + f[1] * u[1][0] + f[2] * u[2][0],
            f[0] * u[0][1] + f[1] * u[1][1] + f[2] * u[2][1],
            f[0] * u[0][2] + f[1] * u[1][2] + f[2] * u[2][2],
        )
    return (
        f[0] * u[0][0] + f[1] * u[1][0] + f[2] * u[2][0] + f[3] * u[3][0],
        f[0] * u[0][1] + f[1] * u[1][1] + f[2] * u[2][1] + f[3] * u[3][1],
        f[0] * u[0][2] + f[1] * u[1][2] + f[2] * u[2][2] + f[3] * u[3][2],
        f[0] * u[0][3] + f[1] * u[1][3] + f[2] * u[2][3] + f[3] * u[3][3],
    )


@njit(cache=True)
def product(f, u):
    """The block f u."""
    if len(f) == 3:
        return _row_product(f[0], u), _row_product(f[1], u), _row_product(f[2], u)
    return _row_product(f[0], u), _row_product(f[1], u), _row_product(f[2], u), _row_product(f[3], u)


@njit(cache=True, fastmath={"contract"})
def _less_row(s, f, u):
    """s - f u for one row: s and f (m,)."""
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


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _inverse2(a, b, c, d):
    """The inverse of ((a, b), (c, d)), row by row, and whether its determinant is more than round-off."""
    f, size = a * d - b * c, max(max(abs(a), abs(b)), max(abs(c), abs(d)))
    return (d / f, -b / f, -c / f, a / f), abs(f) > _SMALLEST * size * size


@njit(cache=True, fastmath={"contract"})
def _product2(a, b):
    return (
        *(a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3]),
        *(a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3]),
    )


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _inverse3(s):
    """By the Schur complement t of the first pivot."""
    (a, b, c), (d, e, f), (g, h, i) = s
    p = 1.0 / a
    b, c, x, y = p * b, p * c, p * d, p * g
    t, good = _inverse2(e - d * b, f - d * c, h - g * b, i - g * c)
    u, v = b * t[0] + c * t[2], b * t[1] + c * t[3]
    q, r = t[0] * x + t[1] * y, t[2] * x + t[3] * y
    size = max(max(abs(d), abs(e)), max(abs(g), abs(i)))
    good = good and abs(a) > _SMALLEST * size
    return ((p + u * x + v * y, -u, -v), (-q, t[0], t[1]), (-r, t[2], t[3])), good


@njit(cache=True, fastmath={"contract"})
def _inverse4(s):
    """By the Schur complement t of the first two pivots."""
    (a, b, c, d), (e, f, g, h), (i, j, k, m), (o, p, q, r) = s
    first, well = _inverse2(a, b, e, f)
    x, y = _product2(first, (c, d, g, h)), _product2((i, j, o, p), first)
    z = _product2(y, (c, d, g, h))
    t, good = _inverse2(k - z[0], m - z[1], q - z[2], r - z[3])
    u, v = _product2(x, t), _product2(t, y)
    w = _product2(u, y)
    top = (first[0] + w[0], first[1] + w[1], -u[0], -u[1]), (first[2] + w[2], first[3] + w[3], -u[2], -u[3])
    return (*top, (-v[0], -v[1], t[0], t[1]), (-v[2], -v[3], t[2], t[3])), good and well


@njit(cache=True)
def inverse(s):
    """The inverse of a block, its rows taken in their order; and whether no pivot on the way was nearly zero."""
    if len(s) == 3:
        return _inverse3(s)
    return _inverse4(s)
