"""The results of a trade study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..settings import Setting
from .reference import Reference

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class Trial:
    """A setting, its errors by measure (empty where it failed), and seconds a unit of simulated time, one a repeat."""

    setting: Setting
    status: str  # finished | stopped | failed | left out (by the budget)
    message: str
    errors: Mapping[str, float]
    seconds: tuple[float, ...]
    processor: tuple[float, ...]  # the same of processor time, whichever clock `seconds` are of

    @property
    def cost(self) -> float:
        """The least of its repeats: what other programs on the machine have added is left out as far as can be."""
        return min(self.seconds, default=float("inf"))


@dataclass(frozen=True)
class Trade:
    """The whole result: the reference, every setting, and the front of each measure (indices, cheapest first)."""

    title: str
    reference: Reference
    measures: tuple[str, ...]
    trials: tuple[Trial, ...]
    fronts: Mapping[str, tuple[int, ...]]
    about: Mapping[str, Any]

    def cheapest(self, error: float) -> Trial | None:
        """Return the cheapest setting of which all errors, with the reference's own added, are at most ``error``."""
        good = [one for one in self.trials if one.errors and all(self.error(one, m) <= error for m in self.measures)]
        return min(good, key=lambda one: one.cost, default=None)

    def error(self, one: Trial, measure: str) -> float:
        """The bound of a setting's error: as found, plus the reference's own."""
        return one.errors[measure] + self.reference.estimate(measure)

    def uncertain(self, one: Trial, measure: str) -> bool:
        """Whether an error is under what the reference can tell."""
        return one.errors[measure] < self.reference.estimate(measure)
