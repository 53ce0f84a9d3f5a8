"""Free space: no box, no images; nodes move each other at any distance, and net forces need no back pressure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...grid import free_space
from ...grid.kernels import Kernel
from ...grid.spreading import Stencil
from ..coupling import Coupling
from ..mobility_table import Octant
from .base import Mobility, TableMobility


@dataclass(frozen=True)
class FreeSpace:
    """All of space, with a point at the origin and the others ``spacing`` apart."""

    spacing: float

    def coordinates(self, r: np.ndarray) -> np.ndarray:
        """Positions (n, 3) in units of the spacing, from the origin."""
        return r / self.spacing

    def stencil(self, kernel: Kernel, r: np.ndarray) -> Stencil:
        """The kernel's own."""
        return kernel.stencil(self.coordinates(r))

    def mobility(
        self, coupling: Coupling, points: int, viscosity: float, alpha: float = 0.0, number: type = np.float64
    ) -> Mobility:
        """By the one table, and beyond its reach by Oseen's tensor. Raises ValueError for a fluid with inertia."""
        if alpha:
            raise ValueError("the response of free space is that of Stokes flow")
        return TableMobility(coupling, octant(coupling.grid_vectors, points, self.spacing, viscosity, number))


def octant(vectors: int, points: int, spacing: float, viscosity: float, number: type = np.float64) -> Octant:
    """The octant of free space for kernels of so many points, and nodes with so many ``vectors``."""
    parts = free_space.PARTS[vectors]
    scales = 1.0 / (viscosity * spacing ** np.arange(1.0, 4.0))  # of G, R and W
    values = free_space.octant(parts, points - 1) * np.repeat(scales, (6, 3, 6))[:parts]
    modulus = np.full(3, 2 * free_space.REACH - 1, np.int64)
    return Octant(values.reshape(*values.shape[:2], -1).astype(number, copy=False), modulus, free_space.REACH, scales)
