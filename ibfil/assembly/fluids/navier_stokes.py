"""From a case to Navier-Stokes flow on a periodic grid, and what is told of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from ...case.shape import RunShape
from .. import costs
from ..flow import flow_parts
from .base import Term
from .on_grid import GridModel

if TYPE_CHECKING:
    from ...case.filament import Filament
    from ...fluids.base import Flow, Fluid
    from ...fluids.immersed_boundary import Immersed
    from ...fluids.output import FluidOutput
    from ...fluids.stokes import Solver, Tabulated
    from ..stacked import RodStack
    from .base import Scene

CELLS, INERTIAL = 0.125, 0.5  # see crossing
LOOKS = 9  # places along an axis at which the speed of a flow is looked at
_HISTORY = "past of the fluid, as large in a checkpoint"
_TRANSFORMS = "its transforms"


def crossing(reynolds: float) -> float:
    """Cells that the fastest fluid may cross in an automatic step, by a cell's own Reynolds number rho u h/eta.

    As a rod passes a point of the grid, fluid without inertia follows at once; with it the velocity there is stepped
    through the passing, so this goes from 1 to CELLS around INERTIAL. Set to errors of about 1e-3 L in two periods of
    the swimmer with its fastest node at Re 7 to 880; 25 steps a period, 0.4 cells, make 3e-3 L of them at Re 88, a
    speed wrong by 9 %, and none at Re 880: the run fails.
    """
    return (INERTIAL + CELLS * reynolds) / (INERTIAL + reynolds)


class NavierStokesModel(GridModel):
    """Navier-Stokes flow on a periodic grid, from rest: the statement of Stokes flow with a history."""

    fluid_inertia_absent = ""
    rod_inertia = "inertia of the rods beyond the fluid they displace"
    steps_known = False

    @property
    def density(self) -> float:
        """That of the fluid."""
        assert self.case.fluid.density is not None
        return self.case.fluid.density

    def fluid(self, rods: RodStack, immersed: Immersed, method: str) -> Fluid:
        """The fluid, its forces answered by ``method``; what transforms whole fields shares one room for it."""
        from ...fluids.background_flow import Background
        from ...fluids.navier_stokes import NavierStokes, Workspace
        from ...fluids.stokes import StokesSolve
        from ...fluids.torque_coupling import TorqueStokesSolve

        threads = self.case.compute.threads
        workspace = Workspace(self.grid, immersed.coupling.grid_vectors, threads, immersed.number)
        shared = workspace.flow if immersed.number is np.float64 else None  # solvers by FFT are exact to round-off

        def solver(alpha: float) -> Solver:
            if immersed.coupling.grid_vectors == 1:
                return StokesSolve(self.grid, immersed.viscosity, threads, alpha=alpha, transform=shared)
            return TorqueStokesSolve(self.grid, immersed.viscosity, threads, alpha, shared)

        operator = self.operators(rods, immersed, method, solver)
        background = None
        if immersed.flow is not None:
            background = Background(self.grid, immersed.flow, flow_parts(self.case), threads)
        if not rods.bodies:
            return NavierStokes(immersed, self.density, operator, workspace, background)
        from ...fluids.shells.navier_stokes import NavierStokesWithBodies
        from ...fluids.shells.stokes import ImmersedBodies

        assert isinstance(immersed, ImmersedBodies)
        swimmers = self.swimmers(rods, method)
        return NavierStokesWithBodies(immersed, self.density, operator, workspace, background, swimmers=swimmers)

    def operators(
        self, rods: RodStack, immersed: Immersed, method: str, solver: Callable[[float], Solver]
    ) -> Callable[[float], Tabulated]:
        """The maker of answers to forces by ``method``, from an alpha; ``solver`` makes the transforms of one."""
        from ...fluids import stokes

        factor_cost = self.factor_cost(rods)

        def operator(alpha: float) -> Tabulated:
            if method == "table":
                return stokes.StokesByTable(immersed, alpha)
            if method == "krylov":
                return stokes.StokesByKrylov(immersed, solver(alpha), factor_cost, alpha)
            return stokes.StokesByFFT(immersed, solver(alpha), alpha)

        return operator

    def output(self, rods: RodStack, fluid: Fluid) -> FluidOutput:
        """Of the velocity that the fluid has."""
        from ...fluids.inertial_fields import InertialFields
        from ...fluids.navier_stokes import InertialFluid
        from ...fluids.output import GridOutput

        assert isinstance(fluid, InertialFluid)
        return GridOutput(self.ingredients(rods, fluid), InertialFields(fluid, self.flow, self.case.compute.threads))

    def transforms(self, rods: RodStack) -> bool:
        """Always: advection does."""
        return True

    # -- what a step costs

    def _flow_terms(self, rods: RodStack, seconds: float, used: Mapping[str, float]) -> list[Term]:
        """The response to forces; history and advection apart."""
        past = min(seconds, costs.of_inertia(self.grid.cells.tolist(), self.components))
        held = used[_HISTORY] + used[_TRANSFORMS]
        rest = super()._flow_terms(rods, seconds - past, {"rest": sum(used.values()) - held})
        return [*rest, Term("inertia and advection", past, held)]

    def memory(self, rods: RodStack) -> dict[str, float]:
        """History and transforms, and the background flow; two mobility tables: of Euler's first step, and BDF2's."""
        out, cells = super().memory(rods), self.grid.cells
        modes = 3 * 2 * self._number * float(np.prod(cells[:2])) * (cells[2] // 2 + 1)
        out |= {_HISTORY: 4 * modes, _TRANSFORMS: modes + 4 * modes}
        out["mobility table"] *= 2
        if self.flow is not None:
            parts = flow_parts(self.case) or []
            fields = len(parts) + (len(parts) != 1 or parts[0].factor is not None)
            out["the background flow"] = fields * 6 * 8.0 * float(np.prod(cells))
        return out

    # -- the speeds of the scene

    def automatic_limit(self, longest: float) -> float:
        """Shorter where a cell's own Reynolds number is large."""
        reynolds = self.density * self.grid.spacing**2 / (self.case.fluid.viscosity * longest)
        return longest * crossing(reynolds)

    # -- what is told

    def modelled(self) -> list[str]:
        """Navier-Stokes flow, slip, spin."""
        return ["Navier-Stokes flow on a periodic grid, from rest: with inertia and advection", *super().modelled()]

    def remarks(self) -> list[str]:
        """A background flow that is put on the grid at each step."""
        if self.flow is None or flow_parts(self.case):
            return super().remarks()
        return [
            *super().remarks(),
            "fluid.flow is no sum of at most 4 products f(t) g(x, y, z) that is seen: it is put on the grid each step, "
            "which takes as long as the step itself or twice that",
        ]

    def step_lines(self) -> list[str]:
        """How far the fluid may move in a step."""
        time = self.case.time
        limited = "steps are shortened for it" if time.tolerance is not None else "told"
        if time.automatic and time.tolerance is None:
            limited = f"steps are shortened to that, to {CELLS:g} of it where rho u h/eta is large"
        return [f"advection is extrapolated: stable while the fluid crosses less than about a cell a step ({limited})"]

    def groups(self, filament: Filament, rate: float) -> dict[str, float]:
        """The Reynolds numbers of what drives the scene, and of the background flow; and groups of the grid."""
        out, length = {}, filament.length * self.density / self.case.fluid.viscosity
        if rate:
            out["Re = rho omega L^2/eta"] = rate * filament.length * length
        if self.flow is not None:
            out["Re = rho U L/eta, U the fastest of fluid.flow"] = self._fastest(self.flow) * length
        return out | super().groups(filament, rate)

    def _fastest(self, flow: Flow) -> float:
        """The largest speed of a flow in the box, at the start, midway and at the end."""
        axes = [np.linspace(-0.5 * side, 0.5 * side, LOOKS) for side in self.box]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        end = self.case.time.end
        return max(float(np.max(np.linalg.norm(flow(points, time), axis=1))) for time in (0.0, 0.5 * end, end))

    def warnings_of(self, scene: Scene, name: str, groups: Mapping[str, float]) -> list[str]:
        """A shape from another run, whose flow is not known."""
        out = super().warnings_of(scene, name, groups)
        if isinstance(self.case.filaments[name].shape, RunShape):
            out.append(
                f"filament.{name}.shape: the shape of another run, and nothing of its flow: the fluid starts at rest, "
                "or in fluid.flow"
            )
        return out
