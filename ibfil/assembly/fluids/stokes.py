"""From a case to Stokes flow on a periodic grid, and what is told of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .immersed import FIELDS
from .on_grid import GridModel

if TYPE_CHECKING:
    from ...fluids.base import Fluid
    from ...fluids.immersed_boundary import Immersed
    from ...fluids.stokes import StokesSolve
    from ..stacked import RodStack


class StokesModel(GridModel):
    """Stokes flow on a periodic grid: all nodes and their images move each other at once."""

    def fluid(self, rods: RodStack, immersed: Immersed, method: str) -> Fluid:
        """The exact table, or transforms, with the preconditioner that the method has."""
        from ...fluids import stokes

        if method == "table":
            return stokes.StokesByTable(immersed)
        solver = self.solver(rods, method)
        if method == "krylov":
            return stokes.StokesByKrylov(immersed, solver, self.factor_cost(rods))
        return stokes.StokesByFFT(immersed, solver)

    def memory(self, rods: RodStack) -> dict[str, float]:
        """Fields too, where steps or outputs transform them."""
        out = super().memory(rods)
        if self.transforms(rods) or self.case.output.grid_every is not None:
            out[FIELDS] = (self.components - 2) * 2 * 3 * 8.0 * float(np.prod(self.grid.cells))
        return out

    def modelled(self) -> list[str]:
        """Stokes flow, slip, spin."""
        return [
            "Stokes flow on a periodic grid: hydrodynamic interaction of all nodes and their images",
            *super().modelled(),
        ]

    @property
    def flow_from_forces(self) -> bool:  # type: ignore[override]
        """Where no torque is on the grid: a run file has the forces alone."""
        return not self.case.couples_torque

    def solve_for_flow(self) -> StokesSolve:
        """One whole FFT there and back, planned in a hurry."""
        from ...fluids.stokes import StokesSolve
        from ...grid.fft import ESTIMATED

        return StokesSolve(self.grid, self.case.fluid.viscosity, self.case.compute.threads, ESTIMATED)
