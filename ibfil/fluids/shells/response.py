"""Rods and bodies in one mobility: the shells of bodies are taken out, so that what is left is rods in their presence.

With rods r, markers m, and the bodies' unknowns q, whose markers move by B q at the geometry at which the fluid is
asked, the statement for both is

    (y - target)_r = tau (u0_r + M_rr F_r + M_rm F_m),    B (q - target)/tau = u0_m + M_mr F_r + M_mm F_m

and so, with T = M_mm^-1 M_mr, the rods feel a fluid in which the bodies are, and move:

    F_m = M_mm^-1 (B (q - target)/tau - u0_m) - T F_r
    y_r = target + tau (u0_r - T^T u0_m) + T^T B (q - target) + tau (M_rr - M_rm T) F_r

The rods' system is factored once and has one right side more for each unknown of q; the balance of q is in
bodies/border.py, with own = B^T F_m. M_mm is positive definite, and taken out once a step.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from ...bodies.border import Done, Own, bordered, frozen, supported
from ...errors import StepFailed
from ...linalg.constraints import Carried, Prescribed
from ...linalg.normal_numbers import Draw
from ...linalg.stiffness import Stiffness, no_pairs
from ..base import Solution
from ..coupling import Nodes
from ..immersed_boundary import Immersed
from ..stokes import DenseResponse
from .shell import Shells


class MarkersTooClose(StepFailed):
    """Markers so close to each other or to a rod that their mobility has no inverse."""


class Rigid:
    """The mobility of n nodes and k markers, these taken out; c numbers of a node go through the fluid."""

    def __init__(
        self, matrix: np.ndarray, rods: int, components: int, levers: np.ndarray, drift: np.ndarray | None
    ) -> None:
        """``matrix`` (c n + c k,) square, of which ``rods`` numbers are those of nodes, which come first.

        ``levers`` (3 k, p) and ``drift`` (3 k,), in a background flow, are of the markers.
        """
        self.whole, self.levers = matrix, levers
        at = np.arange(rods, len(matrix)).reshape(-1, components)[:, :3].ravel()  # markers do not spin
        try:
            self._factors = cho_factor(matrix[np.ix_(at, at)], lower=True, check_finite=False)
        except np.linalg.LinAlgError:
            raise MarkersTooClose("markers of bodies are too close: their mobility has no inverse", 0) from None
        half = solve_triangular(self._factors[0], matrix[at, :rods], lower=True)
        self.rods = matrix[:rods, :rods] - half.T @ half
        self._through = solve_triangular(self._factors[0], half, lower=True, trans=1)  # T
        self.by_bodies = self._through.T @ levers  # how rods move with q
        self._drift = np.zeros(len(levers)) if drift is None else drift
        self.carried = -(self._through.T @ self._drift)
        self._own = cho_solve(self._factors, np.column_stack([levers, self._drift]))
        self.resistance = levers.T @ self._own[:, :-1]  # of the bodies where rods do not push (p, p)

    def pushes(self, rate: np.ndarray, felt: np.ndarray) -> np.ndarray:
        """The forces of markers on the fluid (3 k,) when q has rates (p,) and rods push with ``felt`` (c n,)."""
        return self._own[:, :-1] @ rate - self._own[:, -1] - self._through @ felt

    def forces(self, rate: np.ndarray, felt: np.ndarray) -> np.ndarray:
        """B^T F_m: forces and torques of the bodies on the fluid (p,)."""
        out: np.ndarray = self.levers.T @ self.pushes(rate, felt)
        return out

    def rates(self, force: np.ndarray, felt: np.ndarray) -> np.ndarray:
        """The rates (p,) at which bodies do ``force`` (p,) to the fluid; zero of what has no markers."""
        short = force - self.forces(np.zeros(len(force)), felt)
        out: np.ndarray = np.linalg.lstsq(self.resistance, short, rcond=1e-13)[0]
        return out


class WithShells:
    """The response of rods and bodies, positions frozen over a step of effective length tau."""

    keeps = True

    def __init__(
        self, immersed: Immersed, nodes: Nodes, flow: np.ndarray | None, rigid: Rigid, shells: Shells, tau: float
    ) -> None:
        """``nodes`` of rods alone and the motions ``flow`` (n, c) or (n, m) of these without any force."""
        self._rigid, self._shells, self._flow, self.tau = rigid, shells, flow, tau
        self._rods = DenseResponse(immersed, nodes, None, tau, rigid.rods)
        self._c = immersed.coupling.components

    def fluctuation(self, draw: Draw, shape: tuple[int, int]) -> np.ndarray:
        """Not of scenes with bodies, which have no thermal forces."""
        raise NotImplementedError

    def implicit(
        self, force: np.ndarray, stiffness: Stiffness, held: Prescribed, y: np.ndarray, target: np.ndarray
    ) -> Solution:
        """One correction of nodes and bodies."""
        carried = held.carried
        assert carried is not None
        n, shells = self._shells.nodes, self._shells
        moved = shells.of_rows(y - target)
        fixed, still = _inside(held, carried, y, n)
        first = self._rods.implicit(force[:n], stiffness, fixed, y[:n], self._base(target[:n], moved))
        each = [self._by(k, stiffness, carried, still, force[:n].shape) for k in range(len(carried.by))]
        return self._whole(held, first, each, y, moved)

    def forced(self, force: np.ndarray, held: Prescribed, target: np.ndarray) -> Solution:
        """The displacements without stiffness: by that of none."""
        n, m = self._shells.nodes, force.shape[1]
        none = Stiffness(np.zeros((n, m, 3 * m)), no_pairs(m))
        carried = held.carried
        assert carried is not None
        bare = frozen(carried)
        return self.implicit(force, none, held._replace(carried=bare), np.zeros_like(force), target)

    def apply(self, force: np.ndarray) -> np.ndarray:
        """Velocities of forces on rods and markers, c numbers of each (flat), without the background flow."""
        return self._rigid.whole @ force

    def _base(self, target: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """The displacements (n, m) of rods without any force, bodies having moved by ``moved`` (p,)."""
        out, c = target.copy(), self._c
        out[:, :c] += (self._rigid.by_bodies @ moved).reshape(-1, c)
        if self._flow is not None:
            out[:, : self._flow.shape[1]] += self.tau * self._flow
        out[:, :c] += self.tau * self._rigid.carried.reshape(-1, c)
        return out

    def _by(
        self, k: int, stiffness: Stiffness, carried: Carried, still: np.ndarray, shape: tuple[int, int]
    ) -> Solution:
        """The rods' part where the k-th unknown of the bodies moves by one, and nothing else pushes."""
        zero = np.zeros(shape)
        follow = Prescribed(
            np.concatenate([still, carried.at]), np.concatenate([np.zeros(len(still)), carried.lever[:, k]])
        )
        base = zero.copy()
        base[:, : self._c] = self._rigid.by_bodies[:, k].reshape(-1, self._c)
        return self._rods.implicit(carried.columns[:, :, k], stiffness, follow, zero, base)

    def _whole(
        self, held: Prescribed, first: Solution, each: list[Solution], y: np.ndarray, moved: np.ndarray
    ) -> Solution:
        """The correction of rods and bodies, from that of rods while bodies stay and by each unknown of these."""
        c, rigid, tau = self._c, self._rigid, self.tau
        moves, felt, reaction = (np.array(column) for column in zip(*each, strict=True))
        by_felt = felt[:, :, :c].reshape(len(each), -1)
        own = Own(
            rigid.forces(moved / tau, first.force[:, :c].ravel()),
            rigid.resistance / tau - rigid.by_bodies.T @ by_felt.T,
        )
        nodes, by_each, carried, supports = Done(first.move, first.force), Done(moves, felt), held.carried, None
        assert carried is not None
        if carried.clamps is not None:
            at = carried.clamps.nodes
            supports = supported(carried.clamps, first.reaction[at], reaction[:, at], nodes, by_each)
        dq, reacted = bordered(held, carried, (nodes, by_each, own, supports), y, moved / tau, tau)
        d, force, support = (
            one + np.tensordot(dq, some, 1) for one, some in zip(first, (moves, felt, reaction), strict=True)
        )
        done = rigid.forces((moved + dq) / tau, force[:, :c].ravel())
        rows = (self._shells.in_rows(q, y.shape) for q in (dq, done, reacted))
        return Solution(*(np.concatenate(both) for both in zip((d, force, support), rows, strict=True)))


def _inside(held: Prescribed, carried: Carried, y: np.ndarray, n: int) -> tuple[Prescribed, np.ndarray]:
    """The held and the carried among n nodes, at its place while bodies stay; and which is held but not carried."""
    inside = held.at < n * y.shape[1]
    still = held.at[inside]
    value = np.concatenate([held.value[inside], y.ravel()[carried.at] + carried.value])
    return Prescribed(np.concatenate([still, carried.at]), value), still
