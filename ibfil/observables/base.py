"""The numbers of a run: what observables, stop rules and expectations have in common.

An observable gives one value at every output, its series, which the run file keeps, and one number at the
end, its summary. The kinds a case may name are in local.py and fitted.py; from Python any object with
the attributes of `Observable` may be added to a run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol

import numpy as np

from ..io.snapshots import Snapshot
from . import time_series
from .blocks import StandardError, means_of_blocks, standard_error

if TYPE_CHECKING:
    from ..case.observe import Observe
    from ..case.schema import Case


Value = float | np.ndarray


class Observable(Protocol):
    """One number, or vector (3,), at every output, and one of the whole run.

    ``dimension`` and ``summary_dimension`` are as in io/units.py, ``description`` says what the series is.
    ``sample`` is called once for each output in the order of time, from the first one on, also when a run
    that was cut goes on.
    """

    @property
    def dimension(self) -> str:
        """Of the series."""
        ...

    @property
    def summary_dimension(self) -> str:
        """Of the summary."""
        ...

    @property
    def description(self) -> str:
        """Of the series, in words."""
        ...

    def sample(self, snapshot: Snapshot) -> Value:
        """Value at this output."""
        ...

    def summary(self, times: np.ndarray, samples: np.ndarray) -> Value:
        """Value for the run, from its times (T,) and samples (T,) or (T, 3)."""
        ...


class Unfit(Exception):
    """An observable's key that its kind does not have, or not so."""

    def __init__(self, key: str, found: object, allowed: str) -> None:
        super().__init__(f"{key}: found {_shown(found)}; allowed: {allowed}")


def _shown(found: object) -> str:
    if isinstance(found, Sequence) and not isinstance(found, str):
        return "[" + ", ".join(f"{value:g}" for value in found) + "]"
    return f'"{found}"' if isinstance(found, str) else str(found)


class _Reduction(NamedTuple):
    """One way to make a number of a series: what it is called before the series' name, and its function."""

    words: str
    of: Callable[[np.ndarray, np.ndarray, float, float], np.ndarray]
    average: bool = False  # over half a window it tends to what it is over the whole


def _over(reduce: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray, np.ndarray, float, float], np.ndarray]:
    """A reduction of the samples between two times; no number where there are none."""

    def of(times: np.ndarray, samples: np.ndarray, start: float, end: float) -> np.ndarray:
        _, values = time_series.cut(times, samples, start, end)
        return reduce(values) if len(values) else np.full(samples.shape[1:], np.nan)

    return of


_SUMMARIES = {
    "last": _Reduction("", _over(lambda values: values[-1])),
    "mean": _Reduction("mean over time of ", time_series.mean, average=True),
    "median": _Reduction("median over time of ", _over(lambda values: np.median(values, axis=0)), average=True),
    "max": _Reduction("max over time of ", _over(lambda values: values.max(axis=0))),
    "min": _Reduction("min over time of ", _over(lambda values: values.min(axis=0))),
}


class ObservableBase:
    """The base of the kinds of a case: the keys `along`, `over` and `summary`. A kind adds ``sample``.

    ``keys`` are those that mean something to it; any other is refused. ``over`` is the window or None,
    ``axis`` the direction `along` (3,) or None, ``words`` says what the summary is.
    """

    keys: ClassVar[tuple[str, ...]] = ()
    along: ClassVar[tuple[float, float, float] | None] = None  # where it is not given
    fitted: ClassVar[bool] = False  # the summary is a fit to the series
    dimension = "1"
    summary_dimension = "1"
    description = ""  # of the series
    number: ClassVar[str] = ""  # what the summary is, where it is a fit

    def __init_subclass__(cls, kind: str = "") -> None:
        """Enter the class as the kind of that name. Only a fit's dimension is not its series' own."""
        if kind:
            KINDS[kind] = cls
        if not cls.fitted:
            cls.summary_dimension = cls.dimension

    def __init__(self, case: Case, observe: Observe) -> None:
        given = sorted(observe.model_fields_set - {"kind", "filament"})
        for key in given:
            if key not in self.keys and getattr(observe, key) != type(observe).model_fields[key].default:
                allowed = f"nothing; {observe.kind} has {', '.join(self.keys)}"
                raise Unfit(key, getattr(observe, key), allowed)
        self.filament = observe.filament
        self.random = case.thermal is not None and case.thermal.energy > 0
        self.over, self._how, self.recorded = observe.over, observe.summary, observe.recorded
        along = observe.along or self.along
        self.axis = None if along is None else np.array(along) / np.linalg.norm(along)
        details = [f"{key} = {_shown(value)}" for key, value in self.details(observe).items()]
        whose = "all filaments" if observe.together else getattr(observe, observe.looks_at)
        self.description = ", ".join([f"{self.description} of {whose}", *details])
        how = "" if self.fitted else _SUMMARIES[observe.summary].words
        over = [] if observe.over is None else [f"over = {_shown(observe.over)}"]
        what = f"{self.number or how + type(self).description} of {whose}"
        self.words = ", ".join([what, *details, *over])

    def details(self, observe: Observe) -> dict[str, object]:
        """Where and along what it looks, by key: what is told beside its name."""
        return {key: getattr(observe, key) for key in ("at", "along", "space") if key in observe.model_fields_set}

    def sample(self, snapshot: Snapshot) -> Value:
        """Value at one output."""
        raise NotImplementedError

    @property
    def average(self) -> bool:
        """Whether the summary is a mean or a fit over a window, and not the value of one output."""
        return self.fitted or _SUMMARIES[self._how].average

    @property
    def vector(self) -> bool:
        """Whether the series is (T, 3)."""
        return False

    def window(self, times: np.ndarray) -> tuple[float, float]:
        """Start and end of `over`, as far as the run went."""
        start, end = (times[0], times[-1]) if self.over is None else self.over
        return float(max(start, times[0])), float(min(end, times[-1]))

    def summary(self, times: np.ndarray, samples: np.ndarray) -> Value:
        """Return the last, mean (over time), max, min or median of the outputs in `over`."""
        start, end = self.window(times)
        return plain(_SUMMARIES[self._how].of(times, samples, start, end))

    def quality(self, times: np.ndarray, samples: np.ndarray) -> str:
        """How well the summary fits the series, or why there is none; "" where nothing is fitted."""
        return ""

    def error(self, times: np.ndarray, samples: np.ndarray) -> StandardError | None:
        """The standard error of a mean over time, where the run is thermal; None where there is none."""
        start, end = self.window(times)
        if not self.random or self.fitted or _SUMMARIES[self._how].of is not time_series.mean or end <= start:
            return None
        inside = int(np.sum((times >= start) & (times <= end)))
        return standard_error(means_of_blocks(times, samples), inside, start, end)


KINDS: dict[str, type[ObservableBase]] = {}


def plain(value: np.ndarray) -> Value:
    """Return a float for an array (), any other array as it is."""
    return float(value) if np.ndim(value) == 0 else np.asarray(value)
