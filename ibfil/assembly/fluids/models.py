"""The models of the fluid that a case may name: one class each, one line each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .base import FluidModel
from .free_space import FreeModel
from .navier_stokes import NavierStokesModel
from .resistive_force import ResistiveForceModel
from .shared import among
from .stokes import StokesModel
from .wall import WallModel

if TYPE_CHECKING:
    from ...case.schema import Case

MODELS: dict[str, type[FluidModel]] = {
    "rft": ResistiveForceModel,
    "stokes": StokesModel,
    "free": FreeModel,
    "wall": WallModel,
    "navier-stokes": NavierStokesModel,
}


def fluid_model(case: Case) -> FluidModel:
    """The model of the fluid that the case names. Raises CaseError where processes have nothing of it to share."""
    return among(MODELS[case.fluid.kind], case)
