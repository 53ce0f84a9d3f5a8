"""The past of a fluid with inertia: velocity and advection at the last two steps that were taken, mode by mode.

    u = (alpha + eta k^2)^-1 [ alpha (b_n u_n + b_{n-1} u_{n-1}) + c_n N_n + c_{n-1} N_{n-1} + P f ],   alpha = rho/tau

    Euler   b = 1, 0                                     c = -(1 + w/2), w/2
    BDF2    b = (1 + w)^2/(1 + 2 w), -w^2/(1 + 2 w)      c = -(1 + w), w,            w = dt/dt_old

the same discretisation of time as the rods' (stepping.py). N is rho div(u u), projected (advection.py). The mean mode
is zero: a uniform back pressure carries any net force, so the fluid keeps the momentum it began with, none.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from .advection import filters, projected
from .grid import Grid


class Weights(NamedTuple):
    """alpha, and what multiplies u_n, u_{n-1}, N_n, N_{n-1} in a step; ``dt`` is its length."""

    alpha: float
    now: float
    old: float
    n_now: float
    n_old: float
    dt: float


def weights(alpha: float, tau: float, w: float, dt_old: float) -> Weights:
    """Those of a step: BDF2 with w = dt/dt_old, or Euler (w = 0), whose advection knows dt_old by itself (0: none)."""
    if w == 0.0:
        half = 0.5 * tau / dt_old if dt_old > 0 else 0.0
        return Weights(alpha, alpha, 0.0, -1.0 - half, half, tau)
    part = alpha / (1 + 2 * w)
    return Weights(alpha, part * (1 + w) ** 2, -part * w * w, -1.0 - w, w, tau * (1 + 2 * w) / (1 + w))


class Past:
    """Velocities and advection (3, nx, ny, 2 (nz//2 + 1)) at the last two steps, pairs of reals a mode.

    Real multipliers are then loops over plain reals, which compilers vectorise.
    """

    def __init__(self, grid: Grid) -> None:
        nx, ny, nz = (int(n) for n in grid.cells)
        self.now, self.old, self.n_now, self.n_old = (np.zeros((3, nx, ny, 2 * (nz // 2 + 1))) for _ in range(4))
        self._ahead = np.zeros_like(self.now)  # what the last step asked about would come to without forces
        fx, fy, fz = filters(grid)
        self._f = (fx, fy, np.repeat(fz, 2))
        self.dt_old = 0.0
        (kx, ky, kz), (sx, sy, sz) = grid.wave_numbers()
        self._k, self._s = (kx, ky, np.repeat(kz, 2)), (sx, sy, np.repeat(sz, 2))

    def coast(self, w: Weights, viscosity: float, out: np.ndarray) -> None:
        """Into ``out`` the velocity's modes, as pairs of reals, at the end of a step without forces."""
        past = (self._ahead, self.now, self.old, self.n_now, self.n_old)
        _coast(out, *past, *self._s, w.alpha, viscosity, w.now, w.old, w.n_now, w.n_old)

    def push(self, w: Weights, viscosity: float, modes: np.ndarray, scale: float) -> None:
        """Takes the step last asked about: the force density's modes times 1/scale, as pairs of reals, act over it.

        Leaves u there, filtered.
        """
        _push(modes, self._ahead, self.old, *self._k, *self._s, *self._f, w.alpha, viscosity, scale)
        self.now, self.old = self.old, self.now
        self.n_now, self.n_old = self.n_old, self.n_now  # the newest advection is yet to be written into n_now
        self.dt_old = w.dt

    def advect(self, modes: np.ndarray, scale: float) -> None:
        """Takes up the advection of the newest velocity: scale times the modes, as pairs of reals."""
        projected(modes, *self._k, *self._f, scale, self.n_now)

    def memory(self) -> dict[str, np.ndarray | float]:
        """All of it; nothing before the first step."""
        if self.dt_old == 0.0:
            return {}
        return {"now": self.now, "old": self.old, "n_now": self.n_now, "n_old": self.n_old, "dt_old": self.dt_old}

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""
        for name in ("now", "old", "n_now", "n_old"):
            getattr(self, name)[:] = memory[name]
        self.dt_old = float(memory["dt_old"])


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def _coast(out, ahead, now, old, n_now, n_old, sx, sy, sz, alpha, viscosity, b, b_old, c, c_old):
    nx, ny, nz = now.shape[1:]
    for x in range(3):
        for i in range(nx):
            for j in range(ny):
                s = alpha + viscosity * (sx[i] + sy[j])
                for k in range(nz):
                    f = b * now[x, i, j, k] + b_old * old[x, i, j, k]
                    f += c * n_now[x, i, j, k] + c_old * n_old[x, i, j, k]
                    u = f / (s + viscosity * sz[k])
                    ahead[x, i, j, k] = out[x, i, j, k] = u


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def _push(modes, ahead, new, kx, ky, kz, sx, sy, sz, fx, fy, fz, alpha, viscosity, scale):
    """``new`` is ``ahead`` and what the forces add; ``modes``, the forces', become the same, filtered."""
    nx, ny, nz = new.shape[1:]
    for i in range(nx):
        for j in range(ny):
            s, d, e = alpha + viscosity * (sx[i] + sy[j]), kx[i] * kx[i] + ky[j] * ky[j], fx[i] * fy[j]
            for k in range(nz):
                u, v, w = modes[0, i, j, k], modes[1, i, j, k], modes[2, i, j, k]
                square = d + kz[k] * kz[k]
                p = (kx[i] * u + ky[j] * v + kz[k] * w) / square if square != 0.0 else 0.0
                g, f = scale / (s + viscosity * sz[k]), e * fz[k]
                u = ahead[0, i, j, k] + g * (u - kx[i] * p)
                v = ahead[1, i, j, k] + g * (v - ky[j] * p)
                w = ahead[2, i, j, k] + g * (w - kz[k] * p)
                new[0, i, j, k], modes[0, i, j, k] = u, f * u
                new[1, i, j, k], modes[1, i, j, k] = v, f * v
                new[2, i, j, k], modes[2, i, j, k] = w, f * w
    for x in range(3):
        for k in range(2):
            new[x, 0, 0, k] = modes[x, 0, 0, k] = 0.0
