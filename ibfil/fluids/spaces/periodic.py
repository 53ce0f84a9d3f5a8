"""A periodic box: nodes and all their images move each other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...grid.kernels import Kernel
from ...grid.periodic_grid import Grid
from ...grid.spreading import Stencil
from .. import mobility_table
from ..coupling import Coupling
from .base import TableMobility


@dataclass(frozen=True)
class PeriodicSpace:
    """The box (3,) of a periodic grid, and its cells (3,)."""

    box: tuple[float, ...]
    cells: tuple[int, ...]

    @classmethod
    def of(cls, grid: Grid) -> PeriodicSpace:
        """That of a grid."""
        return cls(tuple(map(float, grid.box)), tuple(map(int, grid.cells)))

    @cached_property
    def grid(self) -> Grid:
        """The grid."""
        return Grid(self.box, self.cells)

    @property
    def spacing(self) -> float:
        """The grid's."""
        return self.grid.spacing

    def coordinates(self, r: np.ndarray) -> np.ndarray:
        """Positions (n, 3) in units of the spacing, from grid index (0, 0, 0)."""
        return self.grid.coordinates(r)

    def stencil(self, kernel: Kernel, r: np.ndarray) -> Stencil:
        """The kernel's own; indices are unwrapped."""
        return kernel.stencil(self.coordinates(r))

    def mobility(
        self, coupling: Coupling, points: int, viscosity: float, alpha: float = 0.0, number: type = np.float64
    ) -> TableMobility:
        """By the grid's response to one cell."""
        response = coupling.response(self.grid, viscosity, alpha)
        return TableMobility(coupling, mobility_table.octant(response, points, number))
