"""The numbers of a run: what observables, stop rules and expectations have in common.

An observable gives one value at every output, its series, which the run file keeps, and one number at the
end, its summary. The kinds a case may name are in observables.py and observables_fitted.py; from Python any object with
the attributes of `Observable` may be added to a run.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np

from . import time_series
from .errors import CaseError
from .frames import Frame

if TYPE_CHECKING:
    from .case_schema import Case, Observe

Value = float | np.ndarray


class Observable(Protocol):
    """One number, or vector (3,), at every output, and one of the whole run.

    ``dimension`` and ``summary_dimension`` are as in units.py, ``description`` says what the series is.
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

    def sample(self, frame: Frame) -> Value:
        """Value at this output."""
        ...

    def summary(self, times: np.ndarray, samples: np.ndarray) -> Value:
        """Value for the run, from its times (T,) and samples (T,) or (T, 3)."""
        ...


@dataclass(frozen=True)
class Summary:
    """The number of one observable; ``note`` is not empty where it does not cover all that was asked for."""

    value: Value
    note: str = ""


class Observers:
    """The observables of a run, and what they have seen."""

    def __init__(self, observables: Mapping[str, Observable]) -> None:
        self.observables = dict(observables)
        self._times: list[float] = []
        self._series: dict[str, list[Value]] = {name: [] for name in observables}

    def take(self, frame: Frame) -> dict[str, Value]:
        """Look at one output; the values by name."""
        values = {name: observable.sample(frame) for name, observable in self.observables.items()}
        self._times.append(frame.time)
        for name, value in values.items():
            self._series[name].append(value)
        return values

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


def summaries(
    observables: Mapping[str, Observable], times: np.ndarray, series: Mapping[str, np.ndarray]
) -> dict[str, Summary]:
    """Return the number of every observable from its series; noted where the run ended before `over` did."""
    found = {}
    for name, observable in observables.items():
        over, end, note = getattr(observable, "over", None), float(times[-1]), ""
        samples = np.asarray(series[name], float)
        value: Value = float("nan") if samples.ndim == 1 else np.full(3, np.nan)
        if over is not None and end < over[1] - 1e-9 * abs(over[1]):
            note = f"the run ended at {end:.6g}, within `over` = {_shown(over)}"
        if over is None or end >= over[0]:
            value = observable.summary(times, samples)
        found[name] = Summary(value, note)
    return found


def observers(case: Case, extra: Mapping[str, Observable] | None = None) -> Observers:
    """Make the observables of a case, and take in ``extra`` ones made in Python.

    Raises CaseError, a line for each observable or stop rule that asks for what its kind does not have.
    """
    from . import observables, observables_fitted  # noqa: F401  (they fill KINDS)
    from .stops import stop_faults

    made: dict[str, Observable] = {}
    faults: list[str] = []
    for name, observe in case.observe.items():
        try:
            made[name] = KINDS[observe.kind](case, observe)
        except Unfit as fault:
            faults.append(f"{case.file}: observe.{name}.{fault}")
    if not faults:
        made.update(extra or {})
        faults = stop_faults(case, made)
    if faults:
        raise CaseError(faults)
    return Observers(made)


class Unfit(Exception):
    """An observable's key that its kind does not have, or not so."""

    def __init__(self, key: str, found: object, allowed: str) -> None:
        super().__init__(f"{key}: found {_shown(found)}; allowed: {allowed}")


def _shown(found: object) -> str:
    if isinstance(found, Sequence) and not isinstance(found, str):
        return "[" + ", ".join(f"{value:g}" for value in found) + "]"
    return f'"{found}"' if isinstance(found, str) else str(found)


class Kind:
    """What the kinds of case files share: the keys `along`, `over` and `summary`. A kind adds ``sample``.

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
        self.over, self._how = observe.over, observe.summary
        along = observe.along or self.along
        self.axis = None if along is None else np.array(along) / np.linalg.norm(along)
        details = [f"{key} = {_shown(getattr(observe, key))}" for key in ("at", "along", "space") if key in given]
        self.description = ", ".join([f"{self.description} of {observe.filament}", *details])
        how = "" if self.fitted or observe.summary == "last" else f"{observe.summary} over time of "
        over = [] if observe.over is None else [f"over = {_shown(observe.over)}"]
        what = f"{self.number or how + type(self).description} of {observe.filament}"
        self.words = ", ".join([what, *details, *over])

    def sample(self, frame: Frame) -> Value:
        """Value at one output."""
        raise NotImplementedError

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
        if self._how == "mean":
            return plain(time_series.mean(times, samples, start, end))
        _, values = time_series.cut(times, samples, start, end)
        if len(values) == 0:
            return plain(np.full(samples.shape[1:], np.nan))
        if self._how == "last":
            return plain(values[-1])
        if self._how == "median":
            return plain(np.median(values, axis=0))
        return plain(values.max(axis=0) if self._how == "max" else values.min(axis=0))


KINDS: dict[str, type[Kind]] = {}


def kinds_text() -> str:
    """What each kind of observable is and which keys it has, for `ibfil schema`."""
    from . import observables, observables_fitted  # noqa: F401  (they fill KINDS)

    lines = ["The kinds of [observe.NAME]: what each takes at an output, or of the run, and the keys it has"]
    for name, kind in KINDS.items():
        meaning = " ".join((kind.__doc__ or "").split("\n\n")[0].split()).rstrip(".")
        line = f"{name}: {meaning} ({', '.join(kind.keys)})"
        lines.append(textwrap.fill(line, 112, initial_indent="  ", subsequent_indent="      "))
    return "\n".join(lines)


def plain(value: np.ndarray) -> Value:
    """Return a float for an array (), any other array as it is."""
    return float(value) if np.ndim(value) == 0 else np.asarray(value)
