"""From a case to Stokes flow in free space, and what is told of it."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from .. import costs
from .. import grid as grids
from .immersed import FIELDS, ImmersedModel

if TYPE_CHECKING:
    from ...fluids.base import Fluid
    from ...fluids.immersed_boundary import Immersed
    from ...fluids.output import FieldSource, FluidOutput
    from ...fluids.spaces.flow_of_forces import FlowOfForces
    from ...fluids.spaces.free import FreeSpace
    from ...fluids.stokes import Solver
    from ...grid.free_fft import FreeSolve
    from ...grid.periodic_grid import Lattice
    from ..stacked import RodStack


class FreeModel(ImmersedModel):
    """Stokes flow in free space: all nodes move each other at once, at any distance, and nothing else does."""

    @property
    def flow_from_forces(self) -> bool:  # type: ignore[override]
        """Where no bodies push: a run file has the forces of nodes alone."""
        return not self.case.bodies

    @cached_property
    def space(self) -> FreeSpace:
        """All of space."""
        return grids.free_space(self.case)

    @cached_property
    def grid(self) -> Lattice | None:
        """The window in which fields are written; None where none are."""
        return grids.window(self.case)

    # -- the fluid itself

    def fluid(self, rods: RodStack, immersed: Immersed, method: str) -> Fluid:
        """The exact table, or convolutions, with the preconditioner that the method has."""
        from ...fluids import stokes

        if rods.bodies:
            return self.with_bodies(rods, immersed, method, None if method == "table" else self.solver())
        if method == "table":
            return stokes.StokesByTable(immersed)
        if method == "krylov":
            return stokes.StokesByKrylov(immersed, self.solver(), self.factor_cost(rods))
        return stokes.StokesByFFT(immersed, self.solver())

    def solver(self) -> Solver:
        """The solver for velocities by FFTs of the nodes' box."""
        return self.free_solver()

    def free_solver(self) -> FreeSolve:
        """That of free space."""
        from ...grid.free_fft import FreeSolve

        fluid, vectors = self.case.fluid, self.components - 2
        return FreeSolve(self.space.spacing, fluid.viscosity, vectors, self.case.compute.threads)

    def output(self, rods: RodStack, fluid: Fluid) -> FluidOutput:
        """Heat by the power of the nodes, fields in the window."""
        from ...fluids.output import SpaceOutput

        return SpaceOutput(self.ingredients(rods, fluid), fluid, self.fields())

    def fields(self) -> FieldSource | None:
        """The fields in the window; None where there is none."""
        from ...fluids.spaces.free_fields import FreeFields

        if self.grid is None:
            return None
        return FreeFields(self.grid, self.case.fluid.viscosity, self.flow, self.case.compute.threads)

    # -- what a step costs

    def cells(self, rods: RodStack) -> list[int]:
        """Cells of the transforms at the start."""
        from ...grid.free_fft import padded

        base, _ = self.space.stencil(self.kernel, self.reached(rods))
        return [padded(int(n)) for n in np.ptp(base, axis=0) + self.kernel.points]

    def seconds(self, rods: RodStack) -> dict[str, float]:
        """Of a step by each method."""
        if rods.bodies:
            return self.with_markers(rods, {"fft": self.evaluation(rods)})
        counts = [where.stop - where.start for where in rods.nodes]
        return costs.without_box(self.case, counts, self.components, self.evaluation(rods))

    def evaluation(self, rods: RodStack) -> float:
        """By convolutions in the nodes' box."""
        return (self.components - 2) * costs.full_evaluation(self.cells(rods)) + len(rods.s) * costs.SPREAD

    def field_evaluation(self) -> float:
        """A convolution from nodes that take up as much as the window, with the transforms of the response."""
        return 0.0 if self.grid is None else 2 * costs.full_evaluation((2 * self.grid.cells).tolist())

    def table_entries(self) -> float:
        """The octant within reach, with its rim; whatever the scene."""
        from ...grid.free_space import PARTS, REACH

        return PARTS[self.components - 2] * float(REACH + 2 * (self.kernel.points - 1)) ** 3

    def _dissipation(self) -> tuple[float, float]:
        """The velocity once more."""
        return 0.0, 0.0

    def memory(self, rods: RodStack) -> dict[str, float]:
        """Fields and symbols too, where steps transform them; and those of the window."""
        out, vectors, fields = super().memory(rods), self.components - 2, 0.0
        if self.transforms(rods):
            fields += (2 * 3 * vectors + 2) * 8.0 * float(np.prod(self.cells(rods)))
        if self.grid is not None:
            fields += 30 * 8.0 * float(np.prod(2 * self.grid.cells))
        return out | ({FIELDS: fields} if fields else {})

    # -- what is told

    def modelled(self) -> list[str]:
        """Stokes flow, slip, spin."""
        return [
            "Stokes flow in free space: hydrodynamic interaction of all nodes; no box, no images",
            *super().modelled(),
        ]

    def size(self) -> list[str]:
        """The spacing, and how thick rods and nodes are."""
        return [f"grid without end, h = {self.space.spacing:.4g}", *super().size()]

    # -- recorded runs

    def solve_for_flow(self) -> FlowOfForces:
        """Pair by pair, torques too."""
        from ...fluids.spaces.flow_of_forces import ByPairs

        return ByPairs(self.space, self.kernel, self.case.fluid.viscosity, self.case.couples_torque)
