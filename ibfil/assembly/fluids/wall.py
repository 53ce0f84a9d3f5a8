"""From a case to Stokes flow above a wall, and what is told of it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...errors import CaseError, StepFailed
from .. import costs
from .. import grid as grids
from . import shells, wall_warnings
from .free_space import FreeModel

if TYPE_CHECKING:
    from ...fluids.base import Fluid
    from ...fluids.output import FieldSource
    from ...fluids.spaces.wall import FreeSlipWall, NoSlipWall
    from ...fluids.stokes import Solver
    from ..stacked import RodStack
    from .base import Scene

_BELOW = 1e-9  # cells by which a node may be below the wall, by rounding
_IMAGES, _TRANSFORMS = 3.0, 2.0  # a pair, and an evaluation by FFT, of those of free space


class WallModel(FreeModel):
    """Stokes flow above the plane z = 0: all nodes move each other, and each is moved by all images."""

    @cached_property
    def space(self) -> NoSlipWall | FreeSlipWall:
        """The half space above the wall."""
        from ...fluids.spaces import wall

        made = wall.NoSlipWall if self.case.fluid.sticks else wall.FreeSlipWall
        return made(grids.spacing(self.case))

    wall = 0.0

    # -- the fluid itself

    def build(self, rods: RodStack) -> Fluid:
        """As in free space. Raises CaseError where a node starts below the wall, or is held on it and cannot be."""
        faults = [*self._below(rods), *self._stuck(rods)]
        if faults:
            raise CaseError(faults)
        if rods.bodies:
            shells.refuse_below(self.case, rods, self.case.fluid.kernel, self.space.spacing, self.lowest_marker)
        return super().build(rods)

    @property
    def lowest_marker(self) -> float:  # type: ignore[override]
        """Half a cell: nearer ones are hardly moved."""
        return 0.5 * self.space.spacing

    def _below(self, rods: RodStack) -> list[str]:
        """A line for each filament that reaches below the wall."""
        out = []
        for name, where in zip(rods.names, rods.nodes, strict=True):
            z = rods.start.r[where, 2]
            if np.min(z) < -_BELOW * self.space.spacing:
                found = f"node {int(np.argmin(z))} at z = {np.min(z):.4g}, below the wall"
                out.append(f"{self.case.file}: filament.{name}.position: found {found}; allowed: z >= 0")
        return out

    def _stuck(self, rods: RodStack) -> list[str]:
        """A line for each end that is held on a wall it sticks to, which nothing moves: its reaction has no value."""
        if self.case.fluid.slip > 0 or not self.case.fluid.sticks:
            return []
        out, h = [], self.space.spacing
        for name, filament, where in zip(rods.names, rods.filaments, rods.nodes, strict=True):
            for side, end, i in (("start", filament.start, where.start), ("finish", filament.finish, where.stop - 1)):
                if end.held and rods.start.r[i, 2] < _BELOW * h:
                    found = f"0 and filament.{name}.{side} held on the wall, where nothing moves it"
                    allowed = f"slip > 0, or an end one cell, {h:.4g}, above"
                    out.append(f"{self.case.file}: fluid.slip: found {found}; allowed: {allowed}")
        return out

    def refuse(self, r: np.ndarray) -> None:
        """Raises StepFailed where a node is below the wall."""
        lowest = int(np.argmin(r[:, 2]))
        if r[lowest, 2] < -_BELOW * self.space.spacing:
            raise StepFailed(f"a node went through the wall, to z = {r[lowest, 2]:.3g}", lowest)

    def solver(self) -> Solver:
        """The solver for velocities by FFTs of the nodes' box, which reaches down to the wall."""
        from ...grid import wall_fft

        if not self.case.fluid.sticks:
            return wall_fft.MirrorSolve(self.free_solver())
        return wall_fft.WallSolve(self.space.spacing, self.case.fluid.viscosity, self.case.compute.threads)

    def fields(self) -> FieldSource | None:
        """In the window; above a wall that it sticks to the velocity alone."""
        from ...fluids.spaces.wall_fields import MirrorFields, WallFields

        if self.grid is None:
            return None
        made = WallFields if self.case.fluid.sticks else MirrorFields
        return made(self.grid, self.case.fluid.viscosity, self.flow, self.case.compute.threads)

    # -- what a step costs

    def cells(self, rods: RodStack) -> list[int]:
        """Cells of the transforms at the start, down to the wall or to the lowest image."""
        from ...grid.free_fft import padded

        base, _ = self.space.stencil(self.kernel, self.reached(rods))
        extents = np.ptp(base, axis=0) + self.kernel.points
        extents[2] = (1 if self.case.fluid.sticks else 2) * (base[:, 2].max() + self.kernel.points)
        return [padded(int(n)) for n in extents]

    def seconds(self, rods: RodStack) -> dict[str, float]:
        """Of a step by each method."""
        if rods.bodies:
            return self.with_markers(rods, {"fft": self.evaluation(rods)}, _IMAGES)
        counts = [where.stop - where.start for where in rods.nodes]
        return costs.without_box(self.case, counts, self.components, self.evaluation(rods), _IMAGES)

    def evaluation(self, rods: RodStack) -> float:
        """Twice as many transforms as in free space, or twice as many nodes."""
        return _TRANSFORMS * super().evaluation(rods)

    def table_entries(self) -> float:
        """The octant of free space, and that of images where there is one."""
        from ...grid.free_space import REACH, RIM
        from ...grid.wall_tables import HIGH, ODD

        rim = self.kernel.points - 1
        images = len(ODD) * float((REACH + 2 * rim) ** 2 * (HIGH + 2 * RIM)) if self.case.fluid.sticks else 0.0
        return super().table_entries() + images

    # -- what is told

    def modelled(self) -> list[str]:
        """Stokes flow above the wall, slip, spin."""
        _, *rest = super().modelled()
        wall = "a no-slip wall" if self.case.fluid.sticks else "a wall without friction"
        first = (
            f"Stokes flow above {wall} at z = 0: hydrodynamic interaction of all nodes and their images in it; no box"
        )
        return [first, *rest]

    def size(self) -> list[str]:
        """As in free space, and from which height on nodes are spheres."""
        near = 1.5 * self.kernel.point_radius * self.space.spacing
        return [
            *super().size(),
            f"nearer to the wall than {near:.4g}, 1.5 radii of a node, mobilities are those of no sphere, and fall to "
            "zero; nothing else keeps rods from it",
        ]

    def warnings_of(self, scene: Scene, name: str, groups: Mapping[str, float]) -> list[str]:
        """Of every immersed filament; and one that nothing holds and that begins very near the wall."""
        near = self.kernel.point_radius * self.space.spacing
        return [*super().warnings_of(scene, name, groups), *wall_warnings.of_height(self.case, scene, name, near)]

    def warnings(self, scene: Scene) -> list[str]:
        """A background flow that goes through the wall, or along one that it should stick to."""
        return wall_warnings.of_flow(self.flow, self.case.fluid.sticks)
