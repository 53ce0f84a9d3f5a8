"""Configurations of rest: v = 0 in the frame of a scene (steady.py).

`continued` follows the motion itself with backward Euler steps that grow as the velocity falls (pseudo-transient
continuation), so it goes where a run would go, but for rests that are not stable, at which it may end as well. `newton`
solves v + A y = 0 with the whole linearised motion, by least squares where rods are free to drift: it finds the next
rest, stable or not. Either ends when the velocity falls no more: its floor is round-off, of the order of 1e-16 times
the fastest rate of the scene, so that no tolerance could be given.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..rods.geometry import Configuration
from ..rods.system import RodSystem
from .base import FAILURES, State
from .implicit import Implicit
from .linear_motion import LinearMotion
from .spectrum import Modes, modes
from .steady import NoRest, SteadyFluid, SteadyRods

_MOST = {"newton": 40, "continued": 400, "pushes": 4}  # steps
_ALIKE = 1e-6  # of an eigenvalue: two that differ by less are one
_SINGULAR = 1e-13  # reciprocal condition of a matrix of which only a part can be solved
_PUSH = 0.02  # of the length, off a rest that is not stable
_FLOOR = 100.0  # times the velocity that round-off makes: above, nothing is taken for a rest
_PATIENCE = {"newton": 1, "continued": 3}  # steps below it in which the velocity must halve
_LONGEST = 1e9  # T: a step of continuation after which a velocity that is left is there to stay
_STRIDE = 0.3  # of the length, or radians between neighbours: the largest change in a step
_GROWTH = (0.5, 10.0)  # of a step of continuation
_ITERATIONS = 10  # of a step of continuation, else it is tried again with a quarter


class Rest(NamedTuple):
    """A configuration of rest: what is left of its velocity times T/L, and the steps and linear solves it took."""

    configuration: Configuration
    residual: float
    steps: int
    solves: int


class _Fall:
    """The residuals of a search, and whether they have come down to round-off."""

    def __init__(self, patience: int) -> None:
        self.best, self._since, self._patience = np.inf, 0, patience
        self.configuration: Configuration

    def ended(self, residual: float, noise: float, configuration: Configuration) -> bool:
        """Take one; whether none has halved the best for some steps, and that is of the size of ``noise``."""
        self._since = 0 if residual < 0.5 * self.best else self._since + 1
        if residual < self.best:
            self.best, self.configuration = residual, configuration
        return residual == 0.0 or (self.best < _FLOOR * noise and self._since >= self._patience)


def residual_of(velocity: np.ndarray, length: float, time: float) -> float:
    """The largest velocity of a node times T/L, or turn times T, of v (n, m)."""
    size = np.abs(velocity[:, :3]).max() / length
    return float(time * max(size, np.abs(velocity[:, 3:]).max(initial=0.0)))


def newton(system: RodSystem, fluid: SteadyFluid, configuration: Configuration, time: float) -> Rest:
    """The rest next to ``configuration``, stable or not; ``time`` T is that of the slowest motion. Raises NoRest."""
    fall, steps = _Fall(_PATIENCE["newton"]), 0
    while True:
        motion = LinearMotion(system, fluid, configuration)
        residual, noise = (residual_of(v, system.length, time) for v in (motion.velocity, motion.noise))
        if fall.ended(residual, noise, configuration):
            return Rest(fall.configuration, fall.best, steps, steps)
        if steps == _MOST["newton"] or not np.isfinite(residual):
            raise _none(motion.velocity, fall.best, steps)
        y = motion.whole(_solved(motion.matrix, -motion.residual))
        configuration, steps = _moved(system, configuration, y), steps + 1


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """x (k,) with A x = right, the smallest one that fits best where rods are free to drift."""
    from scipy.linalg import lapack, lstsq

    factors, pivots, failed = lapack.dgetrf(matrix)
    condition = 0.0 if failed else lapack.dgecon(factors, np.abs(matrix).sum(axis=0).max())[0]
    if condition < _SINGULAR:
        out: np.ndarray = lstsq(matrix, right, lapack_driver="gelsy")[0]
        return out
    return lapack.dgetrs(factors, pivots, right)[0]


def _change(system: RodSystem, y: np.ndarray) -> float:
    """How much y (n, m) changes rods: the largest displacement in lengths, or change of a turn between neighbours."""
    turns = np.diff(y[:, 3:], axis=0)[system.mesh.joined[:-1]]
    return float(max(np.abs(y[:, :3]).max() / system.length, np.abs(turns).max(initial=0.0)))


def _moved(system: RodSystem, configuration: Configuration, y: np.ndarray) -> Configuration:
    """The configuration moved by y (n, m), or by a part of it that moves nothing too far."""
    size = _change(system, y)
    part = min(1.0, _STRIDE / size) if size > 0 else 1.0
    while True:
        try:
            return system.move(configuration, part * y)
        except FAILURES:
            if part < 1e-6:
                raise
            part *= 0.25


def continued(system: RodSystem, fluid: SteadyFluid, configuration: Configuration, time: float) -> Rest:
    """The rest that the motion from ``configuration`` leads to. Raises NoRest where it comes to none."""
    steady = SteadyRods(system, fluid.time)
    fall, tau, solves, before = _Fall(_PATIENCE["continued"]), 0.01 * time, 0, np.inf
    state = State(0.0, configuration, np.zeros((len(configuration.r), system.unknowns)), 0.0)
    for steps in range(_MOST["continued"]):
        motion = LinearMotion(system, fluid, state.configuration)
        residual, noise = (residual_of(v, system.length, time) for v in (motion.velocity, motion.noise))
        if fall.ended(residual, noise, state.configuration):
            return Rest(fall.configuration, fall.best, steps, solves)
        if np.isfinite(before):
            tau *= float(np.clip(_ratio(before, residual), *_GROWTH))
        if tau > _LONGEST * time:
            break
        before = residual
        state, tau, used = _step(steady, fluid, state, tau)
        solves += used
    raise _none(motion.velocity, fall.best, steps)


def _ratio(before: float, residual: float) -> float:
    """The ratio of a step to the last one: that of the residuals; where they rise, half an e-folding of their rise."""
    return before / residual if residual <= before else 0.5 / float(np.log(residual / before))


def _step(steady: SteadyRods, fluid: SteadyFluid, state: State, tau: float) -> tuple[State, float, int]:
    """A backward Euler step of tau, or of a quarter, sixteenth ... of it; the state, the step, the solves."""
    solves, euler, reached = 0, Implicit(order=1, most=_ITERATIONS), tau
    while True:
        try:
            step = euler.step(steady, fluid, state._replace(dt_old=0.0), reached)
            solves += step.iterations
            if _change(steady.system, step.state.y_old) <= _STRIDE:
                return step.state, reached, solves
        except FAILURES:
            solves += _ITERATIONS
        reached *= 0.25
        if reached < 1e-12 * tau:
            raise NoRest("no step of the search could be solved", 0)


class Settled(NamedTuple):
    """The rests that a scene passes through, unstable ones first, and the eigenvalue that grows fastest at each."""

    rests: tuple[Rest, ...]
    leading: tuple[complex, ...]


def settled(system: RodSystem, fluid: SteadyFluid, configuration: Configuration, time: float) -> Settled:
    """The stable rest that the motion leads to: off every rest that is not, along the mode that grows fastest.

    Raises NoRest where what grows oscillates, as in flutter, or nothing stable is reached.
    """
    rests: list[Rest] = []
    leading: list[complex] = []
    for _ in range(_MOST["pushes"] + 1):
        rest = continued(system, fluid, configuration, time)
        motion = LinearMotion(system, fluid, rest.configuration)
        found = modes(motion, 8, 25.0 / time)
        rests, leading = [*rests, rest], [*leading, complex(found.values[0])]
        zero = zero_rate(motion, time)
        if leading[-1].real <= zero:
            return Settled(tuple(rests), tuple(leading))
        if abs(leading[-1].imag) > zero:
            raise NoRest(f"it does not settle: {leading[-1]:.4g} grows and oscillates", 0)
        vector = _towards(LinearMotion(system, fluid, configuration), found)
        configuration = _pushed(system, fluid, rest.configuration, vector, leading[-1].real)
    raise NoRest(f"no stable rest after {_MOST['pushes']} pushes off unstable ones", 0)


def _towards(came_from: LinearMotion, found: Modes) -> np.ndarray:
    """The mode (n, m) that grows fastest; of several alike, and of its two ways, the one that the rods set out on."""
    alike = np.abs(found.values - found.values[0]) <= _ALIKE * abs(found.values[0])
    vectors = found.vectors[:, :, alike].real
    columns = vectors[:, :3].reshape(-1, vectors.shape[2])
    moves = [v[:, :3].ravel() for v in (came_from.velocity, came_from.noise)]
    share, noise = np.linalg.lstsq(columns, np.array(moves).T, rcond=None)[0].T
    along: np.ndarray = vectors @ share
    return along if np.linalg.norm(share) > np.linalg.norm(noise) else vectors[:, :, 0]


def zero_rate(motion: LinearMotion, time: float) -> float:
    """The rate below which a mode neither grows nor decays: round-off, or a millionth of the slowest motion's."""
    return max(10.0 * residual_of(motion.noise, motion.system.length, 1.0), 1e-6 / time)


def _pushed(
    system: RodSystem, fluid: SteadyFluid, configuration: Configuration, vector: np.ndarray, rate: float
) -> Configuration:
    """The configuration pushed off along a mode (n, m) that grows at ``rate``, and followed until it slows down."""
    steady = SteadyRods(system, fluid.time)
    push = _PUSH * vector / _change(system, vector)
    state = State(0.0, _moved(system, configuration, push), np.zeros_like(vector), 0.0)
    away = 0.0
    for _ in range(_MOST["continued"]):
        before, away = away, float(np.linalg.norm(state.configuration.r - configuration.r))
        if away < 1.02 * before:
            break
        state, _, _ = _step(steady, fluid, state, 0.3 / rate)
    return state.configuration


def _none(velocity: np.ndarray, best: float, steps: int) -> NoRest:
    node = int(np.argmax(np.abs(velocity).max(axis=1)))
    return NoRest(f"after {steps} steps of the search the rods still move: |v| T/L = {best:.2g}", node)
