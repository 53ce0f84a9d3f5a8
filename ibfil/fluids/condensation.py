"""Static condensation: which unknowns of a node the fluid solves for, and how the others are eliminated before it does.

`NothingCondensed`: the fluid solves for all of them; rods that do not twist, or whose twist torques go onto the grid
(rotation = "grid"). `TwistCondensed`: e1 turns against the rod's own drag Zr (rotation = "local"), so the turns phi are
eliminated rod by rod, and the linear system of the fluid keeps the three displacements r of a node. With r, p the parts
of the stiffness K and of the force g on displacements and on turns,

    (Zr/tau - K_pp) dphi = Zr/tau (target - phi) + g_p + K_pr dr

which leaves the stiffness K_rr + K_rp (Zr/tau - K_pp)^-1 K_pr on displacements, and the force g_r + K_rp (..)^-1 (..).
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from scipy.linalg import solve_banded

from ..linalg import banded
from ..linalg.constraints import Prescribed


class Newton(NamedTuple):
    """One linearised statement (base.py): forces (n, m), their stiffness by bands, what is held, y, target, tau.

    Where a background flow carries the nodes ``target`` is target + tau u0.
    """

    force: np.ndarray
    stiffness: np.ndarray
    held: Prescribed
    y: np.ndarray
    target: np.ndarray
    tau: float


class RodStiffness(NamedTuple):
    """The stiffness of the unknowns that go through the fluid, and which of them are held."""

    band: np.ndarray  # (n, m, ..) by node
    held: np.ndarray  # (k,) those of them that are held, flat
    turns: np.ndarray | None  # (3, n) Zr/tau - K_pp by diagonals, unit rows where a turn is held; None: none apart
    still: np.ndarray | None  # (n,) zero where a turn is held

    def system(self, rod: slice, mobility: np.ndarray, tau: float) -> np.ndarray:
        """The transpose of 1 - tau M K (c k, c k) for one filament's k nodes, or for all, with M (c k, c k) symmetric.

        Columns of held unknowns are those of -tau M in it: there forces are sought. c unknowns a node go through the
        fluid.
        """
        size, k = len(mobility), rod.stop - rod.start
        out = banded.transposed_product(self.band[rod], mobility, -tau)
        if self.turns is not None and self.still is not None:
            couple = self.still[rod][:, None] * banded.dense(self.band[rod])[:, 3, :, :3].reshape(k, size)
            turned = solve_banded((1, 1), self.turns[:, rod], couple, check_finite=False)
            out = out[:, :3].reshape(size, size) + turned.T @ out[:, 3]
        out = out.reshape(size, size)
        out.ravel()[:: size + 1] += 1.0
        c = size // k
        held = self.held[(self.held >= c * rod.start) & (self.held < c * rod.stop)] - c * rod.start
        out[held] = -tau * mobility[held]
        return out


class Reduced(Protocol):
    """A linearised statement as the unknowns that go through the fluid feel it, c a node.

    ``index`` (k,) are those of them that are held, flat, and ``value`` (k,) their moves; ``free`` (c n,) is zero there
    and one elsewhere; ``force`` (c n,) pushes them.
    """

    index: np.ndarray
    value: np.ndarray
    free: np.ndarray
    force: np.ndarray

    def times(self, d: np.ndarray) -> np.ndarray:
        """The forces (c n,) that moves d (c n,) give."""

    def frozen(self) -> RodStiffness:
        """The stiffness from which matrices of single rods are made."""

    def whole(self, d: np.ndarray) -> np.ndarray:
        """The moves (n, m) of all unknowns from those (c n,) of these."""


class Condensation(Protocol):
    """Which unknowns go through the fluid; what the others do."""

    def held_in_fluid(self, held: Prescribed, m: int) -> tuple[np.ndarray, np.ndarray]:
        """Which of the held unknowns go through the fluid (bool), and where among those that do (flat)."""

    def reduced(self, newton: Newton) -> Reduced:
        """The statement that is left for the fluid."""

    def move_rest(self, y: np.ndarray, force: np.ndarray, target: np.ndarray, tau: float) -> None:
        """Writes the displacements that do not go through the fluid into y (n, m), for given forces."""

    def react_rest(
        self, y: np.ndarray, target: np.ndarray, felt: np.ndarray, held: Prescribed, tau: float
    ) -> np.ndarray:
        """Reactions (n, m) of supports that hold what does not go through the fluid."""


class _Whole:
    """Everything goes through the fluid."""

    def __init__(self, newton: Newton) -> None:
        self._stiffness, self._shape = newton.stiffness, newton.force.shape
        self.index, self.value = newton.held.at, newton.held.value - newton.y.ravel()[newton.held.at]
        self.free = np.ones(newton.force.size)
        self.free[self.index] = 0.0
        self.force = newton.force.ravel()

    def times(self, d: np.ndarray) -> np.ndarray:
        return banded.multiply(self._stiffness, d.reshape(self._shape)).ravel()

    def frozen(self) -> RodStiffness:
        return RodStiffness(self._stiffness, self.index, None, None)

    def whole(self, d: np.ndarray) -> np.ndarray:
        return d.reshape(self._shape)


class NothingCondensed:
    """All unknowns of a node go through the fluid."""

    def held_in_fluid(self, held: Prescribed, m: int) -> tuple[np.ndarray, np.ndarray]:
        """All of them, where they are."""
        return np.ones(held.at.size, bool), held.at

    def reduced(self, newton: Newton) -> Reduced:
        """The statement itself."""
        return _Whole(newton)

    def move_rest(self, y: np.ndarray, force: np.ndarray, target: np.ndarray, tau: float) -> None:
        """Nothing is left to do."""

    def react_rest(
        self, y: np.ndarray, target: np.ndarray, felt: np.ndarray, held: Prescribed, tau: float
    ) -> np.ndarray:
        """None."""
        return np.zeros(felt.shape)


class _Condensed:
    """Displacements go through the fluid, the turns are eliminated."""

    def __init__(self, newton: Newton, drag: np.ndarray) -> None:
        force, held, y, tau = newton.force, newton.held, newton.y, newton.tau
        n, m = force.shape
        self._shape, self._stiffness = (n, m), newton.stiffness
        node, part = held.at // m, held.at % m
        turn = part == 3
        moves = held.value - y.ravel()[held.at]
        self.index, self.value = (3 * node + part)[~turn], moves[~turn]
        self.free = np.ones(3 * n)
        self.free[self.index] = 0.0
        self._turns = self._tridiagonal(drag / tau)
        self._still = np.ones(n)
        self._still[node[turn]] = 0.0
        self._turns[1][node[turn]] = 1.0
        self._turns[0][1:] *= self._still[:-1]
        self._turns[2][:-1] *= self._still[1:]
        right = self._still * (drag / tau * (newton.target[:, 3] - y[:, 3]) + force[:, 3])
        right[node[turn]] = moves[turn]
        self._rest = self._solve_turns(right)
        self.force = np.ascontiguousarray(force[:, :3]).ravel() + self._pushed(self._rest)

    def _tridiagonal(self, drag: np.ndarray) -> np.ndarray:
        """Zr/tau - K_pp by its three diagonals, as solve_banded takes them."""
        n, m = self._shape
        middle = (self._stiffness.shape[2] // m - 1) // 2 * m
        diagonals = np.zeros((3, n))
        diagonals[0, 1:] = -self._stiffness[:-1, 3, middle + m + 3]
        diagonals[1] = drag - self._stiffness[:, 3, middle + 3]
        diagonals[2, :-1] = -self._stiffness[1:, 3, middle - m + 3]
        return diagonals

    def _solve_turns(self, right: np.ndarray) -> np.ndarray:
        return solve_banded((1, 1), self._turns, right, check_finite=False)

    def _pushed(self, turns: np.ndarray) -> np.ndarray:
        """K_rp turns (3 n,)."""
        x = np.zeros(self._shape)
        x[:, 3] = turns
        return np.ascontiguousarray(banded.multiply(self._stiffness, x)[:, :3]).ravel()

    def times(self, d: np.ndarray) -> np.ndarray:
        x = np.zeros(self._shape)
        x[:, :3] = d.reshape(-1, 3)
        y = banded.multiply(self._stiffness, x)
        return np.ascontiguousarray(y[:, :3]).ravel() + self._pushed(self._solve_turns(self._still * y[:, 3]))

    def frozen(self) -> RodStiffness:
        return RodStiffness(self._stiffness, self.index, self._turns, self._still)

    def whole(self, d: np.ndarray) -> np.ndarray:
        out = np.zeros(self._shape)
        out[:, :3] = d.reshape(-1, 3)
        couple = banded.multiply(self._stiffness, out)[:, 3]
        out[:, 3] = self._solve_turns(self._still * couple) + self._rest
        return out


class TwistCondensed:
    """Turns answer to the rods' own drag (n,) against spin, times control volumes."""

    def __init__(self, drag: np.ndarray) -> None:
        self._drag = drag

    def held_in_fluid(self, held: Prescribed, m: int) -> tuple[np.ndarray, np.ndarray]:
        """The positions, three a node."""
        node, part = held.at // m, held.at % m
        place = part < 3
        return place, (3 * node + part)[place]

    def reduced(self, newton: Newton) -> Reduced:
        """The turns eliminated."""
        return _Condensed(newton, self._drag)

    def move_rest(self, y: np.ndarray, force: np.ndarray, target: np.ndarray, tau: float) -> None:
        """Each against its own drag."""
        y[:, 3] = target[:, 3] + tau * force[:, 3] / self._drag

    def react_rest(
        self, y: np.ndarray, target: np.ndarray, felt: np.ndarray, held: Prescribed, tau: float
    ) -> np.ndarray:
        """The torques of supports that hold e1."""
        out = np.zeros(felt.shape)
        at = held.at[held.at % 4 == 3] // 4
        out[at, 3] = (self._drag * (y[:, 3] - target[:, 3]) / tau - felt[:, 3])[at]
        return out
