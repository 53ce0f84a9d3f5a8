"""Contact of rods: segment to segment, all filaments, and their periodic images where the fluid is a box.

Two segments touch where their axes come nearer than D, ``contact.distance`` or the sum of their radii. Segments of one
filament with less than pi D between them along it are neighbours, and never touch (the tightest bend that touches
itself takes half of that). ``stop`` ends the run at the first contact, ``warn`` tells it, and ``repel`` is a force
between segments whose closest points are d < 2 D apart, along the line between these,

    f = F w (2 - d/D),     w = min(1, ds_i ds_j/(pi D^2)),     F = contact.strength

F at contact, zero at the range D beyond it, on the four end nodes by the lever rule: it adds no force and no torque to
the whole. Where nodes are closer than D the weight makes it a force per length of either rod, and finely divided rods
that cross at right angles repel with F when they touch and 1.2 F at the most, whatever their nodes. Coarser ones do
with F to 4 F, most at a node. A larger load would press them through each other, and such a step is not taken.

Which segments are near each other is found by neighbour_search.py.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

from ..errors import StepFailed, Stopped
from .geometry import Configuration
from .linearization import Linearization
from .loads import ExternalLoad
from .neighbour_search import Pairs, Segments, closest, search

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .base import Load


_PULL = 0.01  # of the points that repel to the middles of their segments


class Touch(NamedTuple):
    """The first contact: when, the nodes next to it, counted from 0 at each filament's start, and how near."""

    time: float
    one: str
    node: int
    other: str
    other_node: int
    apart: float
    touching: float

    def __str__(self) -> str:
        """As it stands in messages."""
        where = f"{self.one} node {self.node} and {self.other} node {self.other_node}"
        near = f"axes {self.apart:.4g} apart, contact below {self.touching:.4g} (contact.distance or the sum of radii)"
        return f"contact between {where}, {near}, at t = {self.time:.6g}"


def _farthest(before: np.ndarray, after: np.ndarray) -> float:
    """The longest way of a node from positions ``before`` to ``after`` (n, 3)."""
    return float(np.sqrt(np.max(np.sum((after - before) ** 2, axis=1))))


@njit(cache=True)
def passing(segments: Segments, after, pairs: Pairs, tiny):
    """The first of the pairs whose line from one to the other has turned by more than a right angle, or -1.

    ``after`` (n, 3) are the nodes later on. Pairs nearer than ``tiny`` have no direction to lose.
    """
    u, v, gap = np.empty(3), np.empty(3), np.empty(3)
    for n in range(pairs.i.size):
        i, j = segments.first[pairs.i[n]], segments.first[pairs.j[n]]
        for c in range(3):
            u[c], v[c] = after[i + 1, c] - after[i, c], after[j + 1, c] - after[j, c]
        closest(after[i], u, after[j], pairs.shift[n], v, 0.0, gap)
        old = pairs.gap[n]
        if gap[0] * old[0] + gap[1] * old[1] + gap[2] * old[2] < 0.0 and pairs.distance[n] > tiny:
            return n
    return -1


