"""The kinds of observables that look at the nodes of a window, or of the whole filament, or at an end's support."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..io.snapshots import FilamentSnapshot, Snapshot
from .base import Unfit, Value
from .local import SUMMARY, OfFilament, distance_across
from .location import Location

if TYPE_CHECKING:
    from ..case.observe import Observe
    from ..case.schema import Case


SUPPORTS = {"start": (-1.0, 0), "finish": (1.0, -1)}  # sign of the moment that a support gives, and its node


class Windowed(OfFilament):
    """A kind that looks at the nodes of a window, by default the whole filament."""

    keys: ClassVar[tuple[str, ...]] = ("at", *SUMMARY)
    supports: ClassVar[bool] = False  # whether start and finish stand for the supports there

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        at = observe.at if "at" in observe.model_fields_set else (0.0, self.length)
        self.at: tuple[float, float] = (0.0, self.length)
        self.end = ""
        if isinstance(at, tuple):
            self.at = at
        elif self.supports and at in SUPPORTS:
            self.end = str(at)
            if not getattr(self.model, self.end).held:
                raise Unfit("at", at, "an end that is held; a free end has no support")
        else:
            words = '"start" or "finish" for the support there, ' if self.supports else ""
            raise Unfit("at", at, f"{words}a window [s1, s2], or nothing for the whole filament")
        slack = 1e-9 * self.length
        self.inside = (self.s >= self.at[0] - slack) & (self.s <= self.at[1] + slack)


class Radius(Windowed, kind="radius"):
    """Distance of a window's points from its centroid, across `along` (default x): their mean, max or min."""

    keys: ClassVar[tuple[str, ...]] = ("at", "space", "along", *SUMMARY)
    along = (1.0, 0.0, 0.0)
    dimension = "length"
    description = "distance from the centroid, across the axis"

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        self.space = observe.space
        if not observe.reduces:
            raise Unfit("space", self.space, '"mean", "max" or "min"')
        self.location = Location(self.s, self.at)

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        points = self.location.values(self.look(snapshot).position)
        across = distance_across(points - self.location.reduced(points, "mean"), self.axis)
        return float(self.location.reduced(across, self.space))


class OnFluid(Windowed):
    """A vector or its component: summed over the nodes of a window, or of the support of an end."""

    keys: ClassVar[tuple[str, ...]] = ("at", "along", *SUMMARY)
    supports = True

    @property
    def vector(self) -> bool:
        """Without `along`."""
        return self.axis is None

    def component(self, value: np.ndarray) -> Value:
        """Return the component of a vector (3,), or itself."""
        return value if self.axis is None else float(value @ self.axis)


class Force(OnFluid, kind="force"):
    """Force of a window's nodes on the fluid, over the step to the output; at start or finish, of the support there."""

    dimension = "force"
    description = "force"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        filament = self.look(snapshot)
        if self.end:
            return self.component(getattr(filament, f"reaction_{self.end}"))
        return self.component(filament.force[self.inside].sum(axis=0))


class Torque(OnFluid, kind="torque"):
    """Torque of a window's nodal forces on the fluid about the filament's centroid, twist torques included.

    At start or finish: the couple of the support there on the filament, -M(0) or M(L).
    """

    dimension = "force length"
    description = "torque"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        filament = self.look(snapshot)
        if self.end:
            sign, node = SUPPORTS[self.end]
            return self.component(sign * _lab_moment(filament, self.s, node))
        arms = filament.position - self.share @ filament.position
        torque = np.cross(arms, filament.force)
        if filament.torque is not None:
            torque = torque + filament.torque
        return self.component(torque[self.inside].sum(axis=0))


class Power(Windowed, kind="power"):
    """Power of a window's nodal forces and twist torques on the fluid, sum of F.u + T.w."""

    dimension = "force length/time"
    description = "power on the fluid"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        filament = self.look(snapshot)
        return float(np.sum(filament.power[self.inside]))


def _lab_moment(filament: FilamentSnapshot, s: np.ndarray, node: int) -> np.ndarray:
    """Moment (3,) at an end node in the lab frame; its tangent by one-sided differences of second order."""
    three = slice(0, 3) if node == 0 else slice(-3, None)
    e1 = filament.e1[node]
    tangent = np.gradient(filament.position[three], s[three], axis=0, edge_order=2)[node]
    tangent = tangent - (tangent @ e1) * e1
    e3 = tangent / np.linalg.norm(tangent)
    return filament.moment[node] @ np.array([e1, np.cross(e3, e1), e3])
