"""When a run writes what."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from ..case.schema import Case


SAME = 1e-9  # of the run's length: times nearer than that are one


class Due(NamedTuple):
    """A time at which the filaments are written, or fields, or both."""

    time: float
    output: bool
    fields: bool


def due_times(case: Case, grid: bool, end: float | None = None) -> list[Due]:
    """All times of outputs and fields up to ``end``, by default that of the case; start and end are always outputs.

    Where ``grid`` is False (a fluid without one) there are no fields. Times that are equal but for rounding
    are one.
    """
    output, end = case.output, case.time.end if end is None else end
    times = output.times or () if output.every is None else _multiples(output.every, end)
    outputs = _distinct([0.0, *times, end], end)
    fields = np.array(_multiples(output.grid_every, end) if grid and output.grid_every else [])
    every = _distinct([*outputs, *fields], end)
    columns = zip(every, _among(every, outputs, end), _among(every, fields, end), strict=True)
    return [Due(float(time), bool(first), bool(second)) for time, first, second in columns]


def lasts(case: Case, grid: bool) -> bool:
    """Whether a longer run has, to the bit, the same outputs and fields at the time at which this one ends."""
    last = due_times(case, grid)[-1]
    return last in due_times(case, grid, 2 * case.time.end)


def meets(began: Case, case: Case, time: float, grid: bool) -> bool:
    """Whether steps from ``time`` on lead to the same next output in a case that goes on with another one."""
    a, b = ([due.time for due in due_times(one, grid)] for one in (began, case))
    both = set(a) & set(b)
    return time in both or min((t for t in (*a, *b) if t > time), default=time) in both


def _multiples(every: float, end: float) -> list[float]:
    return [k * every for k in range(int(end / every * (1 + SAME)) + 1)]


def _distinct(times: Sequence[float], end: float) -> np.ndarray:
    """In order, the first of those that are one; ``end`` stays exact."""
    ordered = np.unique(times)
    kept = ordered[np.diff(ordered, prepend=-np.inf) > SAME * end]
    kept[np.abs(kept - end) <= SAME * end] = end
    return kept


def _among(times: np.ndarray, others: np.ndarray, end: float) -> np.ndarray:
    """Which of ``times`` are among the ``others``."""
    if len(others) == 0:
        return np.zeros(len(times), bool)
    after = np.clip(np.searchsorted(others, times), 0, len(others) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.minimum(np.abs(others[after] - times), np.abs(others[before] - times))
    return nearest <= SAME * end
