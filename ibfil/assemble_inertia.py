"""From a case to the Navier-Stokes fluid and its fields."""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import stokes
from .navier_stokes import FIELDS, Background, NavierStokes, Room
from .torque_coupling import StirredSolve
from .transforms import VectorTransform

if TYPE_CHECKING:
    from .case_schema import Case
    from .immersed import Immersed


def navier_stokes(case: Case, made: Immersed, method: str, worth: float) -> NavierStokes:
    """The fluid, its forces answered by ``method``; all that transforms fields shares one room for it.

    ``worth``: what a preconditioner of krylov costs, in velocity evaluations.
    """
    (nx, ny, nz), threads = (int(n) for n in made.grid.cells), case.compute.threads
    flow = VectorTransform((nx, ny, nz), threads, fields=FIELDS)
    spin = VectorTransform((nx, ny, nz), threads) if made.coupling.vectors == 2 else None

    def operator(alpha: float) -> stokes.Tabulated:
        if method == "table":
            return stokes.StokesByTable(made, alpha)
        solver: stokes.Solver
        if spin is None:
            solver = stokes.StokesSolve(made.grid, made.viscosity, threads, alpha=alpha, transform=flow)
        else:
            solver = StirredSolve(made.grid, made.viscosity, threads, alpha, (flow, spin))
        if method == "krylov":
            return stokes.StokesByKrylov(made, solver, worth, alpha)
        return stokes.StokesByFFT(made, solver, alpha)

    assert case.fluid.density is not None
    background = None
    if made.flow is not None:
        steady = not any("t" in component.variables for component in case.fluid.flow or ())
        background = Background(made.grid, made.flow, steady, threads)
    return NavierStokes(made, case.fluid.density, operator, Room(flow, spin, made.grid, threads), background)
