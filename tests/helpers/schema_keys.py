"""Every key of the schema, found by walking its models, with values of it that are wrong; and the faults of a scene."""

from __future__ import annotations

import copy
import re
import types
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

import pytest
import tomli_w
from pydantic import BaseModel

from ibfil.case.reading import parse_case
from ibfil.case.schema import Scene
from ibfil.case.values import Formula, Kind, Listed, Number, Place, Whole
from ibfil.errors import CaseError

SCENE: dict[str, Any] = {
    "filament": {"rod": {"length": 1.0, "nodes": 41, "bending": 1.0, "stretching": 1e4}},
    "fluid": {"model": "rft", "viscosity": 1.0},
    "time": {"end": 1.0},
    "output": {"every": 0.1},
}


def fault_lines(scene: dict[str, Any], *overrides: str) -> list[str]:
    with pytest.raises(CaseError) as caught:
        parse_case(tomli_w.dumps(scene), "bad.toml", overrides)
    assert str(caught.value).splitlines() == caught.value.faults, "one line each"
    return caught.value.faults


class Key(NamedTuple):
    """A key: its path, its hint and metadata, and a scene in which its table stands with all it needs."""

    path: tuple[str, ...]
    hint: Any
    metadata: tuple[Any, ...]
    scene: dict[str, Any]


def bare(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    """A hint without Annotated and None, and what Annotated said."""
    if get_origin(hint) is Annotated:
        inner, said = bare(get_args(hint)[0])
        return inner, (*said, *get_args(hint)[1:])
    if get_origin(hint) in (Union, types.UnionType):
        members = [m for m in get_args(hint) if m is not types.NoneType]
        if len(members) == 1:
            return bare(members[0])
    return hint, ()


def tables(hint: Any) -> list[type[BaseModel]]:
    """The tables a hint may be."""
    hint, _ = bare(hint)
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        return [hint]
    if get_origin(hint) in (Union, types.UnionType):
        return [table for member in get_args(hint) for table in tables(member)]
    return []


def needed(table: type[BaseModel]) -> dict[str, Any]:
    """A table with its required keys, from the examples that stand in the schema."""
    content = {info.alias or n: info.examples[0] for n, info in table.model_fields.items() if info.is_required()}
    kind = table.model_fields.get("kind")
    return content if kind is None or kind.is_required() else {"kind": kind.default, **content}


def put(scene: dict[str, Any], path: tuple[str, ...], value: Any) -> dict[str, Any]:
    """A copy of the scene with the key set."""
    scene = copy.deepcopy(scene)
    location: Any = scene
    for part in path[:-1]:
        location = location[int(part)] if isinstance(location, list) else location.setdefault(part, {})
    location[path[-1]] = value
    return scene


def walk(table: type[BaseModel], path: tuple[str, ...], scene: dict[str, Any]):
    """All keys from ``table`` on, which stands at ``path`` in ``scene``."""
    for name, info in table.model_fields.items():
        key = (*path, info.alias or name)
        hint, said = bare(info.annotation)
        inner = tables(hint)
        if get_origin(hint) is dict and tables(get_args(hint)[1]):
            entry = "rod" if name == "filaments" else "x"
            for model in tables(get_args(hint)[1]):
                start = scene if entry == "rod" else put(scene, (*key, entry), needed(model))
                yield from walk(model, (*key, entry), start)
        elif get_origin(hint) is tuple and tables(get_args(hint)[0]):
            (model,) = tables(get_args(hint)[0])
            if (info.examples or [None])[0]:
                yield from walk(model, (*key, "0"), put(scene, key, info.examples[0]))
            else:
                yield from walk(model, (*key, "0"), put(scene, key, [needed(model)]))
        else:
            if name != "parameters":
                yield Key(key, hint, (*said, *info.metadata), scene)
            for model in inner:
                given = SCENE[key[0]] if key[-1:] == key and key[0] in SCENE else needed(model)
                yield from walk(model, key, put(scene, key, given))


KEYS = {".".join(key.path) + f" {i}": key for i, key in enumerate(walk(Scene, (), SCENE))}
each_key = pytest.mark.parametrize("key", KEYS.values(), ids=KEYS)


def kind_of(key: Key) -> Kind | None:
    return next((item for item in key.metadata if isinstance(item, Kind)), None)


def literals(hint: Any) -> tuple[Any, ...]:
    hint, _ = bare(hint)
    if get_origin(hint) in (Union, types.UnionType):
        return tuple(word for member in get_args(hint) for word in literals(member))
    return get_args(hint) if get_origin(hint) is Literal else ()


def wrong_types(key: Key) -> list[Any]:
    """Values of types the key does not take, those among them that a lax reader would convert."""
    kind = kind_of(key)
    if isinstance(kind, Whole):
        return [True, 41.0, 5.5, [], {}]
    if isinstance(kind, Place):
        return [True, {}, [1], [1, 2, 3], [1, True]]
    if isinstance(kind, Number | Formula):
        return [True, False, [1.0], {"a": 1}]
    if tables(key.hint) or get_origin(key.hint) is dict:
        switch = bool in [bare(member)[0] for member in get_args(bare(key.hint)[0])]
        return [3, [1], *([] if switch else [True]), *([] if literals(key.hint) else ["word"])]
    if get_origin(key.hint) is tuple:
        repeat = any(isinstance(item, Listed) and item.repeat for item in key.metadata)
        length = next(item for item in key.metadata if isinstance(item, Listed)).length
        return [True, {"a": 1}, *([] if repeat else [1, "1"]), *([[1] * (length + 1)] if length else [])]
    if literals(key.hint):
        return [1, True, ["x"], {}]
    return {str: [1, 1.5, True, ["x"], {}], bool: [1, 0, "true", []]}[key.hint]


def out_of_range(key: Key) -> list[Any]:
    """Values of the right type that are not allowed."""
    kind = kind_of(key)
    if isinstance(kind, Number):
        over = [float("inf"), float("nan"), 10**400]
        low = kind.low
        return over if low is None else [*over, low - 1.0, f"{low} - 1", *([low, f"{low}*1"] if kind.open else [])]
    if isinstance(kind, Whole):
        return [7, -1, "7"] if kind.choices else [kind.low - 1, f"{kind.low} - 1", "5.5"]
    if isinstance(kind, Formula):
        return [float("inf"), float("nan")]
    if isinstance(kind, Place):
        return [-1, [2, 1], [-1, 1], [1, 1]]
    if tables(key.hint):
        return []
    return ["no such word", ""] if literals(key.hint) else []


def bad_expressions(key: Key) -> list[str]:
    if kind_of(key) is None:
        return []
    return ["1 +", "nosuchname", "sin", "9**9**9", "1/0", "__import__('os')", "(1).real", "", "w*2"]


def found_line(lines: list[str], path: tuple[str, ...], value: Any) -> str:
    """The line of the fault at ``path``; it must say what was found and what is allowed."""
    name = ".".join(path)
    where = rf"bad\.toml: {re.escape(name)}(\.\w+)?: found "
    found = [line for line in lines if re.match(where, line)]
    assert found, (path, value, lines)
    (what, allowed) = found[0].split("; allowed: ", 1)
    assert len(what) > len(f"bad.toml: {name}: found ")
    assert len(allowed) > 3
    return found[0]
