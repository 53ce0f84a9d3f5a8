"""Curves that keep a least distance of each other."""

from __future__ import annotations

import numpy as np

from ..linalg.compiled import njit

FINE = 0.1  # of the distance: how near to each other the points of a curve are that are looked at
_FOLDED = 64  # cells a side


class Kept:
    """Curves placed one after the other, none nearer to another than ``apart``, nor to images in a box of ``sides``.

    Points ``FINE`` of the distance from each other stand for a curve and are kept so much further apart: so the lines
    between them keep the distance too. They are found by the cell of space that they are in, not much wider than that:
    what a place costs does not grow with the number of curves.
    """

    def __init__(self, apart: float, sides: tuple[float, ...] | None) -> None:
        self._apart, self._least = apart, apart * (1.0 + FINE)
        self._sides = None if sides is None else np.asarray(sides, float)
        # So many cells a side; without a box space is folded to one of as many cells: two points far apart may share
        # one, which their distance tells.
        self._cells = np.full(3, _FOLDED) if sides is None else _cells(np.asarray(sides, float) / self._least)
        self._width = np.full(3, self._least) if sides is None else np.asarray(sides, float) / self._cells
        self._last = np.full(int(np.prod(self._cells)), -1)  # the last point in each cell
        self._points = np.empty((0, 3))
        self._before = np.empty(0, np.int64)  # the point before in the same cell
        self._owner = np.empty(0, np.int64)  # the curve of each point
        self._count = self._curves = 0

    def near(self, r: np.ndarray) -> tuple[int, float] | None:
        """The curve that the nodes ``r`` (N, 3) come too near to, and how near; None where to none: it is kept."""
        points = _fine(r, FINE * self._apart)
        box = np.full(3, np.inf) if self._sides is None else self._sides
        space = self._cells, self._width, box
        other = _met(points, *space, self._last, self._points, self._before, self._owner, self._least)
        if other >= 0:
            return int(other), self._distance(points, self._points[: self._count][self._owner[: self._count] == other])
        self._grow(len(points))
        _keep(points, *space[:2], self._last, self._points, self._before, self._owner, self._count, self._curves)
        self._count, self._curves = self._count + len(points), self._curves + 1
        return None

    def _grow(self, more: int) -> None:
        """Have room for ``more`` points."""
        if self._count + more > len(self._points):
            room = max(2 * len(self._points), self._count + more)
            for name in ("_points", "_before", "_owner"):
                old = getattr(self, name)
                new = np.empty((room, *old.shape[1:]), old.dtype)
                new[: len(old)] = old
                setattr(self, name, new)

    def _distance(self, points: np.ndarray, others: np.ndarray) -> float:
        """The least distance of two clouds of points."""
        from scipy.spatial import cKDTree

        if self._sides is None:
            return float(np.min(cKDTree(others).query(points)[0]))
        points, others = (np.mod(cloud, self._sides) % self._sides for cloud in (points, others))
        return float(np.min(cKDTree(others, boxsize=self._sides).query(points)[0]))


def _cells(widths: np.ndarray) -> np.ndarray:
    """How many cells a side (3,) a box has that is so many distances wide: not narrower than one, some 2^21 at most."""
    return np.clip(widths.astype(np.int64), 1, 2 * _FOLDED)


@njit(cache=True)
def _cell(x, width):
    """The cell (3,) of a point, before it is folded back into the box."""
    return int(np.floor(x[0] / width[0])), int(np.floor(x[1] / width[1])), int(np.floor(x[2] / width[2]))


@njit(cache=True)
def _at(i, j, k, cells):
    """The number of a cell."""
    return ((i % cells[0]) * cells[1] + j % cells[1]) * cells[2] + k % cells[2]


@njit(cache=True)
def _met(points, cells, width, box, last, known, before, owner, least):
    """A curve that has a point nearer than ``least`` to one of ``points``; -1 where none has."""
    for q in range(len(points)):
        i, j, k = _cell(points[q], width)
        for a in range(i - 1, i + 2):
            for b in range(j - 1, j + 2):
                for c in range(k - 1, k + 2):
                    p = last[_at(a, b, c, cells)]
                    while p >= 0:
                        total = 0.0
                        for x in range(3):
                            d = points[q, x] - known[p, x]
                            if box[x] < np.inf:
                                d -= box[x] * np.rint(d / box[x])
                            total += d * d
                        if total < least * least:
                            return owner[p]
                        p = before[p]
    return -1


@njit(cache=True)
def _keep(points, cells, width, last, known, before, owner, count, curve):
    """Puts the points of a curve after the ``count`` that are there."""
    for q in range(len(points)):
        i, j, k = _cell(points[q], width)
        at, p = _at(i, j, k, cells), count + q
        known[p], before[p], owner[p], last[at] = points[q], last[at], curve, p


@njit(cache=True)
def _fine(r, spacing):
    """Points (n, 3) on the polygon of nodes ``r`` (N, 3), at most ``spacing`` from each other."""
    counts = np.ones(len(r), np.int64)
    for i in range(len(r) - 1):
        a, b, c = r[i + 1, 0] - r[i, 0], r[i + 1, 1] - r[i, 1], r[i + 1, 2] - r[i, 2]
        counts[i] = max(1, int(np.ceil(np.sqrt(a * a + b * b + c * c) / spacing)))
    out, k = np.empty((counts.sum(), 3)), 0
    for i in range(len(r)):
        for part in range(counts[i]):
            for x in range(3):
                out[k, x] = r[i, x] + (part / counts[i] * (r[i + 1, x] - r[i, x]) if part else 0.0)
            k += 1
    return out
