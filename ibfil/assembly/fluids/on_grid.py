"""The common part of the models of fluids on a periodic grid."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from .. import costs
from .. import grid as grids
from . import grid_warnings, sheet
from .immersed import ImmersedModel

if TYPE_CHECKING:
    from ...case.filament import Filament
    from ...fluids.base import Fluid
    from ...fluids.output import FluidOutput
    from ...fluids.spaces.periodic import PeriodicSpace
    from ...fluids.stokes import Solver
    from ...grid.periodic_grid import Grid
    from ..stacked import RodStack
    from .base import Scene


SHARED = 2**21  # cells from which a grid is worth sharing between processes


class GridModel(ImmersedModel):
    """A fluid on a periodic grid."""

    @cached_property
    def space(self) -> PeriodicSpace:
        """The periodic box. Raises CaseError where ``thickness`` has no cells."""
        return grids.periodic_space(self.case)

    @property
    def grid(self) -> Grid:
        """The periodic grid."""
        return self.space.grid

    # -- the fluid itself

    def output(self, rods: RodStack, fluid: Fluid) -> FluidOutput:
        """Heat and fields, by an evaluation on the whole grid."""
        from ...fluids.fields import GridFields
        from ...fluids.output import GridOutput

        fields = GridFields(self.grid, self.case.fluid.viscosity, self.flow, self.case.compute.threads)
        return GridOutput(self.ingredients(rods, fluid), fields)

    def solver(self, rods: RodStack, method: str) -> Solver:
        """The solver for velocities by FFT: of the whole grid, or where that is cheaper of the filaments' box."""
        eta, threads = self.case.fluid.viscosity, self.case.compute.threads
        if self.case.couples_torque:
            from ...fluids.torque_coupling import TorqueStokesSolve

            return TorqueStokesSolve(self.grid, eta, threads)
        if method == "fft" or (method == "krylov" and not self.fills_little(rods)):
            from ...fluids.stokes import StokesSolve

            return StokesSolve(self.grid, eta, threads)
        from ...grid.pruned_fft import PrunedSolve

        return PrunedSolve(self.grid, eta, threads)

    # -- what a step costs

    def _sizes(self, rods: RodStack) -> list[int]:
        """Extents, in cells, of the box that holds the filaments' stencils at the start."""
        from ...grid.pruned_fft import bounding_box

        base, _ = self.space.stencil(self.kernel, self.reached(rods))
        return bounding_box(base, self.kernel.points, self.grid.cells)[1]

    def seconds(self, rods: RodStack) -> dict[str, float]:
        """Of a step by each method."""
        if rods.bodies:
            return self._of_bodies(rods)
        counts = rods.group_sizes
        return costs.seconds_a_step(self.case, counts, self.grid.cells.tolist(), self._sizes(rods), self.components)

    def _of_bodies(self, rods: RodStack) -> dict[str, float]:
        """The same with bodies."""
        cells, points = self.grid.cells.tolist(), rods.count + sum(self.markers)
        by = {"fft": (self.components - 2) * costs.full_evaluation(cells) + points * costs.SPREAD}
        if self.components == 3 and not self.case.fluid.inertial:
            by["pruned"] = costs.pruned_evaluation(cells, self._sizes(rods)) + points * costs.SPREAD
        return self.with_markers(rods, by, inertia=costs.of_inertia(cells, self.components))

    def evaluation(self, rods: RodStack) -> float:
        """By whole FFTs, or those of the filaments' box."""
        return costs.evaluation(self.grid.cells.tolist(), self._sizes(rods), len(rods.s))

    def field_evaluation(self) -> float:
        """By whole FFTs."""
        return costs.full_evaluation(self.grid.cells.tolist())

    def table_entries(self) -> float:
        """An octant of the grid, with its rim."""
        rim, parts = self.kernel.points - 1, 15 if self.components == 4 else 6
        return parts * float(np.prod(self.grid.cells // 2 + 1 + 2 * rim))

    def fills_little(self, rods: RodStack) -> bool:
        """Whether transforms of the filaments' bounding box alone are the cheaper ones."""
        cells = self.grid.cells.tolist()
        return costs.pruned_evaluation(cells, self._sizes(rods)) < costs.full_evaluation(cells)

    def _dissipation(self) -> tuple[float, float]:
        """One and a half evaluations of the whole grid."""
        return 1.5 * self.field_evaluation(), 6 * 8.0 * float(np.prod(self.grid.cells))

    # -- what is told

    def of_images(self, force: float) -> str:
        """Words for what a net ``force`` on the box does, and what there is against it."""
        return "a larger box makes it weaker, in proportion to the volume"

    def size(self) -> list[str]:
        """The grid, and how thick rods and nodes are on it."""
        axis, h = self.case.fluid.thin_axis, self.grid.spacing
        more = super().size() if axis is None else sheet.size(axis, h)
        return [f"grid {' x '.join(str(n) for n in self.grid.cells)}, h = {h:.4g}", *more]

    def modelled(self) -> list[str]:
        """Whether the flow is plane; and what every immersed fluid has."""
        axis = self.case.fluid.thin_axis
        return [*([] if axis is None else [sheet.modelled(axis)]), *super().modelled()]

    def drag(self, filament: Filament) -> float:
        """That of a waving sheet where the flow is plane."""
        if self.case.fluid.thin_axis is None:
            return super().drag(filament)
        return sheet.drag(self.case.fluid.viscosity, self.grid.spacing, filament.length)

    def groups(self, filament: Filament, rate: float) -> dict[str, float]:
        """Nodes, radii and waves in units of cells; a sheet has no radius."""
        found = super().groups(filament, rate)
        if self.case.fluid.thin_axis is not None:
            del found["a/L"]
        return found

    def warnings_of(self, scene: Scene, name: str, groups: Mapping[str, float]) -> list[str]:
        """Of every immersed filament; rods longer than the box, sheets that leave their plane."""
        axis, out = self.case.fluid.thin_axis, super().warnings_of(scene, name, groups)
        if axis is not None:
            out = [*out, *sheet.leaves_plane(scene, self.case.filaments[name], name, axis)]
        return [*out, *grid_warnings.of_images(self.grid, scene, name)]

    def warnings(self, scene: Scene) -> list[str]:
        """A net force that a back pressure carries, a flow that is not periodic, or not plane."""
        axis, out = self.case.fluid.thin_axis, grid_warnings.of_net_force(self.grid, scene, self.of_images)
        out = [*out, *super().warnings(scene)]
        if axis is not None:
            return [*out, *grid_warnings.of_flow(self.grid, self.flow, axis), *sheet.of_flow(self.flow, axis, self.box)]
        return [*out, *grid_warnings.of_flow(self.grid, self.flow)]

    def remarks(self) -> list[str]:
        """Of a large grid, that processes may share it."""
        if np.prod(self.grid.cells) < SHARED or self.case.bodies or self.case.thermal is not None:
            return []
        how = "" if self.case.fluid.inertial else ' with fluid.method = "fft" or "krylov"'
        rest = "rods, the mobility table and outputs stay with process 0, as does the file"
        return [f"mpiexec -n P ibfil run shares the grid, its transforms and fields{how}; {rest}"]

    # -- pictures and recorded runs

    @property
    def box(self) -> np.ndarray:
        """The periodic box (3,)."""
        return self.grid.box
