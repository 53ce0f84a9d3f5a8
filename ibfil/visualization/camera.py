"""From where a run is looked at: one camera for all its times, from the reach of its filaments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

FLAT = 0.2  # of the second reach: a motion thicker than that is looked at from a corner


class Viewpoint(NamedTuple):
    """Unit vectors ``towards`` the camera and ``up`` (3,), the ``centre`` (3,) of all positions, and their ``size``."""

    towards: np.ndarray
    up: np.ndarray
    centre: np.ndarray
    size: float
    flat: bool


def viewpoint(positions: Sequence[np.ndarray]) -> Viewpoint:
    """Of filaments (T, N, 3): along the axis of least reach if they are flat, else from a corner.

    The longest reach lies across the picture. ``size`` is the largest distance between two corners of what is reached.
    """
    low = np.min([np.nanmin(p, axis=(0, 1)) for p in positions], axis=0)
    high = np.max([np.nanmax(p, axis=(0, 1)) for p in positions], axis=0)
    reach = high - low
    # Of equal ones the axis that comes first is across, and z is looked along.
    order = sorted(range(3), key=lambda axis: (-round(reach[axis] / max(reach.max(), 1e-300), 6), axis))
    across, upright, least = np.eye(3)[order]
    towards = np.cross(across, upright)
    flat = bool(reach[order[2]] <= FLAT * reach[order[0]])
    if not flat:
        towards = towards + 0.45 * across * np.sign(towards @ least) + 0.5 * upright
        towards = towards / np.linalg.norm(towards)
        upright = upright - (upright @ towards) * towards
        upright = upright / np.linalg.norm(upright)
    return Viewpoint(towards, upright, 0.5 * (low + high), max(float(np.linalg.norm(reach)), 1e-300), flat)
