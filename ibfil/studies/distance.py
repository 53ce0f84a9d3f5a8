"""How far two runs of a scene are apart: root mean square distances of nodes, with and without rigid motion.

Runs may differ in nodes and in outputs: the second is taken at the arclengths of the first, by a quintic spline, and
only outputs at the same times count.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..io.reader import RunFile


_SAME = 1e-9  # of the last time: two outputs are at one time
STRAIGHT = 1e-3  # of the size along, squared: a rod is nearly straight that is less wide (3 % of its length)


def common_outputs(a: RunFile, b: RunFile) -> tuple[np.ndarray, np.ndarray]:
    """Indices (k,) of the outputs of a and of b that are at the same times."""
    slack = _SAME * max(a.time[-1], b.time[-1])
    nearest = np.clip(np.searchsorted(b.time, a.time), 1, max(len(b.time) - 1, 1))
    if len(b.time) > 1:
        nearest -= a.time - b.time[nearest - 1] < b.time[nearest] - a.time
    nearest = np.minimum(nearest, len(b.time) - 1)
    same = np.abs(b.time[nearest] - a.time) <= slack
    return np.nonzero(same)[0], nearest[same]


def paths(a: RunFile, b: RunFile) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """For each filament its positions (k, n, 3) in a and in b at common times, in units of its length."""
    from scipy.interpolate import make_interp_spline

    ia, ib = common_outputs(a, b)
    for name, columns in a.filaments.items():
        length = a.filament(name).length
        there = np.asarray(b.filaments[name]["position"])[ib]
        s, s_there = a.arclength(name), b.arclength(name)
        if len(s) != len(s_there) or np.max(np.abs(s - s_there)) > 1e-12 * length:
            there = make_interp_spline(s_there, there, k=5, axis=1)(s)
        yield np.asarray(columns["position"])[ia] / length, there / length


def rms(a: RunFile, b: RunFile) -> np.ndarray:
    """Root mean square distance (k,) of nodes at common times, in units of the filament's length; the most of all."""
    each = [np.sqrt(np.mean(np.sum((x - y) ** 2, axis=2), axis=1)) for x, y in paths(a, b)]
    return np.max(each, axis=0)


def rms_of_shape(a: RunFile, b: RunFile) -> tuple[np.ndarray, np.ndarray]:
    """The same (k,) after each filament of b was moved and turned onto that of a; and the turn (k,), radians."""
    distances, turns = [], []
    for x, y in paths(a, b):
        moved = [superpose(p, q) for p, q in zip(x, y, strict=True)]
        distances.append([distance for distance, _ in moved])
        turns.append([turn for _, turn in moved])
    return np.max(distances, axis=0), np.max(turns, axis=0)


def superpose(p: np.ndarray, q: np.ndarray) -> tuple[float, float]:
    """Root mean square distance of points p (n, 3) from q moved and turned to fit best, and the angle of the turn.

    Kabsch, Acta Cryst. A 32 (1976) 922. How a nearly straight rod is turned about itself does not count: it moves its
    nodes by no more than it is wide, and may be half a turn between two shapes that nearly agree. The angle is that
    between the longest principal axes then.
    """
    p, q = p - p.mean(axis=0), q - q.mean(axis=0)
    u, sizes, vt = np.linalg.svd(q.T @ p)
    sign = np.sign(np.linalg.det(u @ vt))
    turn = u @ np.diag([1.0, 1.0, sign]) @ vt
    # Planar points leave the sign of the third axis to this.
    distance = float(np.sqrt(np.mean(np.sum((q @ turn - p) ** 2, axis=1))))
    straight = sizes[1] < STRAIGHT * sizes[0]
    cosine = abs(float(u[:, 0] @ vt[0])) if straight else 0.5 * (float(np.trace(turn)) - 1.0)
    return distance, float(np.arccos(np.clip(cosine, -1.0, 1.0)))
