"""Reading a case: TOML, overrides, parameters, schema, checks; one frozen Case, or all faults at once."""

from __future__ import annotations

import copy
import keyword
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import BaseModel, ValidationError

from ..errors import CaseError
from .consistency.scene import check
from .defaults import fill_defaults
from .deprecated import modernise
from .expressions import (
    CONSTANTS,
    FUNCTIONS,
    VARIABLES,
    BrokenParameter,
    Expression,
    ExpressionError,
    Parameters,
    parse,
)
from .faults import Fault, Found, dotted, entry_of, example, found_by_pydantic, known_keys, shown
from .library import find
from .overrides import NAMED, Overrides, apply, pairs, plain
from .schema import Case, Scene
from .toml import load
from .values import keys

MAX_BYTES = 1_000_000
MAX_FAULTS = 100  # told at once
MAX_QUICK = 50  # quick forms
_HDF5 = b"\x89HDF"  # as every run file begins
_NAME = re.compile(r"[A-Za-z0-9_-]+")
_NUMBERS = ("value", "range", "tolerance", "absolute")  # of [expect.NAME], which its quick form may replace


FROM_PYTHON = "case from Python"  # its name in messages; files it reads lie in the present folder

Source = Case | str | Path | Mapping[str, Any]


def read_case(source: Source, overrides: Overrides = ()) -> Case:
    """The case of a file, of the name of a shipped one, of a dict as a file would hold it, or another one changed.

    ``overrides`` as on the command line, or {"time.end": 2.0, ...}: values may be arrays, None takes a key out. The
    text of the case, which a run file records, has them. Raises CaseError, one line a fault.

    >>> case = ibfil.read_case("swimmer_rft", {"time.end": 0.5})
    >>> case.time.end
    0.5
    """
    if isinstance(source, Case):
        return source.with_(overrides) if overrides else source
    if isinstance(source, Mapping):
        return parse_case(_toml(source), FROM_PYTHON, overrides)
    path = find(str(source))
    try:
        with Path(path).open("rb") as file:
            content = file.read(MAX_BYTES + 1)
        text = content.decode("utf-8-sig")
    except OSError as error:
        raise CaseError([f"{path}: cannot be read ({error.strerror})"]) from None
    except UnicodeDecodeError as error:
        found = f"not a text file (byte {error.start} is not UTF-8)"
        if content.startswith(_HDF5):
            found = "is an HDF5 file, not a case: `ibfil show` tells of a run, `ibfil run --resume` goes on with it"
        raise CaseError([f"{path}: {found}"]) from None
    return parse_case(text, str(path), overrides)


def parse_case(text: str, name: str, overrides: Overrides = ()) -> Case:
    """The case in the TOML ``text``, called ``name`` in messages; overrides as in `read_case`. Raises CaseError."""
    if len(text) > MAX_BYTES:
        raise CaseError([f"{name}: {len(text)} characters; a case has at most {MAX_BYTES}"])
    try:
        raw = load(text)
    except ValueError as error:
        raise CaseError([f"{name}: not TOML: {error}"]) from None
    raw, faults = _overridden(raw, list(pairs(overrides)))
    old = modernise(raw)
    scene, more = _read(raw)
    faults += more
    faults += _quick_faults(raw, more)
    if faults or scene is None:
        told = list(dict.fromkeys(fault.line(name) for fault in faults))
        raise CaseError(told[:MAX_FAULTS] + [f"{name}: more faults follow these"] * (len(told) > MAX_FAULTS))
    return Case.model_construct(**scene.__dict__, text=tomli_w.dumps(raw), file=name, deprecated=tuple(old))


Case.reader = parse_case


def _toml(content: Mapping[str, Any]) -> str:
    """The text of a dict. Raises CaseError for a value that TOML has not."""
    try:
        return tomli_w.dumps(plain(content))
    except TypeError as error:
        raise CaseError([f"{FROM_PYTHON}: {error}; allowed: numbers, texts, lists, arrays and dicts of them"]) from None


def quick_case(case: Case, name: str) -> Case:
    """The quick form of [expect.``name``]: the case with its ``quick`` overrides and numbers."""
    raw, _ = _quick(load(case.text), name)
    return parse_case(tomli_w.dumps(raw), case.file)


