"""What in a scene should make its user look twice: it runs, but may not mean what is thought."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import assemble_fluid, assemble_grid, shapes
from .dimensionless import of_filament

if TYPE_CHECKING:
    from .case_filament import Filament
    from .case_schema import Case
    from .simulation import Simulation

LOCKING_SPACING = 0.8  # ds/h below which a nearly inextensible rod locks without slip (numerics.md, 4.3)
BEADS_SPACING = 2.5  # ds/h beyond which the drag of a straight rod changes with it: within 1 % up to here, 5 % off at 4
SLENDER_RADIUS = 0.2  # a/L above which a rod is shorter than 2.5 of its own diameters
CELLS_A_WAVE = 15  # wavelength/h below which the kernel is too wide for the motion
TWIST_RADIUS_SHARE = 0.98  # of the grid's: above, a rod's own spin does not keep its torques from locking
DRAG_SCATTER = 0.02  # scatter of a straight rod's drag over places and directions, above which it is no number
FLOW_JUMP = 1e-6  # jump of a background flow between opposite faces, of its size, that is none
ACCURATE_OMEGA_DT = 0.3  # omega dt up to which the default scheme was measured to be accurate
FLUCTUATION = 0.05  # mean square of a thermal stretch, or angle between nodes, that is still small
QUARTER_TURNS = 0.2  # the same, of angles of twist between nodes, above which some are soon a quarter turn
THERMAL_STRETCH = 2e-3  # mean stretch that thermal kicks leave in a step: as wrong a length is small


def warnings(simulation: Simulation) -> list[str]:
    """One sentence for each thing that runs but may not mean what its user thinks."""
    case, out = simulation.case, []
    for name, filament in case.filaments.items():
        key = f"filament.{name}"
        found = of_filament(simulation, filament)
        out += _of_grid(key, found, case)
        out += _of_held_ends(key, filament)
        out += _of_spin(simulation, key, filament)
        out += _of_images(simulation, key, name)
        if case.time.scheme != "explicit" and found.get("omega dt", 0.0) > 1.01 * ACCURATE_OMEGA_DT:
            found_dt = f"omega dt = {found['omega dt']:.3g}"
            out.append(f"time.step: {found_dt}; the schemes are accurate up to about {ACCURATE_OMEGA_DT}")
        if found.get("matched scatter", 0.0) > DRAG_SCATTER:
            out.append(
                f"{key}: the drag of a straight rod differs by {found['matched scatter']:.2g} of itself between places "
                "in a cell and directions: set fluid.slip = 0.01, or take a wider fluid.kernel or a larger fluid.box"
            )
        if filament.shape.kind == "run" and case.fluid.model == "navier-stokes":
            out.append(
                f"{key}.shape: the shape of another run, and nothing of its flow: the fluid starts at rest, or in "
                "fluid.flow"
            )
        where = simulation.nodes(name)
        out += shapes.stretch_warning(simulation.arclength[where], simulation.start.r[where], key)
    return out + _of_run(simulation)


def _of_grid(key: str, found: dict[str, float], case: Case) -> list[str]:
    """Nodes too near or too far for the grid, and rods and waves too small for it."""
    out, apart, thick = [], found.get("ds/h", 1.0), found.get("a/L", 0.0)
    if apart < LOCKING_SPACING and case.fluid.slip == 0:
        out.append(
            f"{key}: nodes are {apart:.2g} cells apart and fluid.slip = 0: below {LOCKING_SPACING} a nearly "
            "inextensible rod locks, and moves wrongly without any sign of trouble; "
            "set fluid.slip = 0.01, or take fewer nodes or more cells"
        )
    if apart > BEADS_SPACING:
        out.append(
            f"{key}: nodes are {apart:.2g} cells apart: beyond {BEADS_SPACING} it is a row of beads, and fluid passes "
            "between (at 4 cells with 5 % less drag across); take more nodes, or fewer fluid.cells"
        )
    if case.fluid.model != "rft" and thick > SLENDER_RADIUS:
        out.append(
            f"{key}: a/L = {thick:.2g}: on this grid it is less than {0.5 / SLENDER_RADIUS:g} times as long as it "
            "is thick, no slender rod; take more fluid.cells"
        )
    if found.get("wavelength/h", np.inf) < CELLS_A_WAVE:
        out.append(
            f"{key}: {found['wavelength/h']:.3g} cells a wavelength (wavelength/h): below {CELLS_A_WAVE} the "
            "rod is as thick as its waves; take more fluid.cells"
        )
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


def _of_images(simulation: Simulation, key: str, name: str) -> list[str]:
    """A filament that, as it begins, reaches from one face of the box to the other."""
    if simulation.grid is None:
        return []
    box = np.asarray(simulation.grid.box)
    spans = np.ptp(simulation.shape.r[simulation.nodes(name)], axis=0)
    axis = int(np.argmax(spans / box))
    if spans[axis] <= box[axis]:
        return []
    return [
        f"{key}: spans {spans[axis]:.4g} along {'xyz'[axis]}, more than the box, {box[axis]:g}: "
        "the filament meets its own periodic images; take a larger fluid.box"
    ]


def _of_spin(simulation: Simulation, key: str, filament) -> list[str]:
    """A rod that is thicker than what the grid can make spin."""
    case = simulation.case
    if not assemble_grid.couples_torque(case) or filament.twisting is None or filament.radius is None:
        return []
    widest = assemble_grid.twist_radius(case)
    largest = float(np.max(filament.radius.bind("s", "t")(np.linspace(0.0, filament.length, 11), 0.0)))
    out = []
    if case.fluid.slip == 0 and largest > TWIST_RADIUS_SHARE * widest:
        out.append(
            f"{key}: fluid.slip = 0, and the rod is as thick as the grid makes it spin: torques that change sign from "
            "node to node lock it; set fluid.slip = 0.01, or take a smaller radius"
        )
    if largest <= widest * 1.001:
        return out
    return [
        *out,
        f"{key}.radius: {largest:.4g} is above {widest:.4g}, the radius that a rod on this grid has when it spins: "
        'it spins as one of that; take fewer fluid.cells, a wider fluid.kernel, or fluid.rotation = "local"',
    ]


def _of_noise(simulation: Simulation) -> list[str]:
    """What thermal forces ask of the rods and of the step (derivations.md, section 5)."""
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
    """Where a segment's own fluctuations are not small: <strain^2> = kT/(EA ds), <angle^2> = kT ds/A between two."""
    out, ds = [], filament.length / (filament.nodes - 1)
    s = np.linspace(0.0, filament.length, filament.nodes)

    def square(modulus, size: float) -> float:
        return energy * size / float(np.min(modulus.bind("s", "t")(s, 0.0)))

    stretched = square(filament.stretching, 1 / ds)
    if stretched > FLUCTUATION:
        out.append(
            f"{key}.stretching: segments fluctuate by {np.sqrt(stretched):.2g} of their length (rms): "
            "take a larger one, or fewer nodes"
        )
    turned = {"bending": max(square(modulus, ds) for modulus in filament.bending)}
    if filament.twisting is not None:
        turned["twisting"] = square(filament.twisting, ds)
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
    case, dt = simulation.case, simulation.step_length
    out: list[str] = []
    assert case.thermal is not None
    stretch = simulation.thermal_stretch(dt)
    if stretch > THERMAL_STRETCH:
        out.append(
            f"time.step: thermal kicks turn segments so far in a step that they stay {100 * stretch:.2g} % longer; "
            "take a shorter one"
        )
    memory = dt**2 / (2 * simulation.explicit_limit())
    if memory > max(0.1 * case.time.end, dt):
        out.append(
            f"time.step: with it the stiffest motions reach their thermal spread only in {memory:.2g}; "
            "take a shorter one, or start from a shape that has it"
        )
    if case.thermal.directions == "xy" and np.max(np.abs(simulation.start.e3[:, 2])) > 1e-9:
        out.append('thermal.directions: "xy" is meant for rods in a plane z = const, and these leave it')
    return out


