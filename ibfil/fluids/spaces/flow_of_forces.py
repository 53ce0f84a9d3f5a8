"""The flow that recorded forces drive, at any places: by FFT on a periodic grid, else pair by pair."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ...grid.fft import ESTIMATED
from ...grid.kernels import Kernel
from ...grid.spreading import interpolate
from ..coupling import TRANSLATION, Nodes
from ..stokes import StokesSolve
from ..torque_coupling import TorqueCoupling
from .base import Space, velocity_of
from .periodic import PeriodicSpace


class FlowOfForces(Protocol):
    """The velocity J L^-1 S F without slip and background, as a node at a place would feel it."""

    def velocity_at(self, points: np.ndarray, r: np.ndarray, force: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """The velocity (k, 3) at ``points`` (k, 3), of forces and torques (n, 3) on nodes at r (n, 3)."""


class ByFFT:
    """One FFT there and back, whatever the number of points; of forces alone."""

    def __init__(self, space: PeriodicSpace, kernel: Kernel, viscosity: float, threads: int) -> None:
        self._space, self._kernel = space, kernel
        self._solve = StokesSolve(space.grid, viscosity, threads, ESTIMATED)

    def velocity_at(self, points: np.ndarray, r: np.ndarray, force: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """By the field on the grid, and an interpolation with the kernel."""
        field = self._solve.field(*self._space.stencil(self._kernel, r), force)
        return interpolate(*self._space.stencil(self._kernel, points), field)


class ByPairs:
    """Each point with each node; ``torques``: nodes stir the fluid with their torques too."""

    def __init__(self, space: Space, kernel: Kernel, viscosity: float, torques: bool) -> None:
        self._space, self._kernel, self._torques = space, kernel, torques
        self._coupling = TorqueCoupling(np.zeros(0), np.zeros(0)) if torques else TRANSLATION
        self._mobility = space.mobility(self._coupling, kernel.points, viscosity, 0.0, np.float64)

    def velocity_at(self, points: np.ndarray, r: np.ndarray, force: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """A torque is one about itself as an axis."""
        nodes = Nodes(*self._space.stencil(self._kernel, r), torque)
        pushes = np.column_stack([force, np.ones(len(r))]) if self._torques else force
        return velocity_of(self._mobility, self._coupling, self._space.stencil(self._kernel, points), nodes, pushes)
