"""All filaments of a scene stacked node after node, as plain arrays: spacing, stencils, ends.

Segment ``i`` joins nodes ``i`` and ``i + 1``; ``joined[i]`` is False at the last node of each filament. A flux
through a segment that is not there is zero, which is the natural condition of a free end and what separates two
filaments, so no kernel asks where a filament begins.

Derivatives are affine in the positions, ``r' = W1 r + c1`` and ``r'' = W2 r + c2``: at a clamped end the tangent T is
prescribed, so ``W1`` is zero there, ``c1 = T``, and ``r''`` is the cubic through three nodes with that slope.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..linalg.banded import Profile
from ..linalg.compiled import njit
from ..linalg.finite_differences import clamped_weights, ghost_weights, weights


class Mesh(NamedTuple):
    """The discretisation of the rods, as arrays for compiled kernels; n nodes, stencils p wide, in the case's units."""

    joined: np.ndarray  # (n,) bool: a segment joins node i and node i + 1
    ds: np.ndarray  # (n,) rest length of that segment (1 where there is none)
    volume: np.ndarray  # (n,) Lc, the control volume of a node: half of each neighbouring segment
    first: np.ndarray  # (n,) the first node of the stencil
    w1: np.ndarray  # (n, p) weights of r'
    w2: np.ndarray  # (n, p) weights of r''
    c1: np.ndarray  # (n, 3) the constant part of r'
    c2: np.ndarray  # (n, 3) the constant part of r''


class Segmented(NamedTuple):
    """One filament before stacking: arclength of its nodes, derivative order, tangents of clamped ends (or None).

    ``ghost``: r'' at clamps by ``ghost_weights``. ``closed``: the last node is the first, and ``phantoms`` copies of
    the nodes beyond stand before and after (closed.py), so that every stencil within is central.
    """

    s: np.ndarray
    derivative: int
    start_tangent: np.ndarray | None
    finish_tangent: np.ndarray | None
    ghost: bool = False
    closed: bool = False

    @property
    def phantoms(self) -> int:
        """How many copies stand before the first node, and as many after the last."""
        return self.derivative // 2 if self.closed else 0

    @property
    def whole(self) -> np.ndarray:
        """The arclength of all nodes, copies beyond the ends included."""
        g, s = self.phantoms, self.s
        return s if g == 0 else np.concatenate([s[-1 - g : -1] - s[-1], s, s[1 : g + 1] + s[-1]])

    @property
    def source(self) -> np.ndarray:
        """The node that each of all nodes is, by number: itself, but for copies."""
        count, g = len(self.s), self.phantoms
        return (np.arange(count + 2 * g) - g) % (count - 1) + g if self.closed else np.arange(count)


