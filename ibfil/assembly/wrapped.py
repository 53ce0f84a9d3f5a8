"""From a case to a fluid around its fluid: what rods feel of their own velocity. Where that is nothing, the fluid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .profiles import alone, half

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..case.schema import Case
    from ..fluids.base import Fluid
    from ..fluids.wrapped.fluid import VelocityForce
    from ..fluids.wrapped.mass import Mass
    from ..fluids.wrapped.thickness import Thickness
    from .fluids.base import FluidModel
    from .stacked import RodStack

START = 1e-9  # of the run's time: over it a support's first velocity is taken
STRAIGHT = 1e-6  # of its length: deviation of a straight rod's nodes from a line


class Surrounding(NamedTuple):
    """The fluid as rods know it, the fluid inside, the couple across the rods' thickness and their inertia, or None."""

    fluid: Fluid
    inner: Fluid
    thickness: Thickness | None
    mass: Mass | None


def surrounding(model: FluidModel, rods: RodStack) -> Surrounding:
    """The fluid of the model around these rods. Raises CaseError where it cannot be made."""
    inner, thick, heavy = model.build(rods), thickness(model, rods), mass(model.case, rods)
    forces: list[VelocityForce] = [force for force in (thick, heavy) if force is not None]
    if not forces:
        return Surrounding(inner, inner, None, None)
    from ..fluids.wrapped.fluid import Wrapped

    return Surrounding(Wrapped(inner, forces, rods.system.profile.width), inner, thick, heavy)


def mass(case: Case, rods: RodStack) -> Mass | None:
    """The inertia of the rods, their velocity at the start, which is that of supports; None: they have no inertia."""
    if not case.heavy:
        return None
    from ..fluids.wrapped.mass import Mass

    system = rods.system
    inertia, velocity = np.zeros((2, len(rods.s), system.unknowns))
    for filament, where in zip(rods.filaments, rods.nodes, strict=True):
        if filament.mass is None:
            continue
        s, volume = rods.s[where], system.mesh.volume[where]
        inertia[where, :3] = (alone(filament.mass, s) * volume)[:, None]
        if filament.twisting is not None:
            inertia[where, 3] = rotary_inertia(filament, s) * volume
        if filament.velocity is not None:
            velocity[where, :3] = np.column_stack([alone(component, s) for component in filament.velocity])
    moment = START * case.time.end
    held = system.held(0.0, moment)
    velocity.ravel()[held.at] = held.value / moment
    return Mass(inertia, velocity)


def rotary_inertia(filament: Filament, s: np.ndarray) -> np.ndarray | float:
    """The moment of inertia about the tangent per length (k,) at arclengths s (k,): given, or that of a round rod."""
    if filament.rotary_inertia is not None:
        return alone(filament.rotary_inertia, s)
    if filament.mass is None or filament.radius is None:
        return 0.0
    return 0.5 * alone(filament.mass, s) * alone(filament.radius, s) ** 2


def thickness(model: FluidModel, rods: RodStack) -> Thickness | None:
    """The couple across the thickness of the rods; None where the case leaves it out."""
    if not model.case.fluid.thick:
        return None
    from ..fluids.wrapped.thickness import Thickness

    mesh, aspect = rods.system.mesh, model.case.fluid.aspect
    stiff = np.zeros(len(rods.s))
    for filament, where in zip(rods.filaments, rods.nodes, strict=True):
        if aspect is None:
            stiff[where] = along(model, filament, rods.s[where])
        else:
            drag = model.turning_drag(rods, where)
            assert drag is not None
            stiff[where] = drag / (filament.length * aspect**2)
    return Thickness(np.where(mesh.joined, stiff, 0.0), model.flow, float(np.min(mesh.ds[mesh.joined])))


def recorded_thickness(model: FluidModel, rods: Sequence[tuple[Filament, np.ndarray]]) -> Thickness | None:
    """The same of filaments with the arclengths of their nodes, as a run file has them."""
    if not model.case.fluid.thick:
        return None
    from ..fluids.wrapped.thickness import Thickness

    stiff = np.concatenate([along(model, filament, s) for filament, s in rods])
    return Thickness(stiff, model.flow, min(float(np.min(np.diff(s))) for _, s in rods))


def along(model: FluidModel, filament: Filament, s: np.ndarray) -> np.ndarray:
    """kappa eta a^2 (k,) of the segments after the nodes s (k,) of a filament, zero after the last."""
    from ..fluids.wrapped.thickness import KAPPA

    radius = np.full(len(s), model.line_radius) if filament.radius is None else half(alone(filament.radius, s))
    out: np.ndarray = KAPPA * model.case.fluid.viscosity * radius**2
    out[-1] = 0.0
    return out


def aspect_ratio(model: FluidModel, rods: RodStack, thick: Thickness, where: slice) -> float | None:
    """r_e = sqrt(K1/K2) of a filament as it begins; None where it is not straight, or K1 is not known."""
    r, length = rods.start.r[where], rods.system.mesh.ds[where.start : where.stop - 1]
    chord = r[-1] - r[0]
    off = np.linalg.norm(np.cross(r - r[0], chord), axis=1).max() / float(chord @ chord) if chord.any() else 1.0
    drag = model.turning_drag(rods, where) if off < STRAIGHT else None
    return None if drag is None else float(np.sqrt(drag / np.sum(thick.stiff[where][:-1] * length)))
