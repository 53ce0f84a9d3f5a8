"""Rods and bodies in one mobility: the shells of bodies are taken out, so that what is left is rods in their presence.

With rods r, markers m, and the bodies' unknowns q, whose markers move by B q at the geometry at which the fluid is
asked, the statement for both is

    (y - target)_r = tau (u0_r + M_rr F_r + M_rm F_m),    B (q - target)/tau = u0_m + M_mr F_r + M_mm F_m

and so, with T = M_mm^-1 M_mr, the rods feel a fluid in which the bodies are, and move:

    F_m = M_mm^-1 (B (q - target)/tau - u0_m) - T F_r
    y_r = target + tau (u0_r - T^T u0_m) + T^T B (q - target) + tau (M_rr - M_rm T) F_r

The rods' system is dense, factored once, and has one right side more for each unknown of q; the balance of q is in
bodies/border.py, with own = B^T F_m. M_mm is positive definite, and taken out once a step.
"""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dpotrf, dtrtrs

from ...bodies.border import Done, Own, bordered, frozen, supported
from ...errors import StepFailed
from ...linalg.constraints import Carried, Prescribed
from ...linalg.gmres import Factors, factor
from ...linalg.normal_numbers import Draw
from ...linalg.stiffness import Stiffness, no_pairs
from ..base import Solution
from .shell import Shells

FEW = 300  # unknowns of nodes, whose matrix is factored again in less time than an iteration with an old one takes


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
        self.whole, self.components = matrix, components
        at: slice | np.ndarray = slice(rods, None)
        if components > 3:  # markers do not spin
            at = np.arange(rods, len(matrix)).reshape(-1, components)[:, :3].ravel()
        self._lower, fault = dpotrf(matrix[at][:, at].T, lower=1, clean=0)  # symmetric: LAPACK takes rows for columns
        if fault:
            raise MarkersTooClose("markers of bodies are too close: their mobility has no inverse", 0)
        right = np.empty((rods + levers.shape[1] + 1, len(levers)))
        right[:rods], right[rods:-1], right[-1] = matrix[:rods, at], levers.T, 0.0 if drift is None else drift
        half = self._solved(right.T)
        self._half, self._own = half[:, :rods], half[:, rods:-1]
        self.rods = matrix[:rods, :rods] - self._half.T @ self._half
        self.by_bodies = self._half.T @ self._own  # how rods move with q: T^T B
        self.resistance = self._own.T @ self._own  # of the bodies where rods do not push (p, p)
        self._drift(half[:, -1])

    def _drift(self, drifted: np.ndarray) -> None:
        """Takes L^-1 (3 k,) of the motions that markers have without any force."""
        self._drifted = drifted
        self.carried = -(self._half.T @ drifted)
        self._drifting = self._own.T @ drifted

    def drifting(self, drift: np.ndarray) -> Rigid:
        """The same where markers drift so (3 k,)."""
        out = copy(self)
        out._drift(self._solved(drift.copy()))
        return out

    def _solved(self, right: np.ndarray, transposed: bool = False) -> np.ndarray:
        """L^-1 right, or L^-T, of M_mm = L L^T."""
        out: np.ndarray = dtrtrs(self._lower, right, lower=1, trans=int(transposed), overwrite_b=1)[0]
        return out

    def pushes(self, rate: np.ndarray, felt: np.ndarray) -> np.ndarray:
        """The forces of markers on the fluid (3 k,) when q has rates (p,) and rods push with ``felt`` (c n,)."""
        return self._solved(self._own @ rate - self._drifted - self._half @ felt, transposed=True)

    def forces(self, rate: np.ndarray, felt: np.ndarray) -> np.ndarray:
        """B^T F_m: forces and torques of the bodies on the fluid (p,)."""
        out: np.ndarray = self.resistance @ rate - self._drifting - self.by_bodies.T @ felt
        return out

    def rates(self, force: np.ndarray, felt: np.ndarray) -> np.ndarray:
        """The rates (p,) at which bodies do ``force`` (p,) to the fluid; zero of what has no markers."""
        short = force - self.forces(np.zeros(len(force)), felt)
        out: np.ndarray = np.linalg.lstsq(self.resistance, short, rcond=1e-13)[0]
        return out


class _Nodes(NamedTuple):
    """Corrections of nodes, and what the fluid feels and supports bear: (k, n, m) each, k of them."""

    moves: np.ndarray
    felt: np.ndarray
    reactions: np.ndarray


class _Each(NamedTuple):
    """The corrections (p) by each unknown of bodies, and what they are of."""

    of: tuple[Stiffness, np.ndarray, np.ndarray]
    nodes: _Nodes

    def serves(self, stiffness: Stiffness, carried: Carried) -> bool:
        """Whether they are those of this linear step."""
        return all(a is b for a, b in zip(self.of, (stiffness, carried.lever, carried.columns), strict=True))


