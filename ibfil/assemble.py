"""From a case to what a run needs: the rods stacked, their law, ends and loads, the fluid, the scheme.

What the case does not name is not built here, so the step asks nothing about it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from . import assemble_grid, assemble_laws, costs, rft, shape_copies, shapes, stepping
from .along import alone, along, half
from .assemble_loads import loads, number, triple
from .case_filament import copy_name
from .case_schema import Coefficients, Matched
from .ends import EndOf, HeldEnds, Turn, spinning, steady, turned
from .errors import CaseError
from .geometry import Geometry
from .mechanics import Mechanics
from .mesh import Segmented, stack

if TYPE_CHECKING:
    from . import stokes
    from .case_filament import Filament
    from .case_schema import Case
    from .contact import Contact
    from .fields import GridFields
    from .fluid import Fluid
    from .grid import Grid
    from .laws import MomentLaw
    from .matched import Match
    from .thermal import Noise


@dataclass(frozen=True)
class Stacked:
    """The rods of a scene: names and node ranges of its filaments, arclength (n,), and the whole of their mechanics."""

    names: tuple[str, ...]
    filaments: tuple[Filament, ...]
    nodes: tuple[slice, ...]
    s: np.ndarray
    mechanics: Mechanics
    start: Geometry
    contact: Contact | None

    @property
    def spacing(self) -> np.ndarray:
        """Distance between nodes about each node (n,): its control volume, twice that at an end."""
        mesh = self.mechanics.mesh
        ends = ~mesh.joined | ~np.append(False, mesh.joined[:-1])
        return np.where(ends, 2.0, 1.0) * mesh.volume


def _turn(end) -> Turn | None:
    """How e1 turns at a held end; None where it is free."""
    if end.end != "clamped" or end.twist == "free":
        return None
    if end.angle is not None:
        return turned(number(end.angle))
    if end.spin is None:
        return steady(0.0)
    if end.spin.constant is not None:
        return steady(end.spin.constant)
    return spinning(number(end.spin))


Tangents = tuple[np.ndarray | None, np.ndarray | None]


class Placed(NamedTuple):
    """One filament where it starts: name, arclength (k,), positions and directors (k, 3), tangents of its clamps."""

    name: str
    filament: Filament
    s: np.ndarray
    r: np.ndarray
    e1: np.ndarray
    held: tuple[np.ndarray | None, ...]


def _place(case: Case) -> list[Placed]:
    """All filaments, copies one by one. Raises CaseError for shapes that cannot be made."""
    out = []
    for name, filament in case.filaments.items():
        key, folder = f"{case.file}: filament.{name}", Path(case.file).parent
        s = shapes.node_arclength(filament, key)
        r, e1 = shapes.initial_shape(filament, key, folder)
        held = _clamp_tangents(filament, key, folder)
        if filament.copies is None:
            out.append(Placed(name, filament, s, r, e1, held))
            continue
        for k, turn, shift in shape_copies.places(filament.copies, filament.position, key, folder):
            moved = (r - filament.position) @ turn.T + shift
            turned = tuple(None if t is None else turn @ t for t in held)
            out.append(Placed(copy_name(name, k), filament, s, moved, e1 @ turn.T, turned))
    return out


def _clamp_tangents(filament: Filament, key: str, folder: Path) -> Tangents:
    """The tangents that clamped ends hold: those given, else those the start shape has there."""
    ends = (filament.start, filament.finish)
    if "clamped" not in (end.end for end in ends):
        return None, None
    at = shapes.end_tangents(filament, key, folder)
    held = []
    for own, end in zip(at, ends, strict=True):
        given = own if end.tangent is None else np.array(end.tangent) / np.linalg.norm(end.tangent)
        held.append(given if end.end == "clamped" else None)
    return held[0], held[1]


def _ends(filaments, nodes, unknowns: int) -> tuple[HeldEnds, np.ndarray]:
    """The held unknowns, and the mask (n,) of end nodes that carry no moment."""
    held, free = [], np.zeros(nodes[-1].stop, bool)
    idle: list[int] = []
    for filament, where in zip(filaments, nodes, strict=True):
        for end, node in ((filament.start, where.start), (filament.finish, where.stop - 1)):
            free[node] = end.end != "clamped"
            if end.end != "free":
                moves = None if end.moves is None else triple(end.moves, "t")
                held.append(EndOf(node, _turn(end), moves))
        if unknowns == 4 and filament.twisting is None:
            idle += range(where.start, where.stop)
    return HeldEnds(held, unknowns, np.array(idle, np.int64)), free


def _segmented(placed: Placed, thermal: bool) -> Segmented:
    """A filament for the stack. Equipartition asks for a symmetric stiffness, which order 2 has with ghost nodes."""
    derivative = placed.filament.derivative
    return Segmented(placed.s, derivative, placed.held[0], placed.held[1], thermal and derivative == 2)


def rods(case: Case, given: Mapping[str, MomentLaw] = MappingProxyType({})) -> Stacked:
    """All filaments of the case, placed and stacked; ``given`` are laws made in Python, by filament.

    Raises CaseError for shapes that cannot be made and laws of filaments there are not.
    """
    for name in set(given) - set(case.filaments):
        raise CaseError([f"{case.file}: laws: found {name}; allowed: one of {', '.join(case.filaments)}"])
    placed = _place(case)
    filaments, positions = tuple(p.filament for p in placed), [p.r for p in placed]
    offsets = np.cumsum([0] + [len(p.s) for p in placed]).tolist()
    nodes = [slice(a, b) for a, b in pairwise(offsets)]
    s = np.concatenate([p.s for p in placed])
    mesh = stack([_segmented(p, case.thermal is not None) for p in placed])
    unknowns = 4 if any(f.twisting is not None for f in filaments) else 3
    ends, free = _ends(filaments, nodes, unknowns)
    own = [next((law for name, law in given.items() if case.filaments[name] is f), None) for f in filaments]
    law = assemble_laws.law(filaments, nodes, s, mesh, own)
    stretching = half(along(filaments, nodes, s, lambda f: f.stretching))
    length = min(f.length for f in filaments)
    kind = Mechanics
    if filaments[0].force == "torque-free":
        from .torque_free import TorqueFree

        kind = TorqueFree
    forces, names = loads(filaments, nodes, s, mesh, positions), tuple(p.name for p in placed)
    touching = None
    if case.contact is not None:
        from . import contact

        touching = contact.build(case, names, filaments, nodes, s)
        forces += touching.loads()
    mechanics = kind(mesh, law, stretching, free, ends, forces, unknowns, length)
    start = mechanics.start(np.concatenate(positions), np.concatenate([p.e1 for p in placed]))
    return Stacked(names, filaments, tuple(nodes), s, mechanics, start, touching)


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
    from . import matched

    box, cells = case.fluid.box, case.fluid.cells or assemble_grid.cells_of_thickness(case)
    assert box is not None
    nodes, radius = 1 + round(drag.matched * (filament.nodes - 1) / filament.length), 0.0
    if case.fluid.rotation == "grid" and filament.twisting is not None and filament.radius is not None:
        radius = float(np.mean(alone(filament.radius, np.linspace(0.0, filament.length, filament.nodes))))
    rod = matched.Rod(drag.matched, nodes, box, cells, case.fluid.kernel, case.fluid.slip, radius)
    try:
        return matched.match(rod)
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


def flow(case: Case) -> Callable[[np.ndarray, float], np.ndarray] | None:
    """The background velocity (k, 3) at places r (k, 3) and a time; None where the case has none."""
    if case.fluid.flow is None:
        return None
    velocity = triple(case.fluid.flow, "x", "y", "z", "t")
    return lambda r, t: velocity(*r.T, t)


def fluid(case: Case, stacked: Stacked) -> tuple[Fluid, str, Grid | None]:
    """The fluid of the case, the method chosen, and its grid (None in RFT)."""
    if case.fluid.model == "rft":
        return rft.ResistiveForce(drag(case, stacked), stacked.mechanics.profile, flow(case)), "rft", None
    from . import immersed, stokes
    from .grid import Grid

    assert case.fluid.box is not None
    grid, eta = Grid(case.fluid.box, case.fluid.cells or assemble_grid.cells_of_thickness(case)), case.fluid.viscosity
    slip = immersed.slip_mobility(case.fluid.slip, assemble_grid.kernel(case), grid, eta, stacked.spacing)
    against = stacked.mechanics.unknowns == 4 and not assemble_grid.couples_torque(case)
    spin = drag(case, stacked).spin if against else None
    number = np.float32 if case.fluid.precision == "single" else np.float64
    coupled, delta = assemble_grid.coupling(case, stacked), assemble_grid.kernel(case)
    made = immersed.Immersed(grid, delta, eta, slip, spin, flow(case), stacked.nodes, number, coupled)
    seconds = method_seconds(case, stacked, grid)
    # The averaged table is an approximation: on request only.
    exact = [name for name in seconds if name != "averaged"]
    method = case.fluid.method if case.fluid.method != "auto" else min(exact, key=lambda name: seconds[name])
    if case.fluid.model == "navier-stokes":
        from .assemble_inertia import navier_stokes

        return navier_stokes(case, made, method, _worth(case, stacked, grid)), method, grid
    if method == "table":
        return stokes.StokesByTable(made), method, grid
    if method == "averaged":
        return stokes.StokesByAverage(made), method, grid
    solver = _solver(case, stacked, grid, method)
    if method == "krylov":
        return stokes.StokesByKrylov(made, solver, _worth(case, stacked, grid)), method, grid
    return stokes.StokesByFFT(made, solver), method, grid


def _solver(case: Case, stacked: Stacked, grid: Grid, method: str) -> stokes.Solver:
    """What evaluates velocities by FFT: of the whole grid, or where that is cheaper of the filaments' bounding box."""
    eta, threads = case.fluid.viscosity, case.compute.threads
    if assemble_grid.couples_torque(case):
        from .torque_coupling import StirredSolve

        return StirredSolve(grid, eta, threads)
    if method == "fft" or (method == "krylov" and not fills_little(case, stacked, grid)):
        from .stokes import StokesSolve

        return StokesSolve(grid, eta, threads)
    from .pruned import PrunedSolve

    return PrunedSolve(grid, eta, threads)


