"""The report of `ibfil check`: effects modelled and not, costs, stable steps, warnings."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..assembly.contact import strength
from ..assembly.fluids.models import fluid_model
from ..assembly.loads import ALONG, ON_ENDS, named
from ..case.expressions import COPIED
from ..case.idle import idle_keys
from ..case.table import expressions
from ..observables.factory import observers
from ..simulation import timescales
from ..simulation.schedule import due_times
from ..simulation.simulation import Simulation
from ..simulation.steps import AUTOMATIC_ERROR, POINTS_A_PERIOD
from ..timestepping.step_control import equal_parts
from .bodies import ABSENT_OF_BODIES, UNWATCHED, in_body, of_body
from .budget import disk, memory, shares, terms
from .dimensionless import groups, oscillations
from .warnings import warnings

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..case.fluid import Contact
    from ..case.schema import Case, Thermal


def report(case: Case) -> str:
    """The text of `ibfil check`. Raises CaseError where the scene, or what is taken of it, cannot be built."""
    seen = observers(case)
    simulation = Simulation(case)
    seen.record(simulation.snapshot())  # as the first output of a run
    parts = [case.title or case.file, ""]
    parts += _section("modelled", modelled(case))
    parts += _section("not modelled", absent(case))
    parts += _section("dimensionless groups", [f"{k} = {v:.4g}" for k, v in groups(simulation).items()])
    parts += _section("share of a step and of memory, from counts", share_lines(simulation))
    parts += _section("size and cost", _costs(simulation))
    parts += _section("step", _steps(simulation))
    if idle := idle_keys(case):
        parts += _section("idle keys (checked; not used by this fluid)", [", ".join(idle)])
    parts += _section("warnings", warnings(simulation) or ["none"])
    return "\n".join(parts).rstrip()


def _section(title: str, lines: list[str]) -> list[str]:
    return [f"{title}:", *(f"  {line}" for line in lines), ""]


LARGE = 50_000  # nodes, beyond which some hundred velocities are no matter of seconds

_MOTIONS = {"moves": "prescribed motion", "spin": "spin", "angle": "prescribed turn"}


def _copies(filament: Filament) -> str:
    """How many copies there are, and how they differ; nothing of one filament."""
    many = filament.copies
    if many is None:
        return ""
    count = "a copy for each row of " + many.file if many.file is not None else f"{many.count} copies"
    used = {name for path, e in expressions(filament) if not path.startswith("copies.") for name in e.variables}
    varied = sorted(used & set(COPIED))
    differ = f" that differ by {' and '.join(varied)}; groups and warnings are those of the first" if varied else ""
    apart = "" if many.apart is None else f", at least {many.apart:g} apart"
    return f" each, {count}{apart}{differ}"


def modelled(case: Case) -> list[str]:
    """Each term the case asks for, one line each."""
    out = []
    for name, f in case.filaments.items():
        terms = ["bending", "stretching"] + (["twisting"] if f.twisting is not None else [])
        if any(k.constant != 0 for k in (*f.curvature, f.twist_rate)):
            terms.append("preferred strains")
        if f.damping:
            terms.append(f"internal damping, {f.damping:g}")
        if f.mass is not None:
            terms.append("mass")
        if not f.law.linear:
            terms.append(f"{f.law.kind} law")
        for side, end in (("start", f.start), ("finish", f.finish)):
            terms.append(f"{side} {end.end}" if not end.attached else in_body(side, end))
            terms += [f"{row.words} at {side}" for row in named(ON_ENDS, end)]
            terms += [f"{words} at {side}" for key, words in _MOTIONS.items() if getattr(end, key) is not None]
        if f.closed:
            terms.append("closed" + ("" if f.linking is None else f", linking number {f.linking}"))
        terms += [row.words for row in named(ALONG, f.loads)]
        if not (f.moved or f.turned):
            terms.append("standing where its points are given (0.1.0 moved and turned them to position and direction)")
        out.append(f"filament {name}, {f.nodes} nodes{_copies(f)}: " + ", ".join(terms))
    out += [f"link {name}: {link.words}" for name, link in case.links.items()]
    out += [of_body(case, name) for name in case.bodies]
    if case.fluid.flow is not None:
        spins = ", and spins those that twist by half its vorticity about the tangent" if case.twists else ""
        out.append(f"a background flow, which moves the nodes{spins}")
    if case.fluid.thick:
        by = "their radius" if case.fluid.aspect is None else f"an aspect ratio of {case.fluid.aspect:g} when straight"
        out.append(f"the couple of flows across the rods' thickness, by {by}: straight ones tumble in a shear")
    if case.contact is not None:
        out.append(_contact(case, case.contact))
    out += fluid_model(case).modelled()
    return out if case.thermal is None else [*out, _thermal(case.thermal)]


def _contact(case: Case, contact: Contact) -> str:
    where = "the sum of radii" if contact.distance is None else f"{contact.distance:g}"
    default = " (10 A/L^2, as contact.strength is not given)" if contact.strength is None else ""
    acts = {
        "stop": "the first ends the run",
        "warn": "the first is told",
        "repel": f"repulsion of {strength(case):.4g} at that distance{default}, none at twice that",
    }
    return f"contact of axes nearer than {where}, looked for each step: {acts[contact.action]}"


def _thermal(thermal: Thermal) -> str:
    kinds = "forces and twist moments" if thermal.twist else "forces"
    where = " in the plane z = const" if thermal.planar else ""
    return f"thermal {kinds}{where}, kT = {thermal.energy:g}, seed {thermal.seed}"


def absent(case: Case) -> list[str]:
    """The effects that are left out, and so cost nothing."""
    out, fluid = [], fluid_model(case)
    if not case.twists:
        out.append("twist: no twist unknowns; e1 is carried along")
    out += fluid.absent()
    if case.fluid.flow is not None and not case.fluid.thick:
        out.append("the flow's couple across a rod's thickness: a straight one turns towards a shear, never past it")
    if case.output.grid_every is None:
        out.append("field output")
    if case.contact is None:
        out.append("contact: filaments may pass through each other")
    if not case.links:
        out.append("links between filaments")
    if case.bodies:
        out += ABSENT_OF_BODIES
    if case.thermal is None:
        out.append("thermal noise")
    elif not case.thermal.twist and case.twists:
        out.append("thermal twist moments")
    light = [name for name, filament in case.filaments.items() if filament.mass is None]
    of = "" if len(light) == len(case.filaments) else f", of {', '.join(light)}"
    inertia = [fluid.rod_inertia + of] * bool(light) + [fluid.fluid_inertia_absent] * bool(fluid.fluid_inertia_absent)
    walls = ["walls"] * (fluid.wall is None)
    heads = [] if case.bodies else ["heads and motors"]
    rings = [] if any(filament.closed for filament in case.filaments.values()) else ["closed rods"]
    out.append("; ".join([*inertia, *walls, *heads, *rings]))
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
    case, fluid = simulation.case, simulation.model.fluid_model
    unknowns = simulation.system.unknowns
    lines = [f"{simulation.rods.count} nodes with {unknowns} unknowns each; method {simulation.method}"]
    lines += fluid.solved(simulation.rods)
    lines += fluid.size()
    used = memory(simulation)
    parts = ", ".join(f"{name} {_bytes(size)}" for name, size in used.items())
    lines.append(f"memory {_bytes(sum(used.values()))} ({parts}), beside some 250 MiB of libraries")
    lines += fluid.remarks()
    written, whole = len(simulation.rods.written(case.output.copies_every)), len(simulation.rods.names)
    some = "" if written == whole else f", of {written} of {whole} filaments"
    lines.append(f"disk at most {_bytes(disk(simulation))}{some}, fields compressed")
    methods = simulation.model.seconds
    if len(methods) > 1:
        others = ", ".join(f"{k} {v:.2g}" if np.isfinite(v) else f"{k} too large" for k, v in methods.items())
        lines.append(f"seconds a step, from counts: {others}")
    seconds = methods[simulation.method]
    fewest, steps = foretold_steps(simulation)
    may = "" if fluid.steps_known or not case.time.automatic else "at least "  # see step_lines
    total = f"{may}about {steps} steps, {steps * seconds:.2g} s after start-up"
    if fewest != steps:
        total = (
            f"{may}about {fewest} to {steps} steps, {fewest * seconds:.2g} to {steps * seconds:.2g} s after start-up, "
            "nearer the former the sooner rods settle"
        )
    if case.time.tolerance is not None:
        total = f"as many steps as time.tolerance asks for, about {seconds:.2g} s each after start-up"
    lines.append(f"{total}, from counts (within a factor 3)")
    return lines


def foretold_steps(simulation: Simulation) -> tuple[int, int]:
    """How many steps a run takes, at fewest and at most: they end at each time at which something is due."""
    times = [due.time for due in due_times(simulation.case, simulation.grid is not None)]
    shortest = simulation.step_length
    lengths = (max(simulation.choice.longest, shortest), shortest)
    fewest, most = (sum(equal_parts(until - since, length) for since, until in pairwise(times)) for length in lengths)
    return fewest, most


def _steps(simulation: Simulation) -> list[str]:
    case, choice = simulation.case, simulation.choice
    scheme = case.time.scheme if case.thermal is None else "linearised trapezoid (semi-implicit)"
    length = f"dt = {simulation.step_length:.4g} (given)"
    if case.time.tolerance is not None:
        length = f"dt = {simulation.step_length:.4g} at first, then what an error of {case.time.tolerance:g} allows"
    elif case.time.automatic:
        length = f"dt = {simulation.step_length:.4g} (automatic: {choice.reason})"
    lines = [f"{scheme}, order {case.time.order}: {length}"]
    if case.time.solver_error is not None:
        lines.append(f"  solved to {case.time.solver_error:g} of what extrapolation was off by (time.solver_error)")
    if case.time.automatic and case.time.tolerance is None:
        lines += _automatic(simulation)
    if case.time.explicit and simulation.model.fluid is not simulation.model.inner:
        lines.append("explicit steps too solve a linear system each: nodes feel their own velocity (fluid.thick)")
    limit = "not with bodies" if case.bodies else "not with mass"
    if simulation.rods.count > LARGE:
        limit = f"its limit is not looked for beyond {LARGE} nodes"
    elif not case.heavy and not case.bodies:
        most = simulation.explicit_limit()
        limit = f"stable below dt = {most:.3g} at the start shape, 2/rho(M K)"
        if not np.isfinite(most):
            limit = "no limit found: at the start shape no force answers to a move, or a force or the flow has no value"
    return [
        *lines,
        f"explicit scheme: {limit}",
        "implicit and semi-implicit schemes: no such limit; accuracy decides",
        *UNWATCHED[: bool(case.bodies)],
        *simulation.model.fluid_model.step_lines(),
        *_driven(simulation),
        f"slowest bending time: {timescales.slowest_bending(simulation.model):.4g}",
        *ringing(simulation),
    ]


def _automatic(simulation: Simulation) -> list[str]:
    """How an automatic step changes, and how to have its error decide."""
    lines, choice = [], simulation.choice
    if choice.growth:
        lines.append(
            f"  it grows, up to {choice.longest:.4g} ({choice.growth}), as far as an error of {AUTOMATIC_ERROR:g} of "
            "the length over the run lets it"
        )
    growth = simulation.growth_rate()
    if growth:
        lines.append(
            f"  at first no longer than {2 * np.pi / growth / POINTS_A_PERIOD:.3g}: disturbances of the rods grow or "
            f"swing by {growth:.4g} radians a time (their leading mode)"
        )
    if not simulation.case.time.explicit and simulation.case.thermal is None:
        lines.append(
            "  time.tolerance would have the error of each step decide: 1e-3 of the length a unit time is a start"
        )
    return lines


def _driven(simulation: Simulation) -> list[str]:
    """The period of what drives, its fastest change, its jumps."""
    lines, drivers, load = [], simulation.drivers, simulation.load_rate
    if drivers.windows:
        period = drivers.period
        repeats = "never repeats itself"
        if period is not None:
            since = f" from t = {period.since:.4g} on" if period.since > 0 else ""
            repeats = f"repeats itself after {period.length:.4g}{since}"
        lines.append(
            f"what is prescribed in time {repeats}; its fastest change is that of a period of "
            f"{2 * np.pi / drivers.fastest:.4g}"
            if drivers.fastest
            else f"what is prescribed in time {repeats}"
        )
    if drivers.jumps:
        times = ", ".join(f"{t:.4g}" for t in drivers.jumps[:4]) + (" ..." if len(drivers.jumps) > 4 else "")
        lines.append(f"it jumps at t = {times}: steps end there")
    if load:
        lines.append(f"loads or flow move a rod by its length in {2 * np.pi / load:.4g}")
    return lines


def ringing(simulation: Simulation) -> list[str]:
    """The own oscillation of each rod whose mass makes it one, and what the scheme takes away of it."""
    out = []
    for name, found in oscillations(simulation).items():
        out.append(
            f"filament {name} oscillates in bending, alone at omega = {found.omega:.4g} with a decay of "
            f"{found.decay:.3g}; this dt makes that {found.seen_omega:.4g}, {found.seen_decay:.3g}"
        )
    return out
