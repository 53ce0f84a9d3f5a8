"""A model of the fluid, as a case names it: what makes the fluid, and all that is told of it.

One class a model, listed in models.py. Checks, budgets, warnings and pictures ask the model about its fluid;
none of them compares a word of the case.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from .. import costs

if TYPE_CHECKING:
    from ...case.filament import Filament
    from ...case.schema import Case
    from ...fluids.base import Flow, Fluid
    from ...fluids.output import FluidOutput
    from ...fluids.resistive_force import Drag, ResistiveForce
    from ...fluids.spaces.flow_of_forces import FlowOfForces
    from ...grid.periodic_grid import Lattice
    from ...io.snapshots import Snapshot
    from ...rods.geometry import Configuration
    from ...timestepping.brownian import Drift
    from ..stacked import RodStack


class Term(NamedTuple):
    """A term of the model: seconds a step and bytes, from counts."""

    name: str
    seconds: float
    bytes: float


class Scene(Protocol):
    """The part of a simulation that the warnings of a fluid need: rods and their present state."""

    @property
    def rods(self) -> RodStack:
        """The rods of the scene."""

    @property
    def configuration(self) -> Configuration:
        """Their present configuration."""

    def nodes(self, name: str) -> slice:
        """The range of nodes of a filament, or of its first copy."""

    def snapshot(self) -> Snapshot:
        """The snapshot of the present state."""


class FluidModel(ABC):
    """A model of the fluid in a case. Nothing is made before it is asked for."""

    def __init__(self, case: Case) -> None:
        self.case = case

    # -- the fluid itself

    @abstractmethod
    def build(self, rods: RodStack) -> Fluid:
        """The fluid that answers to these rods. Raises CaseError where it cannot be made."""

    def drift(self, rods: RodStack) -> Drift:
        """The drift of these rods' thermal motion in it. Only where thermal forces are allowed."""
        raise NotImplementedError(self.case.fluid.model)

    @abstractmethod
    def output(self, rods: RodStack, fluid: Fluid) -> FluidOutput:
        """Its outputs besides the motion of the rods."""

    @cached_property
    def grid(self) -> Lattice | None:
        """The points at which its fields are written; None where there are none."""
        return None

    @cached_property
    def flow(self) -> Flow | None:
        """The background velocity (k, 3) at places r (k, 3) and a time; None where the case has none."""
        from ..flow import flow

        return flow(self.case)

    def refuse(self, r: np.ndarray) -> None:  # noqa: B027  (most fluids have no end)
        """Nothing; raises StepFailed where nodes r (n, 3) have left the fluid, so that a step is not taken."""

    def solved(self, rods: RodStack) -> list[str]:
        """Lines on the system that a step solves; none where there is nothing to tell."""
        return []

    def method(self, rods: RodStack) -> str:
        """How velocities are found."""
        return self.case.fluid.model

    def transforms(self, rods: RodStack) -> bool:
        """Whether steps transform fields, by plans that are worth keeping."""
        return False

    # -- what a step costs

    def seconds(self, rods: RodStack) -> dict[str, float]:
        """Estimated seconds of a step by each method that the fluid has, from counts."""
        return {self.case.fluid.model: costs.of_rods(self.case, len(rods.s))}

    @abstractmethod
    def terms(self, rods: RodStack, memory: Mapping[str, float], step: float) -> list[Term]:
        """The fluid's terms in a step of length ``step``, given the bytes of large arrays by name."""

    def memory(self, rods: RodStack) -> dict[str, float]:
        """Bytes of its large arrays, by what they are for."""
        return {}

    # -- the speeds of the scene

    @property
    def spacing(self) -> float | None:
        """The spacing of the points that nodes push; None where there are none."""
        return None

    @abstractmethod
    def drag(self, filament: Filament) -> float:
        """A drag per length across, for time scales."""

    def turning_drag(self, rods: RodStack, where: slice) -> float | None:
        """Torque per rate of turning a straight filament, nodes ``where``, about its middle; None: not known."""
        return None

    @abstractmethod
    def local_drag(self, rods: RodStack) -> Drag:
        """The drag of every node by itself: all there is in resistive-force theory; elsewhere for time scales."""

    def local_fluid(self, rods: RodStack) -> ResistiveForce:
        """The fluid of that drag, in the background flow."""
        from ...fluids.resistive_force import Drag, ResistiveForce

        mesh, twists = rods.system.mesh, rods.twists.astype(float) if rods.system.unknowns == 4 else None
        spacing = float(np.min(mesh.ds[mesh.joined]))
        if not rods.bodies:
            return ResistiveForce(self.local_drag(rods), rods.system.profile, self.flow, twists, spacing)
        from ...fluids.resistive_bodies import ResistiveWithBodies
        from ..drag import body_drag

        own = Drag(*(each[: rods.count] for each in self.local_drag(rods)))
        twists = None if twists is None else twists[: rods.count]
        return ResistiveWithBodies(body_drag(self.case, rods), own, rods.system.profile, self.flow, twists, spacing)

    def automatic_limit(self, longest: float) -> float:
        """The longest automatic step, given the ``longest`` that the fluid's own motion allows."""
        return longest

    # -- what is told

    @abstractmethod
    def modelled(self) -> list[str]:
        """The effects it models, a line each."""

    @abstractmethod
    def absent(self) -> list[str]:
        """The effects it leaves out, a line each."""

    fluid_inertia_absent: str = "inertia of the fluid"
    rod_inertia = "inertia of the rods"

    def size(self) -> list[str]:
        """Lines about its grid and what that makes of a rod."""
        return []

    def remarks(self) -> list[str]:
        """Lines about what a step takes."""
        return []

    steps_known = True  # whether the number of steps is known beforehand

    def step_lines(self) -> list[str]:
        """Lines about limits of the step."""
        return []

    def groups(self, filament: Filament, rate: float) -> dict[str, float]:
        """Dimensionless groups of a filament that the fluid brings; ``rate``: of what drives it, radians a time."""
        return {}

    def warnings_of(self, scene: Scene, name: str, groups: Mapping[str, float]) -> list[str]:
        """Warnings about a filament in this fluid, given its dimensionless groups."""
        return []

    def warnings(self, scene: Scene) -> list[str]:
        """Warnings about the whole scene."""
        return []

    # -- pictures and recorded runs

    @property
    def box(self) -> np.ndarray | None:
        """The sides (3,) of a periodic box, centred on the origin; None where the fluid is not periodic."""
        return None

    wall: float | None = None  # the height z of a wall below the fluid; None where there is none

    @property
    def line_radius(self) -> float | None:
        """The hydrodynamic radius that the fluid gives a line of nodes; None where nodes have none of their own."""
        return None

    flow_from_forces = False  # whether recorded forces alone tell the flow at any point

    def solve_for_flow(self) -> FlowOfForces:
        """The solver for the velocity that recorded forces drive. Only where ``flow_from_forces``."""
        raise NotImplementedError(self.case.fluid.model)
