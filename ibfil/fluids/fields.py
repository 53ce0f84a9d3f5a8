"""Fields on the grid for output: one evaluation of the fluid, whatever is asked of it.

From the modes f of the spread forces:  u = (eta k^2)^-1 (1 - k k/|k|^2) f,  omega = i k x u,  p = -i k.f/|k|^2.
The pressure is that of the rods' disturbance, without the uniform gradient that carries a net force.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..grid.fft import ESTIMATED, VectorTransform
from ..grid.periodic_grid import Grid
from ..grid.spectral import half_curl, project
from ..grid.spreading import interpolate, spread
from .base import Flow
from .velocity_gradient import curl


class GridFields:
    """Evaluates velocity, vorticity (nx, ny, nz, 3) and pressure (nx, ny, nz), all single precision."""

    def __init__(self, grid: Grid, viscosity: float, flow: Flow | None, threads: int = 1) -> None:
        self.grid, self.viscosity, self.flow = grid, viscosity, flow
        nx, ny, nz = (int(n) for n in grid.cells)
        self._transform = VectorTransform((nx, ny, nz), threads, ESTIMATED)
        (kx, ky, kz), self._squares = grid.wave_numbers()
        self._k = (kx[:, None, None], ky[None, :, None], kz[None, None, :])
        self._axes = (kx, ky, kz)
        self._waves = (kx, ky, np.repeat(kz, 2))

    def evaluate(
        self, base: np.ndarray, weights: np.ndarray, force: np.ndarray, time: float, names: Sequence[str]
    ) -> dict[str, np.ndarray]:
        """The fields in ``names`` that nodal forces (n, 3), or forces and torques (n, 6), drive.

        The nodes have the stencils (base, weights); torques act as half a curl (torque_coupling.py).
        """
        modes = self._modes(base, weights, force[:, :3])
        if force.shape[1] == 6 or len(names) > 1:
            modes = modes.copy()  # what fields are made of is kept elsewhere: each is transformed in the same room
        if force.shape[1] == 6:
            half_curl(self._modes(base, weights, force[:, 3:]), *self._axes, modes)
        out = {}
        if "pressure" in names:
            out["pressure"] = self._pressure(modes)
        u = self._velocity(modes)
        if "velocity" in names:
            out["velocity"] = self._real(u, self._background(time))
        if "vorticity" in names:
            spin = np.zeros_like(u)
            half_curl(u, *self._axes, spin)
            out["vorticity"] = self._real(2 * spin, self._background_curl(time))
        return out

    def dissipation(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> tuple[float, float]:
        """eta int |grad u|^2 of the rods' flow, from its modes, and the power F.u (+ T.w) of the nodes upon it.

        In Stokes they are the same number, spreading and interpolation being adjoint; with inertia what is between
        them goes into the flow's kinetic energy.
        """
        modes = self._modes(base, weights, force[:, :3])
        if force.shape[1] == 6:
            modes = modes.copy()
            half_curl(self._modes(base, weights, force[:, 3:]), *self._axes, modes)
        u, t = self._velocity(modes), self._transform
        sx, sy, sz = self._squares
        square = sx[:, None, None] + sy[None, :, None] + sz[None, None, :]
        twice = np.full(sz.size, 2.0)  # the half of the modes that is kept stands for both
        twice[0] = 1.0
        if t.real.shape[3] % 2 == 0:
            twice[-1] = 1.0
        heat = float(np.sum((np.abs(u) ** 2).sum(axis=0) * square * twice))
        turns = np.zeros_like(u)
        if force.shape[1] == 6:
            half_curl(u, *self._axes, turns)
        if u is not t.modes:
            t.modes[:] = u
        power = float(np.sum(interpolate(base, weights, t.backward()) * force[:, :3]))
        if force.shape[1] == 6:
            t.modes[:] = turns
            power += float(np.sum(interpolate(base, weights, t.backward()) * force[:, 3:]))
        return self.viscosity * float(np.prod(self.grid.box)) * heat, power

    def _velocity(self, force: np.ndarray) -> np.ndarray:
        """The velocity's modes from those of the force density, which are lost."""
        sx, sy, sz = self._squares
        project(force.view(float), *self._waves, sx, sy, np.repeat(sz, 2), 0.0, self.viscosity, 1.0)
        return force

    def _modes(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The modes of the spread forces (n, 3), as a density, in the room of the transform."""
        t = self._transform
        t.real[:] = 0.0
        spread(base, weights, force, t.real)
        modes = t.forward()
        modes *= 1.0 / (t.size * self.grid.spacing**3)
        return modes

    def _real(self, modes: np.ndarray, background: np.ndarray | None) -> np.ndarray:
        if modes is not self._transform.modes:
            self._transform.modes[:] = modes
        real = np.moveaxis(self._transform.backward(), 0, -1)
        return (real if background is None else real + background).astype(np.float32)

    def _pressure(self, force: np.ndarray) -> np.ndarray:
        k = self._k
        square = k[0] ** 2 + k[1] ** 2 + k[2] ** 2
        square[square == 0] = np.inf
        modes = np.zeros_like(force)
        modes[0] = -1j * (k[0] * force[0] + k[1] * force[1] + k[2] * force[2]) / square
        return np.ascontiguousarray(self._real(modes, None)[..., 0])

    def _background(self, time: float) -> np.ndarray | None:
        if self.flow is None:
            return None
        return self.flow(self.grid.points(), time).reshape(*self.grid.cells, 3)

    def _background_curl(self, time: float) -> np.ndarray | None:
        if self.flow is None:
            return None
        return curl(self.flow, self.grid.points(), time, self.grid.spacing).reshape(*self.grid.cells, 3)
