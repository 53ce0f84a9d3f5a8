"""Tracked centrelines as users have them: text tables of points frame by frame.

A row a point (t, x, y[, z][, s or node][, weight][, filament]), a row a frame (t, x0, y0, x1, y1, ...), a column a
frame (the same, its headings in the first column); tangent angles psi in place of x and y. Cells may be empty or NaN:
such points are left out. Nothing but text of limited size is read.
"""

from __future__ import annotations

import csv
import math
import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import CaseError
from .headings import FORM, OTHERWISE, Heading, factor, heading

MOST = 64 * 2**20  # bytes of a file
_MISSING = ("", "nan", "na", "null", "none", "-")


@dataclass(frozen=True)
class Frame:
    """Points of one filament at one time.

    ``s`` (n,) arclengths, ``points`` (n, d) their places along ``Data.axes``, ``weight`` (n,); all in case units.
    """

    time: float
    filament: str
    s: np.ndarray
    points: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True)
class Data:
    """Frames in order of time. ``axes``: the lab axes that were seen; ``free``: the first point is nowhere (psi)."""

    frames: tuple[Frame, ...]
    axes: tuple[int, ...]
    free: bool
    notes: tuple[str, ...]  # what was taken for granted

    @property
    def count(self) -> int:
        """Number of points."""
        return sum(len(frame.s) for frame in self.frames)

    @property
    def times(self) -> list[float]:
        """The times, each once."""
        return sorted({frame.time for frame in self.frames})


def read(
    path: Path,
    lengths: dict[str, float],
    units: tuple[str, str],
    *,
    scale: float | None,
    rate: float | None,
    named: Sequence[str] = (),
) -> Data:
    """Read the data in ``path`` for filaments of these ``lengths``, in the case's ``units`` of length and time.

    ``named`` are headings to be read in place of the file's own, or where it has none; "" leaves a column out. Raises
    CaseError with one line.
    """
    headings, rows = _table(path, named)
    numbers = _scaled(headings, rows, units, scale, rate)
    if any(one.point is not None for one in headings):
        headings, numbers = _long(headings, numbers)
    return _frames([one.kind for one in headings], numbers, rows, lengths)


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > MOST:
            raise CaseError([f"--data {path}: found {path.stat().st_size >> 20} MiB; allowed: up to {MOST >> 20} MiB"])
        raw = path.read_bytes()
        text = raw.decode("utf-16" if raw[:2] in (BOM_UTF16_LE, BOM_UTF16_BE) else "utf-8-sig")
    except OSError as error:
        raise CaseError([f"--data {path}: cannot be read ({error.strerror})"]) from None
    except UnicodeDecodeError:
        text = "\0"
    if "\0" in text:
        raise CaseError([f"--data {path}: found a binary file; allowed: a text table, {FORM}"])
    return text


def _cells(path: Path, named: Sequence[str]) -> list[list[str]]:
    """Rows of cells, headings first; a table on its side is turned."""
    text = "\n".join(line for line in _text(path).splitlines() if line.strip() and not line.lstrip().startswith("#"))
    first = text.split("\n", 1)[0]
    mark = next((mark for mark in "\t;," if mark in first), None)
    try:
        rows = (
            list(csv.reader(text.splitlines(), delimiter=mark))
            if mark
            else [line.split() for line in text.splitlines()]
        )
    except csv.Error as error:
        raise CaseError([f"--data {path}: found no table ({error}); allowed: {FORM}"]) from None
    rows = [[cell.strip() for cell in row] for row in rows]
    if named:
        return [list(named), *rows[0 if rows and all(map(_is_number, rows[0])) else 1 :]]
    if len(rows) > 1 and heading(rows[0][0]) and heading(rows[1][0]):  # headings in the first column
        if len({len(row) for row in rows}) > 1:
            raise CaseError([f"--data {path}: found rows of different lengths; allowed: as many frames in each"])
        rows = [list(column) for column in zip(*rows, strict=True)]
    return rows


