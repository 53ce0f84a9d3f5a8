"""Resistive-force theory with bodies: the rods' band, and the few unknowns of bodies beside it.

Bodies have their own 6 x 6 resistance, in their axes. With a_0 the correction of the nodes while bodies stay, and a_k
that while only the k-th unknown q_k of the bodies moves by one, all by one factorisation of the rods' matrix,

    (K - Z/tau) a_0 = Z (y - base)/tau - f,   carried: what they are off
    (K - Z/tau) a_k = -columns_k,             carried: lever_k
    F_0 = Z (y - base + a_0)/tau,   F_k = Z a_k/tau,   own drag D (q - base + dq)/tau
    [G (F_k - ext_k) + D/tau] dq = want - G (F_0 - ext_0) - D (q - base)/tau,   d = a_0 + sum dq_k a_k
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..bodies.border import Done, Own, Supported, bordered, frozen, supported
from ..linalg.constraints import Carried, Prescribed
from ..linalg.stiffness import Rows, Stiffness
from .base import Solution
from .resistive_force import Drag, ResistiveForce, _at, _hold, _Response, _system, mobilize, resist
from .velocity_gradient import advected, gradient

_CURVING = 1e-2  # of a body's size: the step of second differences of a flow


class BodyDrag(NamedTuple):
    """The resistances of bodies in their axes (b, 3), their semi-axes (b, 3) for flows, and the length of turns."""

    translation: np.ndarray
    rotation: np.ndarray
    axes: np.ndarray
    length: float


class ResistiveWithBodies(ResistiveForce):
    """The RFT fluid of rods and bodies; arrays of the rods have n rows, those of a step N (bodies/rows.py)."""

    def __init__(self, bodies: BodyDrag, drag: Drag, *parts: Any) -> None:
        """``bodies``, and what the fluid of rods alone is made of."""
        super().__init__(drag, *parts)
        self.bodies = bodies

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> _Bordered:
        """Drag of each node and body about the tangents and axes e3, in the background flow of ``time``."""
        return _Bordered(self, r, e3, self.advected(r, e3, time), tau)

    def advected(self, r: np.ndarray, e3: np.ndarray, time: float) -> np.ndarray | None:
        """The motions (N, m) with which the background flow carries nodes and bodies; None where there is none."""
        if self.flow is None:
            return None
        n = len(self.drag.perp)
        turn = None if self.twists is None else self.twists[:, None] * e3[:n]
        out = np.zeros((len(r), 3 if self.twists is None else 4))
        out[:n] = advected(self.flow, r[:n], turn, time, self.spacing)
        for b, axes in enumerate(self.axes_of(e3)):
            row = n + 2 * b
            out[row, :3], turned = self._drift(r[row], axes, self.bodies.axes[b], time)
            out[row + 1, :3] = self.bodies.length * turned
        return out

    def axes_of(self, e3: np.ndarray) -> np.ndarray:
        """The axes (b, 3, 3) of bodies, in columns, from the tangents of all rows."""
        n, end = len(self.drag.perp), len(self.drag.perp) + 2 * len(self.bodies.axes)
        third, first = e3[n:end:2], e3[n + 1 : end : 2]
        return np.stack([first, np.cross(third, first), third], axis=2)

    def _drift(self, centre: np.ndarray, axes: np.ndarray, semi: np.ndarray, time: float) -> tuple:
        """Velocity and rate (3,) of a body that nothing pushes: Faxen's laws and Jeffery's."""
        from ..bodies.resistance import carried

        assert self.flow is not None
        size = float(semi.max()) or self.spacing
        d = _CURVING * size
        there = self.flow(centre + d * np.concatenate([np.zeros((1, 3)), axes.T, -axes.T]), time)
        curving = (there[1:4] + there[4:7] - 2 * there[0]) / d**2
        grad = axes.T @ gradient(self.flow, centre[None], time, size)[0] @ axes
        u, spin = carried(axes.T @ there[0], grad, axes.T @ curving.T, semi)
        return axes @ u, axes @ spin


class _Bordered(_Response):
    """The response of rods and bodies."""

    _fluid: ResistiveWithBodies

    def __init__(
        self, fluid: ResistiveWithBodies, r: np.ndarray, e3: np.ndarray, flow: np.ndarray | None, tau: float
    ) -> None:
        super().__init__(fluid, np.ascontiguousarray(e3[: len(fluid.drag.perp)]), flow, tau)
        self._n, own = len(fluid.drag.perp), fluid.bodies
        turned = fluid.axes_of(e3)
        moved = np.einsum("bic,bc,bjc->bij", turned, own.translation, turned)
        spun = np.einsum("bic,bc,bjc->bij", turned, own.rotation, turned) / own.length**2
        self._blocks = np.stack([moved, spun], axis=1).reshape(-1, 3, 3)  # one a row: centre, turn, centre ..

    def _own(self, moved: np.ndarray) -> np.ndarray:
        """D times motions of the rows of bodies and motors (N - n, m)."""
        out, count = np.zeros_like(moved), len(self._blocks)
        out[:count, :3] = np.einsum("kij,kj->ki", self._blocks, moved[:count, :3])
        return out

    def _matrix(self, p: int) -> np.ndarray:
        """D (p, p)."""
        out = np.zeros((p, p))
        for k, block in enumerate(self._blocks):
            out[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = block
        return out

    def implicit(
        self,
        force: np.ndarray,
        stiffness: Stiffness,
        held: Prescribed,
        y: np.ndarray,
        target: np.ndarray,
        error: float = 0.0,
    ) -> Solution:
        """One correction of nodes and bodies; uses ``stiffness`` up."""
        carried, n, inverse = held.carried, self._n, 1.0 / self.tau
        assert carried is not None
        base = self._carried(target)
        moved, m = y - base, force.shape[1]
        at, value = held.of_nodes(y, n * m)
        rows = Rows.of(stiffness, np.unique(at // m))
        right = _system(stiffness.band, self.drag, self.e3, moved[:n], force[:n], inverse)
        _hold(stiffness.band, right, at, value)
        solve = self._solver(stiffness, at)
        others = -carried.columns.transpose(2, 0, 1)
        flat = others.reshape(len(others), n * m)
        flat[:, at] = 0.0
        flat[:, carried.at] = carried.lever.T
        first, each = solve(right), np.array([solve(x) for x in flat.reshape(-1, n, m)])
        felt = resist(self.drag, self.e3, inverse * (moved[:n] + first))
        by_each = np.array([resist(self.drag, self.e3, inverse * x) for x in each])
        known = Done(first, felt), Done(each, by_each)
        dq, own = self._bodies(held, carried, (*known, self._supports(carried, force, *known, rows)), y, moved)
        d = np.concatenate([first + np.tensordot(dq, each, 1), _spread(dq, carried, y.shape, n)])
        felt = felt + np.tensordot(dq, by_each, 1)
        rest = felt - force[:n] - carried.columns @ dq
        rest[rows.nodes] -= rows.times(d[:n])
        reaction = np.zeros_like(y)
        reaction[:n] = _at(Prescribed(at, value), rest)
        reaction[n:] = own[1]
        return Solution(d, np.concatenate([felt, own[0]]), reaction)

    def _solver(self, stiffness: Stiffness, at: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """The factored matrix of the rods, the rows of held unknowns in it."""
        return self._fluid.coupled.factored(Stiffness(stiffness.band, stiffness.pairs.held(at, self._n)))

    def _supports(
        self, carried: Carried, force: np.ndarray, first: Done, each: Done, rows: Rows | None
    ) -> Supported | None:
        """The part of supports in the balances. ``rows`` of K; None: forces stay."""
        own = carried.clamps
        if own is None:
            return None
        at = own.nodes
        now, by = first.felt[at] - force[at], each.felt[:, at] - carried.columns[at].transpose(2, 0, 1)
        if rows is not None:
            there = np.searchsorted(rows.nodes, at)
            now = now - rows.times(first.moves)[there]
            by = by - np.array([rows.times(x)[there] for x in each.moves])
        return supported(own, now, by, first, each)

    def _bodies(
        self,
        held: Prescribed,
        carried: Carried,
        known: tuple[Done, Done, Supported | None],
        y: np.ndarray,
        moved: np.ndarray,
    ) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """dq (p,) from the balances, and for the rows of bodies (N - n, m) the force on the fluid and the reaction."""
        first, each, supports = known
        rate, drag = moved.ravel()[carried.by] / self.tau, self._matrix(len(carried.by))
        own = Own(drag @ rate, drag / self.tau)
        dq, reacted = bordered(held, carried, (first, each, own, supports), y, rate, self.tau)
        done = self._own(moved[self._n :] + _spread(dq, carried, y.shape, self._n)) / self.tau
        return dq, (done, _spread(reacted, carried, y.shape, self._n))

    def forced(self, force: np.ndarray, held: Prescribed, target: np.ndarray) -> Solution:
        """Nodes by their forces, bodies and the ends they carry by the balances."""
        carried, n, m = held.carried, self._n, force.shape[1]
        assert carried is not None
        base = self._carried(target)
        at, value = held.of_nodes(np.zeros_like(force), n * m)
        first = base[:n] + self.tau * mobilize(self.drag, self.e3, force[:n])
        first.ravel()[at] = value
        each = np.zeros((len(carried.by), n * m))
        each[:, carried.at] = carried.lever.T
        each = each.reshape(-1, n, m)
        felt = resist(self.drag, self.e3, (first - base[:n]) / self.tau)
        by_each = np.array([resist(self.drag, self.e3, x / self.tau) for x in each])
        still = frozen(carried)
        known = Done(first, felt), Done(each, by_each)
        supports = self._supports(still, force, *known, None)
        dq, own = self._bodies(held, still, (*known, supports), np.zeros_like(force), -base)
        y = np.concatenate([first + np.tensordot(dq, each, 1), _spread(dq, carried, force.shape, n)])
        felt = felt + np.tensordot(dq, by_each, 1)
        reaction = np.zeros_like(force)
        reaction[:n] = _at(Prescribed(at, value), felt - force[:n])
        reaction[n:] = own[1]
        return Solution(y, np.concatenate([felt, own[0]]), reaction)


def _spread(dq: np.ndarray, carried: Carried, shape: tuple[int, ...], n: int) -> np.ndarray:
    """dq (p,) in the rows of bodies (N - n, m)."""
    out = np.zeros(shape)
    out.ravel()[carried.by] = dq
    return out[n:]
