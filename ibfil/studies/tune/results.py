"""The settings that a study chose, and what they were chosen from."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...errors import RunFailed
from .choice import Aim, Settings

if TYPE_CHECKING:
    from .targets import Target


class NoSettings(RunFailed):
    """A target that no settings meet, or none that a run confirms."""

    def __str__(self) -> str:
        """Why; what to change: no run stopped."""
        return "\n".join([self.message, *([f"what to change: {self.advice}"] if self.advice else [])])


@dataclass(frozen=True)
class Tuned:
    """The answer, verified by a run; ``checks`` has by number the run's value, the corrected one and its doubt."""

    title: str
    targets: tuple[Target, ...]
    answer: Settings
    overrides: tuple[str, ...]
    checks: Mapping[str, tuple[float, float, float]]
    aims: Sequence[Aim]
    own: Settings
    candidates: Sequence[Settings]  # cheapest first
    probed: tuple[int, ...]  # numbers of nodes that were run
    end: float  # of all runs
    seconds: Callable[[int], float]  # of a step by nodes, from counts
    runs: int
    spent: float  # processor seconds of all runs
    unplaced: str  # why the place in a cell is not in the bars; empty where it is or makes no difference
    about: Mapping[str, Any]

    def found(self, number: str) -> float:
        """How far the run with the answer is from the corrected value, with what is in doubt of that."""
        value, right, doubt = self.checks[number]
        return abs(value - right) + doubt + self.answer.bars[number][2]
