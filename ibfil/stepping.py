"""Time steps. They know rods and the contract of fluids, and no fluid.

Over a step every scheme is y = target + tau (u0 + M (f(y) + R)) for the displacements y since its start, with M frozen:
    Euler   target = 0,                             tau = dt
    BDF2    target = w^2/(1 + 2 w) y_old,           tau = dt (1 + w)/(1 + 2 w),     w = dt/dt_old
where y_old are the displacements of the step before. The turn of e1 about the tangent is one more component of y,
measured from the frame carried along (Eq. 41), so it advances to the same order as the positions; the paper's split
of Eq. 38 is first order whatever the positions do. w = 0 is Euler: the first step, and after any jump.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from .fluid import Answer, Fluid, Held, Response
from .geometry import Geometry


class State(NamedTuple):
    """Where the rods are, and the step that led there (y_old (n, m) and dt_old; dt_old = 0 before the first)."""

    time: float
    shape: Geometry
    y_old: np.ndarray
    dt_old: float


class Step(NamedTuple):
    """A finished step: the new state, the nodes' velocities, the force the fluid felt, reactions, iterations."""

    state: State
    velocity: np.ndarray  # (n, m)
    force: np.ndarray  # (n, m), reactions included
    reaction: np.ndarray  # (n, m)
    iterations: int


class Rods(Protocol):
    """What a stepper asks of the rods."""

    length: float

    def move(self, start: Geometry, y: np.ndarray) -> Geometry:
        """The configuration displaced by y from ``start``."""

    def forces(self, shape: Geometry, time: float) -> tuple[np.ndarray, Any]:
        """Nodal forces (n, m), and what ``stiffness`` needs to go with them."""

    def stiffness(self, shape: Geometry, start: Geometry, moment: Any, time: float, clip: bool) -> np.ndarray:
        """The Jacobian of the forces with respect to y, a band matrix by node."""

    def held(self, before: float, after: float) -> Held:
        """The prescribed displacements between two times."""


class NotConverged(Exception):
    """Newton's iteration did not converge; the step may be repeated with a shorter dt."""


class Stepper(Protocol):
    """One scheme."""

    @property
    def order(self) -> int:
        """Order of accuracy in time."""

    def step(self, rods: Rods, fluid: Fluid, state: State, dt: float) -> Step:
        """From ``state`` to ``state.time + dt``. Raises NotConverged."""


def _finish(rods: Rods, state: State, dt: float, y: np.ndarray, velocity, answer: Answer, count: int) -> Step:
    new = State(state.time + dt, rods.move(state.shape, y), y, dt)
    return Step(new, velocity, answer.force, answer.reaction, count)


@dataclass(frozen=True)
class Explicit:
    """Forward Euler: y = dt (u0 + M f(t)). Stable for dt < 2/rho(M K) only."""

    order: int = 1

    def step(self, rods: Rods, fluid: Fluid, state: State, dt: float) -> Step:
        """One evaluation of the force, one answer of the fluid."""
        force, _ = rods.forces(state.shape, state.time)
        target = np.zeros_like(force)
        response = fluid.response(state.shape.r, state.shape.e3, state.time, dt)
        answer = response.forced(force, rods.held(state.time, state.time + dt), target)
        return _finish(rods, state, dt, answer.move, answer.move / dt, answer, 0)


@dataclass(frozen=True)
class SemiImplicit:
    """Linearly implicit Euler: one linear solve a step, compressive geometric stiffness left out of the matrix.

    (1 - dt M K) y = dt (u0 + M f(r_n, t + dt)), the paper's Eq. 31 with the tension linearised and K exact.
    """

    order: int = 1

    def step(self, rods: Rods, fluid: Fluid, state: State, dt: float) -> Step:
        """One force, one stiffness, one linear solve."""
        after = state.time + dt
        force, inner = rods.forces(state.shape, after)
        matrix = rods.stiffness(state.shape, state.shape, inner, after, True)
        zero = np.zeros_like(force)
        response = fluid.response(state.shape.r, state.shape.e3, after, dt)
        answer = response.implicit(force, matrix, rods.held(state.time, after), zero, zero)
        return _finish(rods, state, dt, answer.move, answer.move / dt, answer, 1)


@dataclass(frozen=True)
class Implicit:
    """Backward Euler (order 1) or variable-step BDF2 (order 2): Newton on the force, M frozen where the rods will be.

    M is taken at the extrapolated positions; the first iteration leaves compressive geometric stiffness out of the
    matrix, and so does any that makes the correction grow. Two or three iterations are usual.
    """

    order: int = 2
    tolerance: float = 1e-8  # of the length, largest correction of a node
    most: int = 12

    def step(self, rods: Rods, fluid: Fluid, state: State, dt: float) -> Step:
        """Newton to ``tolerance``, or NotConverged after ``most`` iterations."""
        w = dt / state.dt_old if self.order == 2 and state.dt_old > 0 else 0.0
        tau, target = dt * (1 + w) / (1 + 2 * w), (w * w / (1 + 2 * w)) * state.y_old
        after = state.time + dt
        there = rods.move(state.shape, w * state.y_old) if w else state.shape
        response = fluid.response(there.r, there.e3, after, tau)
        held = rods.held(state.time, after)
        y, answer, count = self._newton(rods, response, state, after, target, held)
        return _finish(rods, state, dt, y, (y - target) / tau, answer, count)

    def _newton(
        self, rods: Rods, response: Response, state: State, after: float, target: np.ndarray, held: Held
    ) -> tuple[np.ndarray, Answer, int]:
        y = np.zeros_like(target)
        shape, clip, last = state.shape, True, np.inf
        for count in range(1, self.most + 1):
            force, inner = rods.forces(shape, after)
            answer = response.implicit(
                force, rods.stiffness(shape, state.shape, inner, after, clip), held, y, target
            )
            size = float(np.max(np.abs(answer.move[:, :3])))
            if not clip and size > 4 * last:
                answer = response.implicit(
                    force, rods.stiffness(shape, state.shape, inner, after, True), held, y, target
                )
                size = float(np.max(np.abs(answer.move[:, :3])))
            if not np.isfinite(size):
                break
            y = y + answer.move
            # Newton squares the error, so two exact corrections in a row tell the size of the next.
            coming = size * (size / last) ** 2 if not clip and count > 2 else size
            if coming < self.tolerance * rods.length:
                return y, answer, count
            shape, clip, last = rods.move(state.shape, y), False, size
        raise NotConverged(f"no convergence in {count} iterations, last correction {size:.2g}")
