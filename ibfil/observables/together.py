"""The kinds of observable that are of all filaments together."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..io.snapshots import Snapshot
from .base import ObservableBase, Unfit
from .local import SUMMARY

if TYPE_CHECKING:
    from ..case.observe import Observe
    from ..case.schema import Case


class Dissipation(ObservableBase, kind="dissipation"):
    """Power turned into heat by the motion, all filaments together; with `part`, that part of it.

    flow: by the flow that forces drive, eta int |grad u|^2, and in rft by the drag of velocities; slip: between nodes
    and grid; spin: by spins about the tangent that the flow takes no part in (all of them but for rotation = "grid");
    couple: of thick rods in a background flow. The sum is the power of the filaments, less what they do upon a
    background flow and what sets a fluid with inertia in motion. It costs an evaluation of the fluid at each output.
    """

    keys: ClassVar[tuple[str, ...]] = ("part", *SUMMARY)
    dimension = "force length/time"
    description = "power turned into heat"

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        self._series = observe.heat

    def details(self, observe: Observe) -> dict[str, object]:
        """The part, by key."""
        return {"part": observe.part} if "part" in observe.model_fields_set else {}

    def sample(self, snapshot: Snapshot) -> float:
        """At one output; zero where the model has no such part."""
        return float(snapshot.diagnostics.get(self._series, 0.0))


class Flux(ObservableBase, kind="flux"):
    """Volume a time that all filaments together pump along a no-slip wall: sum of F_x z/(pi eta), x being `along`.

    It flows through any plane across it, far from the filaments or near.
    """

    keys: ClassVar[tuple[str, ...]] = ("along", *SUMMARY)
    along: ClassVar[tuple[float, float, float] | None] = (1.0, 0.0, 0.0)
    dimension = "length length length/time"
    description = "volume pumped along the wall a time, by the motion"

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        if observe.along is not None and observe.along[2] != 0.0:
            raise Unfit("along", observe.along, "a direction along the wall, z = 0")
        self._viscosity = case.fluid.viscosity

    def sample(self, snapshot: Snapshot) -> float:
        """At one output."""
        total = sum(f.force.T @ f.position[:, 2] for f in snapshot.filaments.values())
        return float(np.asarray(total) @ self.axis) / (np.pi * self._viscosity)
