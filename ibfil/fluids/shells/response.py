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

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from ...bodies.border import Done, Own, bordered, frozen, supported
from ...errors import StepFailed
from ...linalg.constraints import Carried, Prescribed
from ...linalg.gmres import Factors, factor
from ...linalg.normal_numbers import Draw
from ...linalg.stiffness import Stiffness, no_pairs
from ..base import Solution
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
        self.whole = matrix
        at: slice | np.ndarray = slice(rods, None)
        if components > 3:  # markers do not spin
            at = np.arange(rods, len(matrix)).reshape(-1, components)[:, :3].ravel()
        shell, across = matrix[at][:, at], matrix[at, :rods]
        try:
            self._lower = cholesky(shell, lower=True, check_finite=False)
        except np.linalg.LinAlgError:
            raise MarkersTooClose("markers of bodies are too close: their mobility has no inverse", 0) from None
        drifting = np.zeros((len(levers), 1)) if drift is None else drift[:, None]
        half = self._solved(np.concatenate([across, levers, drifting], axis=1))
        self._half, own, drifted = half[:, :rods], half[:, rods:-1], half[:, -1]
        self._own = half[:, rods:]
        self.rods = matrix[:rods, :rods] - self._half.T @ self._half
        self.by_bodies = self._half.T @ own  # how rods move with q: T^T B
        self.carried = -(self._half.T @ drifted)
        self.resistance = own.T @ own  # of the bodies where rods do not push (p, p)
        self._drifting = own.T @ drifted

    def _solved(self, right: np.ndarray, transposed: bool = False) -> np.ndarray:
        """L^-1 right, or L^-T, of M_mm = L L^T."""
        out: np.ndarray = solve_triangular(
            self._lower, right, trans=int(transposed), lower=True, overwrite_b=True, check_finite=False
        )
        return out

    def pushes(self, rate: np.ndarray, felt: np.ndarray) -> np.ndarray:
        """The forces of markers on the fluid (3 k,) when q has rates (p,) and rods push with ``felt`` (c n,)."""
        return self._solved(self._own @ np.append(rate, -1.0) - self._half @ felt, transposed=True)

    def forces(self, rate: np.ndarray, felt: np.ndarray) -> np.ndarray:
        """B^T F_m: forces and torques of the bodies on the fluid (p,)."""
        out: np.ndarray = self.resistance @ rate - self._drifting - self.by_bodies.T @ felt
        return out

    def rates(self, force: np.ndarray, felt: np.ndarray) -> np.ndarray:
        """The rates (p,) at which bodies do ``force`` (p,) to the fluid; zero of what has no markers."""
        short = force - self.forces(np.zeros(len(force)), felt)
        out: np.ndarray = np.linalg.lstsq(self.resistance, short, rcond=1e-13)[0]
        return out


