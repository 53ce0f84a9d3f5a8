"""An observable of all copies of a filament: their mean, how they spread, or a number for each.

Where the number of a copy is that of a series (a mean over time, the last ...), the mean and the spread over the copies
are taken at each output, and that is the series. Where it is fitted to a series, as a drift is, series and numbers are
each copy's, and the mean and the spread are of the numbers.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from ..case.copies import copy_name
from ..io.snapshots import Snapshot
from .base import KINDS, ObservableBase, Unfit, Value, plain
from .blocks import StandardError
from .local import OfFilament

if TYPE_CHECKING:
    from ..case.observe import Observe
    from ..case.schema import Case

_WORDS = {"mean": "the mean over all copies", "spread": "the standard deviation between copies", "all": "each copy"}


class OverCopies:
    """One observable of each copy of a filament, made as the first output tells how many there are.

    The series is (T,) or (T, 3) of the mean or spread; of each copy, (T, k) or (T, k, 3), where ``each`` is true. The
    number is a float or (3,), or with "all" (k,).
    """

    def __init__(self, case: Case, observe: Observe) -> None:
        self._case, self._observe, self._how, self._step = case, observe, observe.copies, case.output.copies_every
        self._made: dict[int, ObservableBase] = {}
        first = self._of(0)
        if not isinstance(first, OfFilament):
            raise Unfit("copies", observe.copies, f"nothing; {observe.kind} is of all filaments together")
        self.fitted, self.vector, self.average = first.fitted, first.vector or observe.of_each, first.average
        self.each = self.fitted or observe.of_each
        self.dimension, self.summary_dimension = first.dimension, first.summary_dimension
        whose = f"{_WORDS[self._how]} of {observe.filament}"
        named = copy_name(observe.filament, 0)
        self.words = first.words.replace(named, whose)
        self.description = first.description.replace(named, f"each copy of {observe.filament}" if self.each else whose)
        self.over, self.recorded, self.filament = first.over, first.recorded, observe.filament

    def _of(self, number: int) -> ObservableBase:
        """That of one of the copies that are written, by its place among them."""
        if number not in self._made:
            name = self._named(number)
            own = self._observe.model_copy(update={"copies": "none", "filament": name})
            self._made[number] = KINDS[own.kind](self._case, own)
        return self._made[number]

    def _named(self, number: int) -> str:
        """Its name."""
        return copy_name(self._observe.filament, number * self._step)

    def sample(self, snapshot: Snapshot) -> Value:
        """The mean or spread at one output, or the value of each copy (k,) or (k, 3)."""
        count = next(k for k in itertools.count() if self._named(k) not in snapshot.filaments)
        values = np.array([self._of(number).sample(snapshot) for number in range(count)], float)
        return values if self.each else plain(_OVER[self._how](values))

    def summary(self, times: np.ndarray, samples: np.ndarray) -> Value:
        """The number of the run, from its times (T,) and series."""
        if not self.each:
            return self._of(0).summary(times, samples)
        numbers = [self._of(k).summary(times, samples[:, k]) for k in range(samples.shape[1])]
        return plain(_OVER[self._how](np.array(numbers, float)))

    def quality(self, times: np.ndarray, samples: np.ndarray) -> str:
        """Of numbers that are fitted, how well that of the first copy fits, and how many copies have none."""
        if not self.each:
            return self._of(0).quality(times, samples)
        count = samples.shape[1]
        without = [k for k in range(count) if not np.all(np.isfinite(self._of(k).summary(times, samples[:, k])))]
        if without:
            first = self._named(without[0])
            return f"{len(without)} of {count} copies have no number, {first} being the first"
        found = self._of(0).quality(times, samples[:, 0])
        return f"{self._named(0)}: {found}" if found else ""

    def error(self, times: np.ndarray, samples: np.ndarray) -> StandardError | None:
        """The standard error of the mean over time of what the series is, where the run is thermal."""
        return None if self.each else self._of(0).error(times, samples)


def _spread(values: np.ndarray) -> np.ndarray:
    """The standard deviation over the first axis, of k - 1; of one copy no number."""
    return np.asarray(values.std(axis=0, ddof=1) if len(values) > 1 else np.full(values.shape[1:], np.nan))


_OVER = {"mean": lambda values: values.mean(axis=0), "spread": _spread, "all": lambda values: values}


def number_parts(case: Case, name: str, value: Value) -> dict[str, np.ndarray]:
    """The floats of an observable's number by label: "" of one, x, y, z of a vector, 000, 001 ... of copies."""
    entry = case.observe.get(name)
    return _parts(case, np.asarray(value, float)[None], entry is not None and entry.of_each, 0)


def series_parts(case: Case, name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    """The series (T,) that the series (T, ...) called ``name`` is of, by the same labels; 000_x with both."""
    entry = next((one for own, one in case.observe.items() if one.recorded(own) == name), None)
    each = entry is not None and (entry.of_each or (entry.over_copies and KINDS[entry.kind].fitted))
    return _parts(case, values, each, slice(None))


def _parts(case: Case, values: np.ndarray, each: bool, rows: int | slice) -> dict[str, np.ndarray]:
    every = case.output.copies_every
    copies = [(f"{k * every:03d}", (k,)) for k in range(values.shape[1])] if each else [("", ())]
    letters = [(letter, (k,)) for k, letter in enumerate("xyz")] if values.ndim > 1 + each else [("", ())]
    return {
        "_".join(filter(None, (number, letter))): values[(rows, *at, *axis)]
        for number, at in copies
        for letter, axis in letters
    }