def _table(path: Path, named: Sequence[str]) -> tuple[list[Heading], list[list[str]]]:
    """The headings that are known, and the rows of cells under them."""
    rows = _cells(path, named)
    names = rows[0] if rows else []
    read = [heading(cell) for cell in names]
    kept = [i for i, one in enumerate(read) if one is not None]
    found = {one.kind for one in read if one is not None}
    if not found & {"t", "frame"} or not (len(found & set("xyz")) > 1 or "psi" in found):
        raise CaseError(
            [f"--data {path}: found the headings {', '.join(names)[:80] or 'of nothing'}; allowed: {FORM}; {OTHERWISE}"]
        )
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(names):
            raise CaseError(
                [f"--data {path}: row {number}: found {len(row)} cells; allowed: {len(names)}, one a heading"]
            )
    if len(rows) < 2:
        raise CaseError([f"--data {path}: found no rows under the headings; allowed: one or more"])
    headings = [one for one in read if one is not None]
    keys = [(one.kind, one.point) for one in headings]
    twice = [names[i] for i, key in zip(kept, keys, strict=True) if keys.count(key) > 1]
    if twice:
        raise CaseError([f"--data {path}: found the headings {' and '.join(twice[:2])}; allowed: one of a kind"])
    return headings, [[row[i] for i in kept] for row in rows[1:]]


def _scaled(
    headings: list[Heading], rows: list[list[str]], units: tuple[str, str], scale: float | None, rate: float | None
) -> np.ndarray:
    """The numbers (rows, columns) in case units; NaN where there is none, and for the names of filaments."""
    out = np.full((len(rows), len(headings)), np.nan)
    for j, one in enumerate(headings):
        if one.kind == "filament":
            continue
        times = factor(one, units, scale, rate)
        for i, row in enumerate(rows):
            out[i, j] = _number(row[j], i + 2) * times
    return out


def _is_number(cell: str) -> bool:
    try:
        _number(cell, 0)
    except CaseError:
        return False
    return True


def _number(cell: str, row: int) -> float:
    if cell.lower() in _MISSING:
        return math.nan
    try:
        value = float(cell.replace(",", ".") if cell.count(",") == 1 and "." not in cell else cell)
    except ValueError:
        raise CaseError([f"--data: row {row}: found {cell[:40]!r}; allowed: a number, or nothing"]) from None
    return value if math.isfinite(value) else math.nan


def _long(headings: list[Heading], numbers: np.ndarray) -> tuple[list[Heading], np.ndarray]:
    """A row a point in the place of a row a frame."""
    shared = [j for j, one in enumerate(headings) if one.point is None and one.kind in ("t", "frame", "filament")]
    points = sorted({one.point for one in headings if one.point is not None})
    kinds = list(dict.fromkeys(one.kind for one in headings if one.point is not None))
    where = {(one.kind, one.point): j for j, one in enumerate(headings)}
    lone = [(kind, point) for kind in kinds for point in points if (kind, point) not in where]
    if lone:
        kind, point = lone[0]
        raise CaseError([f"--data: found no {kind}{point}; allowed: each of {', '.join(kinds)} for every point"])
    blocks = [numbers[:, [*shared, *(where[kind, point] for kind in kinds)]] for point in points]
    # Point after point within a frame: the order along the filament.
    out = np.stack(blocks, axis=1).reshape(-1, len(shared) + len(kinds))
    return [headings[j] for j in shared] + [Heading(kind, None, "") for kind in kinds], out


