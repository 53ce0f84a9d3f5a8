"""The kinds of observables whose number needs the whole run: drift, fits, and ratios of sums.

A fit's series in the run file is what it is fitted to. A ratio's series is the ratio so far.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..io.snapshots import Snapshot
from . import time_series
from .base import Value, plain
from .blocks import StandardError, rates_of_blocks, standard_error
from .local import Amplitude, AtPlace, Component, OfFilament
from .location import Location

if TYPE_CHECKING:
    from ..case.observe import Observe
    from ..case.schema import Case


class Drift(Component, kind="drift"):
    """Displacement over `over`, per time. The series is the position.

    Where an end of `over` lies between two outputs, the position there is on the straight line between them.
    """

    keys: ClassVar[tuple[str, ...]] = ("at", "space", "along", "over")
    fitted = True
    mean_only = True
    dimension = "length"
    summary_dimension = "length/time"
    description = "position"
    number = "drift (displacement over time)"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        return self.reduce(self.look(snapshot).position)

    def summary(self, times: np.ndarray, samples: np.ndarray) -> Value:
        """Return the mean velocity over `over`."""
        start, end = self.window(times)
        return plain(time_series.drift(times, samples, start, end))

    def error(self, times: np.ndarray, samples: np.ndarray) -> StandardError | None:
        """From the drifts over blocks."""
        start, end = self.window(times)
        if not self.random or end <= start:
            return None
        inside = (times >= start) & (times <= end)
        return standard_error(rates_of_blocks(times, samples), int(np.sum(inside)), start, end)


class Growth(Amplitude, kind="growth"):
    """Rate of exponential growth of the amplitude: least squares on its logarithm, or on that of its peaks.

    The series is the amplitude. As `time_series.growth`.
    """

    keys: ClassVar[tuple[str, ...]] = ("at", "space", "along", "over")
    fitted = True
    summary_dimension = "1/time"
    description = "distance from the line through the start"
    number = "growth rate of the distance from the line through the start"

    def summary(self, times: np.ndarray, samples: np.ndarray) -> Value:
        """Return the rate over `over`."""
        return self._fit(times, samples).value

    def quality(self, times: np.ndarray, samples: np.ndarray) -> str:
        """How well the rate fits, or why there is none."""
        return self._fit(times, samples).quality

    def _fit(self, times: np.ndarray, samples: np.ndarray) -> time_series.Fit:
        return time_series.growth(*time_series.cut(times, samples, *self.window(times)))


class AcrossAxis(AtPlace):
    """A fit to the motion in the plane across `along` (default x). The series (T, 3) is the vector seen."""

    keys: ClassVar[tuple[str, ...]] = ("at", "space", "along", "over")
    default_at = "finish"
    along = (1.0, 0.0, 0.0)
    fitted = True
    mean_only = True
    dimension = "length"

    @property
    def vector(self) -> bool:
        """Always."""
        return True

    def seen(self, times: np.ndarray, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return times (t,) and points (t, 2) in the plane, within `over`; right-handed with `along`."""
        assert self.axis is not None
        first = np.eye(3)[(int(np.argmax(np.abs(self.axis))) + 1) % 3]
        first = first - (first @ self.axis) * self.axis
        first /= np.linalg.norm(first)
        times, samples = time_series.cut(times, samples, *self.window(times))
        return times, samples @ np.column_stack([first, np.cross(self.axis, first)])


class Circularity(AcrossAxis, kind="circularity"):
    """Smaller over larger variance of the motion across `along`: 0 in a plane, 1 on a circle."""

    summary_dimension = "1"
    description = "position"
    number = "circularity of the path"

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        return self.point(self.look(snapshot).position)

    def summary(self, times: np.ndarray, samples: np.ndarray) -> Value:
        """Return the ratio over `over`."""
        return time_series.circularity(*self.seen(times, samples))


_CENTRES = {"start": "centroid"}  # where a place is seen from, if not from the start


class Frequency(AcrossAxis, kind="frequency"):
    """Angular frequency of rotation about `along` (default x), or of oscillation across it, radians per time.

    About the line through the node at s = 0, right-handed (`time_series.angular_rate`). The series is the position seen
    from that node (from the centroid where `at` is the start).
    """

    summary_dimension = "rad/time"
    description = "position seen from the start"
    number = "angular frequency of the position seen from the start"

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        self._centre = Location(self.s, _CENTRES.get(str(self.at), "start"))

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        position = self.look(snapshot).position
        return self.point(position) - self._centre.values(position)[0]

    def summary(self, times: np.ndarray, samples: np.ndarray) -> Value:
        """Return the rate over `over`."""
        return time_series.angular_rate(*self.seen(times, samples)).value

    def quality(self, times: np.ndarray, samples: np.ndarray) -> str:
        """How well the rate fits, or why there is none."""
        return time_series.angular_rate(*self.seen(times, samples)).quality


class Efficiency(OfFilament, kind="efficiency"):
    """Swimming efficiency, 2 pi eta L U^2/P, after Lighthill.

    The power that would draw the straight filament along itself as fast as it swims, by the paper's drag in
    every fluid, over the power it spends. U is the centroid's displacement (along `along` where given) since
    the start of `over`, per time, P the mean of `Power` since then, and of that of the bodies it is in.
    """

    keys = ("along", "over")
    description = "swimming efficiency, so far,"
    number = "swimming efficiency"

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        self._drag = 2 * np.pi * case.fluid.viscosity * self.length
        self._bodies = {end.body for end in (self.model.start, self.model.finish) if end.attached}
        self._begin: tuple[float, np.ndarray] | None = None
        self._before = (0.0, 0.0)  # time and power at the last output
        self._work = 0.0

    def sample(self, snapshot: Snapshot) -> Value:
        """Return the efficiency since the start of `over`."""
        filament, time = self.look(snapshot), snapshot.time
        centroid = self.share @ filament.position
        power = float(np.sum(filament.power)) + sum(snapshot.bodies[name].power for name in self._bodies)
        last, self._before = self._before, (time, power)
        if self._begin is None:
            if self.over is None or time >= self.over[0] - 1e-9 * abs(time):
                self._begin = (time, centroid)
            return float("nan")
        self._work += 0.5 * (power + last[1]) * (time - last[0])
        moved = centroid - self._begin[1]
        distance = float(np.linalg.norm(moved) if self.axis is None else moved @ self.axis)
        if self._work <= 0:
            return float("nan")
        return self._drag * distance**2 / (time - self._begin[0]) / self._work
