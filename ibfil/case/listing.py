"""The schema to read: every table and key with its type, default and meaning, made from the declarations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from .expressions import CONSTANTS, FUNCTIONS, MAX_EXPONENT
from .faults import members, words
from .schema import Scene
from .values import describe, keys, plain

RULES = f"""\
A case is one TOML file. Unknown keys are errors. Any number may be a text with a constant expression of
[parameters]. An "expression of s, t" names the only variables allowed there: s is the arclength from `start`,
t the time, x y z a position, q runs from 0 to 1; in a filament with copies i is the number of a copy, from 0 on, and
phase its copies.phase; names of [parameters] may stand in every expression.
Operators: + - * / ** (the exponent a number of size <= {MAX_EXPONENT:g}), and < <= > >= in where.
Functions: {" ".join(FUNCTIONS)}. Constants: {" ".join(CONSTANTS)}.
Keys of a fluid that is not chosen are checked and do nothing. NAME is yours to choose.
"""

Tables = list[type[BaseModel]]


def schema_text() -> str:
    """Every table and key of a case file, with its default, its meaning and what it may be."""
    return "\n".join([RULES, *_keys("", [Scene])]) + "\n"


def schema_json() -> dict[str, Any]:
    """The JSON Schema of a case file."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Scene.model_json_schema()}


def _keys(path: str, tables: Tables) -> Iterator[str]:
    """The keys that are values, then the tables in it; of several kinds of table, first what all have."""
    several = len(tables) > 1
    shared = [key for key in keys(tables[0]) if all(key in keys(table) for table in tables)]
    shared = [key for key in shared if not (several and key == "kind")]
    yield from _values(tables[0], [key for key in shared if not _is_table(_info(tables[0], key))])
    inside = dict.fromkeys(shared, tables[0])
    for table in tables if several else ():
        own = [key for key in keys(table) if key not in shared and key != "kind"]
        if "kind" in table.model_fields:
            yield f'  kind = "{table.model_fields["kind"].default}": {table.model_fields["kind"].description}'
        yield from _values(table, own)
        inside = {**dict.fromkeys(own, table), **inside}
    for key, table in inside.items():
        info = _info(table, key)
        inner, form = _inner(info.annotation)
        if not inner:
            continue
        where = f"{path}.{key}" if path else key
        yield f"\n{form.format(where)}  {info.description}"
        if key == "finish":
            yield f"  the keys of [{path}.start]"
        else:
            yield from _keys(where + (".NAME" if "NAME" in form else ""), inner)


def _values(table: type[BaseModel], names: list[str]) -> Iterator[str]:
    for key in names:
        info = _info(table, key)
        default = "required" if info.is_required() else f"default {_default(info.get_default())}"
        yield f"  {key}: {info.description} ({default})"
        yield f"      {describe(info.annotation, tuple(info.metadata))}"


def default_text(info: FieldInfo) -> str:
    """The default of a key as it would stand in the file."""
    return "required" if info.is_required() else _default(info.get_default())


def _default(value: Any) -> str:
    """A default as it would stand in the file."""
    if isinstance(value, tuple):
        return "[" + ", ".join(_default(item) for item in value) + "]"
    if isinstance(value, str):
        return f'"{value}"'
    number = plain(value)
    if isinstance(number, bool):
        return str(number).lower()
    return "absent" if number is None else f"{number:g}" if isinstance(number, float) else f"{number}"


def _info(table: type[BaseModel], key: str) -> FieldInfo:
    return table.model_fields[keys(table)[key]]


def _is_table(info: FieldInfo) -> bool:
    """Whether the key is a table and nothing else."""
    return bool(_inner(info.annotation)[0]) and not words(info.annotation)


def _inner(hint: Any) -> tuple[Tables, str]:
    """The tables a key may hold, and how their heading is written."""
    found, form = [], "[{}]"
    for member in members(hint):
        found += [member]
        if get_origin(member) is dict:
            found[-1:], form = members(get_args(member)[1]), "[{}.NAME]"
        elif get_origin(member) is tuple:
            found[-1:], form = members(get_args(member)[0]), "[[{}]]"
    return [item for item in found if isinstance(item, type) and issubclass(item, BaseModel)], form