def _frames(kinds: list[str], numbers: np.ndarray, rows: list[list[str]], lengths: dict[str, float]) -> Data:
    """Group the points by time and filament, and find their arclengths."""
    column = {kind: numbers[:, j] for j, kind in enumerate(kinds)}
    time = column["t"] if "t" in column else column["frame"]
    names = _filaments(kinds, rows, len(numbers), lengths)
    angles = "psi" in column and not set("xyz") & set(kinds)
    axes = (0, 1) if angles else tuple(i for i, letter in enumerate("xyz") if letter in column)
    used = [column["psi"]] if angles else [column["xyz"[i]] for i in axes]
    given = [column[key] for key in ("s", "weight") if key in column]
    good = np.all(np.isfinite([time, *used, *given]), axis=0)
    good &= column.get("weight", np.ones(len(good))) > 0
    good &= column.get("s", np.zeros(len(good))) >= 0
    notes = (
        [f"{int(np.sum(~good))} of {len(good)} points left out: no number, no weight, or s < 0"]
        if not good.all()
        else []
    )
    frames, measured = [], False
    for name in dict.fromkeys(names):
        for t in np.unique(time[good & (names == name)]):
            at = np.nonzero(good & (names == name) & (time == t))[0]
            if "node" in column:
                at = at[np.argsort(column["node"][at], kind="stable")]
            points = np.stack([one[at] for one in used], axis=1)
            s, along = _arclength(points, column["s"][at] if "s" in column else None, lengths[name], angles, float(t))
            measured |= along
            if angles:
                points = _integrated(points[:, 0], s)
            weight = column["weight"][at] if "weight" in column else np.ones(len(at))
            frames.append(Frame(float(t), str(name), s, points, weight))
    if not frames:
        raise CaseError(["--data: found no point that can be used; allowed: one or more"])
    if measured:
        notes.append(
            "no s: arclength is measured along the points, from the first, and scaled to the filament's length"
        )
    frames.sort(key=lambda frame: frame.time)
    return Data(tuple(frames), axes, angles, tuple(notes))


def _filaments(kinds: list[str], rows: list[list[str]], count: int, lengths: dict[str, float]) -> np.ndarray:
    """The filament's name (count,) of each point."""
    if "filament" not in kinds:
        if len(lengths) > 1:
            raise CaseError([f"--data: found no column filament; allowed: one, with {', '.join(lengths)} in it"])
        return np.array([next(iter(lengths))] * count)
    named = [row[kinds.index("filament")] for row in rows]
    strange = next((name for name in named if name not in lengths), None)
    if strange is not None:
        raise CaseError([f"--data: found the filament {strange[:40]!r}; allowed: {', '.join(lengths)}"])
    return np.repeat(np.array(named), count // len(rows))


def _arclength(
    points: np.ndarray, s: np.ndarray | None, length: float, angles: bool, time: float
) -> tuple[np.ndarray, bool]:
    """Arclengths (n,), and whether they were measured along the points."""
    if s is not None:
        if np.max(s) > 1.001 * length:
            raise CaseError([f"--data: t = {time:g}: found s = {np.max(s):g}; allowed: up to the length {length:g}"])
        if len(np.unique(s)) < len(s):
            raise CaseError([f"--data: t = {time:g}: found one s twice; allowed: once a frame and filament"])
        return np.minimum(s, length), False
    if len(points) < 2:
        raise CaseError([f"--data: t = {time:g}: found one point and no s; allowed: two, or a column s"])
    steps = np.ones(len(points) - 1) if angles else np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.append(0.0, np.cumsum(steps))
    if along[-1] == 0:
        raise CaseError([f"--data: t = {time:g}: found points that are all the same; allowed: points along a filament"])
    return along * length / along[-1], True


def _integrated(psi: np.ndarray, s: np.ndarray) -> np.ndarray:
    """The plane curve (n, 2) of tangent angles, its first point at zero."""
    slope = np.stack([np.cos(psi), np.sin(psi)], axis=1)
    steps = 0.5 * (slope[1:] + slope[:-1]) * np.diff(s)[:, None]
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


_OBSERVED = re.compile(r"\s*([^=]+?)\s*=\s*([-+0-9.eE]+?)\s*(?:\+-|±)\s*([0-9.eE+-]+)\s*")


def observed(words: list[str]) -> dict[str, tuple[float, float]]:
    """Read NAME=VALUE+-ERROR: value and standard error by name. Raises CaseError."""
    out: dict[str, tuple[float, float]] = {}
    for word in words:
        found = _OBSERVED.fullmatch(word)
        try:
            value, error = (float(found[2]), float(found[3])) if found else (math.nan, math.nan)
        except ValueError:
            value = error = math.nan
        if found is None or not math.isfinite(value) or not 0 < error < math.inf or found[1] in out:
            raise CaseError([f"--observe {word}: found what is not that; allowed: NAME=VALUE+-ERROR, once a name"])
        out[found[1]] = (value, error)
    return out
