"""The contract between rods and fluids: over one step, at frozen positions, every fluid is u = u0 + M F.

The stepper decides what to ask (an explicit move, or one Newton iteration with the stiffness K of the forces); the
fluid decides how to answer (drag on the left, a dense table, Krylov on FFTs). Neither imports the other.

Unknowns are the displacements y (n, m) of the nodes since the start of the step: three components, and where the
rods twist (m = 4) the angle by which e1 turned about the tangent. Forces are (n, m) likewise: a force, and a torque
about the tangent. All first and second order schemes are one statement,

    y = target + tau (u0 + M (f(y) + R)),       y = prescribed at held unknowns, where the reaction R acts

so held nodes are data, and the reaction on a support comes out of the solve.

Thermal forces ask for one thing more: a random motion whose covariance is M itself (timestepping/brownian.py).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from ..linalg.constraints import Prescribed
from ..linalg.normal_numbers import Draw
from ..linalg.stiffness import Stiffness

Flow = Callable[[np.ndarray, float], np.ndarray]  # places (k, 3) and a time -> background velocity (k, 3)


class Part(NamedTuple):
    """A part of a flow that is a fixed field (k, 3) at points (k, 3) times a factor; None: it is steady."""

    factor: Callable[[float], float] | None
    place: Callable[[np.ndarray], np.ndarray]


class Solution(NamedTuple):
    """A fluid's solution, each (n, m): the displacement, the force on the fluid, the reactions within that."""

    move: np.ndarray
    force: np.ndarray  # elastic force and loads as they acted over the step, inertia and reactions included
    reaction: np.ndarray  # of the supports on the rod, zero where nothing is held
    error: float = 0.0  # relative, of the displacement, beyond round-off: zero where the solve is direct


class Response(Protocol):
    """A fluid at frozen positions, over a step whose effective length is tau (units of time).

    ``keeps``: ``implicit`` does not overwrite the stiffness, and given the same one again, the same unknowns being
    held, uses its factors again.
    """

    keeps: bool

    def forced(self, force: np.ndarray, held: Prescribed, target: np.ndarray) -> Solution:
        """The displacements y = target + tau (u0 + M (force + R)); no stiffness."""

    def implicit(
        self,
        force: np.ndarray,
        stiffness: Stiffness,
        held: Prescribed,
        y: np.ndarray,
        target: np.ndarray,
        error: float = 0.0,
    ) -> Solution:
        """One Newton correction d of y: y + d = target + tau (u0 + M (force + K d + R)), K = ``stiffness``.

        ``error``: the relative error of d that serves, where a solve is iterative; 0: as small as it makes it.
        """

    def fluctuation(self, draw: Draw, shape: tuple[int, int]) -> np.ndarray:
        """A random motion of mean zero and covariance M, of that shape (n, m), of all nodes as if none were held.

        Raises StepFailed where M has no root.
        """


class Fluid(Protocol):
    """A model of the fluid: turns a configuration into its response."""

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> Response:
        """The response at nodes r (n, 3) with unit tangents e3 (n, 3); flows are those of ``time``.

        ``w`` is dt/dt_old of BDF2, tau = dt (1 + w)/(1 + 2 w), and zero in a scheme that looks back one step only,
        tau = dt: a fluid that remembers discretises its own past likewise. Asking changes nothing that it remembers.
        """

    def advance(self, response: Response, velocity: np.ndarray, force: np.ndarray) -> None:
        """The step that ``response``, the last one asked for, belongs to is taken.

        The nodes moved with ``velocity`` (n, m), and forces (n, m) acted over it.
        """

    def longest_step(self) -> float:
        """The longest step that the fluid's own motion allows now (units of time); infinite where it has none."""

    def velocity_at(
        self, points: np.ndarray, r: np.ndarray, e3: np.ndarray, force: np.ndarray, time: float
    ) -> np.ndarray:
        """The velocity (k, 3) at ``points`` (k, 3) when nodes r (n, 3), tangents e3, push with forces (n, m)."""

    def memory(self) -> dict[str, np.ndarray | float]:
        """The state that the fluid carries from step to step, by name; part of a run's state. Empty for most."""

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""


class Memoryless:
    """A fluid whose response depends on the present only."""

    def advance(self, response: Response, velocity: np.ndarray, force: np.ndarray) -> None:
        """Nothing."""

    def longest_step(self) -> float:
        """As long as one likes."""
        return np.inf

    def memory(self) -> dict[str, np.ndarray | float]:
        """Nothing."""
        return {}

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Nothing."""
