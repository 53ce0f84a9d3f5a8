"""Backward Euler and variable-step BDF2, by Newton's iteration on the exact Jacobian."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..fluids.base import Fluid, Response, Solution
from ..linalg.compiled import njit
from ..linalg.constraints import Prescribed
from ..rods.geometry import Configuration
from .base import FAILURES, Bodies, NotConverged, State, Step, StiffnessOf, System, _finish, valueless

# Newton's own error after a correction is some hundredth of it: an iterative solve need not be better than a tenth of
# that. Nodes may differ: of many, one may be off by so many times the relative error of all.
ERROR, WORST = 3e-4, 10.0


@njit(cache=True)
def _size(move, length):
    """The largest displacement in units of the length, or turn in radians; no number where one of them is none."""
    largest = 0.0
    for i in range(move.shape[0]):
        for c in range(move.shape[1]):
            size = abs(move[i, c]) / (length if c < 3 else 1.0)
            if size > largest or size != size:
                largest = size
    return largest


class _Equation(NamedTuple):
    """The equation of a step: y = target + tau (u0 + M (f(y) + R)), displacements y from ``start``."""

    system: System
    response: Response
    start: Configuration
    time: float
    target: np.ndarray  # (n, m)
    held: Prescribed
    bodies: Bodies | None

    def prescribed(self, y: np.ndarray, configuration: Configuration, inner: Any) -> Prescribed:
        """The held unknowns, and those that bodies carry, at ``configuration``, y away from the start."""
        if self.bodies is None:
            return self.held
        return self.bodies.carried(self.held, self.start, configuration, inner, self.time, y)

    def correction(self, y: np.ndarray, configuration: Configuration, stiffness: StiffnessOf) -> tuple[Solution, float]:
        """Newton's correction of y, with the exact or the definite ``stiffness`` of the system, and its size."""
        force, inner = self.system.forces(configuration, self.time)
        matrix = stiffness(configuration, self.start, inner, self.time)
        held = self.prescribed(y, configuration, inner)
        answer = self.response.implicit(force, matrix, held, y, self.target, ERROR)
        return answer, _size(answer.move, self.system.length)

    def valueless(self, configuration: Configuration, y: np.ndarray, otherwise: int) -> int:
        """The first node at which a force, or else the flow, has no value, ``otherwise`` where all have one."""
        force, inner = self.system.forces(configuration, self.time)
        where = valueless(force, self.response, self.prescribed(y, configuration, inner))
        return otherwise if where is None else where


def _stride(move: np.ndarray, configuration: Configuration) -> float:
    """The largest change of a segment, relative to its length."""
    joined = configuration.edge[:-1].any(axis=1)
    change = np.linalg.norm(np.diff(move[:, :3], axis=0), axis=1)
    return float(np.max(change[joined] / configuration.length[:-1][joined]))


