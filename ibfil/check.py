"""What `ibfil check` says: what a case models and what it does not, what it costs, which steps are stable."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import assemble_grid, timescales
from .budget import disk, flow_parts, memory, shares, terms
from .case import idle_keys
from .case_schema import Matched
from .dimensionless import groups
from .scene_warnings import warnings
from .simulation import Simulation

if TYPE_CHECKING:
    from .case import Case
    from .case_schema import Contact, Thermal


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
    if case.fluid.flow is not None:
        out.append("the flow's couple across a rod's thickness: a straight one turns towards a shear, never past it")
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
    if case.fluid.model == "navier-stokes" and case.fluid.flow is not None and not flow_parts(case):
        lines.append(
            "fluid.flow is no sum of at most 4 products f(t) g(x, y, z) that is seen: it is put on the grid each step, "
            "which takes as long as the step itself or twice that"
        )
    lines.append(f"disk at most {_bytes(disk(simulation))}, fields compressed")
    if simulation.grid is not None:
        others = ", ".join(f"{k} {v:.2g}" for k, v in simulation.method_seconds.items() if np.isfinite(v))
        lines.append(f"seconds a step, from counts: {others}")
    steps, seconds = case.time.end / simulation.step_length, simulation.method_seconds[simulation.method]
    may = "at least " if case.fluid.model == "navier-stokes" and case.time.step == "auto" else ""  # see _steps
    total = f"{may}about {steps:.0f} steps, {steps * seconds:.2g} s after start-up"
    if case.time.tolerance is not None:
        total = f"as many steps as time.tolerance asks for, about {seconds:.2g} s each after start-up"
    lines.append(f"{total}, from counts (within a factor 3)")
    return lines


def _steps(simulation: Simulation) -> list[str]:
    case = simulation.case
    chosen = "automatic" if case.time.step == "auto" else "given"
    scheme = case.time.scheme if case.thermal is None else "linearised trapezoid (semi-implicit)"
    length = f"dt = {simulation.step_length:.4g} ({chosen})"
    if case.time.tolerance is not None:
        length = f"dt = {simulation.step_length:.4g} at first, then what an error of {case.time.tolerance:g} allows"
    lines = [
        f"{scheme}, order {case.time.order}: {length}",
        f"explicit scheme: stable below dt = {simulation.explicit_limit():.3g} at the start shape, 2/rho(M K)",
        "implicit and semi-implicit schemes: no such limit; accuracy decides",
    ]
    if case.fluid.model == "navier-stokes":
        limited = "steps are shortened for it" if case.time.tolerance is not None else "told"
        if case.time.step == "auto" and case.time.tolerance is None:
            limited = f"steps are shortened to that, to {timescales.CELLS:g} of it where rho u h/eta is large"
        lines.append(
            f"advection is extrapolated: stable while the fluid crosses less than about a cell a step ({limited})"
        )
    rates = simulation.driving_rates()
    if rates and max(rates) > 0:
        lines.append(f"shortest period of what drives the rods: {2 * np.pi / max(rates):.4g}")
    lines.append(f"slowest bending time: {simulation.bending_time():.4g}")
    return lines
