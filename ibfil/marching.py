"""How long the steps are: equal parts of the time between outputs, or as long as a tolerance allows.

Both end exactly at the time asked for, halve a step that cannot be solved, and know their own state, so that a run
that is cut goes on with the same steps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from .stepping import FAILURES, State, Step

HELD = 1.3  # a step is kept unless one longer by this would do
MARGIN = 1.1  # what the fluid's own motion may gain before a step it limits changes
SAFETY = 0.9  # of the step that would err as much as is allowed


class Walker(Protocol):
    """What a march asks of a simulation."""

    state_now: State

    @property
    def time(self) -> float:
        """Present time."""

    def attempt(self, dt: float) -> Step:
        """A step of length dt from the present state, not yet taken."""

    def accept(self, step: Step, time: float) -> None:
        """Takes the step, which led to ``time``. Raises RunFailed where it led out of bounds."""

    def give_up(self, reason: str, dt: float, node: int | None = None) -> None:
        """Raises RunFailed: no step of length dt can be taken, because of ``node`` if that is known."""

    def may_halve(self, dt: float) -> bool:
        """Whether a step of length dt that failed may be tried again with half of it."""

    def longest_step(self) -> float:
        """What the fluid's own motion leaves to steps that nobody prescribed; infinite where it has none."""


class EvenSteps:
    """Equal steps no longer than ``length``, and than the fluid allows, from one output to the next.

    No step is longer than ``growth`` times the one before: BDF2 is stable below 2.41. After a short one, where steps
    had to be halved or two outputs are close, several lead to where one would have.
    """

    def __init__(self, length: float, growth: float = np.inf) -> None:
        self.length, self._growth = length, growth
        self.shortened = 0
        self._plan = (0.0, 0.0, 1, 0)  # interval start and end, its number of steps, those taken

    def advance(self, walker: Walker, until: float, after_step: Callable[[], None]) -> None:
        """Goes on to exactly ``until``; calls back after each step."""
        start, end, count, done = self._plan
        if end != until or done >= count:
            start, done, count = walker.time, 0, self._parts(walker, until)
        while done < count:
            goal = until if done + 1 == count else start + (until - start) * ((done + 1) / count)
            self._step_to(walker, goal)
            done += 1
            if done < count and (until - start) / count > walker.longest_step():
                start, done, count = walker.time, 0, self._parts(walker, until)
            self._plan = (start, until, count, done)
            after_step()

    def _parts(self, walker: Walker, until: float) -> int:
        """How many steps there are to ``until``: as long as before where the fluid limits them, or HELD times that."""
        length, longest, old = self.length, walker.longest_step(), walker.state_now.dt_old
        if longest < MARGIN * length:
            length = old if old <= longest < HELD * MARGIN * old else longest / MARGIN
        return max(1, int(np.ceil((until - walker.time) / length * (1 - 1e-9))))

    def _step_to(self, walker: Walker, goal: float) -> None:
        """One step, or as many as halving and growth make of it."""
        dt = goal - walker.time
        while walker.time < goal:
            rest, old = goal - walker.time, walker.state_now.dt_old
            dt = min(dt, self._growth * old) if old > 0 else dt
            parts = int(np.ceil(rest / dt * (1 - 1e-9)))
            dt = rest if parts <= 1 else min(dt, rest / 2) if parts == 2 else dt
            try:
                step = walker.attempt(dt)
            except FAILURES as failure:
                if not walker.may_halve(dt):
                    walker.give_up(str(failure), dt, getattr(failure, "node", None))
                dt *= 0.5
                self.shortened += 1
                continue
            walker.accept(step, goal if dt == rest else walker.time + dt)
            dt *= 2.0  # what made a step fail may be over

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
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Takes up what ``state`` gave."""
        self.length, self.shortened = float(state["length"]), int(state["shortened"])
        self._plan = (
            float(state["plan_start"]),
            float(state["plan_end"]),
            int(state["plan_count"]),
            int(state["plan_done"]),
        )


class ControlledSteps:
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
    VODE, Brown, Byrne & Hindmarsh 1989). A fluid with inertia has its operator made anew for each new length, and what
    is known of equal steps' error holds best for more of them. A step grows by two at the most (BDF2 is stable below
    2.41). Three rejections in a row, as at a jump in what drives the rods, start again from an Euler step.
    """

    def __init__(self, tolerance: float, rate: float, longest: float, order: int, size: float) -> None:
        """``rate``: how fast the scene changes (radians a time); ``size``: the length errors are relative to."""
        self.tolerance, self.length, self._longest = tolerance, min(tolerance, 1.0) / rate, longest
        self._rate, self._order, self._size = rate, order, size
        self.shortened = 0
        self._before: list[tuple[float, np.ndarray]] = []  # dt and displacements of the step before the last, if any

    def advance(self, walker: Walker, until: float, after_step: Callable[[], None]) -> None:
        """Goes on to exactly ``until``; calls back after each step."""
        while walker.time < until:
            self._one(walker, until)
            after_step()

    def _one(self, walker: Walker, until: float) -> None:
        """One step that passes."""
        rejected = 0
        while True:
            rest = until - walker.time
            if self.length > walker.longest_step():
                self.length = walker.longest_step() / MARGIN
            parts = max(1, int(np.ceil(rest / self.length * (1 - 1e-9))))
            dt = rest / parts
            try:
                step = walker.attempt(dt)
                error = self._error(walker.state_now, step, dt) / (self._size * max(dt, 0.01 / self._rate))
            except FAILURES as failure:
                if not walker.may_halve(dt):
                    walker.give_up(str(failure), dt, getattr(failure, "node", None))
                self.length, error = 0.5 * dt, np.inf
            if error <= self.tolerance:
                break
            rejected += 1
            self.shortened += 1
            if not walker.may_halve(dt):
                walker.give_up("the error stays above time.tolerance", dt)
            if np.isfinite(error):
                self.length = dt * max(0.2, SAFETY * (self.tolerance / error) ** (1.0 / self._power(walker)))
            if rejected == 3:
                walker.state_now = walker.state_now._replace(dt_old=0.0)
                self._before = []
        state = walker.state_now
        growth = SAFETY * (self.tolerance / max(error, 1e-300)) ** (1.0 / self._power(walker))
        self._before = [(state.dt_old, state.y_old)] if state.dt_old > 0 else []
        walker.accept(step, until if parts == 1 else walker.time + dt)
        length = min(dt * min(2.0, growth), walker.longest_step() / MARGIN, self._longest)
        if length > HELD * self.length:
            self.length = length

    def _power(self, walker: Walker) -> int:
        """The order of the error a unit time: 2 for BDF2, 1 for Euler."""
        return 2 if self._order == 2 and walker.state_now.dt_old > 0 else 1

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
        out: dict[str, Any] = {"length": self.length, "shortened": self.shortened, "past": len(self._before)}
        for k, (dt, y) in enumerate(self._before):
            out |= {f"dt_{k}": dt, f"y_{k}": y}
        return out

    def restore(self, state: dict[str, Any]) -> None:
        """Takes up what ``state`` gave."""
        self.length, self.shortened = float(state["length"]), int(state["shortened"])
        self._before = [
            (float(state[f"dt_{k}"]), np.ascontiguousarray(state[f"y_{k}"])) for k in range(int(state["past"]))
        ]


def _rms(y: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(y * y, axis=1))))
