"""The part of bodies in one step: the ends of rods, and the balances that their own unknowns obey."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..linalg.constraints import Carried, Clamps, Prescribed
from ..linalg.stiffness import Stiffness
from ..rods.base import Load
from ..rods.elastic_force import Moment
from ..rods.geometry import Configuration
from ..rods.loads import cross_matrix
from ..rods.system import RodSystem
from .attached import levers, place, turn_of
from .balance import balance
from .body import Attachment, Poses
from .end_tangents import EndTangents
from .rotation import turning
from .rows import Rows
from .supports import Supports


class Joined(NamedTuple):
    """Rods and bodies, the ends in bodies, and the nodes of each body's rods and of the rod that each motor turns."""

    rods: RodSystem
    rows: Rows
    ends: tuple[Attachment, ...]
    tangents: EndTangents  # of those ends that are clamped, in their order
    at: np.ndarray  # (k,) flat indices of the unknowns that bodies carry
    nodes: Sequence[np.ndarray]
    driven: Sequence[np.ndarray]
    outside: Sequence[Load]  # those that are not between a body and its own rods
    supports: Supports | None = None  # of rods that have several


class Carrying:
    """The bodies of a system over a step whose fluid is asked at the geometry ``there``."""

    def __init__(self, joined: Joined, there: Configuration) -> None:
        self.joined, self.rows, self.q = joined, joined.rows, joined.rows.q
        rods, poses = self.rows.rods(there), self.rows.poses(there)
        known = joined.nodes, joined.driven, self.rows.motors
        whole = balance(rods, poses, *known, self.q, self.rows.m)
        if joined.supports is not None:
            joined.supports.add_left_over(whole, rods, poses, self.q)
            self._sums = joined.supports.sums(rods, poses, self.rows.motors, self.q, self.rows.m)
        self.balance = whole.reshape(self.q.size, -1)

    def carried(
        self,
        held: Prescribed,
        start: Configuration,
        configuration: Configuration,
        moment: Moment,
        time: float,
        y: np.ndarray,
    ) -> Prescribed:
        """``held`` with what bodies carry at ``configuration``, y (N, m) from ``start``, in the step to ``time``."""
        rods, begin, poses = self.rows.rods(configuration), self.rows.rods(start), self.rows.poses(configuration)
        turns = self.rows.turns(y)
        value, lever, tangents = self._ends(begin, poses, turns, y)
        external, change, external_columns = self._external(rods, begin, time, tangents)
        follow = Carried(
            self.joined.at,
            value,
            lever,
            self.rows.by,
            self._elastic(rods, begin, moment, tangents) + external_columns,
            self.balance,
            external,
            change,
            external_columns,
            *self._pushed(poses, turns, time),
            self._clamps(begin, poses, time, y, tangents),
        )
        return held._replace(carried=follow)

    def _ends(
        self, begin: Configuration, poses: Poses, turns: np.ndarray, y: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
        """How far carried unknowns are off (k,), their levers (k, p), and those of the tangents of clamps (3, p)."""
        value, lever, tangents = [np.zeros(0)], [np.zeros((0, self.q.size))], []
        for end in self.joined.ends:
            at = place(end, self.rows.motors, poses)
            by = levers(end, self.rows.motors, poses, turns, begin, self.q)
            value.append(at.r - begin.r[end.node] - y[end.node, :3])
            lever.append(by.r)
            if at.tangent is not None:
                tangents.append(by.tangent)
            if at.e1 is not None:
                value.append(np.array([turn_of(begin, end.node, at) - y[end.node, 3]]))
                lever.append(by.turn[None])
        return np.concatenate(value), np.concatenate(lever), tangents

    def _clamps(
        self, begin: Configuration, poses: Poses, time: float, y: np.ndarray, tangents: Sequence[np.ndarray]
    ) -> Clamps | None:
        """The part of the balances by supports of rods with several of them."""
        joined = self.joined
        if joined.supports is None:
            return None
        places = [place(end, self.rows.motors, poses).tangent for end in joined.ends]
        mesh = joined.tangents.turned(joined.rods.mesh, [tangent for tangent in places if tangent is not None])
        return joined.supports.clamps(self._sums, mesh, begin, y[: self.rows.n], time, tangents)

    def _elastic(
        self, rods: Configuration, begin: Configuration, moment: Moment, tangents: Sequence[np.ndarray]
    ) -> np.ndarray:
        """How elastic forces follow q through the tangents of clamps (n, m, p)."""
        joined = self.joined
        filled = joined.tangents.begin(rods, begin, self.rows.m)
        joined.tangents.elastic(filled, moment)
        joined.rods.add_nonlocal_twist(filled)
        return self._through(joined.tangents.of(filled), tangents)

    def _external(
        self, rods: Configuration, begin: Configuration, time: float, tangents: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, Stiffness | None, np.ndarray]:
        """The loads from outside (n, m), how they change with nodes, and with q through tangents (n, m, p)."""
        shape, joined = (self.rows.n, self.rows.m), self.joined
        if not joined.outside:
            return np.zeros(shape), None, np.zeros((*shape, self.q.size))
        change = joined.rods.stiffness_of_loads(joined.outside, rods, begin, time)
        filled = joined.tangents.begin(rods, begin, self.rows.m)
        for load in joined.outside:
            load.add_stiffness(time, filled)
        return (
            joined.rods.of_loads(joined.outside, rods, time),
            change,
            self._through(joined.tangents.of(filled), tangents),
        )

    def _through(self, forces: Sequence[np.ndarray], tangents: Sequence[np.ndarray]) -> np.ndarray:
        """The forces (n, m, p) by q, from those by the tangents (n, m, 3) and the tangents' levers (3, p)."""
        out = np.zeros((self.rows.n, self.rows.m, self.q.size))
        for force, tangent in zip(forces, tangents, strict=True):
            out += force @ tangent
        return out

    def _pushed(self, poses: Poses, turns: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The sums that the balances are to have (p,), how that follows q (p, p), and the drag of motors (p,)."""
        q = self.q
        want, slope, drag = np.zeros(q.size), np.zeros((q.size, q.size)), np.zeros(q.size)
        for b, body in enumerate(self.rows.bodies):
            force, torque = body.pushed(poses.axes[b], time)
            want[q.moves(b)], want[q.turns(b)] = force, torque / q.length
            if body.own_axes:
                turn = turning(turns[b]) / q.length
                slope[q.moves(b), q.turns(b)] = -cross_matrix(force) @ turn
                slope[q.turns(b), q.turns(b)] = -cross_matrix(torque) @ turn / q.length
        for k, motor in enumerate(self.rows.motors):
            if motor.torque is not None:
                want[q.motor(k)], drag[q.motor(k)] = motor.torque(time) / q.length, motor.drag / q.length**2
        return want, slope, drag
