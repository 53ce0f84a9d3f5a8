"""A case as a file in which every key of its tables is explained: those that are set, and the others as comments."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, get_args, get_origin

import tomli_w
from pydantic import BaseModel

from ...errors import CaseError
from ..expressions import suggestion
from ..faults import Entry, Fault, entry_of, known_keys, members
from ..idle import idle_keys
from ..listing import default_text
from ..overrides import apply, pairs
from ..reading import parse_case
from ..schema import Scene
from ..toml import load
from ..values import describe, keys
from .physics import PHYSICS, START

WIDTH = 118
CONFLICT = "found what does not go together"


def blank(words: Sequence[str]) -> str:
    """The text of a new case with the physics that ``words`` of `PHYSICS` name. Raises CaseError, a line each."""
    scene = _scene(words)
    lines = ["# Keys that begin with # are as if they stood there: take the # away, and change them."]
    lines += ["# `ibfil check` tells what the case models and costs; `ibfil schema` has the other tables.", ""]
    return "\n".join([*lines, *_table((), scene)]).rstrip() + "\n"


def offers() -> str:
    """The words that may be asked for, a line each."""
    width = max(map(len, PHYSICS))
    return "\n".join(f"  {word:{width}}  {physics.words}" for word, physics in PHYSICS.items())


def _scene(words: Sequence[str]) -> dict[str, Any]:
    """The content of the case. Raises CaseError for words that are not known or do not go together."""
    unknown = [word for word in words if word not in PHYSICS]
    if unknown:
        raise CaseError([f"--with: found {w}{suggestion(w, PHYSICS)}; allowed: {', '.join(PHYSICS)}" for w in unknown])
    raw = load(tomli_w.dumps(START))
    for word in sorted(words, key=list(PHYSICS).index):
        for override in pairs(PHYSICS[word].keys):
            changed = override if isinstance(override, Fault) else apply(raw, *override)
            if isinstance(changed, Fault):
                raise CaseError([changed.line("--with")])
            raw = changed
    try:
        idle = idle_keys(parse_case(tomli_w.dumps(raw), "new"))
    except CaseError as error:
        found = f"--with {','.join(words)}: {CONFLICT}: "
        raise CaseError([found + line.removeprefix("new: ") for line in error.faults]) from None
    if idle:
        raise CaseError([f"--with {','.join(words)}: {CONFLICT}: {', '.join(idle)} would do nothing"])
    return raw


def _table(path: tuple[str, ...], given: Mapping[str, Any]) -> Iterator[str]:
    """A table: the keys that are set, the others as comments, then the tables in it."""
    entry = entry_of(path) if path else Entry(Scene, (), None)
    assert entry is not None
    if path:
        yield f"[{'.'.join(path)}]"
    tables = {}
    for key in _own_keys(entry, given):
        info = _info(entry, key)
        if _holds_tables(info):
            tables[key] = info
            continue
        yield from _comment(f"{info.description} ({describe(info.annotation, tuple(info.metadata))})")
        if key in given:
            yield f"{key} = {_toml(given[key])}"
        else:
            yield f"# {key} = {default_text(info)}"
    yield ""
    for key, info in tables.items():
        yield from _inside((*path, key), info, given.get(key))


def _inside(path: tuple[str, ...], info: Any, given: Any) -> Iterator[str]:
    """The tables of a key: each that is set with all its keys, and one that is not as one comment."""
    name = ".".join(path)
    if given is None:
        held = ", ".join(known_keys(entry_of(path) or Entry(None, (), None)))
        yield from _comment(f"[{name}]: {info.description}" + (f" ({held})" if held else ""))
        yield ""
    elif isinstance(given, list):
        yield from _comment(info.description)
        for item in given:
            yield from (f"[[{name}]]", *(f"{key} = {_toml(value)}" for key, value in item.items()), "")
    elif any(get_origin(member) is dict for member in members(info.annotation)):
        for own, table in given.items():
            yield from _comment(info.description)
            yield from _table((*path, own), table)
    else:
        yield from _comment(info.description)
        yield from _table(path, given)


def _own_keys(entry: Entry, given: Mapping[str, Any]) -> list[str]:
    """The keys of the table, of several kinds those of the one that is meant."""
    return list(dict.fromkeys(key for table in _kinds(entry, given) for key in keys(table)))


def _kinds(entry: Entry, given: Mapping[str, Any]) -> list[type[BaseModel]]:
    tables = [m for m in members(entry.hint) if isinstance(m, type) and issubclass(m, BaseModel)]
    meant = [t for t in tables if "kind" in t.model_fields and t.model_fields["kind"].default == given.get("kind")]
    return meant or tables


def _info(entry: Entry, key: str) -> Any:
    """The field of a key, of the first kind of table that has it."""
    tables = [m for m in members(entry.hint) if isinstance(m, type) and issubclass(m, BaseModel) and key in keys(m)]
    return tables[0].model_fields[keys(tables[0])[key]]


def _holds_tables(info: Any) -> bool:
    """Whether a key is of tables alone."""
    found = members(info.annotation)
    if any(get_origin(member) is dict for member in found):
        return True
    inner = [get_args(m)[0] if get_origin(m) is tuple and get_args(m)[-1] is Ellipsis else m for m in found]
    inner = [deep for m in inner for deep in members(m)]
    return bool(inner) and all(isinstance(m, type) and issubclass(m, BaseModel) for m in inner)


def _toml(value: Any) -> str:
    """A value on one line."""
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(inner)}" for key, inner in value.items()) + " }"
    return tomli_w.dumps({"x": value}).removeprefix("x = ").rstrip()


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent="# ", subsequent_indent="#   ", break_long_words=False)
