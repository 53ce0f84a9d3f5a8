"""From a case to the Navier-Stokes fluid and its fields."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import stokes
from .navier_stokes import Background, NavierStokes, Room
from .torque_coupling import StirredSolve

if TYPE_CHECKING:
    from .case_schema import Case
    from .immersed import Immersed


def navier_stokes(case: Case, made: Immersed, method: str, worth: float) -> NavierStokes:
    """The fluid, its forces answered by ``method``; what transforms whole fields shares one room for it.

    ``worth``: what a preconditioner of krylov costs, in velocity evaluations.
    """
    threads = case.compute.threads
    room = Room(made.grid, made.coupling.vectors, threads, made.number)
    shared = room.flow if made.number is np.float64 else None  # solvers by FFT are exact to round-off

    def operator(alpha: float) -> stokes.Tabulated:
        if method == "table":
            return stokes.StokesByTable(made, alpha)
        solver: stokes.Solver
        if made.coupling.vectors == 1:
            solver = stokes.StokesSolve(made.grid, made.viscosity, threads, alpha=alpha, transform=shared)
        else:
            solver = StirredSolve(made.grid, made.viscosity, threads, alpha, shared)
        if method == "krylov":
            return stokes.StokesByKrylov(made, solver, worth, alpha)
        return stokes.StokesByFFT(made, solver, alpha)

    assert case.fluid.density is not None
    background = None
    if made.flow is not None:
        steady = not any("t" in component.variables for component in case.fluid.flow or ())
        background = Background(made.grid, made.flow, steady, threads)
    return NavierStokes(made, case.fluid.density, operator, room, background)
