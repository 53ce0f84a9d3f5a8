"""Internal damping: moments that resist the rate of strain, by the step's own difference (rates.py).

    M_a = law + mu A_a dO_a/dt,      M3 = law + mu C dO3/dt,      dM_a/dO_a = .. + mu A_a/tau

A mode of bending that decays at the rate k without it then decays at k/(1 + mu k).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .base import Law
from .geometry import Configuration
from .rates import Accepted, Memory, Rate, Remembering


class Damped(Remembering):
    """Another law with internal damping: ``bending`` (n, 2) mu A at nodes, ``torsion`` (n,) mu C at half nodes."""

    key = "damping"

    def __init__(self, law: Law, bending: np.ndarray, torsion: np.ndarray) -> None:
        self._law, self._bending, self._torsion = law, bending, torsion
        self._bend, self._twist = Rate(np.zeros_like(bending)), Rate(np.zeros_like(torsion))

    @property
    def nonlocal_twist(self) -> np.ndarray | None:
        """The inner law's."""
        return self._law.nonlocal_twist

    def start(self, configuration: Configuration) -> None:
        """The strains at t = 0, from which rates count."""
        self._bend, self._twist = Rate(configuration.bend.copy()), Rate(configuration.twist.copy())

    def bending(self, bend: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M1, M2 (n, 2) and their derivatives (n, 2, 2)."""
        moment, slope = self._law.bending(bend, time)
        moment, slope = moment + self._bending * self._bend.of(bend), slope.copy()
        for part in (0, 1):
            slope[:, part, part] += self._bending[:, part] * self._bend.inverse
        return moment, slope

    def twisting(self, twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 (n,) at half nodes and its derivative (n,)."""
        moment, slope = self._law.twisting(twist, time)
        return moment + self._torsion * self._twist.of(twist), slope + self._torsion * self._twist.inverse

    def begin(self, tau: float, w: float) -> None:
        """A step begins."""
        self._bend.begin(tau, w)
        self._twist.begin(tau, w)

    def advance(self, step: Accepted) -> None:
        """The step is taken."""
        self._bend.advance(step.configuration.bend.copy())
        self._twist.advance(step.configuration.twist.copy())

    def memory(self) -> Memory:
        """The strains."""
        return self._bend.memory("bend") | self._twist.memory("twist")

    def recall(self, memory: Mapping[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""
        self._bend.recall("bend", memory)
        self._twist.recall("twist", memory)
