"""Velocities by FFTs that processes share: process 0's side."""

from __future__ import annotations

import numpy as np

from ..grid.periodic_grid import Grid
from ..grid.spreading import Stencil
from .part import GridPart
from .ranks import Ranks, Shared


def share(ranks: Ranks, grid: Grid, vectors: int, threads: int) -> Shared:
    """A grid shared by all processes, for solves; ``vectors`` of a node go through it."""
    box, cells = tuple(map(float, grid.box)), tuple(map(int, grid.cells))
    return ranks.make(GridPart, box, cells, vectors, threads)


class Placed:
    """The nodes that the processes were last given: those of one configuration are asked about many times."""

    def __init__(self, shared: Shared) -> None:
        self._shared, self._last = shared, Stencil(np.empty(0), np.empty(0))

    def at(self, base: np.ndarray, weights: np.ndarray) -> None:
        """Has them be nodes of these stencils; arrays that were given before are not looked into again."""
        if self._last.base is not base or self._last.weights is not weights:
            self._last = Stencil(base, weights)
            self._shared.call("place", own=(self._last,))


class SharedStokesSolve:
    """Velocities, and half vorticities, by FFTs that processes share (fluids/stokes.py has the contract, `Solver`).

    ``alpha`` is density over time, zero in Stokes flow. Those on the same grid have one ``placed`` together.
    """

    def __init__(self, shared: Shared, placed: Placed, viscosity: float, alpha: float = 0.0) -> None:
        self._shared, self._placed, self.viscosity, self.alpha = shared, placed, viscosity, alpha

    def velocity(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocity (n, 3 v) that forces (n, 3 v) drive at the nodes; v = 2: with torques and half vorticities."""
        self._placed.at(base, weights)
        return self._shared.call("velocity", self.viscosity, self.alpha, own=(force,))
