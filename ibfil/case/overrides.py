"""KEY=VALUE on the command line: one key of a case replaced, by its dotted path.

KEY=absent takes the key out, which is what the listing of the schema calls a key that is not there.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import Any, get_origin

from .expressions import suggestion
from .faults import ROOT, Entry, Fault, dotted, members, shown, step_into, unknown_key
from .toml import load

NAMED = {"filament": "rod", "observe": "tip", "expect": "tip"}  # tables whose names are the user's, and such a name
ABSENT = "absent"  # the value that takes a key out
FORM = "KEY=VALUE, KEY a dotted path such as fluid.viscosity or stop.0.below"


Overrides = Sequence[str] | Mapping[str, Any]  # "KEY=VALUE" as on the command line, or from Python {"KEY": value}


def pairs(overrides: Overrides) -> Iterator[tuple[list[str], Any] | Fault]:
    """The path and the value of each override, or its fault; a value None takes the key out."""
    if isinstance(overrides, str):
        overrides = (overrides,)
    if not isinstance(overrides, Mapping):
        yield from map(split, overrides)
        return
    for key, value in overrides.items():
        path = str(key).split(".")
        if all(path):
            yield path, ABSENT if value is None else plain(value)
        else:
            yield Fault("overrides", shown(key), "a dotted path such as fluid.viscosity or stop.0.below")


def plain(value: Any) -> Any:
    """A value made in Python as TOML has it: arrays and tuples are lists, paths texts; keys that are None left out."""
    if hasattr(value, "tolist"):  # of numpy, which is not loaded for this
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, list | tuple):
        return [plain(inner) for inner in value]
    return str(value) if isinstance(value, PurePath) else value


def split(text: str) -> tuple[list[str], Any] | Fault:
    """The path and the value of ``KEY=VALUE``; what is not TOML is a text, so ``fluid.model=rft`` works."""
    key, equals, value = (part.strip() for part in text.partition("="))
    path = key.split(".")
    if not equals or not all(path):
        return Fault("command line", shown(text), FORM)
    try:
        table = load(f"value = {value}")
    except ValueError:
        table = {}
    return path, table["value"] if set(table) == {"value"} else value


def apply(raw: dict[str, Any], path: list[str], value: Any) -> dict[str, Any] | Fault:
    """The content ``raw`` with the key ``path`` set or taken out, making tables the schema knows; or the fault."""
    changed = copy.deepcopy(raw)
    entry, table = ROOT, changed
    for depth, part in enumerate(path):
        here = (*path[: depth + 1],)
        if isinstance(table, list):
            fault = _bad_number(here, table)
            if fault:
                return fault
        elif not isinstance(table, dict):
            above = dotted(here[:-1])
            return Fault(dotted(here), f"{above} = {shown(table)}", f"a table there; write {above}={{...}}")
        inner = step_into(entry, int(part) if isinstance(table, list) else part)
        if inner is None:
            return unknown_key(entry, here)
        if here[0] == "parameters" and depth == 1 and part not in table:
            return Fault(dotted(here), f"no such parameter{suggestion(part, table)}", ", ".join(table) or "none here")
        last = depth == len(path) - 1
        if here[0] in NAMED and depth == 1 and not last and part not in table and suggestion(part, table):
            return Fault(dotted(here), f"no such {here[0]}{suggestion(part, table)}", ", ".join(table))
        index = int(part) if isinstance(table, list) else part
        if last and value == ABSENT and isinstance(table, dict):
            table.pop(part, None)
        elif last:
            table[index] = value
        elif isinstance(table, dict):
            table = table.setdefault(part, _empty(inner))
        else:
            table = table[index]
        entry = inner
    return changed


def _bad_number(path: tuple[str, ...], items: list[Any]) -> Fault | None:
    """The fault of a list entry that is not there."""
    if path[-1].isascii() and path[-1].isdigit() and len(path[-1]) < 6 and int(path[-1]) < len(items):
        return None
    allowed = f"a number from 0 to {len(items) - 1}" if items else "nothing: there is no such list"
    return Fault(dotted(path), f"no entry {path[-1]}", allowed)


def _empty(entry: Entry) -> Any:
    """The empty table or list that a missing one starts as."""
    return [] if all(get_origin(member) is tuple for member in members(entry.hint)) else {}
