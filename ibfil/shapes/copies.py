"""The same filament in many places: at random in a region, or where a file says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import CaseError
from .points import read_csv

if TYPE_CHECKING:
    from ..case.filament import Copies


_NAMES = ("x", "y", "z", "qx", "qy", "qz", "qw")

Place = tuple[int, np.ndarray, np.ndarray]  # number, turn (3, 3), where ``position`` goes (3,)


def places(copies: Copies, position: tuple[float, float, float], key: str, folder: Path) -> Iterator[Place]:
    """The places of the copies: a turn about the filament's ``position``, and where that point goes.

    At random: uniform in ``region``; the same seed gives the same places. From a csv file: a row x, y, z a copy, or
    x, y, z and a quaternion x, y, z, w; a first row of names is passed over. Turned by the quaternion, else as
    ``orientation`` says: by uniformly random rotations or not at all. Raises CaseError.
    """
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(copies.seed)
    if copies.file is None:
        assert copies.count is not None
        assert copies.region is not None
        low, high = np.array(copies.region)
        rows = rng.uniform(low, high, (copies.count, 3))
    else:
        rows = _rows(folder / copies.file, key)
    points = rows[:, :3]
    if rows.shape[1] == 7:
        turns = Rotation.from_quat(rows[:, 3:])
    elif copies.turned_alike:
        turns = Rotation.identity(len(rows))
    else:
        turns = Rotation.random(len(rows), rng=rng)
    for k, (turn, point) in enumerate(zip(turns.as_matrix(), points, strict=True)):
        yield k, turn, point


def _rows(path: Path, key: str) -> np.ndarray:
    """The rows (k, 3) or (k, 7) of a csv file."""
    where = f"{key}.copies.file: {path.name}"
    try:
        rows = read_csv(path, _NAMES)
    except OSError as error:
        raise CaseError([f"{where} cannot be read ({error.strerror})"]) from None
    except ValueError as error:
        raise CaseError([f"{where} {error}"]) from None
    if rows.shape[1] not in (3, 7) or not np.all(np.isfinite(rows)):
        found = f"{rows.shape[1]} columns" if rows.shape[1] not in (3, 7) else "numbers that are not finite"
        raise CaseError([f"{where} has {found}; allowed: x, y, z, or x, y, z and a quaternion qx, qy, qz, qw"])
    if rows.shape[1] == 7 and np.any(np.linalg.norm(rows[:, 3:], axis=1) < 1e-12):
        raise CaseError([f"{where} has a quaternion of zero length"])
    return rows