class WithShells:
    """The response of rods and bodies, positions frozen over a step of effective length tau.

    Dense: all m unknowns of a node in one system, turns that do not go through the fluid by their own drag (n,).
    """

    def __init__(
        self, rigid: Rigid, shells: Shells, flow: np.ndarray | None, spin_drag: np.ndarray | None, tau: float
    ) -> None:
        """``flow`` (n, c) or (n, m): the motions of nodes without any force."""
        self._rigid, self._shells, self._flow, self.tau = rigid, shells, flow, tau
        self._c = rigid.components
        self._mobility = rigid.rods if spin_drag is None else _with_turns(rigid.rods, spin_drag)
        self.keeps = len(self._mobility) > FEW
        self._factors: tuple[Stiffness, Factors] | None = None  # and the stiffness they are of
        self._each: _Each | None = None
        self._last: tuple[Rigid, np.ndarray, np.ndarray] | None = None  # rates of q, and what nodes do

    def fluctuation(self, draw: Draw, shape: tuple[int, int]) -> np.ndarray:
        """Not of scenes with bodies, which have no thermal forces."""
        raise NotImplementedError

    def implicit(
        self,
        force: np.ndarray,
        stiffness: Stiffness,
        held: Prescribed,
        y: np.ndarray,
        target: np.ndarray,
        error: float = 0.0,
        coming: np.ndarray | None = None,
    ) -> Solution:
        """One correction of nodes and bodies: of nodes while bodies stay, and by each unknown of these.

        ``coming`` (n + k, c) or (n + k, m): how nodes and markers move over the step by what is not here, in place of
        the flow and the drift.
        """
        carried = held.carried
        assert carried is not None
        n, m = self._shells.nodes, force.shape[1]
        moved, flow, rigid = self._shells.of_rows(y - target), self._flow, self._rigid
        if coming is not None:
            flow, rigid = coming[:n] / self.tau, self._rigid.drifting(coming[n:, :3].ravel() / self.tau)
        at, value = _inside(held, carried, y, n * m)
        base = self._base(rigid, target[:n], flow, moved) - y[:n]
        parts = self._first_and_each(stiffness, (at, value), (force[:n], base), carried)
        return self._whole(held, (rigid, *parts), y, moved)

    def forced(self, force: np.ndarray, held: Prescribed, target: np.ndarray) -> Solution:
        """The displacements without stiffness: by that of none."""
        return self.implicit(*without_stiffness(force, held, self._shells.nodes), np.zeros_like(force), target)

    def apply(self, force: np.ndarray) -> np.ndarray:
        """Velocities of forces on rods and markers, c numbers of each (flat), without the background flow."""
        return self._rigid.whole @ force

    def marker_forces(self) -> np.ndarray:
        """The forces of markers on the fluid (k, 3), by the last correction."""
        assert self._last is not None
        rigid, rate, felt = self._last
        return rigid.pushes(rate, felt).reshape(-1, 3)

    def _first_and_each(
        self,
        stiffness: Stiffness,
        moves: tuple[np.ndarray, np.ndarray],
        pushed: tuple[np.ndarray, np.ndarray],
        carried: Carried,
    ) -> tuple[_Nodes, _Nodes]:
        """The corrections while bodies stay, and by each of their unknowns, as before in the same linear step.

        ``moves``: the unknowns (l,) that are held or carried, and how far these are off; ``pushed``: forces on nodes
        and their moves without any (n, m).
        """
        (at, value), (n, m, p) = moves, carried.columns.shape
        again = self._each is not None and self._each.serves(stiffness, carried)
        known = np.zeros((1 if again else 1 + p, n * m))
        known[0, at] = value
        if self._each is not None and again:
            return self._corrections(stiffness, at, known, *(part[None] for part in pushed)), self._each.nodes
        known[1:, at[len(at) - len(carried.at) :]] = carried.lever.T
        forces, base = np.empty((1 + p, n, m)), np.zeros((1 + p, n, m))
        forces[0], base[0] = pushed
        forces[1:] = carried.columns.transpose(2, 0, 1)
        base[1:, :, : self._c] = self._rigid.by_bodies.T.reshape(p, n, self._c)
        found = self._corrections(stiffness, at, known, forces, base)
        first, each = _Nodes(*(part[:1] for part in found)), _Nodes(*(part[1:] for part in found))
        self._each = _Each((stiffness, carried.lever, carried.columns), each)
        return first, each

    def _corrections(
        self, stiffness: Stiffness, at: np.ndarray, known: np.ndarray, pushes: np.ndarray, base: np.ndarray
    ) -> _Nodes:
        """Corrections where ``known`` (k, n m) move unknowns ``at``, by forces and displacements (k, n, m)."""
        k, n, m = pushes.shape
        pushed = pushes.reshape(k, -1) + _times(stiffness, known, m)
        x = self._solve(stiffness, at, (base.reshape(k, -1) - known + self.tau * pushed @ self._mobility).T).T
        d, reaction = x.copy(), np.zeros_like(x)
        d[:, at], reaction[:, at] = known[:, at], x[:, at]
        felt = pushes.reshape(k, -1) + _times(stiffness, d, m) + reaction
        return _Nodes(*(part.reshape(k, n, m) for part in (d, felt, reaction)))

    def _solve(self, stiffness: Stiffness, at: np.ndarray, right: np.ndarray) -> np.ndarray:
        """x of (1 - tau M K) x = right (m n, k), columns of -tau M where unknowns are held: there forces are sought."""
        if not right.size:
            return right
        if self._factors is None or self._factors[0] is not stiffness:
            size = len(self._mobility)
            system = stiffness.transposed_product(self._mobility, -self.tau).reshape(size, size)
            system.ravel()[:: size + 1] += 1.0
            system[at] = -self.tau * self._mobility[at]
            self._factors = stiffness, factor(system)
        return self._factors[1].solve(right)

    def _base(self, rigid: Rigid, target: np.ndarray, flow: np.ndarray | None, moved: np.ndarray) -> np.ndarray:
        """The displacements (n, m) of rods without any force, bodies having moved by ``moved`` (p,)."""
        out, c = target.copy(), self._c
        out[:, :c] += (rigid.by_bodies @ moved + self.tau * rigid.carried).reshape(-1, c)
        if flow is not None:
            out[:, : flow.shape[1]] += self.tau * flow
        return out

    def _whole(
        self, held: Prescribed, parts: tuple[Rigid, _Nodes, _Nodes], y: np.ndarray, moved: np.ndarray
    ) -> Solution:
        """The correction of rods and bodies, from that of rods while bodies stay and by each unknown."""
        (rigid, one, each), c, tau, carried = parts, self._c, self.tau, held.carried
        assert carried is not None
        p = len(carried.by)
        pushed = each.felt[:, :, :c].reshape(p, -1)
        own = Own(
            rigid.forces(moved / tau, one.felt[0, :, :c].ravel()), rigid.resistance / tau - rigid.by_bodies.T @ pushed.T
        )
        first, by, supports = Done(one.moves[0], one.felt[0]), Done(each.moves, each.felt), None
        if carried.clamps is not None:
            at = carried.clamps.nodes
            supports = supported(carried.clamps, one.reactions[0, at], each.reactions[:, at], first, by)
        dq, reacted = bordered(held, carried, (first, by, own, supports), y, moved / tau, tau)
        d, force, support = (a[0] + (dq @ b.reshape(p, -1)).reshape(a[0].shape) for a, b in zip(one, each, strict=True))
        rate, felt = (moved + dq) / tau, force[:, :c].ravel()
        self._last = rigid, rate, felt
        rows = (self._shells.in_rows(q, y.shape) for q in (dq, rigid.forces(rate, felt), reacted))
        move, felt, reaction = (np.concatenate(both) for both in zip((d, force, support), rows, strict=True))
        return Solution(move, felt, reaction)


