"""From a case to the Navier-Stokes fluid and its fields."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import stokes
from .assemble_loads import number, triple
from .navier_stokes import Background, NavierStokes, Part, Room
from .separation import products
from .torque_coupling import TorqueStokesSolve

if TYPE_CHECKING:
    from .case_schema import Case
    from .immersed_boundary import Immersed
    from .separation import Product


def navier_stokes(case: Case, made: Immersed, method: str, factor_cost: float) -> NavierStokes:
    """The fluid, its forces answered by ``method``; what transforms whole fields shares one room for it.

    ``factor_cost``: what a preconditioner of krylov costs, in velocity evaluations.
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
            solver = TorqueStokesSolve(made.grid, made.viscosity, threads, alpha, shared)
        if method == "krylov":
            return stokes.StokesByKrylov(made, solver, factor_cost, alpha)
        return stokes.StokesByFFT(made, solver, alpha)

    assert case.fluid.density is not None
    background = None
    if made.flow is not None:
        background = Background(made.grid, made.flow, flow_parts(case), threads)
    return NavierStokes(made, case.fluid.density, operator, room, background)


def flow_parts(case: Case) -> list[Part] | None:
    """What the case's background flow is the sum of: fixed fields times factors in time; None: it is no such sum."""
    found = products(case.fluid.flow or ())
    return None if found is None else [_part(one) for one in found]


def _part(one: Product) -> Part:
    place = triple(one.place, "x", "y", "z")
    return Part(None if one.factor.constant else number(one.factor), lambda r: place(*r.T))
