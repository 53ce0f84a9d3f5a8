"""Rods with bodies: the rods' system, and rows for bodies and motors after those of the nodes.

To a time stepper it is a system like the rods' own. The ends in bodies are unknowns that follow the bodies' (carried),
and a body's unknowns are found from its balance (balance.py) rather than from a force on them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import StepFailed
from ..linalg.constraints import Prescribed
from ..linalg.stiffness import Stiffness
from ..rods import geometry
from ..rods.base import REVERSED, Load, TangentReversed
from ..rods.elastic_force import Moment
from ..rods.geometry import Configuration
from ..rods.mesh import Mesh
from ..rods.rates import Accepted, Memory
from ..rods.system import RodSystem
from .attached import Place, place, turn_of
from .body import Attachment, Body, Motor, Poses
from .carrying import Carrying, Joined
from .end_tangents import EndTangents
from .rows import Rows
from .supports import Supports

FURTHEST = 1.0  # radian: the largest turn of a body within a step


class BodyTurnedTooFar(StepFailed):
    """A body turned by more than a radian within a step."""


class RodsWithBodies(RodSystem):
    """A system of rods, ``rods``, some ends of which are in bodies.

    ``nodes`` (one array a body) are all nodes of the body's rods, ``turned`` (one array a motor) those of the rod that
    it turns, ``outside`` the loads that act from outside on a body's rods: not what acts between these.

    ``supports`` are those of rods that have several, and of the bodies there; None where there are none.
    """

    def __init__(
        self,
        rods: RodSystem,
        bodies: Sequence[Body],
        motors: Sequence[Motor],
        ends: Sequence[Attachment],
        nodes: Sequence[np.ndarray],
        turned: Sequence[np.ndarray],
        outside: Sequence[Load],
        supports: Supports | None = None,
    ) -> None:
        self.rods, self.motors, self.attached = rods, tuple(motors), tuple(ends)
        self.nodes, self.driven = nodes, turned
        self.unknowns, self.length, self.law, self.loads = rods.unknowns, rods.length, rods.law, rods.loads
        self.profile, self.closures, self.remembering = rods.profile, rods.closures, rods.remembering
        self.rows = Rows(len(rods.mesh.ds), rods.unknowns, bodies, motors, rods.length)
        self.mesh = self.rows.mesh(rods.mesh)
        self.stretching = np.append(rods.stretching, np.zeros(self.rows.count - self.rows.n))
        self.clamps = [k for k, end in enumerate(ends) if end.tangent is not None]
        self.tangents = EndTangents(rods.mesh, np.array([ends[k].node for k in self.clamps], np.int64))
        self._anchored = np.zeros(self.rows.n, bool)
        index = rods.ends.index
        self._anchored[index[index % self.unknowns < 3] // self.unknowns] = True
        self._anchored[[end.node for end in ends]] = True
        at = np.concatenate([self._unknowns_of(end) for end in ends] or [np.zeros(0, np.int64)])
        whole, driven = (nodes, turned) if supports is None else supports.alone(nodes, turned)
        self._joined = Joined(rods, self.rows, self.attached, self.tangents, at, whole, driven, outside, supports)
        self.ends = _Ends(rods.ends, self.rows)

    @property
    def volume(self) -> np.ndarray:
        """Control volumes (N,), none of bodies."""
        return self.mesh.volume

    def _unknowns_of(self, end: Attachment) -> np.ndarray:
        """The flat indices of the unknowns that a body carries at an end."""
        return end.node * self.unknowns + np.arange(3 if end.director is None else 4)

    # -- where they are --------------------------------------------------------------------------------------------

    def start(self, r: np.ndarray, e1: np.ndarray) -> Configuration:
        """The configuration of N rows at t = 0, from that of the rods' nodes, r and e1 (n, 3)."""
        return self.rows.appended(self.rods.start(r, e1), self.rows.start())

    def _places(self, poses: Poses) -> list[Place]:
        return [place(end, self.motors, poses) for end in self.attached]

    def _mesh(self, places: Sequence[Place]) -> Mesh:
        """The rods' mesh, the tangents of clamped ends as the bodies have them."""
        found = [place.tangent for place in places if place.tangent is not None]
        return self.tangents.turned(self.rods.mesh, found)

    def move(self, start: Configuration, y: np.ndarray) -> Configuration:
        """The configuration displaced by y (N, m) from ``start``."""
        n, furthest = self.rows.n, np.linalg.norm(self.rows.turns(y), axis=1).max(initial=0.0)
        if not furthest <= FURTHEST:
            raise BodyTurnedTooFar(f"a body turned by {furthest:.2g} rad within a step (allowed {FURTHEST:g})", 0)
        poses = self.rows.moved(self.rows.poses(start), y)
        mesh = self._mesh(self._places(poses))
        rods, least, where = geometry.moved(mesh, self.rows.rods(start), np.ascontiguousarray(y[:n]))
        if not least > REVERSED:
            raise TangentReversed(where, least)
        return self.rows.appended(rods, poses)

    def turned(self, start: Configuration, y: np.ndarray) -> np.ndarray:
        """Displacements (N, m) that turn every segment as y does and do not stretch it, ends where bodies have them."""
        out, rods = y.copy(), self.rows.rods(start)
        for end, at in zip(self.attached, self._places(self.rows.moved(self.rows.poses(start), y)), strict=True):
            out[end.node, :3] = at.r - rods.r[end.node]
            if at.e1 is not None:
                out[end.node, 3] = turn_of(rods, end.node, at)
        out[: self.rows.n] = geometry.turned(self.rods.mesh, rods, self._anchored, out[: self.rows.n].copy())
        return out

    # -- forces ------------------------------------------------------------------------------------------------------

    def moment(self, configuration: Configuration, time: float) -> Moment:
        """The law's moments (n nodes), zero at free ends."""
        return self.rods.moment(self.rows.rods(configuration), time)

    def forces(self, configuration: Configuration, time: float) -> tuple[np.ndarray, Moment]:
        """Eq. 44 and the loads on each node, (N, m), zero on the rows of bodies; and the moments they come from."""
        out = np.zeros((self.rows.count, self.unknowns))
        out[: self.rows.n], moment = self.rods.forces(self.rows.rods(configuration), time)
        return out, moment

    def stiffness(self, configuration: Configuration, start: Configuration, moment: Moment, time: float) -> Stiffness:
        """The exact Jacobian of the rods' forces with respect to the displacements of their nodes."""
        return self.rods.stiffness(self.rows.rods(configuration), self.rows.rods(start), moment, time)

    def definite_stiffness(
        self, configuration: Configuration, start: Configuration, moment: Moment, time: float
    ) -> Stiffness:
        """The same without compressive geometric stiffness."""
        return self.rods.definite_stiffness(self.rows.rods(configuration), self.rows.rods(start), moment, time)

    # -- from step to step -------------------------------------------------------------------------------------------

    def complete(self, y: np.ndarray) -> np.ndarray:
        """y (N, m) itself: no rod is closed."""
        return y

    def begin(self, tau: float, w: float) -> None:
        """A step of effective length tau begins."""
        self.rods.begin(tau, w)

    def advance(self, step: Accepted) -> None:
        """The step that began last is taken."""
        self.rods.advance(step._replace(configuration=self.rows.rods(step.configuration)))

    def memory(self) -> Memory:
        """The state that laws and loads carry from step to step, by name."""
        return self.rods.memory()

    def recall(self, memory: Mapping[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""
        self.rods.recall(memory)

    def held(self, before: float, after: float) -> Prescribed:
        """The prescribed displacements between two times."""
        return Prescribed(self.ends.index, self.ends.motion(before, after))

    def bodies(self, there: Configuration) -> Carrying:
        """The bodies over a step whose fluid is asked at the geometry ``there``."""
        return Carrying(self._joined, there)


class _Ends:
    """The prescribed unknowns of a scene with bodies: of rods, of bodies and motors whose motion is given."""

    def __init__(self, rods, rows: Rows) -> None:
        self._rods, self._rows = rods, rows
        moves = [rows.by[rows.q.moves(b)] for b, body in enumerate(rows.bodies) if body.moves is not None]
        turns = [rows.by[rows.q.turns(b)] for b, body in enumerate(rows.bodies) if body.turns is not None]
        motors = [rows.by[[rows.q.motor(k)]] for k, motor in enumerate(rows.motors) if motor.angle is not None]
        self.index = np.concatenate([rods.index, rows.idle, *moves, *turns, *motors])

    def motion(self, before: float, after: float) -> np.ndarray:
        """Displacements (k,) of the held unknowns between two times."""
        rows = self._rows
        moves = [body.moved(before, after) for body in rows.bodies if body.moves is not None]
        turns = [body.turned(before, after) * rows.length for body in rows.bodies if body.turns is not None]
        angles = [np.array([m.angle(before, after) * rows.length]) for m in rows.motors if m.angle is not None]
        return np.concatenate([self._rods.motion(before, after), np.zeros(len(rows.idle)), *moves, *turns, *angles])
