"""What all immersed-boundary fluids share: the implicit statement on a grid's mobility, whatever evaluates it.

    u = u0 + (J L^-1 S + s) F          (Eq. 45 of the paper, with +f)

S spreads nodal forces with a discrete delta kernel, L^-1 is the fluid's solve, J interpolates back (S transposed, times
the cell's volume), s is the slip mobility that keeps nearly inextensible rods from locking when their nodes are closer
than the grid (numerics.md, 4.3). The spin is local: e1 turns against the rod's own drag, so the turns are eliminated
rod by rod and the linear system keeps three unknowns a node. Reactions of supports are spread like any other force.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_banded

from . import banded
from .fluid import Answer, Held
from .grid import Grid
from .kernels import Kernel

Flow = Callable[[np.ndarray, float], np.ndarray]


@dataclass(frozen=True)
class Immersed:
    """What every grid fluid is made of: grid, kernel, eta, slip (n,), drag against spin (n,) or None, background flow.

    ``rods`` are the node ranges of the filaments: a node feels the stiffness of its own filament only. ``number`` is
    the type of the mobility table's numbers, float or single precision (relative error about 1e-7).
    """

    grid: Grid
    kernel: Kernel
    viscosity: float
    slip: np.ndarray
    spin_drag: np.ndarray | None
    flow: Flow | None = None
    rods: tuple[slice, ...] = ()
    number: type = np.float64

    def spin(self) -> np.ndarray:
        """The drag of each node against spin; zeros where nothing twists."""
        return np.zeros(len(self.slip)) if self.spin_drag is None else self.spin_drag

    def stencil(self, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """First grid index (n, 3) and weights (n, 3, P) of the nodes r (n, 3)."""
        return self.kernel.stencil(self.grid.coordinates(r))


def slip_mobility(fraction: float, kernel: Kernel, grid: Grid, viscosity: float, ds: np.ndarray) -> np.ndarray:
    """s = eps (h / 2 ds)/(6 pi eta a), a the kernel's point radius: a constant slip per length of rod."""
    h = grid.spacing
    return fraction * (h / (2 * ds)) / (6 * np.pi * viscosity * kernel.point_radius * h)


class RodStiffness(NamedTuple):
    """The stiffness of positions, rod by rod in full, the turns eliminated."""

    band: np.ndarray  # (n, m, ..) by node
    held: np.ndarray  # (k,) held positions, flat
    turns: np.ndarray | None  # (3, n) Zr/tau - K_pp by diagonals, unit rows where a turn is held; None: no twist
    still: np.ndarray | None  # (n,) zero where a turn is held

    def matrix(self, rod: slice) -> np.ndarray:
        """The stiffness (3 k, 3 k) of one filament's k nodes, or of all."""
        full = banded.dense(self.band[rod])
        k = len(full)
        out = np.ascontiguousarray(full[:, :3, :, :3]).reshape(3 * k, 3 * k)
        if self.turns is None or self.still is None:
            return out
        couple = self.still[rod][:, None] * full[:, 3, :, :3].reshape(k, 3 * k)
        turned = solve_banded((1, 1), self.turns[:, rod], couple, check_finite=False)
        return out + full[:, :3, :, 3].reshape(3 * k, k) @ turned


