"""The motion of rods in a fluid without a past, linearised about a configuration: dy/dt = v + A y.

y (n, m) are the displacements from the configuration, unconstrained ones only; A = A_K + A_G:

    A_K y = M (K y + R)                    the elastic forces and loads follow the rods: exact
    A_G y = d/dy [u0 + M (f + R)] y        the fluid moves rods that have moved otherwise, f frozen: central differences

R are the reactions that keep held unknowns at rest. A_G is zero where the fluid is at rest and no force acts.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from ..linalg.constraints import Prescribed
from ..linalg.stiffness import Stiffness
from ..rods.geometry import Configuration
from ..rods.system import RodSystem
from .steady import SteadyFluid

REACH = 1e-6  # of the length, or radians: the largest displacement of a central difference
_FELT = 100.0  # times the round-off of a force: below, no force acts
_STIR = 1e-3  # of the length: a displacement that tells whether the fluid moves
_NONE = Prescribed(np.zeros(0, np.int64), np.zeros(0))


class LinearMotion:
    """A at a ``configuration``, for rods in a steady fluid, its frame included.

    ``force`` (n, m) acts on the nodes, ``velocity`` (n, m) is the motion v that is left in the frame, ``free`` (k,) are
    the flat indices of the unconstrained unknowns. Vectors that A multiplies are (k,) of these.
    """

    def __init__(self, system: RodSystem, fluid: SteadyFluid, configuration: Configuration) -> None:
        self.system, self.fluid, self.configuration = system, fluid, configuration
        force, inner = system.forces(configuration, fluid.time)
        self.force, self.shape = force, force.shape
        self.stiffness = system.stiffness(configuration, configuration, inner, fluid.time)
        self.held = Prescribed(system.ends.index, np.zeros(system.ends.index.size))
        self.free = np.delete(np.arange(force.size), system.ends.index)
        self._zero = np.zeros(force.shape)
        self._response = fluid.response(configuration.r, configuration.e3, fluid.time, 1.0)
        self._still = self._moved(self._response, self._zero)
        self.velocity = self._moved(self._response, force)

    def _moved(self, response, force: np.ndarray) -> np.ndarray:
        """The velocity (n, m) that forces (n, m) give; tau of the response is one."""
        move: np.ndarray = response.forced(force, self.held, self._zero).move
        return move

    def whole(self, x: np.ndarray) -> np.ndarray:
        """x (k,) as displacements (n, m), zero where held."""
        y = np.zeros(self.shape, x.dtype)
        y.ravel()[self.free] = x
        return y

    @property
    def residual(self) -> np.ndarray:
        """v (k,) of the unconstrained unknowns."""
        return self.velocity.ravel()[self.free]

    @cached_property
    def round_off(self) -> float:
        """The round-off of a nodal force: that of its stiffness times the size of the rods."""
        size = np.abs(self.configuration.r - self.configuration.r.mean(axis=0)).max()
        return float(np.finfo(float).eps * np.abs(self.stiffness.band[:, :3]).max() * size)

    @cached_property
    def noise(self) -> np.ndarray:
        """A velocity (n, m) as round-off of the forces makes it."""
        force = self.round_off * np.random.default_rng(0).standard_normal(self.shape)
        return self._moved(self._response, force) - self._still

    @cached_property
    def carried(self) -> bool:
        """Whether A_G is not zero: the fluid or the frame moves, or a force acts that round-off does not explain."""
        if self.fluid.frame.turns or np.abs(self.force).max() > _FELT * self.round_off:
            return True
        y = _STIR * self.system.length * np.random.default_rng(0).standard_normal(self.shape)
        y.ravel()[self.held.at] = 0.0
        there = self.system.move(self.configuration, y)
        stirred = self.fluid.fluid.response(there.r, there.e3, self.fluid.time, 1.0).forced(
            self._zero, _NONE, self._zero
        )
        return bool(stirred.move.any())

    @cached_property
    def _definite(self) -> Stiffness:
        """K without compression."""
        _, inner = self.system.forces(self.configuration, self.fluid.time)
        return self.system.definite_stiffness(self.configuration, self.configuration, inner, self.fluid.time)

    def elastic(self, x: np.ndarray) -> np.ndarray:
        """A_K x (k,)."""
        force = self.stiffness.times(self.whole(x))
        out: np.ndarray = (self._moved(self._response, force) - self._still).ravel()[self.free]
        return out

    def geometric(self, x: np.ndarray) -> np.ndarray:
        """A_G x (k,), by a central difference along x."""
        y = self.whole(x)
        size = max(float(np.abs(y[:, :3]).max()) / self.system.length, float(np.abs(y[:, 3:]).max(initial=0.0)))
        if size == 0.0:
            return np.zeros_like(x)
        step, out = REACH / size, np.zeros(self.shape)
        for sign in (1.0, -1.0):
            there = self.system.move(self.configuration, sign * step * y)
            out += sign * self._moved(self.fluid.response(there.r, there.e3, self.fluid.time, 1.0), self.force)
        gone: np.ndarray = out.ravel()[self.free] / (2 * step)
        return gone

    def times(self, x: np.ndarray) -> np.ndarray:
        """A x (k,)."""
        return self.elastic(x) + self.geometric(x) if self.carried else self.elastic(x)

    @cached_property
    def matrix(self) -> np.ndarray:
        """A (k, k), column by column."""
        unit, out = np.eye(self.free.size), np.empty((self.free.size, self.free.size))
        for column, x in enumerate(unit):
            out[:, column] = self.times(x)
        return out

    def relaxation(self, tau: float, definite: bool = False) -> Callable[[np.ndarray], np.ndarray]:
        """The map x -> (1 - tau A_K)^-1 x (k,): an implicit step of the fluid from displacements x.

        ``definite``: with the stiffness that leaves compression out, of linearly implicit steps.
        """
        response = self.fluid.response(self.configuration.r, self.configuration.e3, self.fluid.time, tau)
        matrix = self._definite if definite else self.stiffness

        def solved(target: np.ndarray) -> np.ndarray:
            stiffness = matrix if response.keeps else matrix.copy()
            move = response.implicit(self._zero, stiffness, self.held, self._zero, target).move
            out: np.ndarray = move.ravel()[self.free]
            return out

        still = solved(self._zero)  # what a flow and the frame move by
        return lambda x: solved(self.whole(x)) - still
