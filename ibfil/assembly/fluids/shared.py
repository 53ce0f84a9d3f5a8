"""From a case to a fluid whose grid is shared by several processes (parallel/), and which scenes have nothing to share.

A model of models.py with what differs: the solver, and a method whose work is the grid's.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from ...errors import CaseError
from ...parallel.ranks import ours
from .. import grid as grids
from ..flow import flow_parts
from .navier_stokes import NavierStokesModel
from .on_grid import GridModel
from .stokes import StokesModel

if TYPE_CHECKING:
    from ...case.schema import Case
    from ...fluids.base import Fluid
    from ...fluids.immersed_boundary import Immersed
    from ...fluids.stokes import Solver
    from ...parallel.table import SharedSpace
    from ..stacked import RodStack
    from .base import FluidModel

SHARED_METHODS = ("fft", "krylov")
_ALONE = "run it with one process, without mpiexec"
_BOTH = 'fluid.method = "fft" or "krylov"'


def among(model: type[FluidModel], case: Case) -> FluidModel:
    """The model of a case's fluid for the processes of this run. Raises CaseError where they have nothing to share."""
    ranks = ours()
    if ranks is None:
        return model(case)
    found = next((kind for kind in (SharedStokes, SharedNavierStokes) if issubclass(kind, model)), None)
    if found is None:
        raise _refused(case, f"fluid {case.fluid.words} has no periodic grid for {ranks.size} processes")
    if case.bodies:
        raise _refused(case, f"bodies: {ranks.size} processes share a grid, and with bodies none is at work")
    if case.thermal is not None:
        raise _refused(case, f"thermal: {ranks.size} processes share no thermal forces yet")
    return found(case)


def _refused(case: Case, why: str) -> CaseError:
    return CaseError([f"{case.file}: {why}: nothing to share; {_ALONE}"])


class SharedGrid(GridModel):
    """A grid that is shared."""

    @cached_property
    def space(self) -> SharedSpace:
        """The periodic box. Raises CaseError where ``thickness`` has no cells, or the grid not one for each process."""
        from ...parallel.table import SharedSpace

        made, ranks = grids.periodic_space(self.case), ours()
        assert ranks is not None
        least = min(made.cells[:2])
        if ranks.size > least:
            why = f"{ranks.size} processes share planes of the grid, of which {least} is the least along x and y"
            raise CaseError([f"{self.case.file}: fluid.cells: {why}; allowed: mpiexec -n {least} at most"])
        return SharedSpace(made.box, made.cells, ranks)


class SharedStokes(SharedGrid, StokesModel):
    """Stokes flow by FFTs of a grid that is shared."""

    def method(self, rods: RodStack) -> str:
        """The case's, or the cheapest by counts. Raises CaseError where that transforms no whole grid."""
        asked, ranks = self.case.fluid.method, ours()
        assert ranks is not None
        if asked in SHARED_METHODS:
            return asked
        seconds = self.seconds(rods)
        if asked != "auto":
            raise _refused(
                self.case, f'fluid.method = "{asked}": {ranks.size} processes share whole transforms, {_BOTH}'
            )
        if min(seconds, key=lambda name: seconds[name]) == "table":
            why = f"for {len(rods.s)} nodes the exact table is the quickest, and {ranks.size} processes do not share it"
            raise _refused(self.case, f'fluid.method = "auto": {why} ({_BOTH})')
        return min(SHARED_METHODS, key=lambda name: seconds[name])

    def solver(self, rods: RodStack, method: str) -> Solver:
        """That of all processes."""
        from ...parallel.stokes import Placed, SharedStokesSolve, share

        vectors = 2 if self.case.couples_torque else 1
        shared = share(self.space.ranks, self.grid, vectors, self.case.compute.threads)
        return SharedStokesSolve(shared, Placed(shared), self.case.fluid.viscosity)


class SharedNavierStokes(SharedGrid, NavierStokesModel):
    """Navier-Stokes flow on a grid that is shared; whichever method answers to forces, the fluid's own motion is."""

    def fluid(self, rods: RodStack, immersed: Immersed, method: str) -> Fluid:
        """That of all processes."""
        from ...parallel import navier_stokes as shared
        from ...parallel.stokes import SharedStokesSolve

        ranks, threads = self.space.ranks, self.case.compute.threads
        workspace = shared.SharedWorkspace(ranks, immersed, self.grid, self.density, threads)
        background = None
        if immersed.flow is not None:
            background = shared.SharedBackground(workspace, immersed.flow, flow_parts(self.case))

        def solver(alpha: float) -> Solver:
            return SharedStokesSolve(*workspace.solves(ranks, immersed), immersed.viscosity, alpha)

        operator = self.operators(rods, immersed, method, solver)
        return shared.SharedNavierStokes(immersed, self.density, operator, workspace, background)