@njit(cache=True)
def repel(segments: Segments, r, pairs: Pairs, strength, force):
    """Adds to force (n, 3 or 4) the repulsion of the pairs; returns its stiffness, but for what couples two segments.

    Along the gap, df = -F w/D (gap gap)/d^2 dr: (n, 3, 3) of a node on itself, and of nodes i and i + 1 on each other.
    """
    n = force.shape[0]
    u, v, gap = np.empty(3), np.empty(3), np.empty(3)
    own, beside = np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
    for k in range(pairs.i.size):
        i, j = pairs.i[k], pairs.j[k]
        p, q = segments.first[i], segments.first[j]
        for c in range(3):
            u[c], v[c] = r[p + 1, c] - r[p, c], r[q + 1, c] - r[q, c]
        a, b, d = closest(r[p], u, r[q], pairs.shift[k], v, _PULL, gap)
        touch = segments.radius[i] + segments.radius[j]
        if d == 0.0 or d >= 2.0 * touch:
            continue  # rods laid through each other have no direction to part in
        lengths = (segments.end[i] - segments.begin[i]) * (segments.end[j] - segments.begin[j])
        scale = strength * min(1.0, lengths / (np.pi * touch * touch))
        for node, t, sign in ((p, a, 1.0), (q, b, -1.0)):
            for c in range(3):
                f = sign * scale * (2.0 - d / touch) * gap[c] / d
                force[node, c] += (1.0 - t) * f
                force[node + 1, c] += t * f
                for e in range(3):
                    s = -scale / touch * gap[c] * gap[e] / (d * d)
                    own[node, c, e] += (1.0 - t) ** 2 * s
                    own[node + 1, c, e] += t * t * s
                    beside[node, c, e] += t * (1.0 - t) * s
    return own, beside


class Contact:
    """The search for contact in a scene; what comes of it is said by the classes below.

    ``box`` (3,) holds the sides of a periodic box, 0 along open axes.
    """

    def __init__(
        self,
        segments: Segments,
        names: Sequence[str],
        offsets: Sequence[int],
        box: np.ndarray,
    ) -> None:
        self.segments, self.box = segments, box
        self._names, self._offsets = names, offsets
        self._nearest = 2 * float(np.min(segments.radius))
        self._clear = 0.0  # how much nearer two segments may come before there is anything to look for
        self.since = np.nan  # time of the first contact

    def near(self, r: np.ndarray, factor: float = 1.0, margin: float = 0.0) -> Pairs:
        """The pairs nearer than ``factor`` times their distance of contact and ``margin``, at nodes r (n, 3)."""
        return search(self.segments, r, self.box, factor, margin)

    def watch(self, before: np.ndarray, after: np.ndarray, start: float, end: float) -> str:
        """The first contact of a step from nodes ``before`` to ``after`` (n, 3), in words; "" if none.

        Raises Stopped, with that line, where contact stops a run.
        """
        if not np.isnan(self.since):
            return ""
        self._clear -= 2 * _farthest(before, after)
        if self._clear > 0:
            return ""
        touch = self.first(before, after, start, end)
        if touch is None:
            self._clear = self.clearance(after, self._nearest)
            return ""
        return self._found(touch)

    def _found(self, touch: Touch) -> str:
        self.since = touch.time
        return str(touch)

    def first(self, before: np.ndarray, after: np.ndarray, start: float, end: float) -> Touch | None:
        """The first contact on straight ways from nodes ``before`` to ``after`` (n, 3), between two times.

        Looked for in parts of a step in which no two rods come nearer by more than they touch at: none slips through.
        """
        parts = max(1, int(np.ceil(2 * _farthest(before, after) / self._nearest)))
        for part in range(1, parts + 1):
            r = after if part == parts else before + (part / parts) * (after - before)
            pairs = self.near(r)
            if pairs.i.size:
                time = end if part == parts else start + (part / parts) * (end - start)
                return self._touch(pairs, int(np.argmin(pairs.distance)), time)
        return None

    def clearance(self, r: np.ndarray, most: float) -> float:
        """How much nearer two segments may come before any touch, or ``most``, if that is less; at nodes r (n, 3)."""
        pairs = self.near(r, 1.0, most)
        radius = self.segments.radius
        return float(np.min(pairs.distance - radius[pairs.i] - radius[pairs.j], initial=most))

    def _touch(self, pairs: Pairs, k: int, time: float) -> Touch:
        rods, nodes = [], []
        for segment, t in ((pairs.j[k], pairs.b[k]), (pairs.i[k], pairs.a[k])):
            rod = int(self.segments.rod[segment])
            rods.append(self._names[rod])
            nodes.append(int(self.segments.first[segment] + round(t)) - self._offsets[rod])
        touching = float(self.segments.radius[pairs.i[k]] + self.segments.radius[pairs.j[k]])
        return Touch(time, rods[0], nodes[0], rods[1], nodes[1], float(pairs.distance[k]), touching)

    def refuse_passing(self, before: np.ndarray, after: np.ndarray) -> None:
        """Nothing: rods may pass through each other."""

    def loads(self) -> list[Load]:
        """The forces of contact on the rods: none."""
        return []

    def diagnostics(self, r: np.ndarray) -> dict[str, float]:
        """Diagnostics of an output: pairs that touch now, at nodes r (n, 3), and the time of the first contact."""
        return {"contacts": float(self.near(r).i.size), "first_contact": self.since}

    def state(self) -> dict[str, float]:
        """The part of a run's state that it is."""
        return {"first_contact": self.since}

    def restore(self, state: dict[str, float]) -> None:
        """Goes on from what ``state`` gave."""
        self.since = state["first_contact"]


