"""From where a run is looked at: one camera for all its times, from the reach of its filaments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..assembly.fluids.models import fluid_model
from ..errors import CaseError
from .style import AXES

if TYPE_CHECKING:
    from ..case.schema import Case

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


def direction(name: str, wanted: str | Sequence[float]) -> np.ndarray:
    """The unit vector (3,) of x, -z, or three numbers "1,0.5,2". Raises CaseError, which calls it ``name``."""
    word = wanted if isinstance(wanted, str) else ""
    if word.lstrip("+-") in AXES and len(word.lstrip("+-")) == 1:
        return np.eye(3)["xyz".index(word[-1])] * (-1.0 if word.startswith("-") else 1.0)
    try:
        found = np.array([float(part) for part in (word.split(",") if word else wanted)])
        size = float(np.linalg.norm(found))
        if found.shape == (3,) and 0 < size < np.inf:
            return found / size
    except (ValueError, TypeError):
        pass
    raise CaseError([f"{name}: found {wanted}; allowed: x, y, z, -x, -y, -z, or three numbers X,Y,Z"])


def turned(look: Viewpoint, towards: np.ndarray | None, up: np.ndarray | None, scene: np.ndarray | None) -> Viewpoint:
    """The same centre from another side: from ``towards``, with ``up`` upwards, or what is up in the ``scene`` (3,).

    A corner from below is turned to one from above. Raises CaseError where both are given along one line.
    """
    away = look.towards if towards is None else towards
    if towards is None and up is None and scene is not None and not look.flat and away @ scene < 0:
        away = away - 2 * (away @ scene) * scene
    wanted = [up] if up is not None else [v for v in (scene, look.up, *np.eye(3)[::-1]) if v is not None]
    for upright in wanted:
        across = upright - (upright @ away) * away
        size = float(np.linalg.norm(across))
        if size > 1e-6:
            return look._replace(towards=away, up=across / size)
    raise CaseError(["--view, --up: found directions along one line; allowed: two that differ"])


def upwards(case: Case) -> np.ndarray | None:
    """The way up (3,) that a scene has: from a wall, or against the weight of its filaments; None where it has none."""
    if fluid_model(case).wall is not None:
        return np.array([0.0, 0.0, 1.0])
    weight = np.zeros(3)
    for filament in case.filaments.values():
        if filament.loads is not None and filament.loads.weight is not None:
            weight += np.array([float(part) for part in filament.loads.weight])
    size = float(np.linalg.norm(weight))
    return -weight / size if size > 0 else None
