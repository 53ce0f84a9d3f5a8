"""The past of a fluid with inertia: velocity and advection at the last two steps that were taken, mode by mode.

    u = (alpha + eta k^2)^-1 [ alpha (b_n u_n + b_{n-1} u_{n-1}) + c_n N_n + c_{n-1} N_{n-1} + P f ],   alpha = rho/tau

    Euler   b = 1, 0                                     c = -(1 + w/2), w/2
    BDF2    b = (1 + w)^2/(1 + 2 w), -w^2/(1 + 2 w)      c = -(1 + w), w,            w = dt/dt_old

the same discretisation of time as the rods' (timestepping/base.py). N is rho (omega x u), kept as transformed: it is
projected and filtered (advection.py) where it is used. The mean mode is zero: a uniform back pressure carries any net
force, so the fluid keeps the momentum it began with, none.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..grid.fft import modes_of
from ..grid.fftw import pyfftw
from ..grid.periodic_grid import Grid
from ..grid.slab_fft import Block
from ..grid.spectral import solenoidal
from ..linalg.compiled import njit
from .advection import filters


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


def _fields(count: int, shape: tuple[int, ...], dtype: np.dtype) -> list[np.ndarray]:
    """Zeros, aligned for FFTW, each field nine cache lines further into its page.

    All in the same place would share few lines of the first cache where the grid's extents are powers of two, and a
    loop over all of them would take a third longer.
    """
    size, shift = math.prod(shape), 9 * 64 // dtype.itemsize
    rooms = [pyfftw.zeros_aligned(size + count * shift, dtype) for _ in range(count)]
    return [workspace[k * shift : k * shift + size].reshape(shape) for k, workspace in enumerate(rooms)]


class History:
    """Velocities and advection (3, nx, ny, nz//2 + 1) at the last two steps.

    Kept in the type ``number``, double or single precision, and computed in double. Loops go over pairs of reals, which
    compilers vectorise, as all multipliers are real. ``rows`` are those modes along the second axis that are kept here,
    all of them but where processes share a grid (parallel/).
    """

    def __init__(
        self, grid: Grid, density: float, viscosity: float, number: type = np.float64, rows: slice = slice(None)
    ) -> None:
        nx, ny, nz = (int(n) for n in grid.cells)
        (kx, ky, kz), (sx, sy, sz) = grid.wave_numbers()
        fx, fy, fz = filters(grid)
        ky, sy, fy = ky[rows], sy[rows], fy[rows]
        fields = _fields(5, (3, nx, len(ky), nz // 2 + 1), modes_of(number))
        self.now, self.old, self.n_now, self.n_old = fields[:4]
        self._ahead = fields[4]  # what the step asked about last would come to without forces
        self._waves = (kx, ky, np.repeat(kz, 2), viscosity * sx, viscosity * sy, viscosity * np.repeat(sz, 2))
        self._filters = (fx, fy, np.repeat(fz, 2))
        self._scale, self._force_scale = density / (nx * ny * nz), 1.0 / (nx * ny * nz * grid.spacing**3)
        self._real, self.dt_old = np.dtype(number), 0.0

    def predict(self, w: Weights, block: Block) -> None:
        """Into the first three fields of the block: the velocity at the end of a step without forces."""
        fields = (self._ahead, self.now, self.old, self.n_now, self.n_old)
        c, c_old = w.n_now * self._scale, w.n_old * self._scale
        reals = [field.view(self._real) for field in (block.modes, *fields)]
        _predict(*reals, block.i, block.j, *self._waves, *self._filters, w.alpha, w.now, w.old, c, c_old)

    def apply_forces(self, w: Weights, block: Block, flow: np.ndarray) -> None:
        """Adds what the forces, whose modes are in the block, do in the step asked about last.

        Leaves the velocity, filtered, and its vorticity in ``flow`` (6, nx, ny, nz//2 + 1).
        """
        reals = [field.view(self._real) for field in (block.modes, self._ahead, flow)]
        _apply_forces(*reals, block.i, block.j, *self._waves, *self._filters, w.alpha, self._force_scale)

    def commit(self, w: Weights) -> np.ndarray:
        """The step asked about last, all of it pushed, is the newest. Returns room for the modes of its omega x u."""
        self.now, self.old, self._ahead = self._ahead, self.now, self.old
        self.n_now, self.n_old = self.n_old, self.n_now
        self.dt_old = w.dt
        return self.n_now

    def memory(self) -> dict[str, np.ndarray | float]:
        """All of it; nothing before the first step."""
        if self.dt_old == 0.0:
            return {}
        kept = {name: getattr(self, name).view(self._real) for name in ("now", "old", "n_now", "n_old")}
        return {**kept, "dt_old": self.dt_old}

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""
        for name in ("now", "old", "n_now", "n_old"):
            getattr(self, name).view(self._real)[:] = memory[name]
        self.dt_old = float(memory["dt_old"])


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def _predict(out, ahead, now, old, n_now, n_old, i0, j0, kx, ky, kz, sx, sy, sz, fx, fy, fz, alpha, b, b_old, c, c_old):
    """Pairs of reals a mode; kz, sz and fz twice each. s has the viscosity in it."""
    for i in range(i0, i0 + out.shape[1]):
        for j in range(j0, j0 + out.shape[2]):
            s, d, e = alpha + sx[i] + sy[j], kx[i] * kx[i] + ky[j] * ky[j], fx[i] * fy[j]
            p, q = kx[i], ky[j]
            for k in range(out.shape[3]):
                u = c * n_now[0, i, j, k] + c_old * n_old[0, i, j, k]
                v = c * n_now[1, i, j, k] + c_old * n_old[1, i, j, k]
                w = c * n_now[2, i, j, k] + c_old * n_old[2, i, j, k]
                u, v, w = solenoidal(u, v, w, p, q, kz[k], d + kz[k] * kz[k])
                f, r = e * fz[k], 1.0 / (s + sz[k])
                u = r * (b * now[0, i, j, k] + b_old * old[0, i, j, k] + f * u)
                v = r * (b * now[1, i, j, k] + b_old * old[1, i, j, k] + f * v)
                w = r * (b * now[2, i, j, k] + b_old * old[2, i, j, k] + f * w)
                ahead[0, i, j, k] = out[0, i - i0, j - j0, k] = u
                ahead[1, i, j, k] = out[1, i - i0, j - j0, k] = v
                ahead[2, i, j, k] = out[2, i - i0, j - j0, k] = w
    if i0 == 0 and j0 == 0 and sx[0] + sy[0] + sz[0] == 0.0:  # the mean mode is among these
        for x in range(3):
            for k in range(2):
                ahead[x, 0, 0, k] = out[x, 0, 0, k] = 0.0


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def _apply_forces(force, ahead, flow, i0, j0, kx, ky, kz, sx, sy, sz, fx, fy, fz, alpha, scale):
    """Adds P force / (alpha + s) to ``ahead``; into ``flow`` that, filtered, and i k x of it."""
    for i in range(i0, i0 + force.shape[1]):
        for j in range(j0, j0 + force.shape[2]):
            s, d, e = alpha + sx[i] + sy[j], kx[i] * kx[i] + ky[j] * ky[j], fx[i] * fy[j]
            p, q = kx[i], ky[j]
            for k in range(force.shape[3]):
                u, v, w = force[0, i - i0, j - j0, k], force[1, i - i0, j - j0, k], force[2, i - i0, j - j0, k]
                u, v, w = solenoidal(u, v, w, p, q, kz[k], d + kz[k] * kz[k])
                r = scale / (s + sz[k])
                ahead[0, i, j, k] += r * u
                ahead[1, i, j, k] += r * v
                ahead[2, i, j, k] += r * w
            for x in range(3):
                for k in range(force.shape[3]):
                    flow[x, i, j, k] = e * fz[k] * ahead[x, i, j, k]
            for k in range(0, force.shape[3], 2):
                a, b, r = flow[0, i, j, k], flow[0, i, j, k + 1], kz[k]
                u, v = flow[1, i, j, k], flow[1, i, j, k + 1]
                w, g = flow[2, i, j, k], flow[2, i, j, k + 1]
                flow[3, i, j, k], flow[3, i, j, k + 1] = r * v - q * g, q * w - r * u
                flow[4, i, j, k], flow[4, i, j, k + 1] = p * g - r * b, r * a - p * w
                flow[5, i, j, k], flow[5, i, j, k + 1] = q * b - p * v, p * u - q * a
    if i0 == 0 and j0 == 0 and sx[0] + sy[0] + sz[0] == 0.0:  # the mean mode is among these
        for x in range(3):
            for k in range(2):
                ahead[x, 0, 0, k] = flow[x, 0, 0, k] = 0.0