def differences(a: Case, b: Case) -> dict[str, tuple[Any, Any]]:
    """The keys, as dotted paths, whose values differ, with both; ``text`` and ``file`` are not compared."""
    return {key: (one, other) for key, one, other in _differing(a, b, ()) if key not in ("text", "file", "deprecated")}


def written(value: Any) -> str:
    """A value of a case as its file has it, or nearly."""
    if isinstance(value, Expression):
        return value.text if value.constant is None else f"{value.constant:g}"
    if isinstance(value, BaseModel):
        inner = ", ".join(f"{key} = {written(getattr(value, key))}" for key in sorted(value.model_fields_set))
        return f"{{ {inner} }}" if inner else "the default"
    if isinstance(value, tuple):
        return "[" + ", ".join(map(written, value)) + "]"
    return "nothing" if value is None else shown(value)


def _overridden(
    raw: dict[str, Any], overrides: Sequence[tuple[list[str], Any] | Fault]
) -> tuple[dict[str, Any], list[Fault]]:
    """The file's content with all overrides that can be applied, and the faults of the others."""
    faults = []
    for override in overrides:
        changed = override if isinstance(override, Fault) else apply(raw, *override)
        if isinstance(changed, Fault):
            faults.append(changed)
        else:
            raw = changed
    return raw, faults


def _read(raw: dict[str, Any]) -> tuple[Scene | None, list[Fault]]:
    """The scene of the file's content and no faults, or all the faults there are."""
    faults = list(_bad_names(raw))
    parameters = _parameters(raw.get("parameters"), faults)
    filled = copy.deepcopy(raw)
    faults += _without_names(filled)
    fill_defaults(filled, parameters)
    if isinstance(raw.get("parameters", {}), dict):
        filled["parameters"] = {key: value for key, value in parameters.items() if value is not None}
    scene, tainted = None, {fault.key for fault in faults}
    # Another look without the faulty keys, so that what does not go together is told at once too.
    for attempt in range(6):
        try:
            scene = Scene.model_validate(filled, context=parameters)
            break
        except ValidationError as error:
            for found in found_by_pydantic(error, filled, MAX_FAULTS + 1):
                if attempt == 0 and found.fault:
                    faults.append(found.fault)
                tainted.update((dotted(found.path), *(found.fault.reads if found.fault else ())))
                _prune(filled, found)
            if error.error_count() > MAX_FAULTS:
                break
    if scene is not None:
        faults += [fault for fault in check(scene) if not fault.touches(tainted)]
    meant = {key for fault in faults if "did you mean" in fault.found for key in fault.reads}
    return scene, [fault for fault in faults if not (fault.found == "nothing" and fault.key in meant)]


def _without_names(filled: dict[str, Any]) -> Iterator[Fault]:
    """Tables that have keys where they have names, [filament] for [filament.NAME]: told once, and left out."""
    for table in NAMED:
        entries = filled.get(table)
        inner = entry_of((table, "name"))
        if not isinstance(entries, dict) or inner is None or all(isinstance(v, dict) for v in entries.values()):
            continue
        loose = [key for key, value in entries.items() if not isinstance(value, dict)]
        found = f"{', '.join(loose[:3])}{' ...' if loose[3:] else ''} in [{table}] itself"
        yield Fault(table, found, f"a name of yours for each: [{table}.{NAMED[table]}]")
        own = {key: entries.pop(key) for key in list(entries) if key in loose or key in known_keys(inner)}
        entries[NAMED[table]] = own


def _bad_names(raw: dict[str, Any]) -> Iterator[Fault]:
    """Names of tables become names in files and paths of keys, so they are plain."""
    for table in ("filament", "body", "link", "observe", "expect"):
        entries = raw.get(table)
        for name in entries if isinstance(entries, dict) else ():
            if not _NAME.fullmatch(name):
                yield Fault(dotted((table, name)), f"the name {shown(name)}", "letters A-Z a-z, digits, _ and -")


