"""Warnings about a scene on a grid: nodes, waves, spins, images, net forces, flows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from .. import grid as grids

if TYPE_CHECKING:
    from ...case.filament import Filament
    from ...case.schema import Case
    from ...fluids.base import Flow
    from ...grid.periodic_grid import Grid
    from .base import Scene

LOCKING_SPACING = 0.8  # ds/h below which a nearly inextensible rod locks without slip
BEADS_SPACING = 2.5  # ds/h beyond which the drag of a straight rod changes with it: within 1 % up to here, 5 % off at 4
SLENDER_RADIUS = 0.2  # a/L above which a rod is shorter than 2.5 of its own diameters
CELLS_A_WAVE = 15  # wavelength/h below which the kernel is too wide for the motion
TWIST_RADIUS_SHARE = 0.98  # of the grid's: above, a rod's own spin does not keep its torques from locking
THICKNESS = 1.25  # ratio of a rod's radius and the grid's up to which they are taken for one
FLOW_JUMP = 1e-6  # jump of a background flow between opposite faces, of its size, that is none


def finer(case: Case) -> str:
    """The words for a finer grid."""
    return "a smaller fluid.spacing" if case.fluid.free else "more fluid.cells"


def coarser(case: Case) -> str:
    """The words for a coarser one."""
    return "a larger fluid.spacing" if case.fluid.free else "fewer fluid.cells"


def wave_number(filament: Filament) -> float:
    """Largest wave number of the preferred curvatures at t = 0, 2 pi over the wavelength; zero where constant."""
    s, waves = np.linspace(0.0, filament.length, 2001), [0.0]
    for curvature in filament.curvature:
        if "s" in curvature.variables:
            samples = np.broadcast_to(curvature.bind("s", "t")(s, 0.0), s.shape)
            size = 0.5 * float(np.ptp(samples))
            waves.append(float(np.max(np.abs(np.gradient(samples, s)))) / size if size > 1e-12 else 0.0)
    return max(waves)


def spun_radius(filament: Filament, widest: float) -> float:
    """The radius a filament spins as on a grid whose twist radius is ``widest``: no more than that."""
    if filament.radius is None:
        return widest
    return min(widest, float(np.max(filament.radius.bind("s", "t")(0.5 * filament.length, 0.0))))


def of_nodes(case: Case, name: str, groups: Mapping[str, float]) -> list[str]:
    """Nodes too near or too far for the grid, and rods and waves too small for it."""
    key, out, apart, thick = f"filament.{name}", [], groups["ds/h"], groups.get("a/L", 0.0)
    if apart < LOCKING_SPACING and case.fluid.slip == 0:
        out.append(
            f"{key}: nodes are {apart:.2g} cells apart and fluid.slip = 0: below {LOCKING_SPACING} a nearly "
            "inextensible rod locks, and moves wrongly without any sign of trouble; "
            f"set fluid.slip = 0.01, or take fewer nodes or {finer(case)}"
        )
    if apart > BEADS_SPACING:
        out.append(
            f"{key}: nodes are {apart:.2g} cells apart: beyond {BEADS_SPACING} it is a row of beads, and fluid passes "
            f"between (at 4 cells with 5 % less drag across); take more nodes, or {coarser(case)}"
        )
    if thick > SLENDER_RADIUS:
        out.append(
            f"{key}: a/L = {thick:.2g}: on this grid it is less than {0.5 / SLENDER_RADIUS:g} times as long as it "
            f"is thick, no slender rod; take {finer(case)}"
        )
    if groups.get("wavelength/h", np.inf) < CELLS_A_WAVE:
        out.append(
            f"{key}: {groups['wavelength/h']:.3g} cells a wavelength (wavelength/h): below {CELLS_A_WAVE} the "
            f"rod is as thick as its waves; take {finer(case)}"
        )
    return out


def of_spin(case: Case, name: str) -> list[str]:
    """A rod that is thicker than what the grid can make spin."""
    key, filament = f"filament.{name}", case.filaments[name]
    if not case.couples_torque or filament.twisting is None or filament.radius is None:
        return []
    widest = grids.twist_radius(case)
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
        f'it spins as one of that; take {coarser(case)}, a wider fluid.kernel, or fluid.rotation = "local"',
    ]


def of_thickness(case: Case, name: str, radius: float) -> list[str]:
    """A rod whose radius makes its couple in a flow, and is not the one that the grid drags it with."""
    filament = case.filaments[name]
    if not case.fluid.thick or filament.radius is None:
        return []
    own = float(np.max(filament.radius.bind("s", "t")(np.linspace(0.0, filament.length, 11), 0.0)))
    if 1 / THICKNESS < own / radius < THICKNESS:
        return []
    return [
        f"filament.{name}.radius: {own:.3g} makes the couple of the flow across it (fluid.thick); the grid drags it "
        f"with {radius:.3g}: it tumbles as neither would; leave radius out, or take other fluid.cells"
    ]


def of_images(grid: Grid, scene: Scene, name: str) -> list[str]:
    """A filament that, as it begins, reaches from one face of the box to the other."""
    box = np.asarray(grid.box)
    spans = np.ptp(scene.configuration.r[scene.nodes(name)], axis=0)
    spans[grid.cells == 1] = 0.0  # told otherwise
    axis = int(np.argmax(spans / box))
    if spans[axis] <= box[axis]:
        return []
    return [
        f"filament.{name}: spans {spans[axis]:.4g} along {'xyz'[axis]}, more than the box, {box[axis]:g}: "
        "the filament meets its own periodic images; take a larger fluid.box"
    ]


def back_pressure(grid: Grid, scene: Scene) -> np.ndarray | None:
    """The mean pressure gradient (3,) that a net force on a periodic box implies; None if there is none."""
    snapshot = scene.snapshot()
    net = np.asarray(snapshot.diagnostics["net_force"])
    scale = sum(float(np.sum(np.abs(f.force))) for f in snapshot.filaments.values())
    if np.max(np.abs(net)) <= 1e-9 * scale:
        return None
    return net / float(np.prod(grid.box))


def of_net_force(grid: Grid, scene: Scene, cure: Callable[[float], str]) -> list[str]:
    """A net force, which a uniform back pressure carries; ``cure`` of its size: what it does, and what to change."""
    pressure = back_pressure(grid, scene)
    if pressure is None:
        return []
    # A component that is a rounding error is zero to its reader.
    seen = np.where(np.abs(pressure) > 1e-9 * np.max(np.abs(pressure)), pressure, 0.0)
    net = float(np.linalg.norm(pressure) * np.prod(grid.box))
    return [
        f"fluid.box: the rods push the fluid with a net force of {net:.3g} at the start (0 where nothing outside "
        f"pulls or holds them); on a periodic box a uniform back pressure gradient "
        f"({', '.join(f'{p:.3g}' for p in seen)}) carries it, so that there is no mean flow; {cure(net)}"
    ]


def of_flow(grid: Grid, flow: Flow | None, thin: int | None = None) -> list[str]:
    """A background flow on a periodic box that differs from face to face, those across the axis ``thin`` excepted."""
    if flow is None:
        return []
    places = np.random.default_rng(0).uniform(-0.5, 0.5, (64, 3)) * grid.box
    here, sides = flow(places, 0.0), np.delete(np.diag(grid.box), [] if thin is None else [thin], axis=0)
    jump = max(float(np.max(np.abs(flow(places + side, 0.0) - here))) for side in sides)
    largest = max(float(np.max(np.abs(here))), 1e-300)
    if jump <= FLOW_JUMP * largest:
        return []
    return [
        f"fluid.flow: not periodic: it changes by {jump:.3g} from a face of the box to the one opposite (0 if it "
        "were); the rods' images go with the rods and not with the flow where they are: take a larger fluid.box"
    ]
