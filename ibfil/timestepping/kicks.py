"""Sizes of thermal kicks, measured on trial steps: how far they turn segments, move nodes, and make stiff modes ring.

A linear step turns a segment by an angle a and so lengthens it by a^2/2; the next takes half of that back:

    s = <a^2>/4        the stretch that stays, but for what the correction of the scheme takes off it

More generally a linear step leaves out the force phi = f(q + y) - f(q) - K y. It moves a mode of stiffness k and
mobility m by dt m phi/2/(1 + a), a = m k dt/2, which the trapezoid forgets by ((1 - a)/(1 + a))^2 a step, so that
variances dt m phi^2/(8 k) gather. In units of the thermal kT/k, summed over all modes,

    W = dt phi.M phi/(8 kT)

Where this is not small, stretch, shear and curvature of stiff modes feed the kicks that made them, and the run
explodes (timestepping/README.md has what was tried). y is that of a step in equilibrium. Trial steps are linear, about
the start without its stress, M and K frozen: x <- x + y with y = xi + dt M (K x + K y/2 + R), so that nothing but kicks
moves them. They begin short and double in length, which brings every mode into equilibrium at once: a step near 2/rate
forgets its mode.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..errors import StepFailed
from ..fluids.base import Fluid, Response
from ..linalg.constraints import Prescribed
from ..rods.geometry import Configuration
from ..rods.system import RodSystem
from .brownian import Noise


class Kicks(NamedTuple):
    """The kicks of steps of length ``dt``, means over trial steps.

    ``turn`` (n,) is a^2 of each segment, zero where none is; ``ringing`` (n,) what each node adds to W, infinite where
    a step cannot be made; ``kick`` and ``move`` the squares of one component of the random motion itself, and of what
    the rods make of it.
    """

    dt: float
    turn: np.ndarray
    ringing: np.ndarray
    kick: float
    move: float


class Trials:
    """Trial steps from a configuration, one length after the other; ``count`` of each are looked at."""

    def __init__(
        self, system: RodSystem, fluid: Fluid, noise: Noise, configuration: Configuration, time: float, count: int
    ) -> None:
        self._system, self._fluid, self._noise, self._count = system, fluid, noise, count
        self._configuration, self._time, self._taken = configuration, time, 0
        self._force, inner = system.forces(configuration, time)
        self._stiffness = system.stiffness(configuration, configuration, inner, time)
        # As if it were at rest: under the stress of a start that is not, modes may grow that later have no part in it.
        unstressed = inner._replace(bend=np.zeros_like(inner.bend), twist=np.zeros_like(inner.twist))
        self._definite = system.definite_stiffness(configuration, configuration, unstressed, time)
        self._x = self._zero = np.zeros_like(self._force)
        self._held = Prescribed(system.ends.index, np.zeros(system.ends.index.size))
        self._none = Prescribed(self._held.at[:0], self._held.value[:0])

    def pass_by(self, dt: float) -> None:
        """One step of length dt, not looked at."""
        for _ in self._steps(self._response(dt), dt, 1):
            pass

    def of(self, dt: float) -> Kicks:
        """The kicks of steps of length dt, after those made before."""
        n, response = len(self._zero), self._response(dt)
        turn, ringing, kicked, move = np.zeros(n), np.zeros(n), 0.0, 0.0
        for kick, y in self._steps(response, dt, self._count):
            turn += _squared_angles(self._configuration, y) / self._count
            ringing += self._ringing(response, y, dt) / self._count
            kicked += float(np.mean(kick[:, :3] ** 2)) / self._count
            move += float(np.mean(y[:, :3] ** 2)) / self._count
        return Kicks(dt, turn, ringing, kicked, move)

    def _response(self, dt: float) -> Response:
        q = self._configuration
        return self._fluid.response(q.r, q.e3, self._time, 0.5 * dt)

    def _unheld(self, response: Response, force: np.ndarray) -> np.ndarray:
        """Half the displacements (n, m) that forces give, and the background flow, where nothing is held."""
        return response.forced(force, self._none, self._zero).move

    def _steps(self, response: Response, dt: float, count: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Random motions and displacements of steps."""
        carried = self._unheld(response, self._zero)
        for _ in range(count):
            kick = self._noise.trial(response, self._taken, dt, self._zero.shape)
            self._taken += 1
            force = self._definite.times(self._x)
            matrix = self._definite if response.keeps else self._definite.copy()
            half = response.implicit(force, matrix, self._held, self._zero, 0.5 * kick - carried).move
            y = self._system.complete(2 * half)
            self._x = self._x + y
            yield kick, y

    def _ringing(self, response: Response, y: np.ndarray, dt: float) -> np.ndarray:
        """dt phi.M phi/(8 kT) node by node (n,), of positions: what turns leave out stays where it is."""
        start = self._configuration
        try:
            there, _ = self._system.forces(self._system.move(start, y), self._time)
        except StepFailed:
            return np.full(len(y), np.inf)
        left_out = there - self._force - self._stiffness.times(y)
        left_out.ravel()[self._held.at] = 0.0
        moved = self._unheld(response, left_out) - self._unheld(response, self._zero)
        return np.sum((left_out * moved)[:, :3], axis=1) / (4 * self._noise.energy)


def _squared_angles(configuration: Configuration, y: np.ndarray) -> np.ndarray:
    """Squares of the angles (n,) by which a linear step y turns each segment; zero where none is."""
    edge, length = configuration.edge, configuration.length
    joined = edge.any(axis=1)
    change = np.zeros_like(edge)
    change[:-1] = np.diff(y[:, :3], axis=0)
    along = np.sum(change * edge, axis=1) / length
    return np.where(joined, (np.sum(change**2, axis=1) - along**2) / length**2, 0.0)
