"""Warnings about a scene that runs, but may not mean what is thought.

Those that a fluid brings are with its model (assembly/fluids).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..case.shape import RunShape
from ..case.table import expressions
from ..shapes import initial
from ..simulation import steps
from ..simulation.thermal_step import MOVE, RINGING, TURN, KickSizes, sizes_of_step
from .bodies import of_given_motion
from .dimensionless import of_filament, oscillations
from .twist import of_twist

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..case.schema import Case
    from ..simulation.simulation import Simulation


NODES_A_WAVE = 8  # wavelength/ds below which nodes do not resolve a wave: at 5.3 a swimmer is 2 % off, at 2.7 20 times
SLOWED, DAMPED = 0.02, 0.2  # by which steps may change omega, and the decay, of a rod's own oscillation
FLUCTUATION = 0.05  # mean square of a thermal angle between nodes that is still small
QUARTER_TURNS = 0.2  # the same, of angles of twist between nodes, above which some are soon a quarter turn
JUMP = 1e-6  # of the larger value: a difference between the ends of a closed rod that is none
STRAINED = 1e-6  # of the length of a filament: strain of a link at the start that is none
STIFF = 1e6  # stiffness of a link times the step over the drag of a node: beyond it Krylov's forces drift
RINGS, EXPLODES = 0.1, 0.3  # kT a node in ringing motions: variances are off by so much; runs explode sooner or later


def warnings(simulation: Simulation) -> list[str]:
    """One sentence for each thing that runs but may not mean what its user thinks."""
    case, fluid, out = simulation.case, simulation.model.fluid_model, list(simulation.case.deprecated)
    for name in case.filaments:
        filament = simulation.rods.own(name)
        key, found = f"filament.{name}", of_filament(simulation, filament)
        out += fluid.warnings_of(simulation, name, found)
        out += _of_waves(key, found)
        out += of_twist(simulation, name, filament)
        out += _of_held_ends(key, filament)
        out += _of_inertia(simulation, name, filament)
        where = simulation.nodes(name)
        out += initial.stretch_warning(simulation.arclength[where], simulation.start.r[where], key)
        if filament.closed:
            out += _of_closed(key, filament, case)
    return (
        out
        + of_given_motion(case)
        + _of_given_step(simulation)
        + _of_links(simulation)
        + _of_run(simulation)
        + fluid.warnings(simulation)
    )


def _of_waves(key: str, groups: Mapping[str, float]) -> list[str]:
    """Waves along the rod that its nodes do not resolve."""
    found = groups.get("wavelength/ds", np.inf)
    if found >= NODES_A_WAVE:
        return []
    return [
        f"{key}.nodes: {found:.3g} segments a wavelength of what bends or loads the rod (wavelength/ds): below "
        f"{NODES_A_WAVE} numbers are wrong by per cents, below 4 by any factor and in sign; take more nodes"
    ]


def _of_given_step(simulation: Simulation) -> list[str]:
    """A given step too long for what is prescribed in time, or for how fast disturbances of the rods grow or swing."""
    time = simulation.case.time
    if time.automatic or time.explicit or time.tolerance is not None:
        return []
    dt = float(time.step)
    rates = {
        "what is prescribed in time": simulation.drivers.fastest,
        steps.OWN: simulation.growth_rate(),
    }
    return [steps.too_long(dt, what, rate) for what, rate in rates.items() if steps.is_long(dt, rate)]


def _of_closed(key: str, filament: Filament, case: Case) -> list[str]:
    """Values along a closed rod that do not close, and strands that may pass through each other."""
    out: list[str] = []
    for path, expression in expressions(filament):
        if not path.startswith("shape.") and "s" in expression.variables:
            given = dict.fromkeys(expression.variables - {"s"}, 0.0)
            one, other = (expression.at(s=s, **given) for s in (0.0, filament.length))
            if abs(one - other) > JUMP * max(abs(one), abs(other)):
                found = f"{one:.3g} at s = 0 and {other:.3g} at s = length, which are one node of a closed rod"
                out.append(f"{key}.{path}: {found}; a function of s that closes")
    if filament.twisting is not None and (case.contact is None or not case.contact.repels):
        out.append(
            f"{key}.closed: strands that meet may pass through each other, each time with a change of the linking "
            'number by 2; contact.action = "repel" keeps them apart'
        )
    return out


def _of_links(simulation: Simulation) -> list[str]:
    """Links that are strained as the run begins, or stiffer than a step resolves."""
    out: list[str] = []
    drag = min(simulation.drag(f) * f.length / (f.nodes - 1) for f in simulation.case.filaments.values())
    for link in simulation.rods.links:
        passive = link.strained(simulation.configuration)
        if passive > STRAINED * simulation.system.length:
            out.append(
                f"link.{link.name}: strained by {passive:.3g} at the start, and so moves the rods at once; "
                'rest (distance, slide) as the start has it, "initial" where that is allowed'
            )
        stiff = link.stiffest * simulation.step_length / drag
        if stiff > STIFF:
            most = link.stiffest * STIFF / stiff
            out.append(
                f"link.{link.name}: its stiffness times the step is {stiff:.2g} times a node's drag: above {STIFF:g} "
                f"its force has fewer digits, and by Krylov is wrong: a stiffness below {most / link.unit:.2g}"
            )
    return out


def _of_inertia(simulation: Simulation, name: str, filament: Filament) -> list[str]:
    """An oscillation of its own that steps are too long for, and a start that is not known."""
    out, found = [], oscillations(simulation).get(name)
    if found is not None and simulation.case.time.tolerance is None:
        slowed = (1 - found.seen_omega / found.omega) / SLOWED
        damped = abs(found.seen_decay - found.decay) / (DAMPED * max(found.decay, 0.01 * found.omega))
        if max(slowed, damped) > 1.0:
            step = simulation.step_length * max(slowed, damped) ** (-1 / simulation.case.time.order)
            out.append(
                f"time.step: filament {name} oscillates at omega = {found.omega:.3g} with a decay of {found.decay:.3g}"
                f", which steps of {simulation.step_length:.3g} make {found.seen_omega:.3g}, {found.seen_decay:.3g}: "
                f"take {step:.2g}, or leave it where that is over before it matters"
            )
    if filament.mass is not None and isinstance(filament.shape, RunShape) and filament.velocity is None:
        out.append(f"filament.{name}.shape: the shape of another run, and not its velocity: it starts at rest")
    return out


def _of_held_ends(key: str, filament: Filament) -> list[str]:
    """A displacement that is not zero as the run begins, and so does not displace."""
    out = []
    for side, end in (("start", filament.start), ("finish", filament.finish)):
        begins = [] if end.moves is None else [float(part.bind("t")(0.0)) for part in end.moves]
        if any(begins):
            out.append(
                f"{key}.{side}.moves: {begins} at t = 0, when the end stands where the shape puts it: only the change "
                "from there moves it; begin at 0, as with -c*(1 - exp(-t/0.01))"
            )
    return out


def _of_noise(simulation: Simulation) -> list[str]:
    """Warnings about thermal forces: on the rods and on the step (timestepping/README.md)."""
    case = simulation.case
    out: list[str] = []
    if case.thermal is None or case.thermal.energy == 0:
        return out
    for name, filament in case.filaments.items():
        if filament.derivative == 6:
            out.append(
                f"filament.{name}.derivative: stencils of order 6 are not thermal: their stiffness is not symmetric, "
                "and curvatures have 0.83 (inside) and 1.39 (at the ends) of their variance; take 2"
            )
        out += _softness(f"filament.{name}", filament, case.thermal.energy)
    return out + _of_noisy_step(simulation)


def _softness(key: str, filament, energy: float) -> list[str]:
    """Where the angles between neighbours are not small: <angle^2> = kT ds/A."""
    out, ds = [], filament.length / (filament.nodes - 1)
    s = np.linspace(0.0, filament.length, filament.nodes)

    def square(modulus) -> float:
        return energy * ds / float(np.min(modulus.bind("s", "t")(s, 0.0)))

    turned = {"bending": max(square(modulus) for modulus in filament.bending)}
    if filament.twisting is not None:
        turned["twisting"] = square(filament.twisting)
    for kind, value in turned.items():
        if value > FLUCTUATION:
            enough = 1 + int(np.ceil((filament.nodes - 1) * value / FLUCTUATION))
            out.append(
                f"{key}.{kind}: segments turn by {np.sqrt(value):.2g} (rms) against their neighbours: "
                f"{value / FLUCTUATION:.2g} times that modulus, or {enough} nodes"
                + (
                    "; as it is, some are soon a quarter turn apart, which stops the run"
                    if value > QUARTER_TURNS
                    else ""
                )
            )
    return out


def _of_noisy_step(simulation: Simulation) -> list[str]:
    case, out = simulation.case, []
    assert case.thermal is not None
    kicks = sizes_of_step(simulation.model, simulation.step_length)
    out += _of_kicks(kicks) + _of_repulsion(simulation, kicks)
    if case.thermal.planar and np.max(np.abs(simulation.start.e3[:, 2])) > 1e-9:
        out.append('thermal.directions: "xy" is meant for rods in a plane z = const, and these leave it')
    return out


def _of_kicks(kicks: KickSizes) -> list[str]:
    """The faults of a given step: kicks that turn segments too far, make stiff motions ring, or jump over cells."""
    out, advice = [], 'take a shorter one, or "auto"'
    angle = f"{np.sqrt(4 * kicks.turn):.2g} rad (rms) in a step"
    key = f"time.step: thermal kicks turn segments of filament {kicks.filament} by {angle}"
    if kicks.ringing > RINGS:
        fate = "the run is likely to explode"
        if kicks.ringing <= EXPLODES:
            fate = f"these have some {100 * kicks.ringing:.0f} % less than their thermal variance"
        out.append(
            f"{key}, and what is not linear in that makes its stiff motions ring with {kicks.ringing:.2g} kT a node "
            f"(automatic steps: {RINGING:g}): {fate}; {advice}"
        )
    if kicks.turn > 2 * TURN:
        out.append(
            f"{key}: a linear step would leave them {100 * kicks.turn:.2g} % longer, and its correction takes most of "
            f"that off, but not all; {advice}"
        )
    if kicks.kick > 1.1 * MOVE * kicks.cell:
        enough = kicks.dt * (MOVE * kicks.cell / kicks.kick) ** 2
        cells = f"{kicks.kick / kicks.cell:.2g} cells (rms) a step"
        out.append(f"time.step: thermal kicks push nodes by {cells}: take one below {enough:.2g}")
    return out


def _of_repulsion(simulation: Simulation, kicks: KickSizes) -> list[str]:
    """The faults of thermal steps in which segments may jump over what keeps them apart, or are thrown back."""
    repulsion = simulation.rods.contact.repulsion
    if repulsion is None:
        return []
    (strength, distance), out = repulsion, []
    if np.sqrt(3) * kicks.move > 0.25 * distance:
        enough = kicks.dt * (0.25 * distance / kicks.move) ** 2 / 3
        out.append(
            f"time.step: rods move by {np.sqrt(3) * kicks.move:.2g} (rms) a step, above a quarter of the distance over "
            f"which they repel each other, {distance:.2g}: take one below {enough:.2g}"
        )
    assert simulation.case.thermal is not None
    thrown = strength / distance * kicks.kick**2 / (2 * simulation.case.thermal.energy)
    if thrown > 1:
        out.append(
            f"contact.strength: in a step {strength:.2g} over {distance:.2g} throws a node back {thrown:.2g} times as "
            f"far as it came: take a time.step below {kicks.dt / thrown:.2g}, or a strength below "
            f"{strength / thrown:.2g}"
        )
    return out


def _of_windows(case: Case) -> list[str]:
    """Windows of observables that the run does not fill."""
    out = []
    for name, one in case.observe.items():
        if one.over is None or one.over[1] <= case.time.end * (1 + 1e-9):
            continue
        if one.over[0] >= case.time.end:
            what = f"it begins at {one.over[0]:g}, not before time.end = {case.time.end:g}: there will be no number"
        else:
            what = f"it ends at {one.over[1]:g}, beyond time.end = {case.time.end:g}"
        out.append(f"observe.{name}.over: {what}")
    return out


def _of_run(simulation: Simulation) -> list[str]:
    case, out = simulation.case, _of_noise(simulation)
    if case.time.explicit and not case.time.automatic:
        limit = simulation.explicit_limit()
        if float(case.time.step) > limit:
            out.append(f"time.step: {case.time.step:g} is above the explicit limit {limit:.3g}: this will diverge")
    every = case.output.every
    if every is not None and every > case.time.end:
        out.append(
            f"output.every: {every:g} is beyond time.end = {case.time.end:g}: only the start and the end are written"
        )
    out += _of_windows(case)
    touching = simulation.rods.contact.diagnostics(simulation.configuration.r).get("contacts", 0.0)
    if touching:
        out.append(f"contact: {touching:.0f} pairs of segments touch at the start")
    return out
