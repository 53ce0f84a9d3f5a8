"""The same filament in many places: at random in a region, in a row or ring by formulas, or where a file says."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..case.expressions import Expression, ExpressionError
from ..errors import CaseError
from .apart import Kept
from .points import read_csv

if TYPE_CHECKING:
    from ..case.copies import Copies


_NAMES = ("x", "y", "z", "qx", "qy", "qz", "qw")
TRIES = 1000  # places drawn for one copy that is to keep its distance

CurveOf = Callable[[int, Mapping[str, float]], np.ndarray]  # number, i and phase -> nodes (N, 3) about the position


class Place(NamedTuple):
    """Where a copy goes: its number, a turn (3, 3) about the filament's position, the point (3,) that goes to."""

    number: int
    turn: np.ndarray
    point: np.ndarray
    values: dict[str, float]  # of i and phase in its formulas


def places(
    copies: Copies, key: str, folder: Path, curve: CurveOf | None = None, sides: tuple[float, ...] | None = None
) -> Iterator[Place]:
    """The places of the copies: a turn about the filament's ``position``, and where that point goes.

    At random: uniform in ``region``; the same seed gives the same places. By ``at``: three formulas of i. From a csv
    file: a row x, y, z a copy, or x, y, z and a quaternion x, y, z, w; a first row of names is passed over. Turned by
    the quaternion, else as ``orientation`` says: by uniformly random rotations or not at all. ``curve`` is given
    where copies keep ``apart``, also of images in a box of ``sides``. Raises CaseError.
    """
    rng = np.random.default_rng(copies.seed)
    rows = _points(copies, rng, key, folder)
    if rows.shape[1] == 7:
        turns = Rotation.from_quat(rows[:, 3:])
    elif copies.turned_alike:
        turns = Rotation.identity(len(rows))
    else:
        turns = Rotation.random(len(rows), rng=rng)
    drawn = 2.0 * np.pi * rng.random(len(rows)) if copies.phases_drawn else np.zeros(len(rows))
    kept = None if copies.apart is None else Kept(copies.apart, sides)
    for k, (turn, row) in enumerate(zip(turns.as_matrix(), rows, strict=True)):
        point = row[:3]
        for _ in range(TRIES):
            values = {"i": float(k), "phase": _phase(copies, k, point, drawn[k], key)}
            near = None if kept is None or curve is None else kept.near(curve(k, values) @ turn.T + point)
            if near is None:
                break
            point, turn = _again(copies, rng, (k, *near), turn, key)
        else:
            raise CaseError([f"{key}.copies.apart: found no room for copy {k} in {TRIES} draws; allowed: {_LESS}"])
        yield Place(k, turn, point, values)


_LESS = "less, fewer copies or a larger region"


def _points(copies: Copies, rng: np.random.Generator, key: str, folder: Path) -> np.ndarray:
    """Where copies go (k, 3), or with quaternions (k, 7)."""
    if copies.file is not None:
        return _rows(folder / copies.file, key)
    assert copies.count is not None
    number = np.arange(float(copies.count))
    if copies.at is not None:
        points = np.stack([formula.bind("i")(number) for formula in copies.at], axis=1)
        bad = np.nonzero(~np.all(np.isfinite(points), axis=1))[0]
        if len(bad):
            raise CaseError([f"{key}.copies.at: found no finite number at i = {bad[0]}; allowed: a place for each"])
        return points
    assert copies.region is not None
    low, high = np.array(copies.region)
    return rng.uniform(low, high, (copies.count, 3))


def _phase(copies: Copies, number: int, point: np.ndarray, drawn: float, key: str) -> float:
    """The phase of one copy."""
    if not isinstance(copies.phase, Expression):
        return float(drawn)
    x, y, z = point.tolist()
    try:
        return copies.phase.at(i=float(number), x=x, y=y, z=z)
    except ExpressionError as error:
        raise CaseError([f"{key}.copies.phase: found no value at i = {number} ({error}); allowed: a number"]) from None


def _again(
    copies: Copies, rng: np.random.Generator, near: tuple[int, int, float], turn: np.ndarray, key: str
) -> tuple[np.ndarray, np.ndarray]:
    """Another random place and turn. Raises CaseError where places are given, and two are nearer than ``apart``."""
    if copies.region is None:
        found = f"copies {near[1]} and {near[0]} within {near[2]:.3g}"
        raise CaseError([f"{key}.copies.apart: found {found}; allowed: places {copies.apart:g} apart, or less"])
    low, high = np.array(copies.region)
    return rng.uniform(low, high), turn if copies.turned_alike else Rotation.random(rng=rng).as_matrix()


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
