"""A case assembled: its rods, its fluid, its noise, its scheme."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING

from ..assembly import rods as assembly_rods
from ..assembly import scheme
from ..assembly.fluids.models import fluid_model
from ..assembly.wrapped import aspect_ratio, surrounding

if TYPE_CHECKING:
    from ..assembly.fluids.base import FluidModel
    from ..assembly.stacked import RodStack
    from ..case.schema import Case
    from ..fluids.base import Fluid
    from ..fluids.wrapped.mass import Mass
    from ..fluids.wrapped.thickness import Thickness
    from ..grid.periodic_grid import Lattice
    from ..rods.constitutive import MomentLaw
    from ..timestepping.base import Stepper
    from ..timestepping.brownian import Noise


@dataclass(frozen=True)
class Model:
    """A scene put together. Nothing in it changes as a run goes on, but for what fluid, contact and noise remember.

    ``fluid`` is what the rods move in; ``inner`` the same, or what is in it (fluids/wrapped), ``thickness`` the couple
    across the rods and ``mass`` their inertia, where there is one. ``method`` names the fluid's path.
    """

    case: Case
    rods: RodStack
    fluid_model: FluidModel
    fluid: Fluid
    inner: Fluid
    thickness: Thickness | None
    mass: Mass | None
    method: str
    noise: Noise | None
    stepper: Stepper

    @property
    def grid(self) -> Lattice | None:
        """The points at which the fluid's fields are written; None where there are none."""
        return self.fluid_model.grid

    def nodes(self, name: str) -> slice:
        """The range of nodes of the filament of that name, or of its first copy."""
        names = self.rods.names
        return self.rods.nodes[names.index(name if name in names else f"{name}_000")]

    @cached_property
    def aspect_ratios(self) -> dict[str, float]:
        """The effective aspect ratios of the filaments that are straight at the start, where rods are thick."""
        if self.thickness is None:
            return {}
        found = {
            name: aspect_ratio(self.fluid_model, self.rods, self.thickness, self.nodes(name))
            for name in self.case.filaments
        }
        return {name: ratio for name, ratio in found.items() if ratio is not None}

    @cached_property
    def transforms(self) -> bool:
        """Whether steps transform fields."""
        return self.fluid_model.transforms(self.rods)

    @cached_property
    def seconds(self) -> dict[str, float]:
        """Estimated seconds of a step by each method the fluid has, from counts."""
        return self.fluid_model.seconds(self.rods)


def assemble(case: Case, laws: Mapping[str, MomentLaw] = MappingProxyType({}), wisdom: str = "") -> Model:
    """The scene of a case. ``laws`` are constitutive laws made in Python, by filament; ``wisdom`` FFTW plans.

    Raises CaseError where it cannot be built.
    """
    rods = assembly_rods.rods(case, laws)
    described = fluid_model(case)
    if case.fluid.on_grid:
        from ..grid import fft

        fft.learn(wisdom)
    fluid, method = surrounding(described, rods), described.method(rods)
    noise = scheme.noise(case, rods, described)
    return Model(case, rods, described, *fluid, method, noise, scheme.stepper(case, noise))
