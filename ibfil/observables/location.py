"""Where on a filament an observable looks: a node, a point between nodes, the centroid, a window."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..linalg.finite_differences import weights
from .time_series import trapezoid_weights

At = str | float | tuple[float, float]


def point_weights(s: np.ndarray, at: float) -> np.ndarray:
    """Weights (N,) of the nodes for the value at arclength ``at``: the cubic through four nodes."""
    row = np.zeros(len(s))
    nearest = int(np.argmin(np.abs(s - at)))
    if abs(s[nearest] - at) <= 1e-9 * s[-1]:
        row[nearest] = 1.0
        return row
    first = min(max(int(np.searchsorted(s, at)) - 2, 0), len(s) - 4)
    row[first : first + 4] = weights(s[first : first + 4], at, 0)
    return row


def _centroid_weights(s: np.ndarray) -> np.ndarray:
    """Weights (N,) of the nodes for the mean over arclength."""
    return trapezoid_weights(s) / (s[-1] - s[0])


_NAMED: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "start": lambda s: point_weights(s, float(s[0])),
    "middle": lambda s: point_weights(s, 0.5 * float(s[-1])),
    "finish": lambda s: point_weights(s, float(s[-1])),
    "centroid": _centroid_weights,
}


class Location:
    """One point, or the points of a window: its nodes and its two ends.

    ``s`` (N,) is the nodes' arclength, ``at`` start, finish, middle, centroid, an arclength or a window [s1,
    s2]. A mean over a window is over arclength; the centroid is the mean over the filament, as one point.
    """

    def __init__(self, s: np.ndarray, at: At) -> None:
        self._share = np.ones(1)
        if isinstance(at, str):
            self._rows = _NAMED[at](s)[None]
        elif isinstance(at, tuple):
            inside = s[(s > at[0] + 1e-9 * s[-1]) & (s < at[1] - 1e-9 * s[-1])]
            points = np.array([at[0], *inside, at[1]])
            self._rows = np.array([point_weights(s, x) for x in points])
            self._share = trapezoid_weights(points) / (at[1] - at[0])
        else:
            self._rows = point_weights(s, float(at))[None]

    def values(self, field: np.ndarray) -> np.ndarray:
        """Values (m,) or (m, 3) at its m points of a nodal field (N,) or (N, 3)."""
        return self._rows @ field

    def reduced(self, values: np.ndarray, how: str) -> np.ndarray:
        """The mean, max or min of values (m,) or (m, 3); for ``how`` "none" there is only one."""
        return reduced(how, self._share, values)


def reduced(how: str, share: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The mean with weights ``share`` (m,), the max or the min of values (m,) or (m, 3)."""
    return _REDUCED[how](share, values)


_REDUCED: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "none": lambda share, values: share @ values,
    "mean": lambda share, values: share @ values,
    "max": lambda share, values: values.max(axis=0),
    "min": lambda share, values: values.min(axis=0),
}
