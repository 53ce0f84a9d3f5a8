"""The error bars of a scene's numbers, and where they come from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..estimates import Estimate, combined


@dataclass(frozen=True)
class Source:
    """One source of error of one number: the estimate, or why there is none.

    ``numerical``: it goes to zero with effort, the scene the same; else it is a choice, which makes another scene.
    ``words`` say where the estimate comes from.
    """

    name: str
    numerical: bool
    estimate: Estimate | None
    words: str

    @property
    def size(self) -> float:
        """The error and its doubt together; infinite where it is not known."""
        return np.inf if self.estimate is None else abs(self.estimate.error) + self.estimate.doubt


@dataclass(frozen=True)
class Bar:
    """One number of a run with all its sources of error."""

    name: str
    value: float
    words: str  # of the observable
    unit: str
    sources: tuple[Source, ...]
    nothing: str = ""  # why it is no number at all
    halves: tuple[float, float] | None = None  # the number over the two halves of its window

    def of(self, numerical: bool) -> list[Estimate]:
        """The estimates of one kind that are known."""
        return [one.estimate for one in self.sources if one.numerical is numerical and one.estimate is not None]

    @property
    def whole(self) -> bool:
        """Whether every numerical source is known; else the bar is a lower bound."""
        return all(one.estimate is not None for one in self.sources if one.numerical)

    @property
    def bar(self) -> float:
        """The bar of the run as it is: |sum e| + sqrt(sum u^2) over the numerical sources."""
        error, doubt = combined(self.of(True))
        return abs(error) + doubt

    @property
    def settled(self) -> bool:
        """Whether the two halves of its window give the same within its bar, or it has no window."""
        return self.halves is None or not abs(self.halves[0] - self.halves[1]) > 2 * self.bar

    @property
    def corrected(self) -> tuple[float, float]:
        """The value less the numerical errors that are known, and the bar of that."""
        error, doubt = combined(self.of(True))
        return self.value - error, doubt

    @property
    def meant(self) -> tuple[float, float] | None:
        """The same less the choices; None where none was looked at."""
        if not any(not one.numerical for one in self.sources):
            return None
        error, doubt = combined([*self.of(True), *self.of(False)])
        return self.value - error, doubt


@dataclass(frozen=True)
class Uncertainty:
    """All bars of a scene, what they cost, and what to do first."""

    title: str
    bars: tuple[Bar, ...]
    runs: int
    cost: float  # processor seconds of all runs over those of the base
    failures: Sequence[str]
    about: Mapping[str, Any]
