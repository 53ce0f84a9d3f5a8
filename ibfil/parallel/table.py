"""The mobility table (fluids/mobility_table.py) of a grid that processes share, whose response none of them has whole.

Process 0 gets the octant, an eighth of the grid with a rim, of transforms back from the symbol that each process knows
of its rows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..fluids.coupling import Coupling
from ..fluids.mobility_table import COMPONENTS, Octant
from ..fluids.spaces.base import TableMobility
from ..fluids.spaces.periodic import PeriodicSpace
from ..grid.spectral import StokesSymbol
from .moving import gathered
from .part import GridPart
from .ranks import Ranks

LARGE = 2**24  # cells from which the table of a Stokes fluid is not made by process 0, or read from the user's cache


class TablePart(GridPart):
    """The part of one process in making a table."""

    def octant(self, viscosity: float, alpha: float, torque: bool, points: int) -> np.ndarray | None:
        """The components (k, x, y, z) in the octant, with the rim of kernels of so many ``points``, on process 0."""
        t, (nx, ny, nz), rim = self.transform, self.transform.cells, points - 1
        x, y, z = (np.arange(-rim, n // 2 + rim + 1) % n for n in (nx, ny, nz))
        found, made = [], self._symbols(viscosity, alpha, torque)
        for _ in range(5 if torque else 2):
            for field in t.modes[:3]:
                field[:] = next(made)
            real = t.backward(3)
            cut = np.ascontiguousarray(real[:3][:, :, y[:, None], z]) / t.size
            whole = gathered(self._comm, cut, t.planes, 1)
            if whole is not None:
                found.append(whole[:, x])
        return np.concatenate(found) if found else None

    def _symbols(self, viscosity: float, alpha: float, torque: bool) -> Iterator[np.ndarray]:
        """Of G (6), and of R (3) and W (6) where torques go through the grid: fluids/torque_coupling.py."""
        (kx, ky, kz), (sx, sy, sz) = self._k, self.grid.wave_numbers()[1]
        symbol = StokesSymbol((kx, ky, kz), (sx, sy[self.rows], sz), viscosity, alpha)
        if self.rows.start:  # the mean mode is not among these
            symbol.total[0, 0, 0] = alpha + viscosity * sy[self.rows][0]
        total = symbol.total * self.grid.spacing**3
        for a, b in COMPONENTS:
            yield symbol.solenoidal(a, b) / total
        for a in range(3 * torque):
            yield 0.5j * symbol.k[a] / total
        for a, b in COMPONENTS[: 6 * torque]:
            yield 0.25 * symbol.twice_curled(a, b) / total


@dataclass(frozen=True)
class SharedSpace(PeriodicSpace):
    """The periodic box whose tables are made by all processes where that is worth it."""

    ranks: Ranks

    def mobility(
        self, coupling: Coupling, points: int, viscosity: float, alpha: float = 0.0, number: type = np.float64
    ) -> TableMobility:
        """By the grid's response to one cell."""
        if alpha == 0.0 and np.prod(self.cells) < LARGE:
            return super().mobility(coupling, points, viscosity, alpha, number)
        shared = self.ranks.make(TablePart, self.box, self.cells)
        found = shared.call("octant", viscosity, alpha, coupling.grid_vectors == 2, points)
        table: np.ndarray = np.ascontiguousarray(np.moveaxis(found, 0, 3)).astype(number, copy=False)
        values = table.reshape(*table.shape[:2], -1)
        return TableMobility(coupling, Octant(values, np.array(self.cells, np.int64)))
