"""Curves that keep a least distance of each other."""

from __future__ import annotations

import numpy as np

FINE = 0.1  # of the distance: how near to each other the points of a curve are that are looked at


class Kept:
    """Curves placed one after the other, none nearer to another than ``apart``, nor to images in a box of ``sides``.

    Points ``FINE`` of the distance from each other stand for a curve and are kept so much further apart: so the lines
    between them keep the distance too.
    """

    def __init__(self, apart: float, sides: tuple[float, ...] | None) -> None:
        self._apart = apart
        self._sides = None if sides is None else np.asarray(sides, float)
        self._points: list[np.ndarray] = []
        self._middles: list[np.ndarray] = []
        self._reach: list[float] = []

    def near(self, r: np.ndarray) -> tuple[int, float] | None:
        """The curve that the nodes ``r`` (N, 3) come too near to, and how near; None where to none: it is kept."""
        points = _fine(r, FINE * self._apart)
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        reach = float(np.max(np.linalg.norm(points - middle, axis=1)))
        least = self._apart * (1.0 + FINE)
        if self._points:
            away = np.linalg.norm(self._nearest(np.array(self._middles) - middle), axis=1)
            for other in np.nonzero(away < reach + np.array(self._reach) + least)[0]:
                distance = self._distance(points, self._points[other])
                if distance < least:
                    return int(other), distance
        self._points.append(points)
        self._middles.append(middle)
        self._reach.append(reach)
        return None

    def _nearest(self, difference: np.ndarray) -> np.ndarray:
        """Differences (k, 3) to the nearest image."""
        if self._sides is None:
            return difference
        return np.asarray(difference - self._sides * np.rint(difference / self._sides))

    def _distance(self, points: np.ndarray, others: np.ndarray) -> float:
        """The least distance of two clouds of points."""
        from scipy.spatial import cKDTree

        if self._sides is None:
            return float(np.min(cKDTree(others).query(points)[0]))
        points, others = (np.mod(cloud, self._sides) % self._sides for cloud in (points, others))
        return float(np.min(cKDTree(others, boxsize=self._sides).query(points)[0]))


def _fine(r: np.ndarray, spacing: float) -> np.ndarray:
    """Points (n, 3) on the polygon of nodes ``r`` (N, 3), at most ``spacing`` from each other."""
    edges = np.linalg.norm(np.diff(r, axis=0), axis=1)
    counts = np.maximum(np.ceil(edges / spacing), 1).astype(int)
    parts = [a + np.outer(np.arange(n) / n, b - a) for a, b, n in zip(r[:-1], r[1:], counts, strict=True)]
    return np.concatenate([*parts, r[-1:]])
