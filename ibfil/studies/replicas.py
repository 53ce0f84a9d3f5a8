"""Thermal runs that differ in the seed of their random numbers alone, summed up: means, and their standard errors."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..case.schema import Case

# What of a case tells where it comes from, and its seed, also by a name.
_OF_THE_SEED: dict[str, Any] = {
    **dict.fromkeys(("text", "file", "parameters", "deprecated"), True),
    "thermal": {"seed"},
}


@dataclass(frozen=True)
class Mean:
    """Runs of one scene with several seeds: the settings they share, how many they are, means and standard errors."""

    values: Mapping[str, Any]
    runs: int
    numbers: Mapping[str, tuple[float, float]]

    def row(self) -> dict[str, Any]:
        """Its row of the table."""
        found: dict[str, Any] = {**self.values, "seeds": self.runs}
        for name, (mean, error) in self.numbers.items():
            found |= {name: mean, f"{name} +-": error}
        return found


def means(runs: Sequence[tuple[Case, Mapping[str, Any], Mapping[str, float]]]) -> list[Mean]:
    """The means of groups of two runs and more, given the case, the settings and the numbers of each run."""
    groups: dict[str, list[int]] = {}
    for k, (case, _, _) in enumerate(runs):
        if case.thermal is not None and case.thermal.energy > 0:
            groups.setdefault(_but_for_the_seed(case), []).append(k)
    return [_mean([runs[k] for k in group]) for group in groups.values() if len(group) > 1]


def _but_for_the_seed(case: Case) -> str:
    return repr(case.model_dump(exclude=_OF_THE_SEED, warnings=False))  # defaults are made, not read: it doubts them


def _mean(runs: Sequence[tuple[Case, Mapping[str, Any], Mapping[str, float]]]) -> Mean:
    (_, first, numbers), *others = runs
    shared = {key: value for key, value in first.items() if all(values.get(key) == value for _, values, _ in others)}
    found = {}
    for name in numbers:
        values = [one[name] for _, _, one in runs if math.isfinite(one.get(name, math.nan))]
        if len(values) > 1:
            found[name] = statistics.fmean(values), statistics.stdev(values) / math.sqrt(len(values))
    return Mean(shared, len(runs), found)
