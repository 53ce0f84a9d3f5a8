"""The base of every table of a case, and the expressions in one."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import BaseModel, ConfigDict

from .expressions import Expression, parse

ZERO = parse(0)


ORIGIN = (0.0, 0.0, 0.0)


class Table(BaseModel):
    """A table of the file: no other keys, nothing converted that is not said to be."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def expressions(value: object, path: str = "") -> Iterator[tuple[str, Expression]]:
    """The dotted path and the expression of every formula in a table, list or key; none in what is not given."""
    if isinstance(value, Expression):
        yield path, value
    elif isinstance(value, BaseModel):
        for key in type(value).model_fields:
            yield from expressions(getattr(value, key), f"{path}.{key}" if path else key)
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from expressions(inner, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list | tuple):
        for number, inner in enumerate(value):
            yield from expressions(inner, f"{path}.{number}")
