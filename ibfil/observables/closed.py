"""The kinds of observables that look at a closed filament: its linking number, writhe and twist."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from ..io.snapshots import Snapshot
from ..rods.linking import Linking, linking, writhe
from .base import Unfit, Value
from .local import SUMMARY, OfFilament

if TYPE_CHECKING:
    from ..case.observe import Observe
    from ..case.schema import Case


class OfClosed(OfFilament):
    """A number of a closed filament."""

    keys: ClassVar[tuple[str, ...]] = SUMMARY
    of_frame: ClassVar[bool] = True  # whether it needs a filament that twists

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        if not self.model.closed or (self.of_frame and self.model.twisting is None):
            raise Unfit("filament", self.filament, "one that is closed" + (", and twists" if self.of_frame else ""))

    def numbers(self, snapshot: Snapshot) -> Linking:
        """All of them at one output."""
        seen = self.look(snapshot)
        return linking(seen.position, seen.e1)


class LinkingNumber(OfClosed, kind="linking"):
    """Linking number Lk of the axis and the line beside it along e1: a whole number (rods/linking.py)."""

    description = "linking number"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        return float(self.numbers(snapshot).linking)


class Writhe(OfClosed, kind="writhe"):
    """Writhe Wr of the axis: how often it crosses itself with its sign, the mean over all directions of view."""

    description = "writhe"
    of_frame = False

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        return writhe(self.look(snapshot).position)


class TotalTwist(OfClosed, kind="total_twist"):
    """Total twist Tw = Lk - Wr, turns of e1 about the tangent."""

    description = "total twist"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        return self.numbers(snapshot).twist
