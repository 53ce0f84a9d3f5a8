"""Faults of a case, one line each: the key, what was found, what is allowed; also those pydantic finds."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from functools import cache
from types import UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel, Tag, ValidationError

from .expressions import suggestion
from .schema import Scene
from .values import describe, keys, unwrapped

Path = tuple[str | int, ...]


class Fault(NamedTuple):
    """One thing wrong. ``reads``: other keys the judgement rests on; if one is at fault, this is not told."""

    key: str
    found: str
    allowed: str
    reads: tuple[str, ...] = ()

    def line(self, file: str) -> str:
        """The line the user reads."""
        return f"{file}: {self.key}: found {self.found}; allowed: {self.allowed}"

    def touches(self, tainted: Iterable[str]) -> bool:
        """Whether it rests on one of the keys ``tainted``, a table of them or a key in them."""
        mine = (self.key, *self.reads)
        return any(f"{a}.".startswith(f"{b}.") or f"{b}.".startswith(f"{a}.") for a in mine for b in tainted)


def dotted(path: Sequence[str | int]) -> str:
    """The path of a key as the user writes it; parts that TOML would want in quotes are in quotes."""
    parts = [str(part) for part in path]
    return ".".join(p if re.fullmatch(r"[A-Za-z0-9_-]+", p) else json.dumps(p, ensure_ascii=False) for p in parts)


def shown(value: Any) -> str:
    """A value as it stands in the file, cut where it is long."""
    if isinstance(value, dict):
        return "a table"
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 80 else text[:76] + " ..."


class Entry(NamedTuple):
    """The schema's entry for a path: its hint with pydantic's metadata, and the table it stands in."""

    hint: Any
    metadata: tuple[Any, ...]
    table: type[BaseModel] | None

    def allowed(self) -> str:
        """The values that are allowed there."""
        hint = unwrapped(self.hint)
        if (
            get_origin(hint) is dict
            and isinstance(get_args(hint)[1], type)
            and issubclass(get_args(hint)[1], BaseModel)
        ):
            return "tables by names of yours, such as [filament.rod]"
        return describe(self.hint, self.metadata)


def members(hint: Any) -> list[Any]:
    """The tables or lists a hint may be; one, but for unions."""
    hint = unwrapped(hint)
    if isinstance(hint, type) or get_origin(hint) in (dict, tuple):
        return [hint]
    options = () if get_origin(hint) is Literal else get_args(hint)
    return [inner for option in options for inner in members(option)]


def _is_tag(entry: Entry, part: str | int) -> bool:
    """Whether ``part`` of one of pydantic's paths chooses in a union, and is no key of the file."""
    union = get_origin(unwrapped(entry.hint)) in (Union, UnionType)
    return union and isinstance(part, str) and part.startswith("<")


def step_into(entry: Entry, part: str | int) -> Entry | None:
    """The entry of ``part`` in a table or list, or which it chooses in a union; None where there is none."""
    if _is_tag(entry, part):
        for member in get_args(unwrapped(entry.hint)):
            if get_origin(member) is Annotated and Tag(str(part)) in get_args(member):
                return Entry(get_args(member)[0], get_args(member)[1:], entry.table)
        return None
    for member in members(entry.hint):
        if get_origin(member) is dict and isinstance(part, str):
            return Entry(get_args(member)[1], (), None)
        if get_origin(member) is tuple and isinstance(part, int):
            items = get_args(member)
            if items[-1] is Ellipsis or part < len(items):
                return Entry(items[0] if items[-1] is Ellipsis else items[part], (), None)
        if isinstance(member, type) and issubclass(member, BaseModel) and part in keys(member):
            info = member.model_fields[keys(member)[str(part)]]
            return Entry(info.annotation, tuple(info.metadata), member)
    return None


ROOT = Entry(Scene, (), None)


def entry_of(path: Sequence[str | int]) -> Entry | None:
    """The schema's entry for a whole path."""
    entry: Entry | None = ROOT
    for part in path:
        entry = step_into(entry, part) if entry else None
    return entry


def words(hint: Any) -> list[str]:
    """The words of the schema that may stand for a hint, but for those of its kinds of value."""
    hint = unwrapped(hint)
    options = [hint] if get_origin(hint) is Literal else [unwrapped(member) for member in get_args(hint)]
    return [word for option in options if get_origin(option) is Literal for word in get_args(option)]


def example(path: Sequence[str | int]) -> Any:
    """A value that may stand at the required key ``path``."""
    entry = entry_of(path)
    table = entry.table if entry else None
    examples = table.model_fields[keys(table)[str(path[-1])]].examples if table else None
    return examples[0] if examples else None


def known_keys(entry: Entry) -> list[str]:
    """The keys that may stand in the table (or tables) of an entry."""
    tables = [m for m in members(entry.hint) if isinstance(m, type) and issubclass(m, BaseModel)]
    return list(dict.fromkeys(key for table in tables for key in keys(table)))


