"""From a case to Stokes flow on a periodic grid, and what is told of it."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from .immersed import FIELDS
from .on_grid import GridModel

if TYPE_CHECKING:
    from ...fluids.base import Fluid
    from ...fluids.immersed_boundary import Immersed
    from ...fluids.spaces.flow_of_forces import FlowOfForces
    from ..stacked import RodStack


class StokesModel(GridModel):
    """Stokes flow on a periodic grid: all nodes and their images move each other at once."""

    def fluid(self, rods: RodStack, immersed: Immersed, method: str) -> Fluid:
        """The exact table, or transforms, with the preconditioner that the method has."""
        from ...fluids import stokes

        if rods.bodies:
            solver = None if method == "table" else self.solver(rods, method)
            return self.with_bodies(rods, immersed, method, solver)
        if method == "table":
            return stokes.StokesByTable(immersed)
        solver = self.solver(rods, method)
        if method == "krylov":
            from ...fluids.roots import SpectralRoot

            fluid, threads = self.case.fluid, self.case.compute.threads
            root = partial(SpectralRoot, self.grid, fluid.viscosity, immersed.coupling, immersed.own, threads)
            return stokes.StokesByKrylov(immersed, solver, self.factor_cost(rods), root=root)
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

    def of_images(self, force: float) -> str:
        """Hasimoto's 2.837297 F/(6 pi eta L) by which the images of a cubic box of side L slow what is pulled."""
        if self.case.fluid.thin_axis is not None:
            return super().of_images(force)
        side = float(np.prod(self.grid.box)) ** (1 / 3)
        slower = 2.837297 * force / (6 * np.pi * self.case.fluid.viscosity * side)
        return f'with its images this slows the rods by about {slower:.3g}; fluid.box = "free" has neither'

    @property
    def flow_from_forces(self) -> bool:  # type: ignore[override]
        """Where no torque is on the grid, and no bodies push: a run file has the forces of nodes alone."""
        return not self.case.couples_torque and not self.case.bodies

    def solve_for_flow(self) -> FlowOfForces:
        """One whole FFT there and back, planned in a hurry."""
        from ...fluids.spaces.flow_of_forces import ByFFT

        return ByFFT(self.space, self.kernel, self.case.fluid.viscosity, self.case.compute.threads)
