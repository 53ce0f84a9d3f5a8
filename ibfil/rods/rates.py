"""Rates of a step, and what rods remember from step to step: laws and links that answer to how fast they are strained.

Over a step of effective length tau every scheme takes x' = (x - x_n - c (x_n - x_{n-1}))/tau for the rate of what it
advances, c = w^2/(1 + 2 w) with w = dt/dt_old, zero in Euler's steps (timestepping/base.py). A rate of strain or of a
length is taken by the same formula: so it is of the scheme's order, and its slope by x is 1/tau.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from .geometry import Configuration

Memory = dict[str, np.ndarray | float]


class Accepted(NamedTuple):
    """A step that was taken, by its end: the time, its length, and the rods then."""

    time: float
    dt: float
    configuration: Configuration


class Remembering:
    """A part of the rods that depends on the steps before. Its memory changes when a step is taken, and only then.

    ``key`` is its name in a run's state, in which no other part of the rods has the same.
    """

    key: str

    def start(self, configuration: Configuration) -> None:
        """The rods as they begin, for what does not know them before."""

    def begin(self, tau: float, w: float) -> None:
        """A step of effective length tau begins, w = dt/dt_old; zero where it does not look back."""
        raise NotImplementedError

    def advance(self, step: Accepted) -> None:
        """The step that began last is taken."""
        raise NotImplementedError

    def memory(self) -> Memory:
        """All that it depends on, by name."""
        raise NotImplementedError

    def recall(self, memory: Mapping[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""
        raise NotImplementedError


class Rate:
    """The rate of a quantity over a step, from its value ``now`` and its ``change`` over the last step."""

    def __init__(self, now: np.ndarray) -> None:
        self.now, self.change = now, np.zeros_like(now)
        self.inverse, self.base = 0.0, now  # 1/tau, and the value from which the rate counts: none before a step

    def begin(self, tau: float, w: float) -> None:
        """A step begins."""
        self.inverse = 1.0 / tau
        self.base = self.now + (w * w / (1.0 + 2.0 * w)) * self.change

    def of(self, value: np.ndarray) -> np.ndarray:
        """The rate at ``value``."""
        return (value - self.base) * self.inverse

    def advance(self, value: np.ndarray) -> None:
        """The step is taken, and led to ``value``."""
        self.now, self.change = value, value - self.now

    def memory(self, name: str) -> Memory:
        """Its state by names that begin with ``name``."""
        return {f"{name}_now": self.now, f"{name}_change": self.change, f"{name}_base": self.base} | {
            f"{name}_inverse": self.inverse
        }

    def recall(self, name: str, memory: Mapping[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""
        self.now, self.change, self.base = (np.array(memory[f"{name}_{part}"]) for part in ("now", "change", "base"))
        self.inverse = float(memory[f"{name}_inverse"])
