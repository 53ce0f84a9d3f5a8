"""From a case to its fluid: the drag of each node in RFT, or what finds the velocities on the grid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import assemble_grid, costs, rft
from .assemble_loads import triple
from .assemble_profiles import alone
from .case_schema import Coefficients, Matched
from .errors import CaseError

if TYPE_CHECKING:
    from . import stokes
    from .assemble import Stacked
    from .case_filament import Filament
    from .case_schema import Case
    from .fields import GridFields
    from .fluid import Flow, Fluid
    from .grid import Grid
    from .matched_drag import Match


def drag_coefficients(case: Case, filament: Filament, radius: np.ndarray | None) -> tuple[float, float, np.ndarray]:
    """Drag per length across and along the rod, and against spin (k,): paper, slender (Sec. 7.5), given, matched."""
    eta, drag = case.fluid.viscosity, case.fluid.drag
    spin = np.zeros(1) if radius is None else 4 * np.pi * eta * radius**2
    if isinstance(drag, Coefficients):
        return drag.perp, drag.par, spin if drag.spin is None else np.full(1, drag.spin)
    found = matching(case, filament)
    if found is not None:
        if radius is not None and found.spin:
            spin = eta * found.spin * (radius / np.mean(radius)) ** 2
        return eta * found.perp, eta * found.par, spin
    if drag == "slender":
        if radius is None:
            raise ValueError("slender drag needs a radius")
        perp = 8 * np.pi * eta / np.log(filament.length**2 / (4 * float(np.mean(radius)) ** 2 * np.e))
        return perp, 0.5 * perp, spin
    return 4 * np.pi * eta, 2 * np.pi * eta, spin


def matching(case: Case, filament: Filament) -> Match | None:
    """The drag of a straight rod in the case's grid; None where RFT does not take its drag from there.

    Raises CaseError where the grid cannot tell it.
    """
    drag = case.fluid.drag
    if case.fluid.model != "rft" or not isinstance(drag, Matched):
        return None
    from . import matched_drag

    box, cells = case.fluid.box, case.fluid.cells or assemble_grid.cells_of_thickness(case)
    assert box is not None
    nodes, radius = 1 + round(drag.matched * (filament.nodes - 1) / filament.length), 0.0
    if case.fluid.rotation == "grid" and filament.twisting is not None and filament.radius is not None:
        radius = float(np.mean(alone(filament.radius, np.linspace(0.0, filament.length, filament.nodes))))
    rod = matched_drag.Rod(drag.matched, nodes, box, cells, case.fluid.kernel, case.fluid.slip, radius)
    try:
        return matched_drag.match(rod)
    except ValueError as error:
        allowed = "slip = 0.01, fewer nodes or more cells"
        raise CaseError([f"{case.file}: fluid.drag: {error}; allowed: {allowed}"]) from None


def drag(case: Case, stacked: Stacked) -> rft.Drag:
    """The drag of every node: coefficients times control volumes."""
    volume = stacked.mechanics.mesh.volume
    out = rft.Drag(*(np.zeros(len(volume)) for _ in range(3)))
    for filament, where in zip(stacked.filaments, stacked.nodes, strict=True):
        s = stacked.s[where]
        radius = None
        if filament.radius is not None:
            radius = alone(filament.radius, s)
        for field, value in zip(out, drag_coefficients(case, filament, radius), strict=True):
            field[where] = value * volume[where]
    # A filament that does not twist has its turn held; any positive drag will do for the row.
    out.spin[out.spin == 0] = 1.0
    return out


def flow(case: Case) -> Flow | None:
    """The background velocity (k, 3) at places r (k, 3) and a time; None where the case has none."""
    if case.fluid.flow is None:
        return None
    velocity = triple(case.fluid.flow, "x", "y", "z", "t")
    return lambda r, t: velocity(*r.T, t)


def fluid(case: Case, stacked: Stacked) -> tuple[Fluid, str, Grid | None]:
    """The fluid of the case, the method chosen, and its grid (None in RFT)."""
    if case.fluid.model == "rft":
        return rft.ResistiveForce(drag(case, stacked), stacked.mechanics.profile, flow(case)), "rft", None
    from . import immersed_boundary, stokes
    from .grid import Grid

    assert case.fluid.box is not None
    grid, eta = Grid(case.fluid.box, case.fluid.cells or assemble_grid.cells_of_thickness(case)), case.fluid.viscosity
    volume = stacked.mechanics.mesh.volume
    slip = immersed_boundary.slip_mobility(case.fluid.slip, assemble_grid.kernel(case), grid, eta, volume)
    against = stacked.mechanics.unknowns == 4 and not assemble_grid.couples_torque(case)
    spin = drag(case, stacked).spin if against else None
    number = np.float32 if case.fluid.precision == "single" else np.float64
    coupled, delta = assemble_grid.coupling(case, stacked), assemble_grid.kernel(case)
    made = immersed_boundary.Immersed(grid, delta, eta, slip, spin, flow(case), stacked.nodes, number, coupled)
    seconds = method_seconds(case, stacked, grid)
    # The averaged table is an approximation: on request only.
    exact = [name for name in seconds if name != "averaged"]
    method = case.fluid.method if case.fluid.method != "auto" else min(exact, key=lambda name: seconds[name])
    if case.fluid.model == "navier-stokes":
        from .assemble_inertia import navier_stokes

        return navier_stokes(case, made, method, _factor_cost(case, stacked, grid)), method, grid
    if method == "table":
        return stokes.StokesByTable(made), method, grid
    if method == "averaged":
        return stokes.StokesByAverage(made), method, grid
    solver = _solver(case, stacked, grid, method)
    if method == "krylov":
        return stokes.StokesByKrylov(made, solver, _factor_cost(case, stacked, grid)), method, grid
    return stokes.StokesByFFT(made, solver), method, grid


def _solver(case: Case, stacked: Stacked, grid: Grid, method: str) -> stokes.Solver:
    """What evaluates velocities by FFT: of the whole grid, or where that is cheaper of the filaments' bounding box."""
    eta, threads = case.fluid.viscosity, case.compute.threads
    if assemble_grid.couples_torque(case):
        from .torque_coupling import TorqueStokesSolve

        return TorqueStokesSolve(grid, eta, threads)
    if method == "fft" or (method == "krylov" and not fills_little(case, stacked, grid)):
        from .stokes import StokesSolve

        return StokesSolve(grid, eta, threads)
    from .pruned import PrunedSolve

    return PrunedSolve(grid, eta, threads)


