"""Where bodies stand in the arrays of a scene: rows after the n nodes of the rods.

    n + 2 b        the centre of body b: its place r, its axes e1, e2, e3; y is its displacement over a step
    n + 2 b + 1    the same place, its axes as (e2, e3, e1); y is its rotation vector over the step, times the length
    n + 2 B + k    motor k: r[0] and y[0] are its angle, times the length

So unknowns are lengths all, forces on them forces (a torque over the length), and powers add up; a fluid, which is
told places and tangents, reads e3 and e1 of a body from its two rows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..rods import geometry
from ..rods.geometry import Configuration
from ..rods.mesh import Mesh
from .attached import Unknowns
from .body import Body, Motor, Poses
from .rotation import turned

E3 = np.array([0.0, 0.0, 1.0])
_TURNED = np.array([[0, 1, 2, 2], [1, 2, 0, 0]])  # which axes of a body are e1, e2, e3 and r' of its two rows
_LAB = np.eye(3)[_TURNED[0]].ravel()


class Rows:
    """The rows of bodies and motors after n nodes of m unknowns; ``length`` is what their turns are taken times."""

    def __init__(self, n: int, m: int, bodies: Sequence[Body], motors: Sequence[Motor], length: float) -> None:
        self.n, self.m, self.bodies, self.motors, self.length = n, m, tuple(bodies), tuple(motors), length
        self.q = Unknowns(len(bodies), len(motors), length)
        self.count = n + 2 * len(bodies) + len(motors)
        first = [(n + k) * m for k in range(2 * len(bodies))]
        last = [(n + 2 * len(bodies) + k) * m for k in range(len(motors))]
        self.by = np.array([f + c for f in first for c in range(3)] + last, np.int64)
        idle = [f + c for f in first for c in range(3, m)] + [f + c for f in last for c in range(1, m)]
        self.idle = np.array(idle, np.int64)

    def start(self) -> Poses:
        """The poses at t = 0."""
        centre = np.array([body.centre for body in self.bodies])
        return Poses(centre, np.array([body.axes for body in self.bodies]), np.zeros(len(self.motors)))

    def poses(self, configuration: Configuration) -> Poses:
        """The poses of a configuration."""
        end = self.n + 2 * len(self.bodies)
        own = configuration.table[self.n : end : 2]
        axes = own[:, geometry.E1 : geometry.E1 + 9].reshape(-1, 3, 3).transpose(0, 2, 1)
        angle = configuration.table[end:, geometry.R] / self.length
        return Poses(own[:, geometry.R : geometry.R + 3], axes, angle)

    def turns(self, y: np.ndarray) -> np.ndarray:
        """The rotation vectors (b, 3) of bodies in y (N, m)."""
        return y[self.n + 1 : self.n + 2 * len(self.bodies) : 2, :3] / self.length

    def moved(self, before: Poses, y: np.ndarray) -> Poses:
        """The poses displaced by y (N, m)."""
        end = self.n + 2 * len(self.bodies)
        there = [turned(v, axes) for v, axes in zip(self.turns(y), before.axes, strict=True)]
        return Poses(before.centre + y[self.n : end : 2, :3], np.array(there), before.angle + y[end:, 0] / self.length)

    def appended(self, rods: Configuration, poses: Poses) -> Configuration:
        """The configuration of N rows: of the rods, and of bodies and motors."""
        table, end = np.zeros((self.count, rods.table.shape[1])), self.n + 2 * len(self.bodies)
        table[: self.n] = rods.table
        directors = slice(geometry.E1, geometry.R_S + 3)  # e1, e2, e3, and r' as e3
        table[self.n : end, geometry.R : geometry.R + 3] = poses.centre.repeat(2, axis=0)
        table[self.n : end, directors] = poses.axes.transpose(0, 2, 1)[:, _TURNED].reshape(-1, 12)
        table[end:, geometry.R], table[end:, directors] = poses.angle * self.length, _LAB
        table[self.n :, geometry.METRIC] = table[self.n :, geometry.LENGTH] = 1.0
        return Configuration(table)

    def rods(self, configuration: Configuration) -> Configuration:
        """The configuration of the rods by themselves, a view."""
        return Configuration(configuration.table[: self.n])

    def mesh(self, rods: Mesh) -> Mesh:
        """The rods' mesh with a row for each of these: no segment, no stencil, no volume."""
        more = self.count - self.n
        fill = {"joined": False, "ds": 1.0, "volume": 0.0, "first": 0}
        parts = {}
        for name, part in rods._asdict().items():
            rest = np.full((more, *part.shape[1:]), fill.get(name, 0.0), part.dtype)
            parts[name] = np.concatenate([part, rest])
        parts["c1"][self.n :] = E3
        return Mesh(**parts)
