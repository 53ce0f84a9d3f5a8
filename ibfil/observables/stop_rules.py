"""Rules that end a run before its time: [[stop]] of a case. The first true one ends it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from .base import Observable
from .observers import ObservableSet

if TYPE_CHECKING:
    from ..case.observe import Stop
    from ..case.schema import Case


class StopRules:
    """The stop rules of a case, looked at once for each output in the order of time (as `ObservableSet.record`)."""

    def __init__(self, case: Case, observers: ObservableSet) -> None:
        self._rules, self._observers = case.stops, observers
        self._since: dict[int, float] = {}  # rule -> since when it holds

    def check(self, time: float) -> str:
        """Say which rule is true at this output; "" where none is."""
        for number, rule in enumerate(self._rules):
            why = self._holds(rule, time) if time >= rule.after * (1 - 1e-9) else ""
            if not why:
                self._since.pop(number, None)
                continue
            since = self._since.setdefault(number, time)
            if time - since >= rule.hold - 1e-9 * abs(time):
                value = float(self._observers.last(rule.observe))
                return f"stop.{number}: {rule.observe} = {value:.6g} {why} at t = {time:.6g}"
        return ""

    def _holds(self, rule: Stop, time: float) -> str:
        """Say how the rule holds, or "" where it does not."""
        value = float(self._observers.last(rule.observe))
        if rule.below is not None and value < rule.below:
            return f"is below {rule.below:.6g}"
        if rule.above is not None and value > rule.above:
            return f"is above {rule.above:.6g}"
        if rule.steady is not None and self._steady(rule.observe, rule.steady.over, rule.steady.change, time):
            return f"has changed by at most {rule.steady.change:.6g} of itself over {rule.steady.over:.6g}"
        return ""

    def _steady(self, name: str, over: float, change: float, time: float) -> bool:
        """Whether the values of the last ``over``, all of it past, lie within ``change`` of the largest."""
        slack = 1e-9 * abs(time)
        times, values = self._observers.since(name, time - over + slack)
        return bool(times[0] <= time - over + slack and np.ptp(values) <= change * np.abs(values).max())


def stop_faults(case: Case, observables: Mapping[str, Observable]) -> list[str]:
    """Return a line for each rule whose observable is not a single number at each output."""
    lines = []
    for number, rule in enumerate(case.stops):
        observable = observables.get(rule.observe)
        where = f"{case.file}: stop.{number}.observe: found {rule.observe}"
        if getattr(observable, "fitted", False):
            lines.append(f"{where}, known at the end only; allowed: what has a number at each output")
        elif getattr(observable, "vector", False):
            lines.append(f"{where}, a vector; allowed: a number, as with observe.{rule.observe}.along")
    return lines
