"""How long steps are: equal parts of the time between outputs, or as long as a tolerance allows.

A control proposes the next step and judges it when it has been made; it sees states and steps, and no simulation. Both
kinds end exactly at the time asked for, halve a step that cannot be solved, and know their own state, so that a run
that is cut goes on with the same steps.
"""

from __future__ import annotations

from enum import Enum
from typing import Any, NamedTuple, Protocol

import numpy as np

from .base import State, Step

HELD = 1.3  # a step is kept unless one longer by this would do
MARGIN = 1.1  # what the fluid's own motion may gain before a step it limits changes
NEAR = 1e-6  # of a step: it may be longer by so much, where as many fit into the time to an output
SAFETY = 0.9  # of the step that would err as much as is allowed
RESTART = 3  # rejections in a row after which the next step looks back at none before it


class Proposal(NamedTuple):
    """A step to be made: its length, and the time it leads to (exactly that of an output, where it is the last)."""

    dt: float
    time: float


class Verdict(Enum):
    """The fate of a step: it is taken, made again shorter, or made again shorter and without its past (Euler)."""

    ACCEPTED, REJECTED, RESTARTED = range(3)


class StepControl(Protocol):
    """One way to choose steps. ``shortened`` counts those that had to be tried again.

    ``chosen``: the lengths, rates and tolerances that it was made with.
    """

    shortened: int
    chosen: tuple[float, ...]

    @property
    def length(self) -> float:
        """The longest step, or the present one where an error decides."""

    @property
    def reach(self) -> float:
        """The longest step that may be proposed next."""

    def propose(self, state: State, until: float, limit: float) -> Proposal:
        """The next step from ``state``, none beyond ``until``; ``limit``: what the fluid's own motion allows."""

    def judge(self, state: State, step: Step, dt: float) -> Verdict:
        """Whether a step of length dt from ``state`` is taken; where it is not, the next proposal is shorter."""

    def shorten(self, dt: float) -> Verdict:
        """The verdict on a step of length dt that could not be solved: the next proposal is half of it."""

    def restart(self) -> None:
        """Begins anew: the next step looks back at none."""

    def state(self) -> dict[str, Any]:
        """The state of the control, by name: part of a run's state."""

    def restore(self, state: dict[str, Any]) -> bool:
        """Goes on from what ``state`` gave; whether that had been ``chosen`` as this one was."""


def equal_parts(time: float, length: float) -> int:
    """How many equal steps no longer than ``length`` make up a time; by a millionth longer is no longer."""
    return max(1, int(np.ceil(time / length * (1.0 - NEAR))))


