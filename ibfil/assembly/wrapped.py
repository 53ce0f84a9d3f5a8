"""From a case to a fluid around its fluid: what rods feel of their own velocity. Where that is nothing, the fluid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .profiles import alone, half

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..fluids.base import Fluid
    from ..fluids.wrapped.thickness import Thickness
    from .fluids.base import FluidModel
    from .stacked import RodStack

STRAIGHT = 1e-6  # of its length: deviation of a straight rod's nodes from a line


class Surrounding(NamedTuple):
    """The fluid as rods know it, the fluid inside it, and the couple across the thickness of the rods, or None."""

    fluid: Fluid
    inner: Fluid
    thickness: Thickness | None


def surrounding(model: FluidModel, rods: RodStack) -> Surrounding:
    """The fluid of the model around these rods. Raises CaseError where it cannot be made."""
    inner, thick = model.build(rods), thickness(model, rods)
    if thick is None:
        return Surrounding(inner, inner, None)
    from ..fluids.wrapped.fluid import Wrapped

    return Surrounding(Wrapped(inner, [thick], rods.system.profile.width), inner, thick)


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