def fields(case: Case, fluid: Fluid, grid: Grid) -> GridFields:
    """What makes the fields of the fluid that the case has, for output."""
    from .fields import GridFields
    from .inertial_fields import InertialFields
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


def _worth(case: Case, stacked: Stacked, grid: Grid) -> float:
    """What factoring the rods' own systems costs, in velocity evaluations."""
    evaluation = costs.evaluation(grid.cells.tolist(), _box(case, stacked, grid), len(stacked.s))
    parts = assemble_grid.parts(case)
    return sum(costs.factored(where.stop - where.start, parts) for where in stacked.nodes) / evaluation


def fills_little(case: Case, stacked: Stacked, grid: Grid) -> bool:
    """Whether transforms of the filaments' bounding box alone are the cheaper ones."""
    cells = grid.cells.tolist()
    return costs.pruned_evaluation(cells, _box(case, stacked, grid)) < costs.full_evaluation(cells)


def noise(case: Case, stacked: Stacked) -> Noise | None:
    """The thermal noise of the case; None where it has none."""
    thermal = case.thermal
    if thermal is None:
        return None
    from .thermal import Noise

    mechanics = stacked.mechanics
    return Noise(
        drag(case, stacked),
        mechanics.mesh,
        mechanics.ends.index,
        mechanics.unknowns,
        thermal.energy,
        thermal.seed,
        thermal.directions == "xy",
        thermal.twist,
    )


def stepper(case: Case, noise: Noise | None) -> stepping.Stepper:
    """The scheme of the case; with thermal forces the one that keeps their statistics."""
    if noise is not None:
        from .thermal import Trapezoid

        return Trapezoid(noise)
    if case.time.scheme == "explicit":
        return stepping.Explicit()
    if case.time.scheme == "semi-implicit":
        return stepping.SemiImplicit()
    return stepping.Implicit(case.time.order)
