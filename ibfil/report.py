"""What `ibfil check` says: what a case models and what it does not, what it costs, which steps are stable."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import assemble_grid, costs
from .case import idle_keys
from .case_schema import Matched
from .groups import groups, warnings
from .simulation import Simulation
from .terms import shares, terms

if TYPE_CHECKING:
    from .case import Case
    from .case_schema import Contact, Thermal
    from .navier_stokes import Part


def report(case: Case) -> str:
    """The text of `ibfil check`. Raises CaseError where the scene cannot be built."""
    simulation = Simulation(case)
    parts = [case.title or case.file, ""]
    parts += _section("modelled", modelled(case))
    parts += _section("not modelled", absent(case))
    parts += _section("dimensionless groups", [f"{k} = {v:.4g}" for k, v in groups(simulation).items()])
    parts += _section("share of a step and of memory, from counts", share_lines(simulation))
    parts += _section("size and cost", _costs(simulation))
    parts += _section("step", _steps(simulation))
    idle = idle_keys(case)
    if idle:
        parts += _section("idle keys (checked; not used by this fluid)", [", ".join(idle)])
    parts += _section("warnings", warnings(simulation) or ["none"])
    return "\n".join(parts).rstrip()


def _section(title: str, lines: list[str]) -> list[str]:
    return [f"{title}:", *(f"  {line}" for line in lines), ""]


_END = {
    "force": "force",
    "follower": "follower force",
    "moment": "moment",
    "spring": "spring",
    "moves": "prescribed motion",
    "spin": "spin",
    "angle": "prescribed turn",
}
_LOADS = {
    "force": "force per length",
    "body_force": "body force",
    "moment": "active moment",
    "internal_moment": "internal moment",
    "weight": "weight",
    "tether": "tethers",
}


def modelled(case: Case) -> list[str]:
    """Each term the case asks for, one line each."""
    out = []
    for name, f in case.filaments.items():
        terms = ["bending", "stretching"] + (["twisting"] if f.twisting is not None else [])
        if any(k.constant != 0 for k in (*f.curvature, f.twist_rate)):
            terms.append("preferred strains")
        if f.law.kind != "linear":
            terms.append(f"{f.law.kind} law")
        for side, end in (("start", f.start), ("finish", f.finish)):
            terms.append(f"{side} {end.end}")
            given = [word for key, word in _END.items() if getattr(end, key) is not None]
            terms += [f"{word} at {side}" for word in given]
        terms += [word for key, word in _LOADS.items() if getattr(f.loads, key, None) is not None]
        out.append(f"filament {name}, {f.nodes} nodes: " + ", ".join(terms))
    if case.fluid.flow is not None:
        spins = "spins them by half its vorticity" if assemble_grid.couples_torque(case) else "does not spin them"
        out.append(f"a background flow, which moves the nodes and {spins}")
    if case.contact is not None:
        out.append(_contact(case.contact))
    fluid = case.fluid
    if fluid.model == "rft":
        out.append("resistive-force drag on each node; no flow between nodes")
        if isinstance(fluid.drag, Matched):
            out.append(f"its coefficients those of a straight rod of length {fluid.drag.matched:g} in the case's grid")
        if case.thermal is not None:
            out.append(_thermal(case.thermal))
        return out
    if fluid.model == "navier-stokes":
        out.append("Navier-Stokes flow on a periodic grid, from rest: with inertia and advection")
    else:
        out.append("Stokes flow on a periodic grid: hydrodynamic interaction of all nodes and their images")
    if fluid.slip:
        out.append(f"slip mobility of {fluid.slip:g} of a point's own, against locking")
    if assemble_grid.couples_torque(case):
        out.append("twist torques stir the grid as half a curl, rods spin with half its vorticity (rotation = grid)")
    elif any(f.twisting is not None for f in case.filaments.values()):
        out.append("spin against the rod's own drag (rotation = local)")
    return out


def _contact(contact: Contact) -> str:
    where = "the sum of radii" if contact.distance is None else f"{contact.distance:g}"
    acts = {
        "stop": "the first ends the run",
        "warn": "the first is told",
        "repel": f"repulsion of {contact.strength:g} at that distance, none at twice that",
    }
    return f"contact of axes nearer than {where}, looked for each step: {acts[contact.action]}"


def _thermal(thermal: Thermal) -> str:
    kinds = "forces and twist moments" if thermal.twist else "forces"
    where = "" if thermal.directions == "xyz" else " in the plane z = const"
    return f"thermal {kinds}{where}, kT = {thermal.energy:g}, seed {thermal.seed}"


def absent(case: Case) -> list[str]:
    """What is left out, and so costs nothing."""
    out = []
    if all(f.twisting is None for f in case.filaments.values()):
        out.append("twist: no twist unknowns; e1 is carried along")
    if case.fluid.model == "rft":
        out.append("hydrodynamic interaction; grid and FFT plans")
    elif not assemble_grid.couples_torque(case):
        out.append("torque coupling of the spin to the grid")
    if case.output.grid_every is None:
        out.append("field output")
    if case.contact is None:
        out.append("contact: filaments may pass through each other")
    if case.thermal is None:
        out.append("thermal noise")
    elif not case.thermal.twist and any(f.twisting is not None for f in case.filaments.values()):
        out.append("thermal twist moments")
    whose = "of the rod beyond the fluid it displaces" if case.fluid.model == "navier-stokes" else "of rod and fluid"
    out.append(f"inertia {whose}; walls; heads; closed rods")
    return out


def share_lines(simulation: Simulation) -> list[str]:
    """Each term with its share of time and of memory."""
    found = shares(terms(simulation, memory(simulation)))
    width = max(len(name) for name, _, _ in found)
    return [f"{name:{width}}  {100 * time:5.1f} % of time  {100 * size:5.1f} % of memory" for name, time, size in found]


def _bytes(count: float) -> str:
    for unit in ("B", "KiB", "MiB"):
        if count < 1024:
            return f"{count:.3g} {unit}"
        count /= 1024
    return f"{count:.3g} GiB"


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


def _flow_parts(case: Case) -> list[Part]:
    """What a background flow is the sum of; nothing where it is no sum that is seen."""
    from .assemble_inertia import flow_parts

    return flow_parts(case) or []


def _flow_fields(case: Case) -> int:
    """How many fields a background flow of a fluid with inertia takes: its parts and their sum."""
    parts = _flow_parts(case)
    return len(parts) + (len(parts) != 1 or parts[0].factor is not None)


def _disk(simulation: Simulation) -> float:
    case, n = simulation.case, len(simulation.arclength)
    outputs = len(case.output.times or ()) or case.time.end / (case.output.every or case.time.end) + 1
    size = outputs * n * 8.0 * (20 if simulation.mechanics.unknowns == 3 else 26)
    if simulation.grid is not None and case.output.grid_every is not None:
        points = float(np.prod(np.ceil(simulation.grid.cells / case.output.grid_stride)))
        size += (case.time.end / case.output.grid_every + 1) * points * 12.0 * len(case.output.fields)
    return size


def _costs(simulation: Simulation) -> list[str]:
    case = simulation.case
    unknowns = simulation.mechanics.unknowns
    lines = [f"{len(simulation.arclength)} nodes with {unknowns} unknowns each; method {simulation.method}"]
    if simulation.grid is not None:
        h, kernel = simulation.grid.spacing, assemble_grid.kernel(case)
        lines.append(f"grid {' x '.join(str(n) for n in simulation.grid.cells)}, h = {h:.4g}")
        lines.append(
            f"a rod on it is as thick as its kernel: radius {kernel.line_radius * h:.4g} when dragged, "
            f"{assemble_grid.twist_radius(case):.4g} when spun by the grid; no one radius of RFT has both"
        )
        lines.append(
            f"kernel {case.fluid.kernel}: one node moves as a sphere of radius {kernel.point_radius * h:.4g}; its "
            f"mobility differs by {kernel.translation_error:.2g} of itself between places in a cell"
        )
    used = memory(simulation)
    parts = ", ".join(f"{name} {_bytes(size)}" for name, size in used.items())
    lines.append(f"memory {_bytes(sum(used.values()))} ({parts}), beside some 250 MiB of libraries")
    if case.fluid.model == "navier-stokes" and case.fluid.flow is not None and not _flow_parts(case):
        lines.append(
            "fluid.flow is no sum of at most 4 products f(t) g(x, y, z) that is seen: it is put on the grid each step, "
            "which takes as long as the step itself or twice that"
        )
    lines.append(f"disk at most {_bytes(_disk(simulation))}, fields compressed")
    steps = case.time.end / simulation.step_length
    seconds = steps * simulation.method_seconds[simulation.method]
    if simulation.grid is not None:
        others = ", ".join(f"{k} {v:.2g}" for k, v in simulation.method_seconds.items() if np.isfinite(v))
        lines.append(f"seconds a step, from counts: {others}")
    lines.append(f"about {steps:.0f} steps, {seconds:.2g} s after start-up, from counts (within a factor 3)")
    return lines


def _steps(simulation: Simulation) -> list[str]:
    case = simulation.case
    chosen = "automatic" if case.time.step == "auto" else "given"
    scheme = case.time.scheme if case.thermal is None else "linearised trapezoid (semi-implicit)"
    lines = [
        f"{scheme}, order {case.time.order}: dt = {simulation.step_length:.4g} ({chosen})",
        f"explicit scheme: stable below dt = {simulation.explicit_limit():.3g} at the start shape, 2/rho(M K)",
        "implicit and semi-implicit schemes: no such limit; accuracy decides",
    ]
    if case.fluid.model == "navier-stokes":
        given = "told" if case.time.step != "auto" and case.time.tolerance is None else "steps are shortened for it"
        lines.append(
            f"advection is extrapolated: stable while the fluid crosses less than about a cell a step ({given})"
        )
    rates = simulation.driving_rates()
    if rates and max(rates) > 0:
        lines.append(f"shortest period of what drives the rods: {2 * np.pi / max(rates):.4g}")
    lines.append(f"slowest bending time: {simulation.bending_time():.4g}")
    return lines
