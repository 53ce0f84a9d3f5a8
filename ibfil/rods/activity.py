"""Activity from Python: moments that answer to strain and to its rate, beside the law of a filament, with a memory.

    M_a = law + m_a(O, dO/dt),      dM_a/dO_b = .. + dm_a/dO_b + dm_a/d(dO_b/dt)/tau

Rates are the step's own difference (rates.py), so feedback stands within the Newton iteration, of the scheme's order
and without a limit on the step. Its memory changes when a step is taken, and is part of the state of a run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from .base import Law
from .geometry import Configuration
from .rates import Accepted, Memory, Rate, Remembering

Answer = tuple[np.ndarray, np.ndarray, np.ndarray]


class Activity(Protocol):
    """The activity of one filament of k nodes, as a user gives it among ``laws``: it is added to the case's law.

    One with ``bending`` as well is a law too (constitutive.py), and stands in the place of the case's.
    """

    def active(self, strain: np.ndarray, rate: np.ndarray, s: np.ndarray, time: float) -> Answer:
        """m1, m2 (k, 2), and their derivatives (k, 2, 2) by the curvatures O1, O2 (k, 2) and by their rates (k, 2).

        Asked many times a step, also in steps that fail: it must change nothing.
        """

    def advance(self, strain: np.ndarray, rate: np.ndarray, s: np.ndarray, time: float, dt: float) -> None:
        """A step of length dt was taken, to ``time``: the only place where an activity may change."""

    def memory(self) -> Memory:
        """All that it depends on, arrays and numbers by name."""

    def recall(self, memory: Mapping[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""


class Part(NamedTuple):
    """An activity where it acts: its filament's name, nodes, arclength (k,)."""

    name: str
    nodes: slice
    s: np.ndarray
    activity: Activity


class Active(Remembering):
    """Another law with activities beside it."""

    key = "activity"

    def __init__(self, law: Law, parts: Sequence[Part]) -> None:
        self._law, self._parts = law, parts
        self._rates = [Rate(np.zeros((len(part.s), 2))) for part in parts]

    @property
    def nonlocal_twist(self) -> np.ndarray | None:
        """The inner law's."""
        return self._law.nonlocal_twist

    def start(self, configuration: Configuration) -> None:
        """The strains at t = 0, from which rates count."""
        if isinstance(self._law, Remembering):
            self._law.start(configuration)
        self._rates = [Rate(configuration.bend[part.nodes].copy()) for part in self._parts]

    def bending(self, bend: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M1, M2 (n, 2) and their derivatives (n, 2, 2). Raises TypeError where an activity gives other shapes."""
        moment, slope = (part.copy() for part in self._law.bending(bend, time))
        for (_, nodes, s, activity), rate in zip(self._parts, self._rates, strict=True):
            given = activity.active(bend[nodes], rate.of(bend[nodes]), s, time)
            shapes, wanted = [np.shape(each) for each in given], [(len(s), 2), (len(s), 2, 2), (len(s), 2, 2)]
            if shapes != wanted:
                raise TypeError(f"activity {type(activity).__name__}: found arrays {shapes}; wanted {wanted}")
            moment[nodes] += given[0]
            slope[nodes] += given[1] + given[2] * rate.inverse
        return moment, slope

    def twisting(self, twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 (n,) at half nodes and its derivative (n,): the inner law's."""
        return self._law.twisting(twist, time)

    def begin(self, tau: float, w: float) -> None:
        """A step begins."""
        if isinstance(self._law, Remembering):
            self._law.begin(tau, w)
        for rate in self._rates:
            rate.begin(tau, w)

    def advance(self, step: Accepted) -> None:
        """The step is taken."""
        if isinstance(self._law, Remembering):
            self._law.advance(step)
        for part, rate in zip(self._parts, self._rates, strict=True):
            strain = step.configuration.bend[part.nodes].copy()
            part.activity.advance(strain, rate.of(strain), part.s, step.time, step.dt)
            rate.advance(strain)

    def memory(self) -> Memory:
        """The strains, and what activities remember."""
        out: Memory = {}
        if isinstance(self._law, Remembering):
            out |= {f"law_{name}": value for name, value in self._law.memory().items()}
        for part, rate in zip(self._parts, self._rates, strict=True):
            out |= rate.memory(f"of_{part.name}_strain")
            out |= {f"of_{part.name}_own_{name}": value for name, value in part.activity.memory().items()}
        return out

    def recall(self, memory: Mapping[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""
        if isinstance(self._law, Remembering):
            self._law.recall(_part(memory, "law_"))
        for part, rate in zip(self._parts, self._rates, strict=True):
            rate.recall(f"of_{part.name}_strain", memory)
            part.activity.recall(_part(memory, f"of_{part.name}_own_"))


def _part(memory: Mapping[str, np.ndarray | float], start: str) -> dict[str, np.ndarray | float]:
    """The values whose names begin so, by the rest of the names."""
    return {name.removeprefix(start): value for name, value in memory.items() if name.startswith(start)}
