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

from ..errors import StepFailed, Stopped
from ..linalg.compiled import njit
from .neighbour_search import Pairs, Segments, closest, search
from .repulsion import Repulsion, farthest

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from .base import Load


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
        self.nearest = 2 * float(np.min(segments.radius))
        self._clear = 0.0  # how much nearer two segments may come before there is anything to look for
        self.since = np.nan  # time of the first contact

    @property
    def repulsion(self) -> tuple[float, float] | None:
        """The force of repulsion at contact and the distance over which it falls to zero; None where there is none."""
        return None

    def near(self, r: np.ndarray, factor: float = 1.0, margin: float = 0.0) -> Pairs:
        """The pairs nearer than ``factor`` times their distance of contact and ``margin``, at nodes r (n, 3)."""
        return search(self.segments, r, self.box, factor, margin)

    def watch(self, before: np.ndarray, after: np.ndarray, start: float, end: float) -> str:
        """The first contact of a step from nodes ``before`` to ``after`` (n, 3), in words; "" if none.

        Raises Stopped, with that line, where contact stops a run.
        """
        if not np.isnan(self.since):
            return ""
        self._clear -= 2 * farthest(before, after)
        if self._clear > 0:
            return ""
        touch = self.first(before, after, start, end)
        if touch is None:
            self._clear = self.clearance(after, self.nearest)
            return ""
        return self._found(touch)

    def _found(self, touch: Touch) -> str:
        self.since = touch.time
        return str(touch)

    def first(self, before: np.ndarray, after: np.ndarray, start: float, end: float) -> Touch | None:
        """The first contact on straight ways from nodes ``before`` to ``after`` (n, 3), between two times.

        Looked for in parts of a step in which no two rods come nearer by more than they touch at: none slips through.
        """
        parts = max(1, int(np.ceil(2 * farthest(before, after) / self.nearest)))
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

    def state(self) -> dict[str, float | np.ndarray]:
        """The part of a run's state that it is."""
        return {"first_contact": self.since}

    def restore(self, state: Mapping[str, float | np.ndarray]) -> None:
        """Goes on from what ``state`` gave."""
        self.since = float(state["first_contact"])


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
        self._repulsion = Repulsion(segments, box, strength)

    @property
    def repulsion(self) -> tuple[float, float]:
        """The strength, and the smallest distance of contact."""
        return self.strength, self.nearest

    def watch(self, before: np.ndarray, after: np.ndarray, start: float, end: float) -> str:
        """Nothing to tell: they are kept apart."""
        return ""

    def refuse_passing(self, before: np.ndarray, after: np.ndarray) -> None:
        """Raises StepFailed where a step from nodes ``before`` to ``after`` (n, 3) takes a segment through another."""
        if not np.all(np.isfinite(after)):
            return
        pairs = self.near(before, 2.0, 2 * farthest(before, after))
        k = passing(self.segments, after, pairs, 1e-9 * self.nearest)
        if k >= 0:
            node = int(self.segments.first[pairs.i[k]])
            other = self._names[self.segments.rod[pairs.j[k]]]
            raise StepFailed(f"a segment is pressed through {other}: contact.strength is less than the load", node)

    def loads(self) -> list[Load]:
        """The repulsion."""
        return [self._repulsion]

    def state(self) -> dict[str, float | np.ndarray]:
        """The nodes at which pairs were looked for, too."""
        near = self._repulsion.near
        return super().state() | ({} if near is None else {"contact_near": near})

    def restore(self, state: Mapping[str, float | np.ndarray]) -> None:
        """Goes on from what ``state`` gave."""
        super().restore(state)
        if "contact_near" in state:
            self._repulsion.look(np.asarray(state["contact_near"]))