class Positions:
    """The stiffness as the positions alone feel it, the turns (if any) eliminated; and what is held.

    (Zr/tau - K_pp) dp = Zr/tau (target - phi) + g_p + K_pr dr: turns answer to their own drag only, so what is left
    is the stiffness K_rr + K_rp (Zr/tau - K_pp)^-1 K_pr on positions, and the force g_r + K_rp (..)^-1 (..).
    ``index`` (k,) are the held positions, flat, and ``value`` (k,) their moves.
    """

    def __init__(
        self,
        force: np.ndarray,
        stiffness: np.ndarray,
        held: Held,
        y: np.ndarray,
        target: np.ndarray,
        spin_drag: np.ndarray,
        tau: float,
    ) -> None:
        n, m = force.shape
        self.shape, self.stiffness = (n, m), stiffness
        node, part = held.at // m, held.at % m
        turn = part == 3
        moves = held.value - y.ravel()[held.at]
        self.index, self.value = (3 * node + part)[~turn], moves[~turn]
        self.free = np.ones(3 * n)
        self.free[self.index] = 0.0
        self.force = np.ascontiguousarray(force[:, :3]).ravel()
        if m == 3:
            return
        self._turns = self._tridiagonal(spin_drag / tau)
        self._still = np.ones(n)
        self._still[node[turn]] = 0.0
        self._turns[1][node[turn]] = 1.0
        self._turns[0][1:] *= self._still[:-1]
        self._turns[2][:-1] *= self._still[1:]
        right = self._still * (spin_drag / tau * (target[:, 3] - y[:, 3]) + force[:, 3])
        right[node[turn]] = moves[turn]
        self._rest = self._solve_turns(right)
        self.force = self.force + self._pushed(self._rest)

    def _tridiagonal(self, drag: np.ndarray) -> np.ndarray:
        """Zr/tau - K_pp by its three diagonals, as solve_banded takes them."""
        n, m = self.shape
        middle = (self.stiffness.shape[2] // m - 1) // 2 * m
        diagonals = np.zeros((3, n))
        diagonals[0, 1:] = -self.stiffness[:-1, 3, middle + m + 3]
        diagonals[1] = drag - self.stiffness[:, 3, middle + 3]
        diagonals[2, :-1] = -self.stiffness[1:, 3, middle - m + 3]
        return diagonals

    def _solve_turns(self, right: np.ndarray) -> np.ndarray:
        return solve_banded((1, 1), self._turns, right, check_finite=False)

    def _pushed(self, turns: np.ndarray) -> np.ndarray:
        """K_rp turns (3 n,)."""
        x = np.zeros(self.shape)
        x[:, 3] = turns
        return np.ascontiguousarray(banded.multiply(self.stiffness, x)[:, :3]).ravel()

    def times(self, d: np.ndarray) -> np.ndarray:
        """The forces (3 n,) that moves d (3 n,) of the positions give."""
        n, m = self.shape
        x = np.zeros(self.shape)
        x[:, :3] = d.reshape(n, 3)
        y = banded.multiply(self.stiffness, x)
        out = np.ascontiguousarray(y[:, :3]).ravel()
        return out if m == 3 else out + self._pushed(self._solve_turns(self._still * y[:, 3]))

    def frozen(self) -> RodStiffness:
        """What the matrices of single rods are made of."""
        if self.shape[1] == 3:
            return RodStiffness(self.stiffness, self.index, None, None)
        return RodStiffness(self.stiffness, self.index, self._turns, self._still)

    def whole(self, d: np.ndarray) -> np.ndarray:
        """The moves (n, m) of all unknowns from those of the positions (3 n,)."""
        n, m = self.shape
        out = np.zeros(self.shape)
        out[:, :3] = d.reshape(n, 3)
        if m == 4:
            couple = banded.multiply(self.stiffness, out)[:, 3]
            out[:, 3] = self._solve_turns(self._still * couple) + self._rest
        return out


class ImmersedResponse(ABC):
    """Positions frozen over a step of effective length tau. What evaluates the mobility is a subclass's."""

    def __init__(self, fluid: Immersed, r: np.ndarray, time: float, tau: float) -> None:
        self.fluid, self.tau = fluid, tau
        self.base, self.weights = fluid.stencil(r)
        self.flow = None if fluid.flow is None else fluid.flow(r, time)

    @abstractmethod
    def apply(self, force: np.ndarray) -> np.ndarray:
        """Velocities (3 n,) of forces (3 n,), without the background flow."""

    @abstractmethod
    def columns(self, index: np.ndarray) -> np.ndarray:
        """Columns (3 n, k) of the mobility at flat position indices (k,)."""

    @abstractmethod
    def solve(self, positions: Positions, right: np.ndarray) -> np.ndarray:
        """x (3 n,) with (1 - tau M K) x = right; at held positions columns of -tau M: forces are sought."""

    def _base(self, target: np.ndarray) -> np.ndarray:
        if self.flow is None:
            return target[:, :3].ravel()
        return (target[:, :3] + self.tau * self.flow).ravel()

    def forced(self, force: np.ndarray, held: Held, target: np.ndarray) -> Answer:
        """y = target + tau (u0 + M (force + R)), R such that held unknowns move as prescribed."""
        n, m = force.shape
        node, part = held.at // m, held.at % m
        place = part < 3
        index = (3 * node + part)[place]
        reaction = np.zeros((n, m))
        move = self._base(target) + self.tau * self.apply(np.ascontiguousarray(force[:, :3]).ravel())
        if index.size:
            columns = self.columns(index)
            push = np.linalg.solve(self.tau * columns[index], held.value[place] - move[index])
            move = move + self.tau * columns @ push
            reaction[node[place], part[place]] = push
        y = np.zeros((n, m))
        y[:, :3] = move.reshape(n, 3)
        if m == 4:
            y[:, 3] = target[:, 3] + self.tau * force[:, 3] / self.fluid.spin()
        y.ravel()[held.at] = held.value
        if m == 4:
            self._add_couples(y, target, force, reaction, node[~place])
        return Answer(y, force + reaction, reaction)

    def _add_couples(self, y: np.ndarray, target: np.ndarray, felt: np.ndarray, reaction: np.ndarray, at) -> None:
        """The torques of supports that hold e1, into ``reaction``."""
        couple = self.fluid.spin() * (y[:, 3] - target[:, 3]) / self.tau - felt[:, 3]
        reaction[at, 3] = couple[at]

    def implicit(
        self, force: np.ndarray, stiffness: np.ndarray, held: Held, y: np.ndarray, target: np.ndarray
    ) -> Answer:
        """One Newton correction: y + d = target + tau (u0 + M (force + K d + R))."""
        positions = Positions(force, stiffness, held, y, target, self.fluid.spin(), self.tau)
        known = np.zeros(positions.force.size)
        known[positions.index] = positions.value
        push = positions.force + positions.times(known)
        right = self._base(target) - y[:, :3].ravel() + self.tau * self.apply(push) - known
        x = self.solve(positions, right)
        d, reaction = x.copy(), np.zeros(force.shape)
        d[positions.index] = positions.value
        reaction[positions.index // 3, positions.index % 3] = x[positions.index]
        move = positions.whole(d)
        felt = force + banded.multiply(stiffness, move)
        if force.shape[1] == 4:
            at = held.at[held.at % 4 == 3] // 4
            self._add_couples(y + move, target, felt, reaction, at)
        return Answer(move, felt + reaction, reaction)
