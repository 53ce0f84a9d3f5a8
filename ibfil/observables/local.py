"""The kinds of observables a case may name, `kind = ...` in [observe.NAME], that are read off each output.

One class a kind. Points between nodes are on the cubic through the four nodes around them; directions are in
the lab frame. Those whose number is fitted to the whole run are in fitted.py.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..case.filament import single
from ..case.spacing import node_arclength
from ..errors import CaseError
from ..io.snapshots import FilamentSnapshot, Snapshot
from .base import ObservableBase, Unfit, Value
from .location import Location, reduced
from .time_series import trapezoid_weights

if TYPE_CHECKING:
    from ..case.observe import Observe
    from ..case.schema import Case


SUMMARY = ("over", "summary")
POINTS = "start, finish, middle, an arclength or a window [s1, s2]"


MEANS, WINDOWS = ("mean",), ("mean", "max", "min")  # what may be asked of the points of a window


class OfFilament(ObservableBase):
    """A kind that looks at one filament; ``s`` (N,) is its arclength."""

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        filament = single(case.filaments, self.filament)
        assert filament is not None  # case/consistency/scene.py
        self.model = filament
        self.length, self.s = filament.length, node_arclength(filament)
        self.share = trapezoid_weights(self.s) / self.length  # (N,) of each node in the filament

    def look(self, snapshot: Snapshot) -> FilamentSnapshot:
        """Return this filament at one output. Raises CaseError for a copy beyond those that a file has placed."""
        if self.filament not in snapshot.filaments:
            names = list(snapshot.filaments)
            raise CaseError([f'an observable: filament: found "{self.filament}"; allowed: {names[0]} to {names[-1]}'])
        return snapshot.filaments[self.filament]


class AtPlace(OfFilament):
    """A kind that looks at a point, or at a window through `space`."""

    keys: ClassVar[tuple[str, ...]] = ("at", "space", *SUMMARY)
    default_at: ClassVar[str] = "centroid"  # where one looks for what is said of a filament as a whole
    refused: ClassVar[tuple[str, ...]] = ()  # names of places that mean nothing here
    mean_only: ClassVar[bool] = False  # of a window

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        self.at = observe.at if "at" in observe.model_fields_set else self.default_at
        if self.at in self.refused:
            raise Unfit("at", self.at, POINTS)
        self.space = observe.space
        mean_only = self.mean_only or self.vector
        if isinstance(self.at, tuple) and self.space not in (MEANS if mean_only else WINDOWS):
            words = '"mean"' if mean_only else '"mean", "max" or "min"'
            more = "" if self.mean_only or not self.vector else '; "max" and "min" with `along`'
            raise Unfit("space", self.space, f"{words} where `at` is a window{more}")
        self.location = Location(self.s, self.at)

    def details(self, observe: Observe) -> dict[str, object]:
        """Where it looks, always."""
        found = super().details(observe)
        return {"at": found.get("at", self.default_at), **found}

    def point(self, field: np.ndarray) -> np.ndarray:
        """Return a nodal field (N, 3) at the point, or its mean over the window: (3,)."""
        return self.location.reduced(self.location.values(field), "mean")


class Component(AtPlace):
    """A vector at a place, or its component along `along`."""

    keys: ClassVar[tuple[str, ...]] = ("at", "space", "along", *SUMMARY)

    @property
    def vector(self) -> bool:
        """Without `along`."""
        return self.axis is None

    def reduce(self, field: np.ndarray) -> Value:
        """Return the component (or vector) of a nodal field (N, 3) at the place."""
        if self.axis is None:
            return self.point(field)
        return float(self.location.reduced(self.location.values(field @ self.axis), self.space))


class Position(Component, kind="position"):
    """Position r, or its component."""

    dimension = "length"
    description = "position"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        return self.reduce(self.look(snapshot).position)


class Velocity(Component, kind="velocity"):
    """Velocity u, or its component, over the step that led to the output (at t = 0: over the first)."""

    dimension = "length/time"
    description = "velocity"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        return self.reduce(self.look(snapshot).velocity)


class Displacement(Component, kind="displacement"):
    """Position minus that at the first output, or its component."""

    dimension = "length"
    description = "displacement since the start"

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        self._first: np.ndarray | None = None

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        position = self.look(snapshot).position
        if self._first is None:
            self._first = position.copy()
        return self.reduce(position - self._first)


class Speed(AtPlace, kind="speed"):
    """Size of the velocity |u|, that of the point; `drift` and `velocity` along a direction tell how fast one swims."""

    dimension = "length/time"
    description = "speed"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        values = np.linalg.norm(self.location.values(self.look(snapshot).velocity), axis=1)
        return float(self.location.reduced(values, self.space))


class Amplitude(AtPlace, kind="amplitude"):
    """Distance from the line through the node at s = 0 along `along` (default x)."""

    keys: ClassVar[tuple[str, ...]] = ("at", "space", "along", *SUMMARY)
    default_at = "finish"
    along = (1.0, 0.0, 0.0)
    dimension = "length"
    description = "distance from the line through the start"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        position = self.look(snapshot).position
        across = distance_across(self.location.values(position) - position[0], self.axis)
        return float(self.location.reduced(across, self.space))


class Twist(AtPlace, kind="twist"):
    """Strain Omega_3."""

    default_at = "finish"
    refused = ("centroid",)
    dimension = "rad/length"
    description = "twist Omega_3"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        values = self.location.values(self.look(snapshot).strain[:, 2])
        return float(self.location.reduced(values, self.space))


class Stretch(AtPlace, kind="stretch"):
    """Length over rest length, minus 1, of the segment that holds the place.

    In a window: of the segments whose middles lie in it.
    """

    default_at = "finish"
    refused = ("centroid",)
    description = "stretch of the segments"

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        self.ds = np.diff(self.s)
        if isinstance(self.at, tuple):
            middles = self.s[:-1] + 0.5 * self.ds
            self.chosen = np.nonzero((middles >= self.at[0]) & (middles <= self.at[1]))[0]
            if len(self.chosen) == 0:
                raise Unfit("at", self.at, "a window that holds the middle of a segment")
        else:
            named = {"start": 0.0, "middle": 0.5 * self.length, "finish": self.length}
            where = float(named[self.at] if isinstance(self.at, str) else self.at)
            self.chosen = np.array([min(int(np.searchsorted(self.s[1:], where)), len(self.ds) - 1)])

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        lengths = np.linalg.norm(np.diff(self.look(snapshot).position, axis=0), axis=1)
        values, weights = (lengths / self.ds - 1.0)[self.chosen], self.ds[self.chosen]
        return float(reduced(self.space, weights / weights.sum(), values))


class EndToEnd(OfFilament, kind="end_to_end"):
    """Distance of the two ends."""

    keys = SUMMARY
    dimension = "length"
    description = "distance of the two ends"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        position = self.look(snapshot).position
        return float(np.linalg.norm(position[-1] - position[0]))


class TurnAngle(OfFilament, kind="turn_angle"):
    """Angle the chord from start to finish has turned through since the first output.

    With `along`: about that axis, right-handed and continuous (less than half a turn from one output to the
    next). Without: between the two directions, from 0 to pi.
    """

    keys: ClassVar[tuple[str, ...]] = ("along", *SUMMARY)
    dimension = "rad"
    description = "angle the chord has turned since the start"

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        self._first: np.ndarray | None = None
        self._last = 0.0

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        position = self.look(snapshot).position
        chord = position[-1] - position[0]
        if self.axis is not None:
            chord = chord - (chord @ self.axis) * self.axis
        if self._first is None:
            self._first = chord
        turned = np.cross(self._first, chord)
        if self.axis is None:
            return float(np.arctan2(np.linalg.norm(turned), self._first @ chord))
        angle = float(np.arctan2(turned @ self.axis, self._first @ chord))
        self._last = angle + 2 * np.pi * round((self._last - angle) / (2 * np.pi))
        return self._last


def distance_across(points: np.ndarray, axis: np.ndarray | None) -> np.ndarray:
    """Distance (m,) of points (m, 3) from the line through the origin along ``axis``."""
    assert axis is not None  # these kinds have a default
    return np.linalg.norm(np.cross(points, axis), axis=1)
