"""The search for the parameters: least squares on runs, the runs of one Jacobian side by side.

Runs are members of a study, named by their values: done ones are kept, so a fit that was cut goes on, bit for bit.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...errors import CaseError, RunFailed
from ..member import Member

if TYPE_CHECKING:
    from ..member import Outcome
    from .results import Parameter

_STEP = 1e-3  # of a difference, relative; below 1e-4 it meets the tolerance of the implicit steps
_LOOKS = 11  # least squares steps at most: 4 runs each for three parameters, and 3 at the end: 47
_SEVERAL = 15  # letters of a run's name

Make = Callable[[Sequence[Member]], "list[Outcome]"]
Measure = Callable[["Outcome"], np.ndarray]


@dataclass(frozen=True)
class Found:
    """Where the search ended: ``inner`` (p,), the residuals (n,) there, their central Jacobian (n, p)."""

    inner: np.ndarray
    residuals: np.ndarray
    jacobian: np.ndarray
    outcome: Outcome
    runs: int
    converged: bool


class Search:
    """The runs at values of the parameters, each made once, and their residuals."""

    def __init__(
        self, case: str, overrides: Sequence[str], parameters: Sequence[Parameter], make: Make, measure: Measure
    ) -> None:
        self.parameters = list(parameters)
        self._case, self._overrides, self._make, self._measure = case, tuple(overrides), make, measure
        self._known: dict[tuple[float, ...], tuple[np.ndarray | None, Outcome]] = {}
        self.low, self.high = (
            np.array([one.inner(bound) for one, bound in zip(parameters, bounds, strict=True)])
            for bounds in ([one.low for one in parameters], [one.high for one in parameters])
        )

    @property
    def runs(self) -> int:
        """How many runs were asked for."""
        return len(self._known)

    def values(self, inner: np.ndarray) -> tuple[float, ...]:
        """The values of the parameters."""
        return tuple(one.outer(float(x)) for one, x in zip(self.parameters, inner, strict=True))

    def member(self, values: Sequence[float]) -> Member:
        """The run at some values."""
        changes = [f"{one.key}={value!r}" for one, value in zip(self.parameters, values, strict=True)]
        name = "run_" + hashlib.sha256(json.dumps(changes).encode()).hexdigest()[:_SEVERAL]
        return Member(name, self._case, (*self._overrides, *changes))

    def at(self, points: Sequence[np.ndarray]) -> list[np.ndarray | None]:
        """The residuals (n,) at each place; None where the run failed. Raises Interrupted."""
        wanted = [self.values(point) for point in points]
        new = [values for values in dict.fromkeys(wanted) if values not in self._known]
        outcomes = self._make([self.member(values) for values in new])
        for values, outcome in zip(new, outcomes, strict=True):
            self._known[values] = (self._measure(outcome) if outcome.done else None, outcome)
        return [self._known[values][0] for values in wanted]

    def beside(self, members: Sequence[Member]) -> list[tuple[Outcome, np.ndarray | None]]:
        """Other runs than those of parameters: how each ended, and its residuals (n,), None where it failed."""
        return [(one, self._measure(one) if one.done else None) for one in self._make(members)]

    def outcome(self, inner: np.ndarray) -> Outcome:
        """How the run there ended."""
        return self._known[self.values(inner)][1]

    def residuals(self, inner: np.ndarray) -> np.ndarray:
        """The residuals; infinite where the run failed, so that the step is halved."""
        found = self.at([inner])[0]
        size = next((len(r) for r, _ in self._known.values() if r is not None), 1)
        return np.full(size, np.inf) if found is None else found

    def jacobian(self, inner: np.ndarray) -> np.ndarray:
        """By forward differences, backward ones where a bound is near."""
        moved = [inner + self._unit(i, _STEP if x + _STEP < self.high[i] else -_STEP) for i, x in enumerate(inner)]
        self.at([inner, *moved])
        return np.stack([self._slope(inner, point, i) for i, point in enumerate(moved)], axis=1)

    def central(self, inner: np.ndarray) -> np.ndarray:
        """By central differences, as far as the bounds allow."""
        up = [inner + self._unit(i, min(_STEP, self.high[i] - x)) for i, x in enumerate(inner)]
        down = [inner - self._unit(i, min(_STEP, x - self.low[i])) for i, x in enumerate(inner)]
        self.at([*up, *down])
        return np.stack([self._slope(b, a, i) for i, (a, b) in enumerate(zip(up, down, strict=True))], axis=1)

    def _unit(self, i: int, step: float) -> np.ndarray:
        return step * np.eye(len(self.low))[i]

    def _slope(self, a: np.ndarray, b: np.ndarray, i: int) -> np.ndarray:
        first, second = self.at([a, b])
        if first is None or second is None:
            self.refuse(a if first is None else b)
        return np.asarray((np.asarray(second) - np.asarray(first)) / (b[i] - a[i]))

    def refuse(self, inner: np.ndarray) -> None:
        """Raise RunFailed for a place where the run fails."""
        where = ", ".join(f"{p.key} = {v:.6g}" for p, v in zip(self.parameters, self.values(inner), strict=True))
        raise RunFailed(f"fit: the run fails at {where}: {self.outcome(inner).message}; allowed: bounds without such")


def search(runs: Search, start: np.ndarray) -> Found:
    """The least squares from ``start`` (p,) within the bounds. Raises RunFailed, Interrupted, CaseError."""
    from scipy.optimize import least_squares

    first = runs.at([start])[0]
    if first is None:
        runs.refuse(start)
    if len(np.asarray(first)) < len(start):
        raise CaseError([f"fit: found {len(np.asarray(first))} numbers in the data; allowed: at least {len(start)}, "
                         "one a parameter"])  # fmt: skip
    edge = 1e-6 * (runs.high - runs.low)
    found = least_squares(
        runs.residuals,
        np.clip(start, runs.low + edge, runs.high - edge),
        runs.jacobian,
        bounds=(runs.low, runs.high),
        x_scale=1.0,
        ftol=1e-8,
        xtol=1e-6,
        gtol=1e-12,
        max_nfev=_LOOKS,
    )
    jacobian = runs.central(found.x)
    return Found(found.x, found.fun, jacobian, runs.outcome(found.x), runs.runs, found.status > 0)
