"""What a run takes: bytes of memory and disk, and the share of each modelled term in a step. Counted, not measured.

Only what a case names is counted, because only that is built. Shares of time are of one step, outputs spread over
the steps between them; that of the rods and of the fluid are those by which the method is chosen (costs.py), the rest
was measured against them: twisting 0.7 of what bending and stretching take, contact 1.5, noise 0.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from . import assemble_grid, costs

if TYPE_CHECKING:
    from .case_schema import Case
    from .navier_stokes import Part
    from .simulation import Simulation

_TWISTING = 0.7  # of the step of bending and stretching
_CONTACT, _NOISE = 1.5, 0.1  # the same of an implicit one
_DRAG = 0.05
_FIELDS = "fields and their transforms"


@dataclass(frozen=True)
class Term:
    """A term of the model: seconds a step and bytes, from counts."""

    name: str
    seconds: float
    bytes: float


def terms(simulation: Simulation, memory: dict[str, float]) -> list[Term]:
    """Return every term that the case names; ``memory`` are bytes of large arrays by what they are for."""
    case, n = simulation.case, len(simulation.arclength)
    unknowns, band = simulation.mechanics.unknowns, memory["band matrix"]
    rods, implicit = costs.of_rods(case, n), costs.of_rods(case, n, "implicit")
    out = [Term("bending and stretching", rods, band * 9 / unknowns**2)]
    if unknowns == 4:
        out.append(Term("twisting", _TWISTING * rods, band * 7 / 16))
    if case.contact is not None:
        out.append(Term("contact", _CONTACT * implicit, 8.0 * 30 * n))
    if case.thermal is not None:
        out.append(Term("thermal noise", _NOISE * implicit, 8.0 * unknowns * n))
    if simulation.grid is None:
        return [*out, Term("drag of each node", _DRAG * rods, 8.0 * 3 * n)]
    return [*out, *_of_grid(simulation, memory)]


def _of_grid(simulation: Simulation, memory: dict[str, float]) -> list[Term]:
    """The fluid on the grid; with inertia its past and advection apart; and what is put out of it."""
    case, grid = simulation.case, simulation.grid
    assert grid is not None
    cells, out = grid.cells.tolist(), []
    seconds = simulation.method_seconds[simulation.method] - costs.of_rods(case, len(simulation.arclength))
    fields, used = memory.get(_FIELDS, 0.0), {k: v for k, v in memory.items() if k not in ("band matrix", _FIELDS)}
    if case.fluid.model == "navier-stokes":
        past = min(seconds, costs.of_inertia(cells, assemble_grid.parts(case)))
        held = sum(size for name, size in used.items() if "past" in name or "transforms" in name)
        out.append(Term("inertia and advection", past, held))
        seconds, used = seconds - past, {"rest": sum(used.values()) - held}
    puts_out = case.output.grid_every is not None
    size = sum(used.values()) + (0.0 if puts_out else fields)
    torques = ", torques too" if assemble_grid.couples_torque(case) else ""
    out.insert(0, Term(f"flow between nodes{torques} ({simulation.method})", seconds, size))
    look, step = costs.full_evaluation(cells), simulation.step_length
    if case.output.grid_every is not None:
        out.append(Term("fields put out", len(case.output.fields) * look * step / case.output.grid_every, fields))
    if any(one.kind == "dissipation" for one in case.observe.values()):
        every = case.output.every or case.time.end / max(len(case.output.times or ()), 1)
        out.append(
            Term("dissipation looked at", 1.5 * look * step / every, 0.0 if fields else 6 * 8.0 * float(np.prod(cells)))
        )
    return out


def shares(found: list[Term]) -> list[tuple[str, float, float]]:
    """Return (name, share of time, share of memory) of each term."""
    time, size = sum(term.seconds for term in found), sum(term.bytes for term in found)
    return [(term.name, term.seconds / time, term.bytes / size) for term in found]


def memory(simulation: Simulation) -> dict[str, float]:
    """Bytes of the large arrays, by what they are for."""
    case, n, m = simulation.case, len(simulation.arclength), simulation.mechanics.unknowns
    out = {"band matrix": 8.0 * n * m * m * (2 * simulation.mechanics.profile.width + 1)}
    if simulation.grid is None:
        return out
    from .kernels import KERNELS

    cells = simulation.grid.cells
    rim, parts = KERNELS[case.fluid.kernel].points - 1, assemble_grid.parts(case)
    number = 4.0 if case.fluid.precision == "single" else 8.0
    out["mobility table"] = number * (15 if parts == 4 else 6) * float(np.prod(cells // 2 + 1 + 2 * rim))
    if simulation.method == "averaged":
        out["averaged table"] = 8.0 * 6 * float(np.prod(2 * (cells // 2 + 5)))
    if simulation.method == "krylov":
        blocks = [len(f.position) for f in simulation.frame().filaments.values()]
        out["preconditioner"] = sum(8.0 * (parts * k) ** 2 for k in blocks) + 2 * out["band matrix"]
        out["Krylov vectors"] = 60 * 8.0 * parts * n
    else:
        out["dense matrices"] = costs.dense_bytes(n, parts)
    if case.fluid.model == "navier-stokes":
        modes = 3 * 2 * number * float(np.prod(cells[:2])) * (cells[2] // 2 + 1)
        out["past of the fluid, as large in a checkpoint"] = 4 * modes
        out["its transforms"] = modes + 4 * modes
        out["mobility table"] *= 2  # of Euler's first step, and of BDF2's
        if case.fluid.flow is not None:
            out["the background flow"] = _flow_fields(case) * 6 * 8.0 * float(np.prod(cells))
    elif simulation.method not in ("table", "averaged") or case.output.grid_every is not None:
        out["fields and their transforms"] = (parts - 2) * 2 * 3 * 8.0 * float(np.prod(cells))
    return out


def flow_parts(case: Case) -> list[Part]:
    """What a background flow is the sum of; nothing where it is no sum that is seen."""
    from . import assemble_inertia

    return assemble_inertia.flow_parts(case) or []


def _flow_fields(case: Case) -> int:
    """How many fields a background flow of a fluid with inertia takes: its parts and their sum."""
    parts = flow_parts(case)
    return len(parts) + (len(parts) != 1 or parts[0].factor is not None)


def disk(simulation: Simulation) -> float:
    """Bytes of the run file, at most: fields are compressed."""
    case, n = simulation.case, len(simulation.arclength)
    outputs = len(case.output.times or ()) or case.time.end / (case.output.every or case.time.end) + 1
    size = outputs * n * 8.0 * (20 if simulation.mechanics.unknowns == 3 else 26)
    if simulation.grid is not None and case.output.grid_every is not None:
        points = float(np.prod(np.ceil(simulation.grid.cells / case.output.grid_stride)))
        size += (case.time.end / case.output.grid_every + 1) * points * 12.0 * len(case.output.fields)
    return size
