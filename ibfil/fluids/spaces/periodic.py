"""A periodic box: nodes and all their images move each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache as once
from functools import cached_property
from pathlib import Path

import numpy as np
import scipy

from ... import cache
from ...grid.kernels import Kernel
from ...grid.periodic_grid import Grid
from ...grid.spreading import Stencil
from .. import mobility_table
from ..coupling import Coupling
from .base import TableMobility

_LARGE = 2**17  # cells of a grid below which its table takes less than a tenth of a second


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
        """By the grid's response to one cell, whose octant is kept in the user's cache where it is large.

        In Stokes flow it is that of viscosity 1, divided by the viscosity: one table for all of them.
        """

        def made(eta: float) -> np.ndarray:
            return mobility_table.octant(coupling.response(self.grid, eta, alpha), points, number).values

        if alpha:
            values = made(viscosity)
        else:
            key = self._key(coupling, points, number)
            unit = _at_hand(key, lambda: made(1.0)) if self._kept() else made(1.0)
            values = unit if viscosity == 1.0 else unit / number(viscosity)
        return TableMobility(coupling, mobility_table.Octant(values, np.array(self.cells, np.int64)))

    def _kept(self) -> bool:
        """Whether it is worth it. With inertia each length of a step has a table: they would drive out all others."""
        return int(np.prod(self.cells)) >= _LARGE and bool(_code())

    def _key(self, coupling: Coupling, points: int, number: type) -> dict[str, object]:
        """All that an octant of unit viscosity depends on."""
        passed = f"{type(coupling).__module__}.{type(coupling).__qualname__}"
        return {
            "box": [float(side).hex() for side in self.box],
            "cells": list(self.cells),
            "points": points,
            "number": np.dtype(number).str,
            "coupling": passed,
            "versions": [np.__version__, scipy.__version__, _code()],
        }


_last: dict[str, np.ndarray] = {}  # the last octant, by its key


def _at_hand(key: dict[str, object], make: Callable[[], np.ndarray]) -> np.ndarray:
    """The octant of the last run of this process, as runs of a study have the same, or that of the user's cache."""
    text = repr(key)
    values = _last.get(text)
    if values is None:
        values = cache.table(key, make)
        _last.clear()
        _last[text] = values
    return values


@once
def _code() -> str:
    """The code that makes octants."""
    fluids = Path(__file__).parents[1]
    return cache.code(fluids, fluids / "spaces", fluids.parent / "grid")
