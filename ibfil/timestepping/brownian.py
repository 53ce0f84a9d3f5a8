"""Thermal motion: over a step the fluid moves the nodes at random, with the covariance of its own mobility.

    dy = [M f + kT div M] dt + sqrt(2 kT) M^1/2 dW              (Ito)
    xi = sqrt(2 kT dt) M^1/2 w + dt kT div M                    the random motion of a step, held nodes as if free

M is taken where the step begins. The reactions that then hold nodes take from xi what they must, so that the others are
left with the covariance of the mobility that is left to them (timestepping/README.md). In resistive-force theory
M = Z^-1, and this is the paper's Eq. 53, impulses of covariance 2 kT dt Z (Eq. 50-52 print 2 zeta kT/(ds dt) where
lambda^2 = 2 zeta kT is meant), with a normal number of its own for the twist (Sec. 7.5 prints none).

The drift kT div M is what Boltzmann's law asks for where M follows the rods, its divergence along their motions.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from ..fluids.base import Fluid, Response
from ..linalg.compiled import njit
from ..linalg.constraints import Prescribed
from ..linalg.normal_numbers import Draw, NormalNumbers, Purpose
from ..linalg.vectors import at, plus, put
from ..rods.mesh import Mesh
from .base import State, System


class Asked(NamedTuple):
    """A step whose random motion is asked for: rods, fluid and state, the fluid's response, its time and its tau."""

    system: System
    fluid: Fluid
    state: State
    response: Response
    time: float
    tau: float


class Drift(Protocol):
    """A way to find the drift."""

    def add(self, asked: Asked, draw: Draw, factor: float, motion: np.ndarray) -> None:
        """Adds ``factor`` div M to ``motion`` (n, m)."""


@njit(cache=True)
def _add_along(motion, factor, size, metric, e3):
    """Adds factor size/|r'| e3 to ``motion`` (n, m)."""
    for i in range(len(size)):
        put(motion, i, 0, plus(at(motion, i, 0), factor * size[i] / metric[i], at(e3, i, 0)))


class EndDrift:
    """div Z^-1 in resistive-force theory: along the tangent, at the ends and where spacing is uneven.

    In Z^-1 = [1/zeta_perp + (1/zeta_par - 1/zeta_perp) e3 e3]/Lc only e3 depends on the node's own position, by
    de3 = (1 - e3 e3) W1_ii dr/|r'|, so that it is (d - 1)(1/zeta_par - 1/zeta_perp) W1_ii/(Lc |r'|) e3 in d dimensions,
    d = 2 in a plane. ``across``, ``along`` (n,) are drag coefficients times control volumes.
    """

    def __init__(self, across: np.ndarray, along: np.ndarray, mesh: Mesh, planar: bool) -> None:
        rows = np.arange(len(mesh.ds))
        own_weight = mesh.w1[rows, rows - mesh.first]  # W1_ii: how much of its own position is in r' of a node
        self._size = (1 if planar else 2) * (1 / along - 1 / across) * own_weight

    def add(self, asked: Asked, draw: Draw, factor: float, motion: np.ndarray) -> None:
        """By that formula; no turns."""
        configuration = asked.state.configuration
        _add_along(motion, factor, self._size, configuration.metric, configuration.e3)


class Divergence:
    """div M of any fluid, by a random finite difference of one sample, exact in the mean.

        1/delta [M(q + delta w) - M(q)] w,     w (n, m) normal on the unknowns ``free`` (n, m), zero elsewhere

    M is the mobility that held unknowns leave, as `forced` answers with it. Two forces of opposite sign take away what
    is moved without them. Odd moments of w vanish, so that a difference to one side has no error of first order in
    ``delta``. Turns have no part: M does not depend on them.
    """

    def __init__(self, delta: float, free: np.ndarray) -> None:
        self._delta, self._free = delta, free

    def add(self, asked: Asked, draw: Draw, factor: float, motion: np.ndarray) -> None:
        """By one more response."""
        w = draw(Purpose.DRIFT, motion.shape) * self._free
        there = asked.system.move(asked.state.configuration, self._delta * w)
        displaced = asked.fluid.response(there.r, there.e3, asked.time, asked.tau)
        held = asked.system.held(asked.time, asked.time)
        still = held._replace(value=np.zeros(held.value.shape))
        moved = [_moved_by(response, w, still) for response in (displaced, asked.response)]
        motion += factor / (2 * asked.tau * self._delta) * (moved[0] - moved[1])


def _moved_by(response: Response, force: np.ndarray, held: Prescribed) -> np.ndarray:
    """2 tau M force (n, m)."""
    zero = np.zeros_like(force)
    return response.forced(force, held, zero).move - response.forced(-force, held, zero).move


class Noise:
    """The random motion of n nodes over a step.

    ``energy`` is kT, ``moved`` (n, m) one where a component has thermal motion and zero elsewhere, as along z of rods
    in a plane z = const, and for turns of rods that do not twist.
    """

    def __init__(self, energy: float, seed: int, moved: np.ndarray, drift: Drift) -> None:
        self.energy = energy
        self._moved, self._drift = None if moved.all() else moved, drift
        self._numbers, self._trials = NormalNumbers(seed), NormalNumbers(0, trial=True)

    def motion(self, asked: Asked, dt: float) -> np.ndarray:
        """xi (n, m) over a step dt, drift included."""
        state = asked.state
        draw = Draw(self._numbers, state.steps)
        out = self._kick(asked.response, draw, dt, state.y_old.shape)
        self._drift.add(asked, draw, dt * self.energy, out)
        return self._only_moved(out)

    def trial(self, response: Response, count: int, dt: float, shape: tuple[int, int]) -> np.ndarray:
        """The ``count``th of the motions without drift that are the same whatever the seed of the run."""
        return self._only_moved(self._kick(response, Draw(self._trials, count), dt, shape))

    def _kick(self, response: Response, draw: Draw, dt: float, shape: tuple[int, int]) -> np.ndarray:
        out = response.fluctuation(draw, shape)
        out *= np.sqrt(2 * self.energy * dt)
        return out

    def _only_moved(self, motion: np.ndarray) -> np.ndarray:
        return motion if self._moved is None else motion * self._moved
