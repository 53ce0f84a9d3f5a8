"""The observables of a run as plain numbers: whole, from fewer outputs, over parts of their window, moved back.

A vector is three numbers, NAME_x, NAME_y, NAME_z.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ...observables.factory import observers
from ...observables.observers import summaries

if TYPE_CHECKING:
    from ...io.reader import RunFile
    from ...observables.base import Observable

Numbers = dict[str, float]


def flat(values: Mapping[str, np.ndarray | float]) -> Numbers:
    """Numbers () and vectors (3,) by component."""
    out: Numbers = {}
    for name, value in values.items():
        if np.ndim(value):
            out |= {f"{name}_{letter}": float(part) for letter, part in zip("xyz", np.asarray(value), strict=True)}
        else:
            out[name] = float(value)
    return out


def own(name: str, observables: Iterable[str]) -> str:
    """The observable that a number is of."""
    known = set(observables)
    return name if name in known else name[:-2]


class Numbered(Protocol):
    """Numbers of a run, and the same of other runs of its scene."""

    def numbers(self) -> Numbers:
        """They themselves."""
        ...

    def of(self, run: RunFile) -> Numbered:
        """The same of another run."""
        ...

    def back(self, run: RunFile, shift: np.ndarray) -> Numbers:
        """The same of a run whose rods stand ``shift`` (3,) aside, as if they did not."""
        ...

    def scales(self) -> Numbers:
        """The sizes by which round-off is told, of numbers that vanish too."""
        ...


class Recorded:
    """The observables of a run and their series."""

    def __init__(self, run: RunFile, wanted: Sequence[str]) -> None:
        self.case, self.time = run.case, np.array(run.time)
        known = observers(run.case).observables
        self.observables: dict[str, Observable] = {name: known[name] for name in wanted}
        self.series = {name: np.array(run.observables[run.case.observe[name].recorded(name)]) for name in wanted}

    def of(self, run: RunFile) -> Recorded:
        """The same observables of another run."""
        return Recorded(run, tuple(self.observables))

    def back(self, run: RunFile, shift: np.ndarray) -> Numbers:
        """The numbers of a run whose rods stand ``shift`` (3,) aside, as if they did not."""
        known = moved_back(run, shift)
        return {key: known[key] for key in self.numbers()}

    def numbers(self, every: int = 1) -> Numbers:
        """The summaries; with ``every`` above 1 from each so many outputs only, counted back from the last."""
        found: Numbers = {}
        for name, one in self.observables.items():
            keep = _kept(one, self.time, every)
            found |= self._summed({name: one}, self.time[keep], {name: self.series[name][keep]})
        return found

    def over(self, name: str, start: float, end: float) -> Numbers:
        """The summary of one observable over another window."""
        fresh = observers(self.case).observables[name]
        fresh.over = (start, end)  # type: ignore[attr-defined]
        return self._summed({name: fresh}, self.time, self.series)

    def _summed(
        self, observables: Mapping[str, Observable], time: np.ndarray, series: Mapping[str, np.ndarray]
    ) -> Numbers:
        """The summaries of series; no number where they cannot be had."""
        found: dict[str, np.ndarray | float] = {}
        for name, one in observables.items():
            try:
                found[name] = np.asarray(summaries({name: one}, time, series)[name].value, float)
            except (ValueError, IndexError, ZeroDivisionError, np.linalg.LinAlgError):
                found[name] = np.full(series[name].shape[1:], np.nan)
        return flat(found)

    def scales(self) -> Numbers:
        """The largest change of each series, over the time of its window where the number is a rate."""
        out: Numbers = {}
        for name, one in self.observables.items():
            change = np.nanmax(np.ptp(self.series[name], axis=0))
            if one.summary_dimension != one.dimension:
                over = getattr(one, "over", None) or (self.time[0], self.time[-1])
                ratio = change if one.summary_dimension.startswith(one.dimension.split("/")[0]) else 1.0
                change = ratio / max(over[1] - over[0], 1e-300)
            out[name] = float(change)
        return {key: out[own(key, out)] for key in self.numbers()}


def average(one: Observable) -> bool:
    """Whether an observable is a mean or a fit over a window, and not the value of one output."""
    return bool(getattr(one, "average", False))


def _kept(one: Observable, time: np.ndarray, every: int) -> np.ndarray:
    """Each so many outputs, counted back from the last, and the first of the observable's window."""
    start = (getattr(one, "over", None) or (time[0],))[0]
    first = int(np.argmin(time < start - 1e-9 * abs(start)))
    return np.union1d(np.arange(len(time) - 1, -1, -every), first)


def moved_back(run: RunFile, shift: np.ndarray) -> Numbers:
    """The numbers of a run whose rods stand ``shift`` (3,) aside, as if they did not."""
    seen = observers(run.case)
    for snapshot in run.snapshots():
        filaments = {
            name: replace(filament, position=filament.position - shift) for name, filament in snapshot.filaments.items()
        }
        seen.record(replace(snapshot, filaments=filaments))
    return flat({name: np.asarray(one.value, float) for name, one in seen.summaries().items()})
