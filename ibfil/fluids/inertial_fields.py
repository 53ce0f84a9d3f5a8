"""Fields on the grid of a fluid with inertia: its velocity is at hand, and its pressure carries advection too.

grad p is what f - rho div(u u) is not allowed to have of a gradient:  p = -i k.f/|k|^2 - rho k.(u u)^.k/|k|^2, with
the products filtered as in advection.py. In a background flow U, which something else drives, u u - U U
stands for u u: the pressure is that of the rods' disturbance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .advection import filters
from .base import Flow
from .fields import GridFields

if TYPE_CHECKING:
    from .navier_stokes import InertialFluid


class InertialFields(GridFields):
    """The fields of ``fluid`` as it is, with the forces that act now."""

    def __init__(self, fluid: InertialFluid, flow: Flow | None, threads: int = 1) -> None:
        super().__init__(fluid.grid, fluid.immersed.viscosity, flow, threads)
        self._fluid = fluid

    def _velocity(self, force: np.ndarray) -> np.ndarray:
        return self._fluid.history.now.astype(complex)

    def _pressure(self, force: np.ndarray) -> np.ndarray:
        return super()._pressure(force) - self._dynamic().astype(np.float32)

    def _dynamic(self) -> np.ndarray:
        """rho k.(u u)^.k/|k|^2, (nx, ny, nz)."""
        t, k, (fx, fy, fz) = self._transform, self._k, filters(self.grid)
        smooth = fx[:, None, None] * fy[:, None] * fz
        t.modes[:] = self._fluid.history.now * smooth
        own = t.backward().copy()
        flow = np.zeros_like(own) if self.flow is None else self._fluid.background()[:3]
        square = k[0] ** 2 + k[1] ** 2 + k[2] ** 2
        square[square == 0] = np.inf
        total = np.zeros(square.shape, complex)
        for a in range(3):
            t.real[:] = (own + flow) * (own[a] + flow[a]) - flow * flow[a]
            t.forward()
            total += k[a] * (k[0] * t.modes[0] + k[1] * t.modes[1] + k[2] * t.modes[2]) * smooth
        t.modes[:] = 0.0
        t.modes[0] = self._fluid.density / t.size * total / square
        return np.array(t.backward()[0])