# What keys are called elsewhere, and here: in the table of the key, or in another.
_ELSEWHERE = {
    **dict.fromkeys(("dt", "timestep", "time_step"), "step"),
    **dict.fromkeys(("duration", "t_end", "tmax", "T"), "end"),
    **dict.fromkeys(("tol", "rtol"), "tolerance"),
    **dict.fromkeys(("base", "root", "clamp"), "start"),
    **dict.fromkeys(("tip", "stop"), "finish"),
    **dict.fromkeys(("E", "EI", "B", "A", "bending_modulus", "stiffness"), "bending"),
    **dict.fromkeys(("EA", "ks", "stretch"), "stretching"),
    **dict.fromkeys(("GJ", "C", "torsion", "twist_modulus"), "twisting"),
    **dict.fromkeys(("eta", "mu", "nu"), "viscosity"),
    **dict.fromkeys(("rho",), "density"),
    **dict.fromkeys(("L", "l"), "length"),
    **dict.fromkeys(("N", "n", "points", "segments"), "nodes"),
    **dict.fromkeys(("a", "diameter"), "radius"),
    **dict.fromkeys(("domain", "size"), "box"),
    **dict.fromkeys(("grid", "resolution"), "cells"),
    **dict.fromkeys(("kT", "kBT", "temperature"), "energy"),
    **dict.fromkeys(("gravity", "g"), "weight"),
    **dict.fromkeys(("kappa", "kappa0"), "curvature"),
    **dict.fromkeys(("interval", "dt_out"), "every"),
}
_LONGEST = 60  # letters of a key that is shown, or held against others


def unknown_key(parent: Entry, path: Path) -> Fault:
    """The fault of the unknown key ``path`` in the table ``parent``; the nearest name is in ``reads``."""
    name, known = str(path[-1]), known_keys(parent)
    elsewhere = _ELSEWHERE.get(name, "")
    hint = f'; did you mean "{elsewhere}"?' if elsewhere in known else ""
    if not hint and len(name) <= _LONGEST:
        hint = suggestion(name, known)
    if not hint:
        whole = entry_of(path)  # the union of which ``parent`` is the chosen member
        where = places(name) or places(elsewhere)
        if whole is not None:
            hint = f"; {name} belongs to another kind"
        elif where:
            hint = f"; {name if places(name) else elsewhere} belongs in {' or '.join(where)}"
    near = hint.split('"')[1:2] if "did you mean" in hint else []
    allowed = ", ".join(known) if known else describe(parent.hint, parent.metadata)
    cut = path if len(name) <= _LONGEST else (*path[:-1], f"{name[:_LONGEST]} ...")
    return Fault(dotted(cut), f"an unknown key{hint}", allowed, tuple(dotted((*path[:-1], key)) for key in near))


def places(name: str) -> list[str]:
    """The tables, as paths with NAME, in which a key ``name`` is known; a few of them."""
    return [place for place in _places().get(name, ()) if place != "[]"][:3]


@cache
def _places() -> dict[str, list[str]]:
    """The tables in which each key of the schema is known."""
    found: dict[str, list[str]] = {}

    def look(entry: Entry, path: tuple[str, ...]) -> None:
        for key in known_keys(entry):
            here = found.setdefault(key, [])
            if (place := f"[{'.'.join(path)}]") not in here:
                here.append(place)
            inner = step_into(entry, key)
            if inner is None:
                continue
            kinds = members(inner.hint)
            if kinds and get_origin(kinds[0]) is dict:
                look(Entry(get_args(kinds[0])[1], (), None), (*path, key, "NAME"))
            else:
                look(inner, (*path, key))

    look(ROOT, ())
    return found


class Found(NamedTuple):
    """A fault that pydantic found; ``fault`` is None where it has been told before."""

    path: Path
    fault: Fault | None
    missing: bool


def found_by_pydantic(error: ValidationError, raw: dict[str, Any], most: int) -> list[Found]:
    """The faults in the order of the schema, each once; ``most`` of them."""
    results = [_translate(item, raw) for item in error.errors(include_url=False, include_input=False)[:most]]
    return list(dict.fromkeys(results))


def _translate(item: Any, raw: dict[str, Any]) -> Found:
    """One of pydantic's errors, with the value as it stands in the file."""
    value: Any = raw
    entry = ROOT
    path: Path = ()
    missing = item["type"] == "missing"
    for part in item["loc"]:
        chooses = _is_tag(entry, part)
        if not chooses and not isinstance(value, dict | list):
            break  # one value that stands for a list of equal ones: the fault is its own
        path = path if chooses else (*path, part)
        inner = step_into(entry, part)
        if inner is None:
            return Found(path, unknown_key(entry, path), False)
        entry = inner
        if not chooses:
            value = value[part] if isinstance(value, list) or part in value else None
    if item["type"] == "told":
        return Found(path, None, False)
    if missing:
        return Found(path, Fault(dotted(path), "nothing", entry.allowed()), True)
    if item["type"].startswith("union_tag") and isinstance(value, dict):
        return _unknown_kind(path, entry, value)
    why = item["msg"] if item["type"] == "refused" else ""
    if not why and isinstance(value, str):
        why = suggestion(value, words(entry.hint)).removeprefix("; ")
    return Found(path, Fault(dotted(path), shown(value) + (f" ({why})" if why else ""), entry.allowed()), False)


def _unknown_kind(path: Path, entry: Entry, table: dict[str, Any]) -> Found:
    kinds = [member.model_fields["kind"].default for member in members(entry.hint)]
    kind = table.get("kind")
    hint = suggestion(kind, kinds).removeprefix("; ") if isinstance(kind, str) else ""
    allowed = " or ".join(f'"{name}"' for name in kinds)
    found = shown(kind) + (f" ({hint})" if hint else "")
    return Found(path, Fault(dotted((*path, "kind")), found, allowed, (dotted(path),)), False)
