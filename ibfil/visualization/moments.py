"""The moments of a run that a figure shows: its window of time, and the outputs drawn as shapes.

Shapes of a scene that repeats itself are those of its last period: evenly spaced over the run they would alias the
beat. Elsewhere they are evenly spaced over the window.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import CaseError
from ..simulation.simulation import Simulation
from .style import with_unit

if TYPE_CHECKING:
    from ..io.reader import RunFile


SHAPES = 14  # shapes drawn of each filament, where none are asked for
LINES = 60  # of all filaments together
FEWEST = 4  # outputs of a period that show it


class Look(NamedTuple):
    """How the figure of a run is wanted.

    Times ``begin`` to ``end``, by default the whole run; ``shapes`` of each filament; ``co_moving``: shapes are seen
    from the centroid of all filaments.
    """

    begin: float | None = None
    end: float | None = None
    shapes: int | None = None
    co_moving: bool = False


class Moments(NamedTuple):
    """The outputs ``span`` of a window, the outputs ``shapes`` that are drawn, ``words`` for these."""

    span: slice
    shapes: np.ndarray
    words: str


def moments(run: RunFile, look: Look) -> Moments:
    """The moments of a run. Raises CaseError for a window without an output, and a number of shapes below 1."""
    times = np.asarray(run.time)
    begin, end = (times[k] if t is None else t for k, t in ((0, look.begin), (-1, look.end)))
    slack = 1e-9 * (times[-1] - times[0])
    inside = np.flatnonzero((times >= begin - slack) & (times <= end + slack))
    if not len(inside):
        allowed = f"a window with outputs, within {times[0]:g} to {times[-1]:g}"
        raise CaseError([f"--from, --to: found {begin:g}, {end:g}; allowed: {allowed}"])
    if look.shapes is not None and look.shapes < 1:
        raise CaseError([f"--shapes: found {look.shapes}; allowed: 1 or more"])
    count = look.shapes or max(1, min(SHAPES, LINES // max(len(run.filaments), 1)))
    unit, whole = run.case.units.time, len(inside) == len(times)
    span = slice(int(inside[0]), int(inside[-1]) + 1)
    of_period = _of_period(run, times[span], count, slack)
    if of_period is not None:
        length, picked = of_period
        return Moments(span, picked + span.start, f"over the last period of {with_unit(length, unit)}")
    picked = np.unique(nearest(times[span], np.linspace(times[span][0], times[span][-1], count)))
    if count == 1:
        picked = np.array([span.stop - span.start - 1])
        return Moments(span, picked + span.start, f"at {with_unit(times[span][-1], unit)}")
    return Moments(span, picked + span.start, f"{len(picked)} over the {'run' if whole else 'window'}")


def nearest(times: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The numbers of the times nearest to the wanted ones."""
    return np.argmin(np.abs(times[:, None] - wanted), axis=0)


def _of_period(run: RunFile, times: np.ndarray, count: int, slack: float) -> tuple[float, np.ndarray] | None:
    """The last period within the window: its length, and outputs evenly over it; None where there is none."""
    period = Simulation(run.case).drivers.period if count > 1 else None
    if period is None or times[-1] - period.length < max(times[0], period.since) - slack:
        return None
    start = times[-1] - period.length  # which is the same phase as the end
    if np.count_nonzero(times > start + slack) < FEWEST:
        return None
    return period.length, np.unique(nearest(times, start + period.length * np.arange(1, count + 1) / count))
