"""The observables of a run, and what they have recorded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..io.snapshots import Snapshot
from .base import Observable, Value, _shown, plain

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class Summary:
    """The number of one observable, and where it is a mean of a thermal run its standard error.

    ``note`` is not empty where it does not cover all that was asked for; ``doubt`` where its error is not well known.
    ``quality`` tells of a number that is fitted how well it fits, or why there is none.
    """

    value: Value
    note: str = ""
    quality: str = ""
    error: Value | None = None
    doubt: str = ""

    def __repr__(self) -> str:
        error = "" if self.error is None else f" +- {np.array2string(np.asarray(self.error), precision=2)}"
        said = [text for text in (self.note, self.quality, self.doubt) if text]
        return f"<{'; '.join([np.array2string(np.asarray(self.value), precision=6) + error, *said])}>"


class ObservableSet:
    """The observables of a run, and what they have seen."""

    def __init__(self, observables: Mapping[str, Observable]) -> None:
        self.observables = dict(observables)
        self._times: list[float] = []
        self._series: dict[str, list[Value]] = {name: [] for name in observables}

    def record(self, snapshot: Snapshot) -> dict[str, Value]:
        """Look at one output; the values by the names of their series."""
        values = {name: observable.sample(snapshot) for name, observable in self.observables.items()}
        self._times.append(snapshot.time)
        for name, value in values.items():
            self._series[name].append(value)
        return {self.recorded(name): value for name, value in values.items()}

    def recorded(self, name: str) -> str:
        """The name of an observable's series: its own, unless it is a number fitted to another quantity."""
        return str(getattr(self.observables[name], "recorded", lambda own: own)(name))

    @property
    def times(self) -> np.ndarray:
        """Times of the outputs seen (T,)."""
        return np.array(self._times)

    def series(self, name: str) -> np.ndarray:
        """Series (T,) or (T, 3) of one observable."""
        return np.array(self._series[name], float)

    def since(self, name: str, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return times and values from the last output at or before ``time`` on (else from the first one)."""
        first = max(int(np.searchsorted(self._times, time, side="right")) - 1, 0)
        return np.array(self._times[first:]), np.array(self._series[name][first:], float)

    def last(self, name: str) -> Value:
        """Return the value at the last output."""
        return self._series[name][-1]

    def summaries(self) -> dict[str, Summary]:
        """Return the number of every observable."""
        return summaries(self.observables, self.times, {name: self.series(name) for name in self.observables})


def _no_fit(times: np.ndarray, samples: np.ndarray) -> str:
    return ""


def summaries(
    observables: Mapping[str, Observable], times: np.ndarray, series: Mapping[str, np.ndarray]
) -> dict[str, Summary]:
    """Return the number of every observable from its series; noted where they end before `over` does."""
    found = {}
    for name, observable in observables.items():
        over, end, note = getattr(observable, "over", None), float(times[-1]), ""
        samples = np.asarray(series[name], float)
        value: Value = float("nan") if samples.ndim == 1 else np.full(samples.shape[1:], np.nan)
        if over is not None and end < over[1] - 1e-9 * abs(over[1]):
            note = f"seen until {end:.6g}, within `over` = {_shown(over)}"
        quality = ""
        if over is None or end >= over[0]:
            value = observable.summary(times, samples)
            quality = getattr(observable, "quality", _no_fit)(times, samples)
        found[name] = Summary(value, note, quality, *_error(observable, times, samples))
    return found


def _error(observable: Observable, times: np.ndarray, samples: np.ndarray) -> tuple[Value | None, str]:
    """The standard error of an observable that knows one, and what is doubtful about it."""
    find = getattr(observable, "error", None)
    found = find(times, samples) if find is not None and len(times) > 1 else None
    if found is None:
        return None, ""
    doubt = "" if found.settled else "it stays correlated over much of its window: its standard error is uncertain"
    return plain(found.value), doubt