def _stencils(s: np.ndarray, derivative: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First node, weights of r' and of r'' for one free filament: 7 points, or 3 (4 for r'' at the ends)."""
    first, w1, w2 = _known_stencils(s.tobytes(), derivative)
    return first.copy(), w1.copy(), w2.copy()


@lru_cache(maxsize=64)
def _known_stencils(places: bytes, derivative: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same, found once for filaments whose nodes are at the same places (n doubles)."""
    s = np.frombuffer(places)
    n, p = len(s), (7 if derivative == 6 else 4)
    first, w1, w2 = np.zeros(n, np.int64), np.zeros((n, p)), np.zeros((n, p))
    for i in range(n):
        if derivative == 6:
            a = min(max(i - 3, 0), n - 7)
            w1[i], w2[i] = (weights(s[a : a + 7], s[i], k) for k in (1, 2))
        elif 0 < i < n - 1:
            a = min(i - 1, n - 4)
            at = slice(i - 1 - a, i + 2 - a)
            w1[i, at], w2[i, at] = (weights(s[i - 1 : i + 2], s[i], k) for k in (1, 2))
        else:
            a = 0 if i == 0 else n - 4
            three = slice(0, 3) if i == 0 else slice(1, 4)
            w1[i, three] = weights(s[a : a + 4][three], s[i], 1)
            w2[i] = weights(s[a : a + 4], s[i], 2)
        first[i] = a
    return first, w1, w2


def _clamp(s: np.ndarray, end: int, tangent: np.ndarray, ghost: bool, mesh: tuple[np.ndarray, ...]) -> None:
    """Put the clamp at node ``end`` (0 or -1) into the stencils of one filament."""
    first, w1, w2, c1, c2 = mesh
    order = [0, 1, 2] if end == 0 else [-1, -2, -3]
    w, slope = (ghost_weights if ghost else clamped_weights)(s[order])
    nodes = np.arange(len(s))[order]
    w1[end], w2[end] = 0.0, 0.0
    w2[end, nodes - first[end]] = w
    c1[end], c2[end] = tangent, slope * tangent


def stack(filaments: Sequence[Segmented]) -> Mesh:
    """The filaments one after the other. Narrower stencils are padded with zero weights."""
    width = max(7 if f.derivative == 6 else 4 for f in filaments)
    columns: list[list[np.ndarray]] = [[] for _ in Mesh._fields]
    offset = 0
    for f in filaments:
        s, g = f.whole, f.phantoms
        n = len(s)
        first, w1, w2 = _stencils(s, f.derivative)
        if f.closed:  # to the last bit
            last = n - 1 - g
            shift = (last - first[last]) - (g - first[g])
            w1[last], w2[last] = np.roll(w1[g], shift), np.roll(w2[g], shift)
        c1, c2 = np.zeros((n, 3)), np.zeros((n, 3))
        for end, tangent in ((0, f.start_tangent), (-1, f.finish_tangent)):
            if tangent is not None:
                _clamp(f.s, end, tangent, f.ghost, (first, w1, w2, c1, c2))
        joined = (np.arange(n) >= g) & (np.arange(n) < n - 1 - g)
        segment = np.append(np.diff(s), 1.0)
        there = np.where(joined, segment, 0.0)
        volume = 0.5 * (there + np.append(0.0, there[:-1]))
        pad = ((0, 0), (0, width - w1.shape[1]))
        parts = (
            joined,
            np.where(joined, segment, 1.0),
            volume,
            first + offset,
            np.pad(w1, pad),
            np.pad(w2, pad),
            c1,
            c2,
        )
        for column, part in zip(columns, parts, strict=True):
            column.append(part)
        offset += n
    mesh = Mesh(*(np.concatenate(column) for column in columns))
    # A padded stencil must not reach past the last node of the stack.
    beyond = np.maximum(mesh.first + width - offset, 0)
    for i in np.nonzero(beyond)[0]:
        for w in (mesh.w1, mesh.w2):
            w[i] = np.roll(w[i], beyond[i])
    return mesh._replace(first=mesh.first - beyond)


def _spread(low: np.ndarray, high: np.ndarray, joined: np.ndarray, times: int) -> tuple[np.ndarray, np.ndarray]:
    """First and last nodes (n,) that rows reach, given those of each node's stencil, after ``times`` neighbours."""
    for _ in range(times):
        first, last = low.copy(), high.copy()
        first[1:] = np.where(joined, np.minimum(first[1:], low[:-1]), first[1:])
        first[:-1] = np.where(joined, np.minimum(first[:-1], low[1:]), first[:-1])
        last[1:] = np.where(joined, np.maximum(last[1:], high[:-1]), last[1:])
        last[:-1] = np.where(joined, np.maximum(last[:-1], high[1:]), last[:-1])
        low, high = first, last
    return low, high


@njit(cache=True)
def _filled(first, last):
    """Has each row reach as far as those above it do that it takes part in: what elimination fills."""
    for i in range(len(first)):
        for k in range(first[i], i):
            last[i] = max(last[i], last[k])


def profile(mesh: Mesh, neighbours: int = 1) -> Profile:
    """Which displacements a node's force feels: its stencils and those of ``neighbours`` each side; fill included."""
    n, p = mesh.w1.shape
    columns, rows, joined = mesh.first[:, None] + np.arange(p), np.arange(n), mesh.joined[:-1]
    # Kernels write whole stencils, zero weights and all: the band must hold them.
    low, high = _spread(np.minimum(columns[:, 0], rows), np.maximum(columns[:, -1], rows), joined, neighbours)
    width = int(max(np.max(rows - low), np.max(high - rows)))
    used = (mesh.w1 != 0) | (mesh.w2 != 0)
    low = np.minimum(np.where(used, columns, n).min(axis=1), rows)
    high = np.maximum(np.where(used, columns, -1).max(axis=1), rows)
    first, last = _spread(low, high, joined, neighbours)
    _filled(first, last)
    return Profile(first, last, max(width, int(np.max(last - rows))))