class WithShells:
    """The response of rods and bodies, positions frozen over a step of effective length tau.

    Dense: all m unknowns of a node in one system, turns that do not go through the fluid by their own drag (n,).
    """

    keeps = True

    def __init__(
        self, rigid: Rigid, shells: Shells, flow: np.ndarray | None, spin_drag: np.ndarray | None, tau: float
    ) -> None:
        """``flow`` (n, c) or (n, m): the motions of nodes without any force."""
        self._rigid, self._shells, self._flow, self.tau = rigid, shells, flow, tau
        self._c = len(rigid.rods) // shells.nodes
        self._mobility = rigid.rods if spin_drag is None else _with_turns(rigid.rods, spin_drag)
        self._factors: tuple[Stiffness, Factors] | None = None  # and the stiffness they are of
        self._last: tuple[np.ndarray, np.ndarray] | None = None  # rates of q, and what nodes do

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
    ) -> Solution:
        """One correction of nodes and bodies: of nodes while bodies stay, and by each unknown of these, in one."""
        carried = held.carried
        assert carried is not None
        n, m = self._shells.nodes, force.shape[1]
        moved = self._shells.of_rows(y - target)
        at, value = _inside(held, carried, y, n * m)
        known = np.zeros((1 + len(carried.by), n * m))
        known[:, at] = value
        pushes = np.concatenate([force[None, :n], carried.columns.transpose(2, 0, 1)]).reshape(len(known), -1)
        base = np.concatenate([(self._base(target[:n], moved) - y[:n])[None], self._by_bodies(m)]).reshape(known.shape)
        pushed = pushes + _times(stiffness, known, m)
        x = self._solve(stiffness, at, (base - known + self.tau * pushed @ self._mobility).T).T
        d, reaction = x.copy(), np.zeros_like(x)
        d[:, at], reaction[:, at] = value, x[:, at]
        felt = pushes + _times(stiffness, d, m) + reaction
        d, felt, reaction = (part.reshape(-1, n, m) for part in (d, felt, reaction))
        return self._whole(held, carried, Solution(d, felt, reaction), y, moved)

    def forced(self, force: np.ndarray, held: Prescribed, target: np.ndarray) -> Solution:
        """The displacements without stiffness: by that of none."""
        n, m = self._shells.nodes, force.shape[1]
        none = Stiffness(np.zeros((n, m, 3 * m)), no_pairs(m))
        assert held.carried is not None
        bare = held._replace(carried=frozen(held.carried))
        return self.implicit(force, none, bare, np.zeros_like(force), target)

    def apply(self, force: np.ndarray) -> np.ndarray:
        """Velocities of forces on rods and markers, c numbers of each (flat), without the background flow."""
        return self._rigid.whole @ force

    def marker_forces(self) -> np.ndarray:
        """The forces of markers on the fluid (k, 3), by the last correction."""
        assert self._last is not None
        return self._rigid.pushes(*self._last).reshape(-1, 3)

    def _solve(self, stiffness: Stiffness, at: np.ndarray, right: np.ndarray) -> np.ndarray:
        """x of (1 - tau M K) x = right (m n, k), columns of -tau M where unknowns are held: there forces are sought."""
        if self._factors is None or self._factors[0] is not stiffness:
            size = len(self._mobility)
            system = stiffness.transposed_product(self._mobility, -self.tau).reshape(size, size)
            system.ravel()[:: size + 1] += 1.0
            system[at] = -self.tau * self._mobility[at]
            self._factors = stiffness, factor(system)
        return self._factors[1].solve(right)

    def _base(self, target: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """The displacements (n, m) of rods without any force, bodies having moved by ``moved`` (p,)."""
        out, c = target.copy(), self._c
        out[:, :c] += (self._rigid.by_bodies @ moved + self.tau * self._rigid.carried).reshape(-1, c)
        if self._flow is not None:
            out[:, : self._flow.shape[1]] += self.tau * self._flow
        return out

    def _by_bodies(self, m: int) -> np.ndarray:
        """The displacements (p, n, m) of rods as each unknown of the bodies moves by one."""
        n, p = self._shells.nodes, self._rigid.by_bodies.shape[1]
        out = np.zeros((p, n, m))
        out[:, :, : self._c] = self._rigid.by_bodies.T.reshape(p, n, self._c)
        return out

    def _whole(self, held: Prescribed, carried: Carried, nodes: Solution, y: np.ndarray, moved: np.ndarray) -> Solution:
        """The correction of rods and bodies, from that of rods while bodies stay and by each unknown (1 + p, n, m)."""
        c, rigid, tau = self._c, self._rigid, self.tau
        felt = nodes.force[:, :, :c].reshape(len(nodes.force), -1)
        own = Own(rigid.forces(moved / tau, felt[0]), rigid.resistance / tau - rigid.by_bodies.T @ felt[1:].T)
        first, each, supports = Done(nodes.move[0], nodes.force[0]), Done(nodes.move[1:], nodes.force[1:]), None
        if carried.clamps is not None:
            there = nodes.reaction[:, carried.clamps.nodes]
            supports = supported(carried.clamps, there[0], there[1:], first, each)
        dq, reacted = bordered(held, carried, (first, each, own, supports), y, moved / tau, tau)
        weights = np.append(1.0, dq)
        d, force, support = ((weights @ part.reshape(len(part), -1)).reshape(part.shape[1:]) for part in nodes[:3])
        self._last = (moved + dq) / tau, force[:, :c].ravel()
        done = rigid.forces(*self._last)
        rows = (self._shells.in_rows(q, y.shape) for q in (dq, done, reacted))
        move, felt, reaction = (np.concatenate(both) for both in zip((d, force, support), rows, strict=True))
        return Solution(move, felt, reaction)


def _inside(held: Prescribed, carried: Carried, y: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The held and the carried among the first unknowns, and their moves (1 + p, k): now, by each of q."""
    inside = held.at < count
    still, flat = held.at[inside], y.ravel()
    value = np.zeros((1 + len(carried.by), len(still) + len(carried.at)))
    value[0] = np.concatenate([held.value[inside] - flat[still], carried.value])
    value[1:, len(still) :] = carried.lever.T
    return np.concatenate([still, carried.at]), value


def _times(stiffness: Stiffness, x: np.ndarray, m: int) -> np.ndarray:
    """K times each of x (k, m n)."""
    return np.array([stiffness.times(one.reshape(-1, m)).ravel() for one in x])


def _with_turns(mobility: np.ndarray, spin_drag: np.ndarray) -> np.ndarray:
    """The mobility (4 n, 4 n) of forces and torques, from that of forces and the drag (n,) against turning."""
    n = len(spin_drag)
    out = np.zeros((n, 4, n, 4))
    out[:, :3, :, :3] = mobility.reshape(n, 3, n, 3)
    out[np.arange(n), 3, np.arange(n), 3] = 1.0 / spin_drag
    return out.reshape(4 * n, 4 * n)
