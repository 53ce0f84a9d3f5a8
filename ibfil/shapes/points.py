"""A start shape read from a file of points: csv or npy, x, y, z[, e1x, e1y, e1z]."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .curves import Curve, perpendicular, transported_frame, unit

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


_NAMES = ("x", "y", "z", "e1x", "e1y", "e1z")
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


def read_points(path: Path) -> np.ndarray:
    """Read the table (n, 3 or 6) in ``path``. Raises ValueError with one line saying what is wrong with it.

    csv: divided by commas; empty lines and lines that begin with # are skipped, and so is a heading
    x,y,z[,e1x,e1y,e1z].
    """
    return _checked(read_table(path, _NAMES))


def read_table(path: Path, names: tuple[str, ...]) -> np.ndarray:
    """The numbers of a csv or npy file, each row all of ``names``, or the first three. Raises ValueError as above."""
    if path.suffix.lower() not in (".csv", ".npy"):
        raise ValueError("must end in .csv or .npy")
    try:
        table = _read_npy(path) if path.suffix.lower() == ".npy" else read_csv(path, names)
    except OSError as error:
        raise ValueError(f"cannot be read ({error.strerror})") from None
    if table.ndim != 2 or table.shape[1] not in (3, len(names)):
        shape, rows = " x ".join(map(str, table.shape)), dict.fromkeys((", ".join(names[:3]), ", ".join(names)))
        raise ValueError(f"holds {shape} numbers; each row must be {' or '.join(rows)}")
    return np.array(table, float)


def _read_npy(path: Path) -> np.ndarray:
    """Read the array in a npy file; ValueError where it is not one of plain numbers."""
    with path.open("rb") as file:
        try:
            table = np.lib.format.read_array(file, allow_pickle=False)
        except (ValueError, EOFError):
            table = np.array(None)
    if table.dtype.kind not in "fiu":
        raise ValueError("is not an array of numbers")
    return table


def read_csv(path: Path, names: tuple[str, ...]) -> np.ndarray:
    """The rows of numbers of a csv file, under a heading or none: all of ``names``, or the first three.

    Raises OSError, and ValueError where a row is not numbers or not as long as the first.
    """
    rows: list[list[float]] = []
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError("is not a text file") from None
    for number, line in enumerate(text.splitlines(), 1):
        cells = [cell.strip() for cell in line.split(",")]
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        if not rows and tuple(cell.lower() for cell in cells) in (names[:3], names):
            continue
        if not rows and cells[0].lower()[:2] in (f"{names[0]}{mark}" for mark in "_ (["):
            own = f"{','.join(names[:3])}, with the numbers in the case's unit of length"
            raise ValueError(f"line {number} names a unit, and none is converted: {line.strip()[:60]!r}; write {own}")
        try:
            rows.append([float(cell) for cell in cells])
        except ValueError:
            raise ValueError(f"line {number} is not numbers divided by commas: {line.strip()[:60]!r}") from None
        if len(rows[-1]) != len(rows[0]):
            raise ValueError(f"line {number} has {len(cells)} columns where the first row has {len(rows[0])}")
    return np.array(rows, float).reshape(len(rows), len(rows[0]) if rows else 0)


def _checked(table: np.ndarray) -> np.ndarray:
    if len(table) < 4:
        raise ValueError(f"holds {len(table)} points; at least 4 are needed to draw a smooth curve")
    bad = np.nonzero(~np.all(np.isfinite(table), axis=1))[0]
    if len(bad):
        raise ValueError(f"point {bad[0] + 1} is not finite")
    same = np.nonzero(np.all(np.diff(table[:, :3], axis=0) == 0.0, axis=1))[0]
    if len(same):
        raise ValueError(f"points {same[0] + 1} and {same[0] + 2} are the same")
    return table


def curve_from_points(table: np.ndarray, s: np.ndarray) -> Curve:
    """Nodes ``s`` (N,) on the cubic spline through the points of ``table`` (n, 3 or 6).

    n = N: the nodes are the points as they stand. Otherwise they are set on the spline at the same
    fractions of its length as ``s`` has of L, so the rod starts evenly stretched by (length of the
    spline)/L. Raises ValueError, with a sentence, where the tangent vanishes or reverses or e1 lies along
    it.
    """
    from scipy.interpolate import CubicSpline

    half = 0.5 * (s[0] + s[-1])
    if len(table) == len(s):
        spline = CubicSpline(s, table)
        at, middle, slope, rows = s, half, spline(s, 1)[:, :3], table
    else:
        chord = np.linalg.norm(np.diff(table[:, :3], axis=0), axis=1)
        spline = CubicSpline(np.append(0.0, np.cumsum(chord)), table)
        places, length = _at_fractions(spline, (np.append(s, half) - s[0]) / (s[-1] - s[0]))
        at, middle, rows = places[:-1], places[-1], spline(places[:-1])
        slope = unit(spline(at, 1)[:, :3]) * length / (s[-1] - s[0])
    e1 = transported_frame(slope) if table.shape[1] == 3 else perpendicular(unit(rows[:, 3:]), unit(slope))
    if not np.all(np.isfinite(e1)):
        raise ValueError("e1 vanishes or lies along the curve")
    return Curve(rows[:, :3], slope, e1, spline(middle)[:3], None)


def _at_fractions(spline: CubicSpline, fractions: np.ndarray) -> tuple[np.ndarray, float]:
    """Find where (n,) the spline has run through ``fractions`` (n,) of its length, and that length."""
    knots = spline.x

    def run(low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Length of the curve between two parameters, by Gauss's rule."""
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        speed = np.linalg.norm(spline(middle[:, None] + half[:, None] * _NODES, 1)[..., :3], axis=-1)
        return half * (speed @ _WEIGHTS)

    # Four pieces a knot: between unevenly placed points the speed varies too much for one rule.
    fine = np.interp(np.arange(4 * len(knots) - 3) / 4, np.arange(len(knots)), knots)
    total = np.append(0.0, np.cumsum(run(fine[:-1], fine[1:])))
    target = fractions * total[-1]
    piece = np.clip(np.searchsorted(total, target, side="right") - 1, 0, len(fine) - 2)
    low, high = fine[piece], fine[piece + 1]
    at = low + (high - low) * (target - total[piece]) / (total[piece + 1] - total[piece])
    for _ in range(50):
        missing = target - total[piece] - run(low, at)
        at = np.clip(at + missing / np.linalg.norm(spline(at, 1)[:, :3], axis=1), low, high)
        if np.max(np.abs(missing)) < 1e-14 * total[-1]:
            break
    return at, float(total[-1])