def _parameters(table: Any, faults: list[Fault]) -> Parameters:
    """The values of [parameters], each an expression of earlier ones; None where one has a fault."""
    values: dict[str, float | None] = {}
    taken = {*FUNCTIONS, *CONSTANTS, *VARIABLES}
    for name, value in table.items() if isinstance(table, dict) else ():
        if len(faults) > MAX_FAULTS:
            break
        key = dotted(("parameters", name))
        if name in taken:
            what = "a function" if name in FUNCTIONS else "pi" if name in CONSTANTS else "a variable"
            faults.append(Fault(key, f"a parameter named like {what}", f"any name but {' '.join(sorted(taken))}"))
            continue
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name) or keyword.iskeyword(name):
            faults.append(Fault(key, f"the name {shown(name)}", "a letter or _, then letters, digits and _"))
            continue
        try:
            values[name] = parse(value, (), values).constant
        except BrokenParameter:
            values[name] = None
        except ExpressionError as error:
            values[name] = None
            why = f" ({error})" if isinstance(value, str) else ""
            faults.append(Fault(key, shown(value) + why, "a number or an expression of earlier parameters"))
    return values


def _prune(filled: dict[str, Any], found: Found) -> None:
    """Take the faulty key out, or put an example in where a required one is missing."""
    value: Any = filled
    table, key = filled, ""
    for part in found.path:
        if isinstance(value, dict):
            table, key = value, str(part)
            value = value.get(key)
        elif isinstance(value, list):
            value = value[int(part)]
    if found.missing and key == found.path[-1]:
        table[key] = copy.deepcopy(example(found.path))
    else:
        table.pop(key, None)


def _quick(raw: dict[str, Any], name: str) -> tuple[dict[str, Any], list[Fault]]:
    """The content of the file in the quick form of [expect.``name``], without any further one."""
    quick = raw["expect"][name].get("quick", {})
    raw = copy.deepcopy(raw)
    for entry in raw["expect"].values():
        if isinstance(entry, dict):
            entry.pop("quick", None)
    expect = raw["expect"][name]
    replaced = {key: quick[key] for key in _NUMBERS if key in quick}
    if {"value", "range"} & set(replaced):
        expect.pop("value", None), expect.pop("range", None)
    if {"tolerance", "absolute", "range"} & set(replaced):
        expect.pop("tolerance", None), expect.pop("absolute", None)
    expect.update(replaced)
    return _overridden(raw, [leaf for leaf in _leaves(quick, ()) if leaf[0][0] not in _NUMBERS])


def _leaves(table: dict[str, Any], path: tuple[str, ...]) -> Iterator[tuple[list[str], Any]]:
    """The dotted paths of a table of overrides, with their values."""
    for key, value in table.items():
        here = (*path, *key.split("."))
        if isinstance(value, dict):
            yield from _leaves(value, here)
        else:
            yield list(here), value


def _quick_faults(raw: dict[str, Any], known: Sequence[Fault]) -> Iterator[Fault]:
    """The faults of the quick forms that the case itself has not."""
    entries = raw.get("expect")
    found = [
        name
        for name, entry in (entries.items() if isinstance(entries, dict) else ())
        if isinstance(entry, dict) and isinstance(entry.get("quick"), dict) and entry["quick"]
    ]
    if len(found) > MAX_QUICK:  # each is a case of its own to read
        yield Fault("expect", f"{len(found)} tables with quick", f"at most {MAX_QUICK}")
    for name in found[:MAX_QUICK]:
        quick, faults = _quick(raw, name)
        for fault in faults + _read(quick)[1]:
            if fault not in known:
                key = f"expect.{name}.quick"
                yield Fault(key, f"an override with {fault.key}: {fault.found}", fault.allowed)


def _differing(a: Any, b: Any, path: tuple[str | int, ...]) -> Iterator[tuple[str, Any, Any]]:
    """The paths at which two descriptions differ, and what stands there in each."""
    if isinstance(a, BaseModel) and type(a) is type(b):
        names = {name: key for key, name in keys(type(a)).items()}
        for name, key in names.items():
            yield from _differing(getattr(a, name), getattr(b, name), (*path, key))
    elif isinstance(a, dict) and isinstance(b, dict):
        for key in dict.fromkeys((*a, *b)):
            yield from _differing(a.get(key), b.get(key), (*path, key))
    elif isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
        for i, (one, other) in enumerate(zip(a, b, strict=True)):
            yield from _differing(one, other, (*path, i))
    elif a != b:
        yield dotted(path), a, b
