"""Springs between two points of rods, or a point of a rod and a place in the lab."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..geometry import Configuration
from ..rates import Accepted, Memory, Rate, Remembering
from .base import Elements, Link, Seen, across, length, outer


class Spring(Link):
    """A spring between points a and b, d = p_b - p_a, L = |d|, u = d/L: with the tension T = k (L - l0),

        g = T u,     J = k u u + T/L (1 - u u)

    A spring of no rest length answers k d, without division. ``definite`` leaves out a compressed spring's T/L < 0.
    """

    def __init__(
        self, name: str, filaments: tuple[int, ...], elements: Elements, stiffness: np.ndarray, rest: np.ndarray
    ) -> None:
        super().__init__(name, filaments, elements)
        self._stiffness, self._rest = stiffness, rest

    def _resist(self, apart: np.ndarray) -> tuple[np.ndarray, float]:
        """The tension (l,) that resists the rate of the lengths ``apart`` (l,), and its slope by them."""
        return np.zeros_like(apart), 0.0

    def _pull(self, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """d (l, 3), u (l, 3), T/L (l,) and dT/dL (l,)."""
        d = vectors[:, 0]
        apart = length(d)
        safe = np.where(apart > 0.0, apart, 1.0)
        resisted, slope = self._resist(apart)
        ratio = self._stiffness * (1.0 - self._rest / safe) + resisted / safe
        return d, d / safe[:, None], np.where(apart > 0.0, ratio, self._stiffness), self._stiffness + slope

    def gradient(self, vectors: np.ndarray, time: float) -> np.ndarray:
        """T u."""
        d, _, ratio, _ = self._pull(vectors)
        return (ratio[:, None] * d)[:, None]

    def jacobian(self, vectors: np.ndarray, time: float, definite: bool) -> np.ndarray:
        """dT/dL u u + T/L (1 - u u)."""
        _, u, ratio, slope = self._pull(vectors)
        ratio = np.maximum(ratio, 0.0) if definite else ratio
        return (slope[:, None, None] * outer(u, u) + ratio[:, None, None] * across(u))[:, None, :, None]

    @property
    def stiffest(self) -> float:
        """k."""
        return float(np.max(self._stiffness))

    def strained(self, configuration: Configuration) -> float:
        """L - l0 where there is a rest length; a spring of none is never there."""
        away = length(self.elements.vectors(configuration.r)[:, 0]) - self._rest
        return float(np.max(np.abs(np.where(self._rest > 0.0, away, 0.0))))

    def seen(self, configuration: Configuration, time: float) -> Seen:
        """Its length and its tension, positive where it pulls its ends together."""
        r, (nodes, weights, offset) = configuration.r, self.elements
        d, _, ratio, _ = self._pull(self.elements.vectors(r))
        first = -(weights[:, 0, :2, None] * r[nodes[:, :2]]).sum(axis=1)
        lab = np.abs(weights[:, 0, 2:]).sum(axis=1) == 0.0
        second = np.where(lab[:, None], offset[:, 0], first + d - offset[:, 0])
        apart = length(d)
        return Seen(first, second, -ratio[:, None] * d, {"length": apart, "tension": ratio * apart})


class DampedSpring(Spring, Remembering):
    """A spring whose tension has a part c dL/dt beside, of the step's own rate."""

    def __init__(
        self,
        name: str,
        filaments: tuple[int, ...],
        elements: Elements,
        stiffness: np.ndarray,
        rest: np.ndarray,
        damping: float,
        start: np.ndarray,
    ) -> None:
        """``start`` (n, 3) are the nodes at t = 0."""
        super().__init__(name, filaments, elements, stiffness, rest)
        self.key, self._damping = f"link_{name}", damping
        self._rate = Rate(self._lengths(start))

    def _lengths(self, r: np.ndarray) -> np.ndarray:
        return length(self.elements.vectors(r)[:, 0])

    def _resist(self, apart: np.ndarray) -> tuple[np.ndarray, float]:
        return self._damping * self._rate.of(apart), self._damping * self._rate.inverse

    def begin(self, tau: float, w: float) -> None:
        """A step begins."""
        self._rate.begin(tau, w)

    def advance(self, step: Accepted) -> None:
        """The step is taken."""
        self._rate.advance(self._lengths(step.configuration.r))

    def memory(self) -> Memory:
        """Its lengths."""
        return self._rate.memory("length")

    def recall(self, memory: Mapping[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""
        self._rate.recall("length", memory)
