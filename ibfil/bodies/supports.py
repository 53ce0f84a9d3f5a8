"""Bodies whose rods have other supports too: another body, or the lab. Each has the balance of its own ends.

A support does to the rod, at its end: a force R, the turn R_4 e3, and at a clamp the moment

    V = -+(M1 e1 + M2 e2)     at s = 0, L;      row of body b:   sum over its ends of R,  (r* - X*) x R + R_4 e3* + V

The forces of the rows sum to those of the whole exactly. The torques do to second order only: V is the moment at the
node, and Eq. 44's own torque is not it. So each of the c bodies of a component has a c-th of what is left over,

    D = sum over all nodes of [ r* x (F - ext) + tau e3* ] - sum over all supports of [ r* x R + R_4 e3* + V ]

and the total is that of the whole, to round-off. How V follows nodes and tangents is taken by central differences.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..linalg.constraints import Clamps
from ..rods import geometry
from ..rods.geometry import Configuration
from ..rods.mesh import Mesh
from ..rods.system import RodSystem
from .attached import Unknowns
from .balance import torques
from .body import Motor, Poses

_STEP = 1e-6  # of the length, and in radians: of differences


class Support(NamedTuple):
    """A support of a rod: its node, whether at s = L, whether clamped; its body or -1 for the lab, its motor or -1.

    ``clamp`` is its number among the clamps in bodies, or -1.
    """

    node: int
    finish: bool
    clamped: bool
    body: int
    motor: int
    clamp: int


class Component(NamedTuple):
    """Bodies that rods connect, with each other or with the lab: their numbers, those of supports, and the nodes."""

    bodies: tuple[int, ...]
    supports: tuple[int, ...]
    nodes: np.ndarray


class Supports:
    """The supports of all components of a scene, over any step."""

    def __init__(self, rods: RodSystem, supports: Sequence[Support], components: Sequence[Component]) -> None:
        self.all, self.components, self._rods = tuple(supports), tuple(components), rods
        self.nodes = np.array([support.node for support in supports], np.int64)
        self._sign = np.array([1.0 if s.finish else -1.0 for s in supports]) * [s.clamped for s in supports]
        self._inwards = np.array([-1 if s.finish else 1 for s in supports])

    def together(self, own: Sequence[np.ndarray]) -> list[np.ndarray]:
        """The nodes that are of one whole: of each body's rods, ``own``, or of all those of its component."""
        out = list(own)
        for part in self.components:
            for b in part.bodies:
                out[b] = part.nodes
        return out

    def alone(self, nodes: Sequence[np.ndarray], driven: Sequence[np.ndarray]) -> tuple[list, list]:
        """The nodes of each body's rods, and of each motor's rod, none where the balance is that of its supports."""
        bodies = {b for part in self.components for b in part.bodies}
        motors = {support.motor for support in self.all}
        none = np.zeros(0, np.int64)
        left = [none if b in bodies else at for b, at in enumerate(nodes)]
        return left, [none if k in motors else at for k, at in enumerate(driven)]

    def add_left_over(self, out: np.ndarray, there: Configuration, poses: Poses, q: Unknowns) -> None:
        """Adds to the balances' matrix (p, n, m) the shares of the totals of the components."""
        for part in self.components:
            whole = torques(there, part.nodes, poses.centre[part.bodies[0]], out.shape[2]) / len(part.bodies)
            for b in part.bodies:
                out[q.turns(b), part.nodes] = whole / q.length

    def sums(self, there: Configuration, poses: Poses, motors: Sequence[Motor], q: Unknowns, m: int) -> np.ndarray:
        """The matrix (p, e, m + 3) that takes R and V of the supports to what they add to the balances."""
        out = np.zeros((q.size, len(self.all), m + 3))
        for part in self.components:
            for k in part.supports:
                own, share = self.all[k].body, 1.0 / len(part.bodies)
                about_first = self._turning(k, there, poses.centre[part.bodies[0]], m) / q.length
                for b in part.bodies:
                    out[q.turns(b), k] -= share * about_first
                if own >= 0:
                    out[q.moves(own), k, :3] = np.eye(3)
                    out[q.turns(own), k] += self._turning(k, there, poses.centre[own], m) / q.length
                if self.all[k].motor >= 0:
                    motor = motors[self.all[k].motor]
                    axes = poses.axes[motor.body]
                    about = self._turning(k, there, poses.centre[motor.body] + axes @ motor.point, m)
                    out[q.motor(self.all[k].motor), k] = (axes @ motor.axis) @ about / q.length
        return out

    def _turning(self, k: int, there: Configuration, point: np.ndarray, m: int) -> np.ndarray:
        """The matrix (3, m + 3) that takes R and V of a support to their torque about a point."""
        of_force = torques(there, np.array([self.all[k].node]), point, m)[:, 0]
        return np.concatenate([of_force, np.eye(3)], axis=1)

    def clamps(
        self, sums: np.ndarray, mesh: Mesh, start: Configuration, y: np.ndarray, time: float, tangents: Sequence
    ) -> Clamps:
        """The part of the supports in the balances at displacements y (n, m); levers (3, p) of clamps' tangents."""
        n, m = y.shape
        value, by_nodes, by_tangents = self._moments(mesh, start, y, time)
        across = sums[:, :, m:]
        slope = np.zeros((len(sums), len(sums)))
        for k, support in enumerate(self.all):
            if support.clamp >= 0:
                slope += across[:, k] @ by_tangents[k] @ tangents[support.clamp]
        moments = np.einsum("pkc,kc->p", across, value)
        following = np.einsum("pkc,kcij->pij", across, by_nodes).reshape(-1, n * m)
        return Clamps(self.nodes, sums[:, :, :m], moments, following, slope)

    def _moments(
        self, mesh: Mesh, start: Configuration, y: np.ndarray, time: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """V (e, 3), and how it follows nodes (e, 3, n, m) and its tangent (e, 3, 3)."""
        n, m = y.shape
        count, all_ends = len(self.all), np.arange(len(self.all))
        by_nodes, by_tangents = np.zeros((count, 3, n, m)), np.zeros((count, 3, 3))
        for j in range(mesh.w1.shape[1]):
            nodes = self.nodes + j * self._inwards
            for c in range(m):
                size = _STEP * (self._rods.length if c < 3 else 1.0)
                d = np.zeros_like(y)
                d[nodes, c] = size
                change = self._at(mesh, start, y + d, time) - self._at(mesh, start, y - d, time)
                by_nodes[all_ends, :, nodes, c] = change / (2 * size)
        for c in range(3):
            values = [self._at(self._tilted(mesh, c, side * _STEP), start, y, time) for side in (1.0, -1.0)]
            by_tangents[:, :, c] = (values[0] - values[1]) / (2 * _STEP)
        return self._at(mesh, start, y, time), by_nodes, by_tangents

    def _tilted(self, mesh: Mesh, c: int, by: float) -> Mesh:
        """The mesh with a component of all clamps' tangents changed."""
        c1, c2 = mesh.c1.copy(), mesh.c2.copy()
        for k, node in enumerate(self.nodes):
            if self._sign[k]:
                largest = int(np.argmax(np.abs(mesh.c1[node])))
                c1[node, c] += by
                c2[node, c] += by * mesh.c2[node, largest] / mesh.c1[node, largest]
        return mesh._replace(c1=c1, c2=c2)

    def _at(self, mesh: Mesh, start: Configuration, y: np.ndarray, time: float) -> np.ndarray:
        """V (e, 3) of the supports; none at hinges."""
        there = geometry.moved(mesh, start, np.ascontiguousarray(y))[0]
        bend = self._rods.moment(there, time).bend[self.nodes]
        moments = bend[:, :1] * there.e1[self.nodes] + bend[:, 1:] * there.e2[self.nodes]
        return self._sign[:, None] * moments
