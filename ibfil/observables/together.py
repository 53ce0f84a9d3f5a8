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
    """Power that the fluid turns into heat, all filaments together: eta int |grad u|^2 on a grid, else F.(u - u0).

    On a grid it is that of the flow alone: slip, and spins with rotation = "local", turn more into heat beside it. It
    costs an evaluation of the fluid at each output there.
    """

    keys: ClassVar[tuple[str, ...]] = SUMMARY
    dimension = "force length/time"
    description = "power turned into heat by the fluid, by the motion"

    def sample(self, snapshot: Snapshot) -> float:
        """At one output."""
        return float(snapshot.diagnostics["dissipation"])


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