@dataclass(frozen=True)
class Implicit:
    """Backward Euler (order 1) or variable-step BDF2 (order 2): Newton on the force, M frozen where the rods will be.

    M is taken at the extrapolated positions. Newton's iteration is tried from three starts, until one converges:

    1. from near the extrapolated positions, for as long as corrections shrink fast. Segments keep their length there:
       extrapolated ones are stretched by half the square of their turn, against which a stiff rod pulls so hard that
       the linear answer is far off. The matrix of the iteration before serves again where the fluid keeps its factors
       and the last correction was small, ``again`` of what it corrected. The first correction is what extrapolation
       was off by, as large as the error of a step: with a ``share`` Newton stops at that part of it;
    2. from the start of the step, compressive geometric stiffness left out of the matrix in the first iteration, and
       in any whose correction would be four times the last one without that;
    3. as 2, but from the extrapolated positions and with corrections cut so that no segment changes by more than
       ``stride`` of itself: soft rods of many nodes, whose ends move by more than a segment in a step, need it.
    """

    order: int = 2
    tolerance: float = 1e-8  # largest correction of a node: of the length, and in radians of its turn
    most: int = 12  # iterations, each time
    stride: float = 0.1  # of a segment
    share: float = 0.0  # of the first correction: an error of the solution that serves; zero: ``tolerance`` alone
    again: tuple[float, float] = (0.3, 0.08)  # a first correction of the displacement, others of the one before

    def step(self, system: System, fluid: Fluid, state: State, dt: float) -> Step:
        """Newton to ``tolerance``. Raises one of FAILURES, NotConverged after ``most`` iterations among them."""
        w = dt / state.dt_old if self.order == 2 and state.dt_old > 0 else 0.0
        tau, target = dt * (1 + w) / (1 + 2 * w), (w * w / (1 + 2 * w)) * state.y_old
        after, ahead = state.time + dt, w * state.y_old
        system.begin(tau, w)
        there = system.move(state.configuration, ahead) if w else state.configuration
        equation = _Equation(
            system,
            fluid.response(there.r, there.e3, after, tau, w),
            state.configuration,
            after,
            target,
            system.held(state.time, after),
            system.bodies(there),
        )
        y, answer, count = self._solve(equation, ahead, there)
        step = _finish(system, state, dt, y, (y - target) / tau, answer, count, equation.response)
        return step if equation.bodies is None else step._replace(there=there)

    def amplification(self, z: np.ndarray) -> np.ndarray:
        """The factor by which an even step takes a mode exp(lam t), z = lam dt: of BDF2 that of the larger root."""
        if self.order == 1:
            return 1.0 / (1.0 - z)
        # (3/2 - z) g^2 - 2 g + 1/2 = 0
        root = np.sqrt(1.0 + 2.0 * np.asarray(z, complex))
        both = (2.0 + root) / (3.0 - 2.0 * z), (2.0 - root) / (3.0 - 2.0 * z)
        return np.where(np.abs(both[0]) >= np.abs(both[1]), *both)

    def _solve(self, equation: _Equation, ahead: np.ndarray, there: Configuration) -> tuple[np.ndarray, Solution, int]:
        """Newton from wherever it converges; ``ahead`` are the extrapolated displacements, to ``there``."""
        if ahead.any():
            try:
                y = equation.system.turned(equation.start, ahead)
                return self._quickly(equation, y, equation.system.move(equation.start, y))
            except FAILURES:
                pass
        try:
            return self._newton(equation, np.zeros(ahead.shape), equation.start, None)
        except FAILURES:
            return self._newton(equation, ahead, there, self.stride)

    def _quickly(
        self, equation: _Equation, y: np.ndarray, configuration: Configuration
    ) -> tuple[np.ndarray, Solution, int]:
        """From y, at ``configuration``, to the solution, while corrections shrink, exact ones to a quarter.

        Where they shrink more slowly another solution may be on the way, as where a soft rod kinks.
        """
        system, last, rate, exact, fresh = equation.system, _size(y, equation.system.length), np.inf, 0, False
        enough = self.tolerance
        for count in range(1, self.most + 1):
            force, inner = system.forces(configuration, equation.time)
            before, fresh = fresh, rate > self.again[count > 2] or not equation.response.keeps
            if fresh:
                matrix = system.stiffness(configuration, equation.start, inner, equation.time)
                exact += 1
            held = equation.prescribed(y, configuration, inner)
            answer = equation.response.implicit(force, matrix, held, y, equation.target, ERROR)
            size = _size(answer.move, system.length)
            enough = max(enough, self.share * size) if count == 1 else enough
            rate = size / max(last, self.tolerance)
            if not rate < (0.25 if fresh and before else 1.0):
                break
            y = y + answer.move
            # Exact matrices square the error, by a factor that settles after the first; a matrix that serves again
            # takes the same part of it each time, which it has to show once.
            known = 10 * rate**2 if exact == count > 2 else 1.0 if before and not fresh else rate
            coming = size * max(known, WORST * answer.error) if count > 1 else size
            if coming < enough:
                return y, answer, count
            configuration, last = system.move(equation.start, y), size
        raise NotConverged(f"corrections do not shrink after {count} iterations", 0)

    def _newton(
        self, equation: _Equation, y: np.ndarray, configuration: Configuration, stride: float | None
    ) -> tuple[np.ndarray, Solution, int]:
        """From y, at ``configuration``, to the solution: its y, the last answer, the iterations it took.

        ``stride``: the largest change of a segment by a correction; None: corrections are whole.
        """
        system, exact, last = equation.system, False, np.inf
        for count in range(1, self.most + 1):
            answer, size = equation.correction(
                y, configuration, system.stiffness if exact else system.definite_stiffness
            )
            if exact and not size <= 4 * last:
                answer, size = equation.correction(y, configuration, system.definite_stiffness)
            if not np.isfinite(size):
                break
            part = 1.0 if stride is None else min(1.0, stride / max(_stride(answer.move, configuration), 1e-300))
            y = y + part * answer.move
            # Newton squares the error, so two exact corrections in a row tell the size of the next.
            coming = size * max((size / last) ** 2, WORST * answer.error) if exact and count > 2 else size
            if part == 1.0 and coming < self.tolerance:
                return y, answer, count
            configuration, exact, last = system.move(equation.start, y), True, size
        worst = int(np.argmax(np.max(np.abs(answer.move), axis=1)))
        still = f"Newton's correction is still {size:.2g} of the length (allowed {self.tolerance:g})"
        if not np.isfinite(size):
            still = "the run diverged: a correction is no finite number"
            worst = equation.valueless(configuration, y, worst)
        raise NotConverged(f"{still} after {count} iterations", worst)
