"""Errors that the base's own series tell, without a run: output times, the window, the scatter of a random run.

The window is halved where both halves hold whole periods of the forcing; a number whose halves differ has not settled.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..estimates import Estimate, estimate
from .levels import Base
from .numbers import Numbers, Recorded, average, own
from .results import Source

if TYPE_CHECKING:
    from collections.abc import Mapping

BLOCKS = 8
STUDENT = 2.3646  # t(0.975; 7 degrees of freedom)
_WHOLE = 0.02  # of a period: a window of so nearly whole ones


def cadence(recorded: Recorded) -> dict[str, Source]:
    """The error of output times, from every, second and fourth output."""
    values = [recorded.numbers(every) for every in (4, 2, 1)]
    scales, out = recorded.scales(), {}
    for key in values[0]:
        three = [numbers[key] for numbers in values]
        scale = max(*(abs(v) for v in three), scales[key])
        told = estimate(three, (4.0, 2.0, 1.0), 2.0, 2, scale)
        if not np.isfinite(told.doubt):
            out[key] = Source("outputs", True, None, "too few outputs to leave any out")
            continue
        out[key] = Source("outputs", True, told, "every, second, fourth output")
    return out


def window(recorded: Recorded, base: Base) -> dict[str, tuple[float, float]]:
    """The numbers that are taken over a window, over the two halves of it: one whose halves differ has not settled.

    No error of the number, which is of its window; whether that window stands for a longer one is for the user.
    """
    driven = base.simulation.drivers.period
    period = None if driven is None else driven.length
    out: dict[str, tuple[float, float]] = {}
    for name, one in recorded.observables.items():
        over = getattr(one, "over", None) or (float(recorded.time[0]), float(recorded.time[-1]))
        over = (max(over[0], float(recorded.time[0])), min(over[1], float(recorded.time[-1])))
        parts = halves(over, period)
        if parts is not None and average(one):
            first, last = (recorded.over(name, *part) for part in parts)
            out |= {key: (first[key], last[key]) for key in first}
    return out


def halves(over: tuple[float, float], period: float | None) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """The two halves of a window; of one of whole periods, as many whole ones from either end. None: of one period."""
    start, end = over
    middle = 0.5 * (start + end)
    if period is None or end - start < (1 - _WHOLE) * period:
        return (start, middle), (middle, end)
    count = round((end - start) / period)
    if abs(end - start - count * period) > _WHOLE * period * count:
        return (start, middle), (middle, end)
    if count < 2:
        return None
    half = (count // 2) * period
    return (start, start + half), (end - half, end)


def blocks(recorded: Recorded) -> dict[str, Source]:
    """The standard error of a random run's numbers, from eight parts of the window of each."""
    out: dict[str, Source] = {}
    value = recorded.numbers()
    for name, one in recorded.observables.items():
        mine = [key for key in value if own(key, recorded.observables) == name]
        if not average(one):
            words = "one output of a random run: `summary` = mean, or several seeds (--fine)"
            out |= {key: Source("seeds", True, None, words) for key in mine}
            continue
        over = getattr(one, "over", None) or (float(recorded.time[0]), float(recorded.time[-1]))
        edges = np.linspace(over[0], over[1], BLOCKS + 1)
        parts = [recorded.over(name, float(a), float(b)) for a, b in pairwise(edges)]
        out |= {key: _scatter([part[key] for part in parts], f"{BLOCKS} blocks of the window") for key in mine}
    return out


def between(numbers: Sequence[Numbers]) -> dict[str, Source]:
    """The same from runs with different random numbers, the first the base."""
    found: Mapping[str, list[float]] = {key: [one[key] for one in numbers] for key in numbers[0]}
    out = {}
    for key, values in found.items():
        mean = float(np.mean(values))
        spread = _scatter(values, f"{len(values)} seeds")
        assert spread.estimate is not None
        told = Estimate(values[0] - mean, spread.estimate.doubt, None, "", tuple(values))
        out[key] = Source("seeds", True, told, spread.words)
    return out


def _scatter(values: Sequence[float], words: str) -> Source:
    doubt = STUDENT * float(np.std(values, ddof=1)) / np.sqrt(len(values))
    return Source("seeds", True, Estimate(0.0, doubt, None, "", tuple(values)), words)