class FixedStep:
    """Equal steps no longer than ``length``, and than the fluid allows, from one output to the next.

    No step is longer than ``growth`` times the one before: BDF2 is stable below 2.41. After a short one, where steps
    had to be halved or two outputs are close, several lead to where one would have. The first step of a run is no
    longer than ``first``: with a growth of two, thermal runs so pass all lengths at which some mode forgets its start.
    """

    def __init__(self, length: float, growth: float = np.inf, first: float = np.inf) -> None:
        self.length, self._growth, self._first = length, growth, first
        self.chosen: tuple[float, ...] = (length,)
        self.shortened = 0
        self._plan = (0.0, 0.0, 1, 1)  # interval start and end, its number of steps, those taken
        self._trial = 0.0  # length to try for the step of the plan that is under way; 0 where none is

    @property
    def reach(self) -> float:
        """As long as any."""
        return self.length

    def propose(self, state: State, until: float, limit: float) -> Proposal:
        """The next step of the plan, or a part of it where it had to be halved or may not grow so fast."""
        start, end, count, done = self._plan
        between, planned = self._trial == 0.0 and done > 0, (end - start) / count
        stale = planned > limit or (planned < 0.5 * self.length and limit > 2.0 * planned)
        if end != until or done >= count or (between and stale):
            self._plan, self._trial = (state.time, until, self._parts(state, until, limit), 0), 0.0
        goal = self._goal()
        rest, old = goal - state.time, state.dt_old
        dt = self._trial or rest
        dt = min(dt, self._growth * old if old > 0 else self._first)
        parts = int(np.ceil(rest / dt * (1 - 1e-9)))
        dt = rest if parts <= 1 else min(dt, rest / 2) if parts == 2 else dt
        self._trial = dt
        return Proposal(dt, goal if dt == rest else state.time + dt)

    def _goal(self) -> float:
        """Where the step of the plan that is under way leads."""
        start, end, count, done = self._plan
        return end if done + 1 == count else start + (end - start) * ((done + 1) / count)

    def _parts(self, state: State, until: float, limit: float) -> int:
        """How many steps there are to ``until``: as long as before where the fluid limits them, or HELD times that."""
        length, old = self.length, state.dt_old
        if limit < MARGIN * length:
            length = old if old <= limit < HELD * MARGIN * old else limit / MARGIN
        return equal_parts(until - state.time, length)

    def judge(self, state: State, step: Step, dt: float) -> Verdict:
        """Every step that could be solved is taken; what made one fail before may be over."""
        if dt == self._goal() - state.time:
            start, end, count, done = self._plan
            self._plan, self._trial = (start, end, count, done + 1), 0.0
        else:
            self._trial = 2.0 * dt
        return Verdict.ACCEPTED

    def restart(self) -> None:
        """Equal steps know no past."""

    def shorten(self, dt: float) -> Verdict:
        """Half of it."""
        self._trial = 0.5 * dt
        self.shortened += 1
        return Verdict.REJECTED

    def state(self) -> dict[str, Any]:
        """The plan, by name."""
        start, end, count, done = self._plan
        return {
            "length": self.length,
            "shortened": self.shortened,
            "plan_start": start,
            "plan_end": end,
            "plan_count": count,
            "plan_done": done,
            "trial": self._trial,
            "chosen": np.array(self.chosen),
        }

    def restore(self, state: dict[str, Any]) -> bool:
        """Goes on from what ``state`` gave."""
        self.length, self.shortened = float(state["length"]), int(state["shortened"])
        self._plan = (
            float(state["plan_start"]),
            float(state["plan_end"]),
            int(state["plan_count"]),
            int(state["plan_done"]),
        )
        self._trial = float(state["trial"])
        return np.array_equal(state["chosen"], self.chosen)


