"""From a case to its scheme in time, and its thermal noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import CaseError
from ..timestepping import base as timestepping_base
from ..timestepping import explicit, implicit, semi_implicit
from .stacked import RodStack

if TYPE_CHECKING:
    from ..case.schema import Case
    from ..timestepping.brownian import Noise
    from .fluids.base import FluidModel


SOFTEST = 0.02  # kT/(EA ds), the variance of a segment's strain: beyond it some soon leave the bounds of a run


def noise(case: Case, stacked: RodStack, fluid: FluidModel) -> Noise | None:
    """The thermal noise of the case in its fluid; None where it has none.

    Raises CaseError for segments so soft that their thermal stretch alone would end the run.
    """
    thermal = case.thermal
    if thermal is None:
        return None
    from ..timestepping.brownian import Noise

    faults = [_too_soft(case, stacked, k, thermal.energy) for k in range(len(stacked.nodes))]
    if any(faults):
        raise CaseError(list(dict.fromkeys(fault for fault in faults if fault)))
    moved = np.ones((len(stacked.s), stacked.system.unknowns))
    if thermal.planar:
        moved[:, 2] = 0.0
    for filament, where in zip(stacked.filaments, stacked.nodes, strict=True):
        if filament.twisting is None or not thermal.twist:
            moved[where, 3:] = 0.0
    return Noise(thermal.energy, thermal.seed, moved, fluid.drift(stacked))


def _too_soft(case: Case, stacked: RodStack, k: int, energy: float) -> str:
    """The fault of the ``k``th filament's EA; empty where it has none."""
    where, mesh = stacked.nodes[k], stacked.system.mesh
    here = slice(where.start, where.stop - 1)
    softness = energy / (stacked.system.stretching[here] * mesh.ds[here])
    worst = int(np.argmax(softness))
    if softness[worst] <= SOFTEST:
        return ""
    name = stacked.tables[k]
    stretching = stacked.system.stretching[where.start + worst]
    found = f"{stretching:g}, for a thermal stretch of {np.sqrt(softness[worst]):.2g} (rms) of a segment"
    allowed = f"at least {stretching * softness[worst] / SOFTEST:.3g} = kT/({SOFTEST:g} ds), or fewer nodes"
    return f"{case.file}: filament.{name}.stretching: found {found}; allowed: {allowed}"


def stepper(case: Case, noise: Noise | None) -> timestepping_base.Stepper:
    """The scheme of the case; with thermal forces the one that keeps their statistics."""
    if noise is not None:
        from ..timestepping.trapezoid import Trapezoid

        return Trapezoid(noise)
    if case.time.scheme == "explicit":
        return explicit.Explicit()
    if case.time.scheme == "semi-implicit":
        return semi_implicit.SemiImplicit()
    return implicit.Implicit(case.time.order, share=case.time.solver_error or 0.0)