def _of_run(simulation: Simulation) -> list[str]:
    case, out = simulation.case, _of_noise(simulation)
    if case.time.scheme == "explicit" and case.time.step != "auto":
        limit = simulation.explicit_limit()
        if case.time.step > limit:
            out.append(f"time.step: {case.time.step:g} is above the explicit limit {limit:.3g}: this will diverge")
    every = case.output.every
    if every is not None and every > case.time.end:
        out.append(
            f"output.every: {every:g} is beyond time.end = {case.time.end:g}: only the start and the end are written"
        )
    if simulation.contacts:
        out.append(f"contact: {simulation.contacts} pairs of segments touch at the start")
    pressure = back_pressure(simulation)
    if pressure is not None:
        # A component that is a rounding error is zero to its reader.
        shown = ", ".join(
            f"{p:.3g}" for p in np.where(np.abs(pressure) > 1e-9 * np.max(np.abs(pressure)), pressure, 0.0)
        )
        assert simulation.grid is not None
        net = float(np.linalg.norm(pressure) * np.prod(simulation.grid.box))
        out.append(
            f"fluid.box: the rods push the fluid with a net force of {net:.3g} at the start (0 where nothing outside "
            f"pulls or holds them); on a periodic box a uniform back pressure gradient ({shown}) carries it, so that "
            "there is no mean flow; a larger box makes it weaker, in proportion to the volume"
        )
    return out + _of_flow(simulation)


def _of_flow(simulation: Simulation) -> list[str]:
    """A background flow on a periodic box that differs from face to face."""
    flow, grid = assemble_fluid.flow(simulation.case), simulation.grid
    if flow is None or grid is None:
        return []
    places = np.random.default_rng(0).uniform(-0.5, 0.5, (64, 3)) * grid.box
    here = flow(places, simulation.time)
    jump = max(float(np.max(np.abs(flow(places + side, simulation.time) - here))) for side in np.diag(grid.box))
    largest = max(float(np.max(np.abs(here))), 1e-300)
    if jump <= FLOW_JUMP * largest:
        return []
    return [
        f"fluid.flow: not periodic: it changes by {jump:.3g} from a face of the box to the one opposite (0 if it "
        "were); the rods' images go with the rods and not with the flow where they are: take a larger fluid.box"
    ]


def back_pressure(simulation: Simulation) -> np.ndarray | None:
    """The mean pressure gradient (3,) that a net force on a periodic box implies; None if there is none."""
    if simulation.grid is None:
        return None
    frame = simulation.frame()
    net = np.asarray(frame.diagnostics["net_force"])
    scale = sum(float(np.sum(np.abs(f.force))) for f in frame.filaments.values())
    if np.max(np.abs(net)) <= 1e-9 * scale:
        return None
    return net / float(np.prod(simulation.grid.box))