class AdaptiveStep:
    """Steps chosen so that the error a unit time, rms over the nodes and relative to the length, is ``tolerance``.

    The local error of variable-step BDF2 from the third divided difference of the positions, of Euler from the second
    (w = dt/dt_old):

        BDF2   dt^3 (1 + w)^2/(6 w (1 + 2 w)) |r'''|,  r''' = 6 [r_{n+1}, r_n, r_{n-1}, r_{n-2}]
        Euler  dt^2/2 |r''|,                           r''  = 2 [r_{n+1}, r_n, r_{n-1}]

    Where the past for a difference is missing, after a start, the difference below it times the scene's own rate takes
    its place. Steps shorter than a hundredth of the scene's own time may each err as much as one of that length: so
    the few short steps through a stiff start, where nodes settle by a millionth of the length, are not refined for it.

    A step whose error is above tolerance times dt is rejected, the whole of it, and repeated shorter. Steps are held:
    equal parts of the time to the next output, until one HELD times as long would do (codes for stiff equations do so:
    VODE, Brown, Byrne & Hindmarsh 1989). A fluid with inertia has its operator made again for each new length, and what
    is known of equal steps' error holds best for more of them. A step grows by two at the most (BDF2 is stable below
    2.41). Three rejections in a row, as at a jump in what drives the rods, start again from an Euler step.
    """

    def __init__(
        self, tolerance: float, rate: float, longest: float, order: int, size: float, shortest: float = 0.0
    ) -> None:
        """``rate``: how fast the scene changes (radians a time); ``size``: the length errors are relative to.

        ``shortest``: a step that is good enough whatever its error; the first one, and after what drives jumps.
        """
        self.tolerance, self._longest, self._shortest = tolerance, longest, shortest
        self.length = (
            shortest or min(tolerance / rate, 1.0) ** (2 / 3) / rate
        )  # a guess between both orders, in any units
        self._rate, self._order, self._size = rate, order, size
        self.chosen: tuple[float, ...] = (tolerance, rate, longest, shortest)
        self.shortened = 0
        self._rejected = 0  # times in a row
        self._wanted = 0.0  # what the error of the last step would allow the next; 0 where that has been seen to
        self._before: list[tuple[float, np.ndarray]] = []  # dt and displacements of the step before the last, if any

    @property
    def reach(self) -> float:
        """The present one, or what the last error would allow."""
        return max(self.length, self._wanted)

    def propose(self, state: State, until: float, limit: float) -> Proposal:
        """An equal part of the rest."""
        rest = until - state.time
        wanted, self._wanted = min(self._wanted, limit / MARGIN), 0.0
        if wanted > HELD * self.length:
            self.length = wanted
        if self.length > limit:
            self.length = limit / MARGIN
        parts = equal_parts(rest, self.length)
        return Proposal(rest / parts, until if parts == 1 else state.time + rest / parts)

    def judge(self, state: State, step: Step, dt: float) -> Verdict:
        """Accepts a step whose error is within the tolerance, and chooses the length of the next."""
        error = self._error(state, step, dt) / (self._size * max(dt, 0.01 / self._rate))
        scale = SAFETY * (self.tolerance / max(error, 1e-300)) ** (1.0 / self._power(state))
        if not error <= self.tolerance and dt > self._shortest * (1 + 1e-9):
            if np.isfinite(error):
                self.length = max(dt * max(0.2, scale), self._shortest)
            return self._reject()
        self._before = [(state.dt_old, state.y_old)] if state.dt_old > 0 else []
        self._rejected = 0
        self._wanted = min(dt * min(2.0, scale), self._longest)
        return Verdict.ACCEPTED

    def shorten(self, dt: float) -> Verdict:
        """Half of it."""
        self.length = 0.5 * dt
        return self._reject()

    def restart(self) -> None:
        """Looks back at no step; one that is good enough is next."""
        self._before, self.length = [], self._shortest or self.length

    def _reject(self) -> Verdict:
        self._rejected += 1
        self.shortened += 1
        if self._rejected != RESTART:
            return Verdict.REJECTED
        self._before = []
        return Verdict.RESTARTED

    def _power(self, state: State) -> int:
        """The order of the error a unit time: 2 for BDF2, 1 for Euler."""
        return 2 if self._order == 2 and state.dt_old > 0 else 1

    def _error(self, state: State, step: Step, dt: float) -> float:
        """The rms over the nodes of the local error of the step."""
        y = step.state.y_old[:, :3]
        if state.dt_old == 0.0:
            return 0.5 * dt * self._rate * _rms(y)
        second = (y / dt - state.y_old[:, :3] / state.dt_old) / (dt + state.dt_old)
        if self._order == 1:
            return dt * dt * _rms(second)
        w = dt / state.dt_old
        factor = dt**3 * (1 + w) ** 2 / (w * (1 + 2 * w))
        if not self._before:
            return factor * self._rate / 3 * _rms(second)
        dt_before, y_before = self._before[0]
        older = (state.y_old[:, :3] / state.dt_old - y_before[:, :3] / dt_before) / (state.dt_old + dt_before)
        return factor * _rms((second - older) / (dt + state.dt_old + dt_before))

    def state(self) -> dict[str, Any]:
        """The step's length and the displacements the error is estimated from, by name."""
        out: dict[str, Any] = {"length": self.length, "wanted": self._wanted, "shortened": self.shortened}
        out["past"], out["chosen"] = len(self._before), np.array(self.chosen)
        for k, (dt, y) in enumerate(self._before):
            out |= {f"dt_{k}": dt, f"y_{k}": y}
        return out

    def restore(self, state: dict[str, Any]) -> bool:
        """Takes up what ``state`` gave."""
        self.length, self.shortened = float(state["length"]), int(state["shortened"])
        self._wanted = float(state["wanted"])
        self._before = [
            (float(state[f"dt_{k}"]), np.ascontiguousarray(state[f"y_{k}"])) for k in range(int(state["past"]))
        ]
        return np.array_equal(state["chosen"], self.chosen)


def _rms(y: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(y * y, axis=1))))
