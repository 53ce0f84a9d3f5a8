"""From a case to its scheme in time, and its thermal noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..timestepping import base as timestepping_base
from ..timestepping import explicit, implicit, semi_implicit
from . import drag
from .stacked import RodStack

if TYPE_CHECKING:
    from ..case.schema import Case
    from ..timestepping.brownian import Noise


def noise(case: Case, stacked: RodStack) -> Noise | None:
    """The thermal noise of the case; None where it has none."""
    thermal = case.thermal
    if thermal is None:
        return None
    from ..timestepping.brownian import Noise

    system = stacked.system
    return Noise(
        drag.drag(case, stacked),
        system.mesh,
        system.ends.index,
        system.unknowns,
        thermal.energy,
        thermal.seed,
        thermal.directions == "xy",
        thermal.twist,
    )


def stepper(case: Case, noise: Noise | None) -> timestepping_base.Stepper:
    """The scheme of the case; with thermal forces the one that keeps their statistics."""
    if noise is not None:
        from ..timestepping.brownian import Trapezoid

        return Trapezoid(noise)
    if case.time.scheme == "explicit":
        return explicit.Explicit()
    if case.time.scheme == "semi-implicit":
        return semi_implicit.SemiImplicit()
    return implicit.Implicit(case.time.order)
