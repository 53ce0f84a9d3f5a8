"""A fluid around a fluid: nodes feel forces that are affine in their own velocity, z - Z u, beside those of the rods.

The fluid inside is pushed by F = f + z - Z u, frozen at the positions at which its mobility is. With
u = (y - target)/tau, which is exact for Euler and BDF2, its own statements answer those of the whole:

    implicit   force + z - Z (y - target)/tau    with the stiffness K - Z/tau
    forced     force + z + Z target/tau          with the stiffness - Z/tau, from y = 0

so that whatever solves inside solves here, and reactions of supports come out right. Z is symmetric, not negative, and
couples a node with its neighbours at most: it fits into the band of K.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from ...linalg import banded
from ...linalg.constraints import Prescribed
from ...linalg.normal_numbers import Draw
from ...linalg.stiffness import Stiffness, no_pairs
from ..base import Fluid, Response, Solution


class Frozen(Protocol):
    """Forces z - Z u of nodes over one step, at frozen positions."""

    def add(self, constant: np.ndarray, matrix: np.ndarray) -> None:
        """Adds z to ``constant`` (n, m), and Z over tau to the band ``matrix`` (n, m, ..)."""

    def from_fluid(self, u: np.ndarray) -> np.ndarray | None:
        """That part (n, m) of them which the fluid does to the rods, and so no rod to the fluid; None: none of it."""


class VelocityForce(Protocol):
    """Forces of nodes that are affine in their velocity."""

    def frozen(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float) -> Frozen:
        """Those over a step, at nodes r (n, 3); arguments as for Fluid.response."""

    def advance(self, velocity: np.ndarray) -> None:
        """A step is taken in which the nodes moved with ``velocity`` (n, m)."""

    def memory(self) -> dict[str, np.ndarray | float]:
        """The state that is carried from step to step, by names of its own; empty for most."""

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""


class _Response:
    """A fluid's response, and the forces z - Z u of the nodes in it."""

    def __init__(self, inner: Response, frozen: Sequence[Frozen], tau: float, width: int) -> None:
        self.inner, self.keeps, self.tau = inner, inner.keeps, tau
        self._frozen, self._width = frozen, width
        self._sums: tuple[np.ndarray, np.ndarray] | None = None  # z, and Z/tau by bands
        self._softened: tuple[Stiffness, Stiffness] | None = None  # a stiffness, and the same less Z/tau
        self._alone: tuple[np.ndarray, Stiffness] | None = None  # held unknowns, and - Z/tau

    def _own(self, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
        """z (n, m), and Z/tau (n, m, ..)."""
        if self._sums is None:
            n, m = shape
            self._sums = np.zeros((n, m)), np.zeros((n, m, (2 * self._width + 1) * m))
            for one in self._frozen:
                one.add(*self._sums)
        return self._sums

    def _less(self, stiffness: Stiffness, own: np.ndarray) -> Stiffness:
        """K - Z/tau: one for one K where the fluid keeps factors; else in the room of K, which is used up."""
        if not self.keeps:
            np.subtract(stiffness.band, own, out=stiffness.band)
            return stiffness
        if self._softened is None or self._softened[0] is not stiffness:
            self._softened = stiffness, stiffness._replace(band=stiffness.band - own)
        return self._softened[1]

    def _minus(self, own: np.ndarray, held: Prescribed) -> Stiffness:
        """-Z/tau: one for the same held unknowns where the fluid keeps factors, else a new one each time."""
        if self._alone is None or self._alone[0] is not held.at or not self.keeps:
            self._alone = held.at, Stiffness(-own, no_pairs(own.shape[1]))
        return self._alone[1]

    def _of_rods(self, answer: Solution, y: np.ndarray, target: np.ndarray) -> Solution:
        """The solution with the forces of the rods on the fluid, without those that the fluid does to them."""
        done = self.from_fluid((y + answer.move - target) / self.tau)
        return answer if done is None else answer._replace(force=answer.force - done)

    def from_fluid(self, u: np.ndarray) -> np.ndarray | None:
        """The forces (n, m) on nodes with velocities u (n, m) that the fluid inside does not know it does, if any."""
        parts = [part for part in (one.from_fluid(u) for one in self._frozen) if part is not None]
        return sum(parts[1:], parts[0]) if parts else None

    def forced(self, force: np.ndarray, held: Prescribed, target: np.ndarray) -> Solution:
        """The displacements of given forces of the rods."""
        constant, own = self._own(force.shape)
        y = np.zeros_like(target)
        given = force + constant + banded.multiply(own, target)
        return self._of_rods(self.inner.implicit(given, self._minus(own, held), held, y, target), y, target)

    def implicit(
        self,
        force: np.ndarray,
        stiffness: Stiffness,
        held: Prescribed,
        y: np.ndarray,
        target: np.ndarray,
        error: float = 0.0,
    ) -> Solution:
        """One Newton correction."""
        constant, own = self._own(force.shape)
        given = force + constant - banded.multiply(own, y - target)
        answer = self.inner.implicit(given, self._less(stiffness, own), held, y, target, error)
        return self._of_rods(answer, y, target)

    def fluctuation(self, draw: Draw, shape: tuple[int, int]) -> np.ndarray:
        """Not known: forces that resist motion have a noise of their own, and cases with both are refused."""
        raise NotImplementedError


class Wrapped:
    """A fluid in which nodes feel forces that are affine in their velocity. ``width`` is that of the rods' bands."""

    def __init__(self, inner: Fluid, forces: Sequence[VelocityForce], width: int) -> None:
        self.inner, self.forces, self._width = inner, forces, width

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> _Response:
        """The fluid's own, and the nodes' forces at the same positions."""
        frozen = [force.frozen(r, e3, time, tau, w) for force in self.forces]
        return _Response(self.inner.response(r, e3, time, tau, w), frozen, tau, self._width)

    def advance(self, response: Response, velocity: np.ndarray, force: np.ndarray) -> None:
        """Tells the fluid of all that pushed it, and the forces of the velocity."""
        assert isinstance(response, _Response)
        done = response.from_fluid(velocity)
        self.inner.advance(response.inner, velocity, force if done is None else force + done)
        for own in self.forces:
            own.advance(velocity)

    def longest_step(self) -> float:
        """The fluid's."""
        return self.inner.longest_step()

    def velocity_at(
        self, points: np.ndarray, r: np.ndarray, e3: np.ndarray, force: np.ndarray, time: float
    ) -> np.ndarray:
        """The fluid's, ``force`` being all that pushes it."""
        return self.inner.velocity_at(points, r, e3, force, time)

    def memory(self) -> dict[str, np.ndarray | float]:
        """The fluid's, and the forces'."""
        out = dict(self.inner.memory())
        for own in self.forces:
            out |= own.memory()
        return out

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Each its own."""
        rest = dict(memory)
        for own in self.forces:
            own.recall({key: rest.pop(key) for key in own.memory()})
        if rest:
            self.inner.recall(rest)
