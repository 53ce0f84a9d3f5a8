"""The controls of a played case: its parameters, numbers, formulas, words and switches, by their dotted paths."""

from __future__ import annotations

import re
from collections.abc import Iterator
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from ...case.expressions import ExpressionError, parse
from ...case.faults import Entry, dotted, entry_of, words
from ...case.toml import load
from ...case.values import Kind, Whole, keys

if TYPE_CHECKING:
    from ...case.schema import Case

NOT_PLAYED = ("title", "source", "units", "expect", "compute")  # words, and what a process begins with
CHOOSES = "kind"  # the key that chooses which keys a table has
_NAMED = re.compile(r"[A-Za-z_]\w*")


class Control(NamedTuple):
    """A key of a case that a page can change.

    ``kind`` is number, whole, formula, word or switch; ``value`` stands there now; ``words`` are those that may.
    ``help`` has the meaning of the key and the values it may have. ``group`` is the table it stands in.
    """

    path: str
    group: str
    kind: str
    value: float | int | str | bool
    words: list[str]
    help: str


def controls(case: Case) -> list[Control]:
    """The controls of all keys that the text of a case has: parameters first, else in its order."""
    raw = load(case.text)
    found = [one for key, value in raw.items() if key not in NOT_PLAYED for one in _of(case, (key,), value)]
    return sorted(found, key=lambda one: one.group != "parameters")


def _of(case: Case, path: tuple[str | int, ...], value: Any) -> Iterator[Control]:
    """The controls of a value, or of all there are in a table or list."""
    if path[-1] == CHOOSES:
        return
    if isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _of(case, (*path, key), inner)
        return
    entry = entry_of(path) or entry_of(path[:-1])  # one value that stands for equal ones is of the list's kind
    if entry is None:
        return
    made = _control(case, entry, value)
    if made is not None:
        kind, shown, known = made
        table = path[: max(1, len(path) - 1)] if not isinstance(path[-1], int) else path[:-2] or path[:1]
        yield Control(dotted(path), dotted(table), kind, shown, known, _help(entry, path))


def _control(case: Case, entry: Entry, value: Any) -> tuple[str, float | int | str | bool, list[str]] | None:
    """The kind of control of a value, the value that it shows, its words; None where it is no thing to play with."""
    if isinstance(value, bool):
        return "switch", value, []
    kind = _kind(entry.hint, entry.metadata)
    if kind is None:
        known = words(entry.hint)
        return ("word", value, known) if known and isinstance(value, str) else None
    named = isinstance(value, str) and set(_NAMED.findall(value)) & {*case.parameters, *kind.words}
    try:
        number = None if named else parse(value, (), case.parameters).constant
    except ExpressionError:
        number = None
    if number is None:
        return "formula", str(value), list(kind.words)
    return ("whole", int(number), []) if isinstance(kind, Whole) else ("number", number, [])


def _kind(hint: Any, metadata: tuple[Any, ...] = ()) -> Kind | None:
    """The kind of numbers or formulas that a hint of the schema allows; of a list that of its first entry."""
    for item in metadata:
        if isinstance(item, Kind):
            return item
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _kind(inner[0], inner[1:])
    if origin is Literal or not inner:
        return None
    if origin is dict:
        return _kind(inner[1])
    members = [one for one in inner if one is not NoneType] if origin in (Union, UnionType) else inner[:1]
    return next((found for one in members if (found := _kind(one)) is not None), None)


def _help(entry: Entry, path: tuple[str | int, ...]) -> str:
    """The meaning of the key, and the values that may stand there."""
    key = next((part for part in reversed(path) if isinstance(part, str)), "")
    table = entry.table or (outer.table if (outer := entry_of(path[:-1])) else None)
    known = keys(table) if table else {}
    meaning = table.model_fields[known[key]].description if table and key in known else ""
    return f"{meaning or key}; {entry.allowed()}"
