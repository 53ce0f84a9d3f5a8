"""From a case to what a run needs: the rods stacked, their law, ends and loads, the fluid, the scheme.

What the case does not name is not built here, so the step asks nothing about it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from . import laws, rft, shapes, stepping
from .assemble_loads import loads, number, triple
from .case_filament import ZERO
from .case_schema import Matched
from .ends import EndOf, HeldEnds, Turn, spinning, steady, turned
from .geometry import Geometry
from .mechanics import Mechanics
from .rods import Mesh, Segmented, stack

if TYPE_CHECKING:
    from .case_filament import Filament
    from .case_schema import Case
    from .expressions import Expression
    from .fluid import Fluid
    from .grid import Grid
    from .kernels import Kernel
    from .mechanics import Law


@dataclass(frozen=True)
class Stacked:
    """The rods of a scene: names and node ranges of its filaments, arclength (n,), and the whole of their mechanics."""

    names: tuple[str, ...]
    filaments: tuple[Filament, ...]
    nodes: tuple[slice, ...]
    s: np.ndarray
    mechanics: Mechanics
    start: Geometry

    @property
    def spacing(self) -> np.ndarray:
        """Distance between nodes about each node (n,): its control volume, twice that at an end."""
        mesh = self.mechanics.mesh
        ends = ~mesh.joined | ~np.append(False, mesh.joined[:-1])
        return np.where(ends, 2.0, 1.0) * mesh.volume


def _pieces(
    filaments: Sequence[Filament], nodes: Sequence[slice], s: np.ndarray, pick: Callable[[Filament], Expression]
) -> list[tuple[slice, Callable, np.ndarray]]:
    """One function of (s, t) for each run of filaments that share an expression."""
    runs: list[tuple[slice, Expression]] = []
    for filament, where in zip(filaments, nodes, strict=True):
        expression = pick(filament)
        if runs and runs[-1][1] == expression:
            runs[-1] = (slice(runs[-1][0].start, where.stop), expression)
        else:
            runs.append((where, expression))
    return [(where, expression.bind("s", "t"), s[where]) for where, expression in runs]


def _field(filaments, nodes, s: np.ndarray, pick: Callable[[Filament], Expression]) -> laws.Field:
    """A field of time over all nodes; evaluated once where nothing in it depends on time."""
    field = laws.gather(_pieces(filaments, nodes, s, pick), s.shape)
    if any("t" in pick(f).variables for f in filaments):
        return field
    fixed = np.broadcast_to(field(0.0), s.shape).copy()
    return lambda t: fixed


def _along(filaments, nodes, s: np.ndarray, pick: Callable[[Filament], Expression]) -> np.ndarray:
    """A property along the rods (n,)."""
    return np.broadcast_to(_field(filaments, nodes, s, pick)(0.0), s.shape).astype(float)


def _alone(expression: Expression, s: np.ndarray) -> np.ndarray:
    """A property along one filament (k,)."""
    return np.broadcast_to(expression.bind("s")(s), s.shape).astype(float)


def _half(values: np.ndarray) -> np.ndarray:
    """Values at half nodes from values at nodes, by the mean; the entry between two filaments is never used."""
    return np.append(0.5 * (values[1:] + values[:-1]), values[-1])


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


def _place(case: Case) -> tuple[list[slice], list[np.ndarray], list[np.ndarray], list[np.ndarray]]:
    """Node ranges, arclengths, start positions and directors of the filaments."""
    nodes, arclengths, positions, directors = [], [], [], []
    offset = 0
    for name, filament in case.filaments.items():
        key = f"{case.file}: filament.{name}"
        s = shapes.node_arclength(filament, key)
        r, e1 = shapes.initial_shape(filament, key, Path(case.file).parent)
        nodes.append(slice(offset, offset + len(s)))
        offset += len(s)
        arclengths.append(s)
        positions.append(r)
        directors.append(e1)
    return nodes, arclengths, positions, directors


def _mesh(case: Case, arclengths: Sequence[np.ndarray]) -> Mesh:
    """The stencils, with the tangents of clamped ends: those given, else those the start shape has there."""
    parts = []
    for (name, filament), s in zip(case.filaments.items(), arclengths, strict=True):
        held: list[np.ndarray | None] = [None, None]
        if "clamped" in (filament.start.end, filament.finish.end):
            at = shapes.end_tangents(filament, f"{case.file}: filament.{name}", Path(case.file).parent)
            for k, end in enumerate((filament.start, filament.finish)):
                if end.end == "clamped":
                    held[k] = at[k] if end.tangent is None else np.array(end.tangent) / np.linalg.norm(end.tangent)
        parts.append(Segmented(s, filament.derivative, *held))
    return stack(parts)


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


def _internal(filament: Filament, part: int) -> Expression:
    """The internal moment along e1 (0) or e2 (1); zero where the filament has none."""
    if filament.loads is None or filament.loads.internal_moment is None:
        return ZERO
    return filament.loads.internal_moment[part]


def rods(case: Case) -> Stacked:
    """All filaments of the case, placed and stacked. Raises CaseError for shapes that cannot be made."""
    names, filaments = tuple(case.filaments), tuple(case.filaments.values())
    nodes, arclengths, positions, directors = _place(case)
    s = np.concatenate(arclengths)
    mesh = _mesh(case, arclengths)
    unknowns = 4 if any(f.twisting is not None for f in filaments) else 3
    ends, free = _ends(filaments, nodes, unknowns)
    bending = np.stack([_along(filaments, nodes, s, lambda f, a=a: f.bending[a]) for a in (0, 1)], axis=1)  # type: ignore[misc]
    torsion = np.zeros(len(s))
    for filament, where in zip(filaments, nodes, strict=True):
        if filament.twisting is not None:
            at = slice(where.start, where.stop - 1)
            torsion[at] = _half(_alone(filament.twisting, s[where]))[:-1]
    law: Law = laws.Linear(
        bending,
        torsion,
        (
            _field(filaments, nodes, s, lambda f: f.curvature[0]),
            _field(filaments, nodes, s, lambda f: f.curvature[1]),
        ),
        _field(filaments, nodes, s, lambda f: f.twist_rate),
    )
    if any(f.loads is not None and f.loads.internal_moment is not None for f in filaments):
        along_e1 = _field(filaments, nodes, s, lambda f: _internal(f, 0))
        law = laws.Driven(law, (along_e1, _field(filaments, nodes, s, lambda f: _internal(f, 1))))
    stretching = _half(_along(filaments, nodes, s, lambda f: f.stretching))
    length = min(f.length for f in filaments)
    kind = Mechanics
    if filaments[0].force == "torque-free":
        from .torque_free import TorqueFree

        kind = TorqueFree
    forces = loads(filaments, nodes, s, mesh, positions)
    mechanics = kind(mesh, law, stretching, free, ends, forces, unknowns, length)
    start = mechanics.start(np.concatenate(positions), np.concatenate(directors))
    return Stacked(names, filaments, tuple(nodes), s, mechanics, start)


def drag_coefficients(case: Case, filament: Filament, radius: np.ndarray | None) -> tuple[float, float, np.ndarray]:
    """Drag per length across and along the rod, and against spin (k,): "paper", "slender" (Sec. 7.5) or explicit."""
    eta, drag = case.fluid.viscosity, case.fluid.drag
    spin = np.zeros(1) if radius is None else 4 * np.pi * eta * radius**2
    if drag == "paper":
        return 4 * np.pi * eta, 2 * np.pi * eta, spin
    if drag == "slender":
        if radius is None:
            raise ValueError("slender drag needs a radius")
        perp = 8 * np.pi * eta / np.log(filament.length**2 / (4 * float(np.mean(radius)) ** 2 * np.e))
        return perp, 0.5 * perp, spin
    assert not isinstance(drag, Matched)  # refused by not_built
    return drag.perp, drag.par, spin if drag.spin is None else np.full(1, drag.spin)


def drag(case: Case, stacked: Stacked) -> rft.Drag:
    """The drag of every node: coefficients times control volumes."""
    volume = stacked.mechanics.mesh.volume
    out = rft.Drag(*(np.zeros(len(volume)) for _ in range(3)))
    for filament, where in zip(stacked.filaments, stacked.nodes, strict=True):
        s = stacked.s[where]
        radius = None
        if filament.radius is not None:
            radius = _alone(filament.radius, s)
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


def kernel(case: Case) -> Kernel:
    """The discrete delta kernel of the case."""
    from .kernels import KERNELS

    return KERNELS[case.fluid.kernel]


def fluid(case: Case, stacked: Stacked) -> tuple[Fluid, str, Grid | None]:
    """The fluid of the case, the method chosen, and its grid (None in RFT)."""
    if case.fluid.model == "rft":
        return rft.ResistiveForce(drag(case, stacked), stacked.mechanics.profile, flow(case)), "rft", None
    from . import stokes
    from .grid import Grid

    assert case.fluid.box is not None
    assert case.fluid.cells is not None
    grid, eta = Grid(case.fluid.box, case.fluid.cells), case.fluid.viscosity
    slip = stokes.slip_mobility(case.fluid.slip, kernel(case), grid, eta, stacked.spacing)
    spin = drag(case, stacked).spin if stacked.mechanics.unknowns == 4 else None
    immersed = stokes.Immersed(grid, kernel(case), eta, slip, spin, flow(case))
    if case.fluid.method == "fft":
        solve = stokes.StokesSolve(grid, eta, case.compute.threads)
        return stokes.StokesByFFT(immersed, solve), "fft", grid
    return stokes.StokesByTable(immersed), "table", grid


def stepper(case: Case) -> stepping.Stepper:
    """The scheme of the case."""
    if case.time.scheme == "explicit":
        return stepping.Explicit()
    if case.time.scheme == "semi-implicit":
        return stepping.SemiImplicit()
    return stepping.Implicit(case.time.order)
