"""Static condensation: which unknowns of a node the fluid solves for, and how the others are eliminated before it does.

`NothingCondensed`: the fluid solves for all of them; rods that do not twist, or whose twist torques go onto the grid
(rotation = "grid"). `TwistCondensed`: e1 turns against the rod's own drag Zr (rotation = "local"), so the turns phi are
eliminated rod by rod, and the linear system of the fluid keeps the three displacements r of a node. With r, p the parts
of the stiffness K and of the force g on displacements and on turns,

    (Zr/tau - K_pp) dphi = Zr/tau (target - phi) + g_p + K_pr dr

which leaves the stiffness K_rr + K_rp (Zr/tau - K_pp)^-1 K_pr on displacements, and the force g_r + K_rp (..)^-1 (..).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

import numpy as np

from ..linalg import banded
from ..linalg.constraints import Prescribed
from ..linalg.lapack import solve_banded
from ..linalg.normal_numbers import Draw, Purpose
from ..linalg.stiffness import Pairs, Stiffness, no_pairs, nodes_of

Solve = Callable[[np.ndarray], np.ndarray]  # right sides (k,) or (k, l) -> the solution
Group = tuple[slice, ...]  # node ranges of filaments that are solved for together


class Newton(NamedTuple):
    """One linearised statement (base.py): forces (n, m), their stiffness, what is held, y, target, tau.

    Where a background flow carries the nodes ``target`` is target + tau u0.
    """

    force: np.ndarray
    stiffness: Stiffness
    held: Prescribed
    y: np.ndarray
    target: np.ndarray
    tau: float


class Turns(NamedTuple):
    """The turns of k nodes that are eliminated."""

    drag: np.ndarray  # (k,) Zr/tau
    still: np.ndarray  # (k,) zero where a turn is held

    def solver(self, stiffness: Stiffness) -> Solve:
        """The solver of Zr/tau - K_pp, with unit rows where a turn is held.

        It is tridiagonal; the turns of a closed rod's first and last node are coupled as well, which SuperLU takes.
        """
        band, m = stiffness.band, 4
        middle = (band.shape[2] // m - 1) // 2 * m
        diagonals = np.zeros((3, len(band)))
        diagonals[0, 1:] = -band[:-1, 3, middle + m + 3] * self.still[:-1]
        diagonals[1] = np.where(self.still > 0.0, self.drag - band[:, 3, middle + 3], 1.0)
        diagonals[2, :-1] = -band[1:, 3, middle - m + 3] * self.still[1:]
        rows, columns, blocks = stiffness.pairs
        if not blocks[:, 3, 3].any():
            return lambda right: solve_banded(1, diagonals, right)
        from scipy.sparse import coo_array, csc_array, dia_array
        from scipy.sparse.linalg import splu

        n = len(band)
        tridiagonal = dia_array((diagonals, [1, 0, -1]), shape=(n, n))
        corners = coo_array((-blocks[:, 3, 3] * self.still[rows], (rows, columns)), shape=(n, n))
        return splu(csc_array(tridiagonal + corners)).solve

    def coupled(self, stiffness: Stiffness) -> np.ndarray:
        """K_pr (k, 3 k) of turns that are not held."""
        k = len(self.drag)
        couple = banded.dense(stiffness.band)[:, 3, :, :3]
        for i, j, block in zip(*stiffness.pairs, strict=True):
            couple[i, j] += block[3, :3]
        return self.still[:, None] * couple.reshape(k, 3 * k)

    def of(self, nodes: np.ndarray) -> Turns:
        """Those of some nodes."""
        return Turns(self.drag[nodes], self.still[nodes])


class RodStiffness(NamedTuple):
    """The stiffness of the unknowns that go through the fluid, and which of them are held."""

    stiffness: Stiffness
    held: np.ndarray  # (k,) those of them that are held, flat
    turns: Turns | None  # None: none apart

    def system(self, rods: Group, mobility: np.ndarray, tau: float) -> np.ndarray:
        """The transpose of 1 - tau M K (c k, c k) for the k nodes of some filaments, with M (c k, c k) symmetric.

        Columns of held unknowns are those of -tau M in it: there forces are sought. c unknowns a node go through the
        fluid.
        """
        own, nodes, size = self.stiffness.of(rods), nodes_of(rods), len(mobility)
        out = own.transposed_product(mobility, -tau)
        if self.turns is not None:
            turns = self.turns.of(nodes)
            turned = turns.solver(own)(turns.coupled(own))
            out = out[:, :3].reshape(size, size) + turned.T @ out[:, 3]
        out = out.reshape(size, size)
        out.ravel()[:: size + 1] += 1.0
        c = size // len(nodes)
        held = np.nonzero(np.isin((c * nodes[:, None] + np.arange(c)).ravel(), self.held))[0]
        out[held] = -tau * mobility[held]
        return out

    def memory(self) -> dict[str, np.ndarray]:
        """Its parts, by name."""
        pairs = self.stiffness.pairs._asdict() if self.stiffness.coupled else {}
        return {"band": self.stiffness.band, "held": self.held, **pairs, **(self.turns._asdict() if self.turns else {})}

    @classmethod
    def recalled(cls, arrays: Mapping[str, np.ndarray]) -> RodStiffness:
        """That of which ``memory`` gave the parts."""
        pairs, band = no_pairs(arrays["band"].shape[1]), arrays["band"]
        if "rows" in arrays:
            pairs = Pairs(arrays["rows"].astype(np.int64), arrays["columns"].astype(np.int64), arrays["blocks"])
        turns = Turns(arrays["drag"], arrays["still"]) if "drag" in arrays else None
        return cls(Stiffness(band, pairs), arrays["held"].astype(np.int64), turns)


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

    def fluctuate_rest(self, motion: np.ndarray, draw: Draw) -> None:
        """Writes random motions of what does not go through the fluid into ``motion`` (n, m) (base.py)."""


class _Whole:
    """Everything goes through the fluid."""

    def __init__(self, newton: Newton) -> None:
        self._stiffness, self._shape = newton.stiffness, newton.force.shape
        self.index, self.value = newton.held.at, newton.held.value - newton.y.ravel()[newton.held.at]
        self.free = np.ones(newton.force.size)
        self.free[self.index] = 0.0
        self.force = newton.force.ravel()

    def times(self, d: np.ndarray) -> np.ndarray:
        return self._stiffness.times(d.reshape(self._shape)).ravel()

    def frozen(self) -> RodStiffness:
        return RodStiffness(self._stiffness, self.index, None)

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

    def fluctuate_rest(self, motion: np.ndarray, draw: Draw) -> None:
        """Nothing is left to do."""


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
        still = np.ones(n)
        still[node[turn]] = 0.0
        self._turns = Turns(drag / tau, still)
        self._solve_turns = self._turns.solver(newton.stiffness)
        right = still * (drag / tau * (newton.target[:, 3] - y[:, 3]) + force[:, 3])
        right[node[turn]] = moves[turn]
        self._rest = self._solve_turns(right)
        self.force = np.ascontiguousarray(force[:, :3]).ravel() + self._pushed(self._rest)

    def _pushed(self, turns: np.ndarray) -> np.ndarray:
        """K_rp turns (3 n,)."""
        x = np.zeros(self._shape)
        x[:, 3] = turns
        return np.ascontiguousarray(self._stiffness.times(x)[:, :3]).ravel()

    def times(self, d: np.ndarray) -> np.ndarray:
        x = np.zeros(self._shape)
        x[:, :3] = d.reshape(-1, 3)
        y = self._stiffness.times(x)
        return np.ascontiguousarray(y[:, :3]).ravel() + self._pushed(self._solve_turns(self._turns.still * y[:, 3]))

    def frozen(self) -> RodStiffness:
        return RodStiffness(self._stiffness, self.index, self._turns)

    def whole(self, d: np.ndarray) -> np.ndarray:
        out = np.zeros(self._shape)
        out[:, :3] = d.reshape(-1, 3)
        couple = self._stiffness.times(out)[:, 3]
        out[:, 3] = self._solve_turns(self._turns.still * couple) + self._rest
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

    def fluctuate_rest(self, motion: np.ndarray, draw: Draw) -> None:
        """Turns, each against its own drag."""
        motion[:, 3] = draw(Purpose.TURN, (len(motion),)) / np.sqrt(self._drag)