class ContactWarns(Contact):
    """The first contact is told."""


class ContactStops(Contact):
    """The first contact ends the run."""

    def _found(self, touch: Touch) -> str:
        raise Stopped(str(touch))


class ContactRepels(Contact):
    """Segments repel each other, with the force ``strength`` at contact, and none passes through another."""

    def __init__(
        self, segments: Segments, names: Sequence[str], offsets: Sequence[int], box: np.ndarray, strength: float
    ) -> None:
        super().__init__(segments, names, offsets, box)
        self.strength = strength

    def watch(self, before: np.ndarray, after: np.ndarray, start: float, end: float) -> str:
        """Nothing to tell: they are kept apart."""
        return ""

    def refuse_passing(self, before: np.ndarray, after: np.ndarray) -> None:
        """Raises StepFailed where a step from nodes ``before`` to ``after`` (n, 3) takes a segment through another."""
        if not np.all(np.isfinite(after)):
            return
        pairs = self.near(before, 2.0, 2 * _farthest(before, after))
        k = passing(self.segments, after, pairs, 1e-9 * self._nearest)
        if k >= 0:
            node = int(self.segments.first[pairs.i[k]])
            other = self._names[self.segments.rod[pairs.j[k]]]
            raise StepFailed(f"a segment is pressed through {other}: contact.strength is less than the load", node)

    def loads(self) -> list[Load]:
        """The repulsion."""
        return [Repulsion(self)]


class Repulsion(ExternalLoad):
    """The repulsion of segments.

    Its stiffness couples filaments, which a band matrix cannot hold: it has the part of each segment on itself, along
    the gap. That is half of what two rods feel on their way apart, so Newton's iteration converges, by a factor each
    time where it would square the error. A single linear solve is stable with it at any step length by backward Euler;
    by the trapezoid of [thermal] where dt F/D is below the drag of a node.
    """

    def __init__(self, contact: ContactRepels) -> None:
        self.contact = contact
        self._known: tuple[np.ndarray, Pairs] | None = None

    def _act(self, r: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        contact = self.contact
        if self._known is None or self._known[0] is not r:
            self._known = r, contact.near(r, 2.0)
        return repel(contact.segments, r, self._known[1], contact.strength, force)

    def add_force(self, configuration: Configuration, time: float, force: np.ndarray) -> None:
        """f = F w (2 - d/D) on the end nodes of either segment."""
        self._act(configuration.r, force)

    def add_stiffness(self, time: float, linearization: Linearization) -> None:
        """df = -F w/D along the gap, of each segment on itself."""
        r = linearization.configuration.r
        own, beside = self._act(r, np.zeros((len(r), 3)))
        for blocks, shift in ((own, 0), (beside, 1)):
            nodes = np.nonzero(np.any(blocks, axis=(1, 2)))[0]
            rows = np.zeros((len(nodes), linearization.m, 3))
            rows[:, :3] = blocks[nodes]
            linearization.position(nodes, rows, shift)
            if shift:
                linearization.position(nodes + 1, rows, -1)
