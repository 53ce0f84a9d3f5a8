"""The settings that studies vary: axes and their combinations.

A study is a list of members (members.py), each a setting of one case. `sweep`, `compare`, `trade` and
`stability` are made of it, and so are scripts of users:

    settings = combinations([axis("time.step=0.01,0.02"), axis("fluid.cells=[32,32,32],[64,64,64]")])
    outcomes = run_members(study_members("swimmer_stokes", (), settings), "folder")
"""

from __future__ import annotations

import csv
import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from ..errors import CaseError

FORM = (
    "KEY=V1,V2,...; a range START:STOP:N, or START:STOP:N:log, among the values; keys that change together: "
    "KEY=V1,V2&OTHER=W1,W2; @POINTS.csv, a table with keys above and a point in each row"
)
_RANGE = re.compile(r"([-+0-9.eE]+):([-+0-9.eE]+):([-+0-9.eE]+)(:log)?")
_MOST = 10_000  # values of a range
_LONGEST = 120  # letters of the name of a run


@dataclass(frozen=True)
class Axis:
    """Keys that change together, and their ``values``: for each place on the axis one text a key."""

    keys: tuple[str, ...]
    values: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Setting:
    """One combination: ``values`` by key. ``name`` is that of its run."""

    name: str
    values: Mapping[str, str]

    @property
    def overrides(self) -> tuple[str, ...]:
        """Return it as KEY=VALUE words."""
        return tuple(f"{key}={value}" for key, value in self.values.items())


def axis(text: str) -> Axis:
    """Read `KEY=V1,V2,...`, several of that with & between, or the points of a table, `@POINTS.csv`.

    A value START:STOP:N is N values evenly apart, both ends among them; START:STOP:N:log evenly apart in the logarithm.
    Raises CaseError, with one line, for anything else.

    Commas within brackets, parentheses and quotes belong to a value: `fluid.box=[2,2,2],[4,4,4]`.
    """
    if text.startswith("@"):
        return _points(text)
    keys, columns = [], []
    for part in _split(text, "&"):
        key, equals, values = (word.strip() for word in part.partition("="))
        column = tuple(one for value in _split(values, ",") for one in _ranged(value.strip(), text))
        if not key or not equals or not all(column):
            raise CaseError([f"--vary {text}: found {part!r}; allowed: {FORM}"])
        keys.append(key)
        columns.append(column)
    counts = sorted({len(column) for column in columns})
    if len(counts) > 1:
        raise CaseError([f"--vary {text}: found {counts[0]} and {counts[-1]} values; allowed: as many of each key"])
    return Axis(tuple(keys), tuple(zip(*columns, strict=True)))


def _ranged(value: str, text: str) -> list[str]:
    """The values of a range, or the one value that is none; whole and round numbers come out as such."""
    found = _RANGE.fullmatch(value)
    if found is None:
        return [value]
    try:
        start, stop, count = float(found[1]), float(found[2]), int(found[3])
    except ValueError:
        raise CaseError([f"--vary {text}: found {value}; allowed: numbers, START:STOP:N or START:STOP:N:log"]) from None
    if not 2 <= count <= _MOST or start == stop:
        raise CaseError([f"--vary {text}: found {value}; allowed: two ends, and N from 2 to {_MOST}"])
    if found[4] and not (start > 0 and stop > 0):
        raise CaseError([f"--vary {text}: found {value}; allowed: with log, ends above 0"])
    parts = [k / (count - 1) for k in range(count)]
    if found[4]:
        return [f"{start ** (1 - q) * stop**q:.10g}" for q in parts]
    return [f"{start * (1 - q) + stop * q:.10g}" for q in parts]


def _points(text: str) -> Axis:
    """The axis of a csv file: its first row the keys, a point in each further one, values as --vary has them."""
    path = Path(text[1:])
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = [[cell.strip() for cell in row] for row in csv.reader(file) if any(cell.strip() for cell in row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = getattr(error, "strerror", None) or "not a csv file"
        raise CaseError([f"--vary {text}: {path} cannot be read ({why})"]) from None
    if len(rows) < 2:
        raise CaseError([f"--vary {text}: found {len(rows)} rows; allowed: one of keys, then one or more of values"])
    keys, points = rows[0], rows[1:]
    twice = [key for key in keys if keys.count(key) > 1]
    if twice:
        raise CaseError([f"--vary {text}: found the key {twice[0]} twice; allowed: once"])
    for number, row in enumerate(rows, 1):
        if len(row) != len(keys) or not all(row):
            found = f"{sum(map(bool, row))} values in row {number}"
            raise CaseError([f"--vary {text}: found {found}; allowed: {len(keys)}, one a key"])
    return Axis(tuple(keys), tuple(map(tuple, points)))


def axis_of(key: str, values: Iterable[Any]) -> Axis:
    """Return the axis of one key from Python values: numbers, texts, lists of them."""
    return Axis((key,), tuple((value if isinstance(value, str) else json.dumps(value),) for value in values))


def _split(text: str, mark: str) -> list[str]:
    """The parts between marks that are in no brackets and no quotes."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        else:
            depth += (letter in "[({") - (letter in "])}")
        if letter == mark and depth == 0 and not quote:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def combinations(axes: Sequence[Axis]) -> list[Setting]:
    """Every combination, the last axis fastest. Raises CaseError where a key is on two axes."""
    keys = [key for one in axes for key in one.keys]
    twice = sorted({key for key in keys if keys.count(key) > 1})
    if twice:
        raise CaseError([f"--vary {twice[0]}: found twice; allowed: once"])
    tails = [key.rsplit(".", 1)[-1] for key in keys]
    short = {key: tail if tails.count(tail) == 1 else key for key, tail in zip(keys, tails, strict=True)}
    settings: dict[str, Setting] = {}
    for places in product(*(one.values for one in axes)):
        values = dict(zip(keys, (text for location in places for text in location), strict=True))
        name = _name({short[key]: value for key, value in values.items()})
        if name in settings:  # texts that differ in nothing a name can show
            name += "-" + _hash(values)
        settings[name] = Setting(name, values)
    return list(settings.values())


def _name(values: Mapping[str, str]) -> str:
    """A name for a file: step=0.01,cells=64x64x64."""
    words = (f"{key}={re.sub(r'[^A-Za-z0-9_.+-]+', 'x', value).strip('x')}" for key, value in values.items())
    name = re.sub(r"[^A-Za-z0-9_.,=+-]", "_", ",".join(words)).lstrip(".,=+-") or "as_it_is"
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 9]}-{_hash(values)}"


def _hash(values: Mapping[str, str]) -> str:
    return hashlib.sha256(json.dumps(dict(values)).encode()).hexdigest()[:8]


def source(case: str) -> str:
    """The case as any process finds it: the text of one, or the whole path of a file or a shipped case."""
    from ..case.library import find

    return case if "\n" in case else str(find(case).resolve())
