"""A Navier-Stokes fluid alone in its box, as tests of it begin it, step it and look at it."""

from __future__ import annotations

import numpy as np

from ibfil.fluids.advection import filters
from ibfil.fluids.background_flow import Background
from ibfil.fluids.history import History, Weights
from ibfil.fluids.immersed_boundary import Immersed
from ibfil.fluids.navier_stokes import NavierStokes, Workspace
from ibfil.fluids.spaces.periodic import PeriodicSpace
from ibfil.fluids.stokes import StokesByTable
from ibfil.grid.kernels import KERNELS
from ibfil.grid.periodic_grid import Grid
from ibfil.grid.slab_fft import Block
from ibfil.linalg.constraints import Prescribed

NOTHING = Prescribed(np.zeros(0, np.int64), np.zeros(0))
FAR = np.array([[0.3, -0.2, 0.1]])  # a node to ask at
ZERO = np.zeros((1, 3))


def fluid(cells=(16, 16, 16), density=1.0, viscosity=0.1, flow=None, parts=None) -> NavierStokes:
    """In a box of 2 pi along x, of cubic cells, with one node that has no slip."""
    grid = Grid([2 * np.pi * n / cells[0] for n in cells], cells)
    made = Immersed(PeriodicSpace.of(grid), KERNELS["peskin4"], viscosity, np.zeros(1), None, flow)
    background = None if flow is None else Background(grid, flow, parts)
    return NavierStokes(made, density, lambda alpha: StokesByTable(made, alpha), Workspace(grid), background)


def low(it: NavierStokes) -> np.ndarray:
    """The modes whose products fall on none of the others, (nx, ny, nz//2 + 1)."""
    nx, ny, nz = it.grid.cells
    axes = [np.fft.fftfreq(nx, 1 / nx), np.fft.fftfreq(ny, 1 / ny), np.fft.rfftfreq(nz, 1 / nz)]
    x, y, z = (4 * np.abs(m) < n for m, n in zip(axes, (nx, ny, nz), strict=True))
    return x[:, None, None] & y[None, :, None] & z


def begin(it: NavierStokes, *fields: np.ndarray) -> None:
    """Gives it the velocities (3, nx, ny, nz) of its last steps, the oldest first, and their advection."""
    for u in fields:
        past = it.history
        past.old, past.now, past.n_old, past.n_now = past.now, past.old, past.n_now, past.n_old
        past.now[:] = np.fft.rfftn(u, axes=(1, 2, 3)) / it.workspace.flow.size
        modes, k = it.workspace.flow.modes, np.stack(np.meshgrid(*it.grid.wave_numbers()[0], indexing="ij"))
        modes[:3] = past.now * smooth(it)
        modes[3:] = 1j * np.cross(k, modes[:3], axis=0)
        it._advect(past.n_now)
    it.history.dt_old = 1.0


def velocity(it: NavierStokes) -> np.ndarray:
    """Its present velocity (3, nx, ny, nz)."""
    return np.fft.irfftn(it.history.now, it.grid.cells, axes=(1, 2, 3)) * it.workspace.flow.size


def smooth(it: NavierStokes) -> np.ndarray:
    """The filter, (nx, ny, nz//2 + 1)."""
    fx, fy, fz = filters(it.grid)
    return fx[:, None, None] * fy[:, None] * fz


def advection(it: NavierStokes) -> np.ndarray:
    """The modes (3, nx, ny, nz//2 + 1) of its present advection, as a step feels them: with 1/alpha = 1 of it alone."""
    return felt(it, 1.0, 0.0)


def felt(it: NavierStokes, n_now: float, n_old: float) -> np.ndarray:
    """The modes of so much of its advection now and before."""
    past = History(it.grid, it.density, 0.0)
    past.n_now, past.n_old = it.history.n_now, it.history.n_old
    block = Block(np.zeros_like(past.now), 0, 0)
    past.predict(Weights(1.0, 0.0, 0.0, n_now, n_old, 1.0), block)
    return block.modes


def coast(it: NavierStokes, dt: float, w: float = 0.0) -> None:
    """A step without forces."""
    it.advance(it.response(FAR, ZERO, 0.0, dt * (1 + w) / (1 + 2 * w), w), ZERO, ZERO)


def places(it: NavierStokes) -> np.ndarray:
    return it.grid.points().T.reshape(3, *it.grid.cells)


def vortices(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Taylor-Green: its advection is a gradient, so it decays by exp(-2 nu t) and nothing else."""
    return np.stack([np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y), 0 * x])


def waves(it: NavierStokes, seed: int = 0) -> np.ndarray:
    """A smooth field without divergence that has a bit of everything."""
    rng, (kx, ky, kz) = np.random.default_rng(seed), it.grid.wave_numbers()[0]
    k = np.stack(np.broadcast_arrays(kx[:, None, None], ky[:, None], kz))
    square = np.sum(k * k, axis=0)
    modes = rng.standard_normal(k.shape) + 1j * rng.standard_normal(k.shape)
    modes *= np.exp(-0.4 * square) * low(it) * (square > 0)
    modes -= k * np.sum(k * modes, axis=0) / np.where(square > 0, square, 1.0)
    u = np.fft.irfftn(modes, it.grid.cells, axes=(1, 2, 3))
    return u / np.abs(u).max()
