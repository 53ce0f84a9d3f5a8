"""The same filament in many places: at random in a region, or where a file says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from .errors import CaseError

if TYPE_CHECKING:
    from .case_filament import Copies

Place = tuple[int, np.ndarray, np.ndarray]  # number, turn (3, 3), where ``position`` goes (3,)


def places(copies: Copies, position: tuple[float, float, float], key: str, folder: Path) -> Iterator[Place]:
    """The places of the copies: a turn about the filament's ``position``, and where that point goes.

    At random: uniform in ``region``, turned by uniformly random rotations; the same seed gives the same places. From a
    csv file: a row x, y, z a copy, turned at random, or x, y, z and a quaternion x, y, z, w. Raises CaseError.
    """
    rng = np.random.default_rng(copies.seed)
    if copies.file is None:
        assert copies.count is not None
        assert copies.region is not None
        low, high = np.array(copies.region)
        points = rng.uniform(low, high, (copies.count, 3))
        turns = Rotation.random(copies.count, rng=rng)
    else:
        rows = _rows(folder / copies.file, key)
        points = rows[:, :3]
        turns = Rotation.random(len(rows), rng=rng) if rows.shape[1] == 3 else Rotation.from_quat(rows[:, 3:])
    for k, (turn, point) in enumerate(zip(turns.as_matrix(), points, strict=True)):
        yield k, turn, point


def _rows(path: Path, key: str) -> np.ndarray:
    """The rows (k, 3) or (k, 7) of a csv file."""
    try:
        rows = np.loadtxt(path, delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        raise CaseError([f"{key}.copies.file: {path.name} cannot be read as rows of numbers ({error})"]) from None
    if rows.shape[1] not in (3, 7) or not np.all(np.isfinite(rows)):
        raise CaseError(
            [f"{key}.copies.file: {path.name} has {rows.shape[1]} columns; allowed: x, y, z[, and a quaternion]"]
        )
    if rows.shape[1] == 7 and np.any(np.linalg.norm(rows[:, 3:], axis=1) < 1e-12):
        raise CaseError([f"{key}.copies.file: {path.name} has a quaternion of zero length"])
    return rows
