"""The length of steps in a scene: what bounds it, and the control that follows from that.

An automatic step of the implicit schemes is a 25th of the shortest period of what goes on: of what is prescribed to
change in time at that time, of what pushes rods by their length, and of how fast a disturbance grows. Where nothing
repeats, the rods are on their way to rest, or to a steady motion: steps begin at a 25th of the slowest bending time,
and become longer as far as the motion lets them without an error of 1e-3 of the length over the run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..timestepping.stability_limit import explicit_limit
from ..timestepping.step_control import AdaptiveStep, FixedStep, StepControl
from . import thermal_step, timescales
from .driving.breaks import Breaks
from .driving.drivers import Drivers
from .growth_watch import GrowthWatch, may_grow

if TYPE_CHECKING:
    from ..timestepping.base import State
    from .model import Model

POINTS_A_PERIOD = 25  # of an automatic step
POINTS_BY_ERROR = 3  # the least of what is prescribed where an error decides, which cannot tell what steps pass over
GROWTH_BY_ERROR = 7  # the same of growth: a mode that grows by e in a step and more comes out with the wrong sign
POINTS_GIVEN = 20  # the least that a given step is not warned of
LONG_PHASE = 2 * np.pi / POINTS_GIVEN  # omega dt above which it is
AUTOMATIC_ERROR = 1e-3  # of the length, over a run: of a step that grows as rods go to rest
_HALVINGS = 40
OTHER_STEPS = (
    "time.step is auto, which looks at the whole run: with this time.end other steps would have been taken from the "
    "start, so the numbers differ from those of one run by as much as steps err; a given time.step goes on bit for bit"
)
OWN = "the rods' own growth or swing under what acts on them"


class Choice(NamedTuple):
    """The control of a scene, what decided on its first step, and what lets it grow, if anything does."""

    control: StepControl
    reason: str
    longest: float
    growth: str


def choose(model: Model, drivers: Drivers) -> Choice:
    """How the steps of a scene are chosen: equal ones, or by their error."""
    time, system = model.case.time, model.rods.system
    growth = 2.0 if model.stepper.order == 2 else np.inf
    if time.tolerance is not None:
        first, reason = (float(time.step), "given") if not time.automatic else _shortest(model, drivers)
        rate = 2 * np.pi / (POINTS_A_PERIOD * first)
        return Choice(AdaptiveStep(time.tolerance, rate, np.inf, time.order, system.length), reason, time.end, "error")
    if not time.automatic:
        given = _ramped(model, float(time.step)) if _thermal(model) else FixedStep(float(time.step), growth)
        return Choice(given, "given", float(time.step), "")
    if time.explicit:
        limit = explicit_limit(system, model.inner, model.rods.start, 0.0)
        return Choice(FixedStep(0.5 * limit, growth), "half the limit of the explicit scheme", 0.5 * limit, "")
    first, reason = _shortest(model, drivers)
    if _thermal(model):
        longest = thermal_step.longest_step(model, first)
        reason = reason if longest == first else "thermal kicks, which are to stay small"
        return Choice(_ramped(model, longest), reason, longest, "")
    longest, pushed = _pushed(model, drivers)
    if drivers.repeating or longest <= first or model.mass is not None:
        return Choice(FixedStep(first, growth), reason, first, "")
    rate, error = 2 * np.pi / (POINTS_A_PERIOD * first), AUTOMATIC_ERROR / time.end
    control = AdaptiveStep(error, rate, min(longest, time.end), time.order, system.length, first)
    return Choice(control, reason, min(longest, time.end), pushed)


def _thermal(model: Model) -> bool:
    return model.noise is not None and model.noise.energy > 0


def _ramped(model: Model, step: float) -> StepControl:
    """Equal steps after short ones that double, so that the stiffest motions have their thermal spread at once."""
    return FixedStep(step, 2.0, explicit_limit(model.rods.system, model.inner, model.rods.start, 0.0))


def _pushed(model: Model, drivers: Drivers) -> tuple[float, str]:
    """The step that what pushes the rods asks for; infinite where nothing does."""
    rate = timescales.load_rate(model, drivers)
    return (_part(rate), "the time in which loads or flow move a rod by its length") if rate else (np.inf, "the run")


def _part(rate: float) -> float:
    """A 25th of the period of a rate."""
    return float(2 * np.pi / rate / POINTS_A_PERIOD)


def _shortest(model: Model, drivers: Drivers) -> tuple[float, str]:
    """The step that what repeats or pushes asks for; where nothing repeats, relaxation does too. And which it was."""
    bounds = [_pushed(model, drivers)]
    if drivers.repeating:
        bounds.append((_part(drivers.repeating), "the shortest period of what is prescribed in time"))
    else:
        slowest = timescales.slowest_bending(model)
        bounds.append((slowest / POINTS_A_PERIOD, "the slowest bending time"))
    inertial = timescales.inertial_time(model)
    if min(bounds)[0] < inertial < np.inf:  # what passes within a step leaves no more than a start
        bounds.append((inertial / POINTS_A_PERIOD, "the time of the rods' inertia"))
    step, what = min(bounds)
    return step, f"a {POINTS_A_PERIOD}th of {what}"


def is_long(step: float, rate: float) -> bool:
    """Whether a given step is too long for a rate (radians a time)."""
    return step * rate > LONG_PHASE * (1 + 1e-9)


def too_long(step: float, what: str, rate: float) -> str:
    """The warning about a given step that is."""
    period = 2 * np.pi / rate
    return (
        f"time.step: {step:g} is {step / period:.2g} of {period:.3g}, the shortest period of {what}: with fewer than "
        f"{POINTS_GIVEN} steps a period numbers are wrong by per cents and more, and growth may be lost or go the "
        f'other way; take {period / POINTS_A_PERIOD:.2g}, step = "auto", or time.tolerance'
    )


class StepLimits:
    """How long the next step may be for what drives a scene, and for what grows in it; and where steps have to end."""

    def __init__(self, model: Model, drivers: Drivers) -> None:
        time = model.case.time
        self._drivers, self.follows = drivers, time.automatic or time.tolerance is not None
        by_error = time.tolerance is not None
        self._points = POINTS_BY_ERROR if by_error else POINTS_A_PERIOD
        self._steady = not by_error  # whether a steady spin counts, which an error can tell
        self._points_of_growth = GROWTH_BY_ERROR if by_error else POINTS_A_PERIOD
        watched = may_grow(model) and not time.explicit and not model.rods.bodies
        self.growth = GrowthWatch(model) if watched else None
        self.breaks = Breaks(drivers.jumps, time.end)

    def longest(self, state: State, steps: int, length: float) -> float:
        """The longest next step, after ``steps`` of them and where ``length`` is wanted; infinite if that may be."""
        rate = self.growth_rate(state, steps, length)
        if not self.follows:
            return np.inf
        limit = 2 * np.pi / (self._points_of_growth * rate) if rate else np.inf
        return min(limit, self._driven(state.time, min(length, limit)))

    def growth_rate(self, state: State, steps: int, length: float) -> float:
        """How fast the fastest disturbance grows, in radians a time."""
        if self.growth is None:
            return 0.0
        self.growth.look(state, steps, length)
        return self.growth.rate

    @property
    def begun(self) -> float:
        """The rate of growth that a given step has to be told of: found since the start; 0 where there is none."""
        return 0.0 if self.follows or self.growth is None or self.growth.at_start else self.growth.rate

    def _driven(self, time: float, length: float) -> float:
        """The longest step for the driving within it: towards something fast, half of the way at a time."""
        wanted = length
        for _ in range(_HALVINGS):
            rate = self._drivers.rate(time, time + length, self._steady)
            allowed = 2 * np.pi / (self._points * rate) if rate else np.inf
            if allowed >= length * (1 - 1e-9):
                return np.inf if length == wanted else length
            length = max(allowed, 0.5 * length)
        return length

    def state(self) -> dict[str, float]:
        """The state of the watch for growth, by name: part of a run's state."""
        return {} if self.growth is None else self.growth.state()

    def restore(self, state: dict[str, float]) -> None:
        """Takes up what ``state`` gave."""
        if self.growth is not None:
            self.growth.restore(state)
