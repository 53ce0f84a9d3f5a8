"""Advection in a periodic box: rho div(u u), projected, its aliases removed (2/3 rule).

Modes with 3 |m| >= n on any axis take no part: then products of the others fall on none of them wrongly, and the form
of the nonlinear term does not matter. The one here needs least transforms (Basdevant 1983, J. Comput. Phys. 50, 209):
w^2 is taken off the diagonal of the symmetric u u, which is a pressure, so that five products go forth for three
velocities that came back, where omega x u needs three for six.

Past fields and these are kept as plain reals, pairs of them a mode: loops over them are what compilers vectorise.
"""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from .grid import Grid


class Band(NamedTuple):
    """The modes that take part: up to ``most`` (3,) on each axis, either sign; the last axis is halved."""

    most: tuple[int, int, int]

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Of an array that holds them, pairs of reals."""
        mx, my, mz = self.most
        return 3, 2 * mx + 1, 2 * my + 1, 2 * (mz + 1)


def band(grid: Grid) -> Band:
    """The modes 3 |m| < n of a grid."""
    mx, my, mz = ((int(n) - 1) // 3 for n in grid.cells)
    return Band((mx, my, mz))


@njit(cache=True, inline="always")
def place(i, n, most):
    """Where mode i of n has its place in a band; negative where it has none."""
    if i <= most:
        return i
    return i - (n - 2 * most - 1) if i >= n - most else -1


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def products(u, fastest):
    """u (5, ..): from u, v, w in the first three to uu - ww, vv - ww, uv, uw, vw in all five, in place.

    Returns the largest of |u|, |v|, |w| and ``fastest``.
    """
    nx, ny, nz = u.shape[1:]
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                a, b, c = u[0, i, j, k], u[1, i, j, k], u[2, i, j, k]
                fastest = max(fastest, max(abs(a), max(abs(b), abs(c))))
                u[0, i, j, k] = a * a - c * c
                u[1, i, j, k] = b * b - c * c
                u[2, i, j, k] = a * b
                u[3, i, j, k] = a * c
                u[4, i, j, k] = b * c
    return fastest


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def products_in(u, flow, fastest):
    """The same of u + U without those of the background flow U (3, ..) alone."""
    nx, ny, nz = u.shape[1:]
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                p, q, r = flow[0, i, j, k], flow[1, i, j, k], flow[2, i, j, k]
                a, b, c = u[0, i, j, k] + p, u[1, i, j, k] + q, u[2, i, j, k] + r
                fastest = max(fastest, max(abs(a), max(abs(b), abs(c))))
                u[0, i, j, k] = a * a - p * p - (c * c - r * r)
                u[1, i, j, k] = b * b - q * q - (c * c - r * r)
                u[2, i, j, k] = a * b - p * q
                u[3, i, j, k] = a * c - p * r
                u[4, i, j, k] = b * c - q * r
    return fastest


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def divergence(modes, kx, ky, kz, most, scale, out):
    """scale P div of the products' modes (5, nx, ny, nz//2 + 1) into ``out``, a band; kz one a mode."""
    nx, ny = modes.shape[1:3]
    for i in range(nx):
        p = place(i, nx, most[0])
        if p < 0:
            continue
        for j in range(ny):
            q = place(j, ny, most[1])
            if q < 0:
                continue
            a, b = kx[i], ky[j]
            for k in range(most[2] + 1):
                c = kz[k]
                square = a * a + b * b + c * c
                xx, yy, xy = modes[0, i, j, k], modes[1, i, j, k], modes[2, i, j, k]
                xz, yz = modes[3, i, j, k], modes[4, i, j, k]
                u, v, w = a * xx + b * xy + c * xz, a * xy + b * yy + c * yz, a * xz + b * yz
                f = (a * u + b * v + c * w) / square if square != 0.0 else 0.0 * u
                u, v, w = scale * (u - a * f), scale * (v - b * f), scale * (w - c * f)
                out[0, p, q, 2 * k], out[0, p, q, 2 * k + 1] = -u.imag, u.real
                out[1, p, q, 2 * k], out[1, p, q, 2 * k + 1] = -v.imag, v.real
                out[2, p, q, 2 * k], out[2, p, q, 2 * k + 1] = -w.imag, w.real


@njit(cache=True)
def cut(modes, most):
    """Zeros modes (c, nx, ny, nz//2 + 1) outside a band."""
    nx, ny, nz = modes.shape[1:]
    for c in range(modes.shape[0]):
        for i in range(nx):
            for j in range(ny):
                inside = place(i, nx, most[0]) >= 0 and place(j, ny, most[1]) >= 0
                for k in range(most[2] + 1 if inside else 0, nz):
                    modes[c, i, j, k] = 0.0