def fields(case: Case, fluid: Fluid, grid: Grid) -> GridFields:
    """What makes the fields of the fluid that the case has, for output."""
    from .fields import GridFields
    from .fields_inertia import InertialFields
    from .navier_stokes import NavierStokes

    if isinstance(fluid, NavierStokes):
        return InertialFields(fluid, flow(case), case.compute.threads)
    return GridFields(grid, case.fluid.viscosity, flow(case), case.compute.threads)


def _box(case: Case, stacked: Stacked, grid: Grid) -> list[int]:
    """Extents, in cells, of the box that holds the filaments' stencils at the start."""
    from .pruned import bounding_box

    base, _ = assemble_grid.kernel(case).stencil(grid.coordinates(stacked.start.r))
    return bounding_box(base, assemble_grid.kernel(case).points, grid.cells)[1]


def method_seconds(case: Case, stacked: Stacked, grid: Grid | None) -> dict[str, float]:
    """Estimated seconds of a step by each method that the fluid has, from counts."""
    rods = [where.stop - where.start for where in stacked.nodes]
    if grid is None:
        return costs.seconds_a_step(case, rods)
    cells, sizes = grid.cells.tolist(), _box(case, stacked, grid)
    return costs.seconds_a_step(case, rods, cells, sizes, assemble_grid.parts(case))


def _factor_cost(case: Case, stacked: Stacked, grid: Grid) -> float:
    """What factoring the rods' own systems costs, in velocity evaluations."""
    evaluation = costs.evaluation(grid.cells.tolist(), _box(case, stacked, grid), len(stacked.s))
    parts = assemble_grid.parts(case)
    return sum(costs.factored(where.stop - where.start, parts) for where in stacked.nodes) / evaluation


def fills_little(case: Case, stacked: Stacked, grid: Grid) -> bool:
    """Whether transforms of the filaments' bounding box alone are the cheaper ones."""
    cells = grid.cells.tolist()
    return costs.pruned_evaluation(cells, _box(case, stacked, grid)) < costs.full_evaluation(cells)