def without_stiffness(force: np.ndarray, held: Prescribed, n: int) -> tuple[np.ndarray, Stiffness, Prescribed]:
    """The force, a stiffness of zeros of n nodes, and what is held and carried where forces stay as they are."""
    m = force.shape[1]
    assert held.carried is not None
    return force, Stiffness(np.zeros((n, m, 3 * m)), no_pairs(m)), held._replace(carried=frozen(held.carried))


def _inside(held: Prescribed, carried: Carried, y: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The held and then the carried among the first unknowns (k,), and their moves (k,) while bodies stay."""
    inside = held.at < count
    still = held.at[inside]
    value = np.concatenate([held.value[inside] - y.ravel()[still], carried.value])
    return np.concatenate([still, carried.at]), value


def _times(stiffness: Stiffness, x: np.ndarray, m: int) -> np.ndarray:
    """K times each of x (k, m n)."""
    return stiffness.times_each(x.reshape(len(x), -1, m)).reshape(x.shape)


def _with_turns(mobility: np.ndarray, spin_drag: np.ndarray) -> np.ndarray:
    """The mobility (4 n, 4 n) of forces and torques, from that of forces and the drag (n,) against turning."""
    n = len(spin_drag)
    out = np.zeros((n, 4, n, 4))
    out[:, :3, :, :3] = mobility.reshape(n, 3, n, 3)
    out[np.arange(n), 3, np.arange(n), 3] = 1.0 / spin_drag
    return out.reshape(4 * n, 4 * n)
