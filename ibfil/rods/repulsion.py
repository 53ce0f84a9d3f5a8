"""The repulsion of segments that are near each other: a force between closest points, and its exact stiffness.

    f = F w (2 - d/D),     w = min(1, ds_i ds_j/(pi D^2))

on the four end nodes by the lever rule (contact.py says what it is for). The closest points move along the segments as
these turn, and with them the levers; the stiffness has all of that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..linalg.compiled import njit
from .geometry import Configuration
from .linearization import Linearization
from .loads import ExternalLoad
from .neighbour_search import Segments, closest, search

_PULL = 0.01  # of the points that repel to the middles of their segments
SKIN = 0.5  # of the distance of contact, beyond where segments repel, that pairs are looked for


def farthest(before: np.ndarray, after: np.ndarray) -> float:
    """The longest way of a node from positions ``before`` to ``after`` (n, 3)."""
    return float(np.sqrt(np.max(np.sum((after - before) ** 2, axis=1))))


class _Contact(NamedTuple):
    """Two segments p + a u and q + b v with a gap g between their closest points, from the second to the first."""

    u: np.ndarray
    v: np.ndarray
    gap: np.ndarray
    a: float
    b: float
    distance: float
    touch: float  # D
    scale: float  # F w


@njit(cache=True)
def _look(segments: Segments, r, i, j, box, strength):
    """Segments i and j as they are now, j moved to its image next to i."""
    p, q = segments.first[i], segments.first[j]
    u, v, gap, shift = np.empty(3), np.empty(3), np.empty(3), np.zeros(3)
    for c in range(3):
        u[c], v[c] = r[p + 1, c] - r[p, c], r[q + 1, c] - r[q, c]
        if box[c] > 0.0:
            d = r[p, c] + 0.5 * u[c] - r[q, c] - 0.5 * v[c]
            shift[c] = box[c] * np.floor(d / box[c] + 0.5)
    a, b, d = closest(r[p], u, r[q], shift, v, _PULL, gap)
    touch = segments.radius[i] + segments.radius[j]
    lengths = (segments.end[i] - segments.begin[i]) * (segments.end[j] - segments.begin[j])
    return _Contact(u, v, gap, a, b, d, touch, strength * min(1.0, lengths / (np.pi * touch * touch)))


@njit(cache=True)
def _repels(it: _Contact):
    """Whether there is a force; rods laid through each other have no direction to part in."""
    return 0.0 < it.distance < 2.0 * it.touch


@njit(cache=True)
def repel(segments: Segments, r, first, second, box, strength, force):
    """Adds to force (n, 3 or 4) the repulsion of segments ``first`` (p,) and ``second`` (p,): F w (2 - d/D) g/d."""
    for k in range(first.size):
        it = _look(segments, r, first[k], second[k], box, strength)
        if _repels(it):
            p, q = segments.first[first[k]], segments.first[second[k]]
            for c in range(3):
                f = it.scale * (2.0 - it.distance / it.touch) * it.gap[c] / it.distance
                force[p, c] += (1.0 - it.a) * f
                force[p + 1, c] += it.a * f
                force[q, c] -= (1.0 - it.b) * f
                force[q + 1, c] -= it.b * f


@njit(cache=True)
def _moving(it: _Contact, on_a, on_b):
    """How the fractions a and b follow the four nodes: da = sum of on_a[k].dr_k, on_a and on_b (4, 3).

    A fraction at an end of its segment stays there. Of the others, u.g + pull u.u (a - 1/2) = 0 and
    -v.g + pull v.v (b - 1/2) = 0 stay true.
    """
    on_a[:], on_b[:] = 0.0, 0.0
    levers = (1.0 - it.a, it.a, it.b - 1.0, -it.b)
    for k in range(4):
        for c in range(3):
            on_a[k, c], on_b[k, c] = -levers[k] * it.u[c], levers[k] * it.v[c]
    for c in range(3):
        along_u = it.gap[c] + 2.0 * _PULL * (it.a - 0.5) * it.u[c]
        along_v = -it.gap[c] + 2.0 * _PULL * (it.b - 0.5) * it.v[c]
        on_a[0, c] += along_u
        on_a[1, c] -= along_u
        on_b[2, c] += along_v
        on_b[3, c] -= along_v
    uu, uv, vv = 0.0, 0.0, 0.0
    for c in range(3):
        uu, uv, vv = uu + it.u[c] * it.u[c], uv + it.u[c] * it.v[c], vv + it.v[c] * it.v[c]
    ku, kv = (1.0 + _PULL) * uu, (1.0 + _PULL) * vv
    free_a, free_b = 0.0 < it.a < 1.0, 0.0 < it.b < 1.0
    for k in range(4):
        for c in range(3):
            x, y = on_a[k, c], on_b[k, c]
            if free_a and free_b:
                across = ku * kv - uv * uv
                on_a[k, c], on_b[k, c] = (kv * x + uv * y) / across, (ku * y + uv * x) / across
            else:
                on_a[k, c], on_b[k, c] = x / ku if free_a else 0.0, y / kv if free_b else 0.0


@njit(cache=True)
def _mix(it: _Contact, k3, f, on_a, on_b, out):
    """The blocks (4, 4, 3, 3) of df = k3 dg on the levers of the four nodes, and of the levers that move."""
    levers, by_a, by_b = (1.0 - it.a, it.a, it.b - 1.0, -it.b), (-1.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, -1.0)
    for c in range(3):
        on_u, on_v = 0.0, 0.0
        for e in range(3):
            on_u, on_v = on_u + k3[c, e] * it.u[e], on_v + k3[c, e] * it.v[e]
        for row in range(4):
            to_a, to_b = levers[row] * on_u + by_a[row] * f[c], by_b[row] * f[c] - levers[row] * on_v
            for column in range(4):
                for e in range(3):
                    direct = levers[row] * levers[column] * k3[c, e]
                    out[row, column, c, e] = direct + to_a * on_a[column, e] + to_b * on_b[column, e]


@njit(cache=True)
def repel_stiffness(segments: Segments, r, first, second, box, strength, definite, blocks):
    """Fills blocks (p, 4, 4, 3, 3): how the force on each of the four nodes of a pair follows each of them.

    With n = g/d and the force f = F w (2 - d/D) n between the closest points,

        df = [F w (2 - d/D)/d (1 - n n) - F w/D n n] dg,    dg = dp + a du - dq - b dv + u da - v db

    and the levers move by da and db. ``definite``: only -F w/D n n, which draws each to where it is.
    """
    on_a, on_b, k3, f = np.empty((4, 3)), np.empty((4, 3)), np.empty((3, 3)), np.empty(3)
    blocks[:] = 0.0
    for k in range(first.size):
        it = _look(segments, r, first[k], second[k], box, strength)
        if not _repels(it):
            continue
        size = it.scale * (2.0 - it.distance / it.touch)
        along, across = -it.scale / it.touch, 0.0 if definite else size / it.distance
        for c in range(3):
            f[c] = size * it.gap[c] / it.distance
            for e in range(3):
                n = it.gap[c] * it.gap[e] / (it.distance * it.distance)
                k3[c, e] = (along - across) * n + (across if c == e else 0.0)
        if definite:
            on_a[:], on_b[:] = 0.0, 0.0
        else:
            _moving(it, on_a, on_b)
        _mix(it, k3, f, on_a, on_b, blocks[k])


class Repulsion(ExternalLoad):
    """The repulsion of segments: a force, and its stiffness, which couples the four nodes of each pair.

    Pairs are looked for out to ``SKIN`` of the distance of contact beyond where they repel, and again when a node has
    moved by half of that: so the same nodes are coupled, and factored in the same order, for many steps. ``box`` (3,)
    holds the sides of a periodic box, 0 along open axes; ``strength`` is F.
    """

    def __init__(self, segments: Segments, box: np.ndarray, strength: float) -> None:
        self._segments, self._box, self._strength = segments, box, strength
        self._reach = 0.5 * SKIN * 2 * float(np.min(segments.radius))
        self.near: np.ndarray | None = None  # the nodes (n, 3) at which pairs were looked for
        self._first = self._second = np.zeros(0, np.int64)
        self._rows = self._columns = np.zeros(0, np.int64)

    def look(self, r: np.ndarray) -> None:
        """Looks for pairs, at nodes r (n, 3)."""
        pairs = search(self._segments, r, self._box, 2.0 + SKIN, 0.0)
        self.near, self._first, self._second = r.copy(), pairs.i, pairs.j
        p, q = (self._segments.first[segment] for segment in (pairs.i, pairs.j))
        nodes = np.stack([p, p + 1, q, q + 1], axis=1)
        self._rows = np.repeat(nodes, 4, axis=1).ravel()
        self._columns = np.tile(nodes, (1, 4)).ravel()

    def _follow(self, r: np.ndarray) -> None:
        if self.near is None or not farthest(self.near, r) < self._reach:
            self.look(r)

    def add_force(self, configuration: Configuration, time: float, force: np.ndarray) -> None:
        """f = F w (2 - d/D) on the end nodes of either segment."""
        self._follow(configuration.r)
        repel(self._segments, configuration.r, self._first, self._second, self._box, self._strength, force)

    def add_stiffness(self, time: float, linearization: Linearization) -> None:
        """df of each node by each of the four of its pair."""
        r = linearization.configuration.r
        self._follow(r)
        blocks = np.empty((len(self._first), 4, 4, 3, 3))
        pairs = self._first, self._second, self._box, self._strength, linearization.definite
        repel_stiffness(self._segments, r, *pairs, blocks)
        linearization.couple(self._rows, self._columns, blocks.reshape(-1, 3, 3))
