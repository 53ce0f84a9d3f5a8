"""The cheapest step and nodes from how errors fall and what steps cost: no runs, no case.

A probe gives three levels of each direction at sizes h1 > h2 > h3, and of them the error e and the doubt u of the rule
(../estimates.py). The bar at a size h is, of a direction that shows its order p,

    (|e| + u)(h1) (h/h1)^min(p, p0)

its round-off where there is no more, and where no order is seen that of the next probed level that is coarser. Bars of
step and nodes add, and what neither changes (place in a cell, outputs): where errors cancel that is luck.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..estimates import Estimate, estimate

FEWEST = 9  # nodes
_UNSEEN = ("unseen", "levels alike")


class Law:
    """How the bar of one number falls with the size of a direction, from three levels ``values`` at ``sizes``."""

    def __init__(self, values: Sequence[float], sizes: Sequence[float], nominal: float, scale: float) -> None:
        self.levels = [estimate(values, sizes, nominal, level, scale) for level in range(3)]
        self.sizes = tuple(sizes)
        self.nominal = nominal

    @property
    def coarsest(self) -> Estimate:
        """The estimate for the first level."""
        return self.levels[0]

    @property
    def seen(self) -> bool:
        """Whether the bar is known between and beyond the levels."""
        return self.coarsest.word not in _UNSEEN

    @property
    def order(self) -> float:
        """The order with which the bar falls; zero where it does not."""
        p = self.coarsest.order
        return 0.0 if p is None or not self.seen else min(p, self.nominal)

    def bar(self, size: float) -> float:
        """The bar at a size; infinite above the first level of a direction without an order."""
        if self.seen:
            return _bar(self.coarsest) * (size / self.sizes[0]) ** self.order
        coarser = [one for one, h in zip(self.levels, self.sizes, strict=True) if h >= size * (1 - 1e-9)]
        return _bar(coarser[-1]) if coarser else float("inf")

    def largest(self, allowed: float) -> float:
        """The largest size with a bar of at most ``allowed``; zero where there is none."""
        whole = _bar(self.coarsest)
        if self.seen and self.order > 0:
            return self.sizes[0] * (max(allowed, 0.0) / whole) ** (1.0 / self.order) if whole > 0 else float("inf")
        if self.seen:
            return float("inf") if whole <= allowed else 0.0
        good = [h for one, h in zip(self.levels, self.sizes, strict=True) if _bar(one) <= allowed]
        return max(good, default=0.0)


def _bar(one: Estimate) -> float:
    return abs(one.error) + one.doubt if np.isfinite(one.doubt) else float("inf")


class Aim(NamedTuple):
    """A number, the bar ``allowed`` for it, what neither step nor nodes change of it, the laws of these."""

    number: str
    allowed: float
    rest: float
    step: Law
    nodes: Law


@dataclass(frozen=True)
class Settings:
    """A step, nodes of the leading filament, the bars of each number from them, and the seconds a run takes."""

    step: float
    nodes: int
    bars: dict[str, tuple[float, float, float]]  # of the nodes, of the step, of the rest
    seconds: float

    def bar(self, number: str) -> float:
        """The whole bar of a number."""
        return sum(self.bars[number])


class Limits(NamedTuple):
    """The range of a choice: nodes from ``fewest`` to ``most``, steps up to ``longest`` that divide ``every``."""

    fewest: int
    most: int
    longest: float
    every: float
    end: float


def settings(aims: Sequence[Aim], step: float, nodes: int, end: float, seconds: Callable[[int], float]) -> Settings:
    """The bars and the cost of a step and nodes; ``seconds`` is what a step takes with so many nodes."""
    size = 1.0 / (nodes - 1)
    bars = {one.number: (one.nodes.bar(size), one.step.bar(step), one.rest) for one in aims}
    return Settings(step, nodes, bars, seconds(nodes) * end / step)


def candidates(aims: Sequence[Aim], limits: Limits, seconds: Callable[[int], float]) -> list[Settings]:
    """For each odd number of nodes the longest step that meets all aims, if there is one; the cheapest first."""
    found = []
    for nodes in range(limits.fewest | 1, limits.most + 1, 2):
        size = 1.0 / (nodes - 1)
        left = (one.step.largest(one.allowed - one.rest - one.nodes.bar(size)) for one in aims)
        step = even(min(*left, limits.longest), limits.every)
        if step > 0:
            found.append(settings(aims, step, nodes, limits.end, seconds))
    return sorted(found, key=lambda one: (one.seconds, one.nodes))


def even(step: float, every: float) -> float:
    """The longest step up to ``step`` of which a whole number make ``every``: others are shortened to that. Or zero."""
    if not step > 1e-9 * every:
        return 0.0
    return every / max(int(np.ceil(every / step * (1 - 1e-9))), 1)


def through(counts: Sequence[int], seconds: Sequence[float]) -> Callable[[int], float]:
    """Seconds a step for other numbers of nodes: a parabola in logarithms through those of three."""
    fit = np.polyfit(np.log(counts), np.log(seconds), min(2, len(set(counts)) - 1))
    return lambda nodes: float(np.exp(np.polyval(fit, np.log(nodes))))


def corrected(one: Aim) -> tuple[float, float]:
    """The value of a number without its errors of step and nodes, and the doubt left: that of the middle levels."""
    value = one.step.coarsest.values[0]
    doubts = [law.levels[1].doubt for law in (one.step, one.nodes)]
    return value - one.step.coarsest.error - one.nodes.coarsest.error, float(np.hypot(doubts[0], doubts[1]))
