"""The base of every table of a case, and the expressions in one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from pydantic import BaseModel, ConfigDict

from .expressions import Expression, parse

ZERO = parse(0)


ORIGIN = (0.0, 0.0, 0.0)


class Table(BaseModel):
    """A table of the file: no other keys, nothing converted that is not said to be."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{name}: a case does not change; one with other values is case.with_({{...}})")


def changed(value: Any, change: Callable[[Expression], Expression]) -> Any:
    """A table, list or key with every formula in it changed; the same object where no formula is."""
    if isinstance(value, Expression):
        return change(value)
    if isinstance(value, tuple):
        items = [changed(item, change) for item in value]
        return value if all(a is b for a, b in zip(items, value, strict=True)) else tuple(items)
    if isinstance(value, BaseModel):
        inner = {key: changed(getattr(value, key), change) for key in type(value).model_fields}
        new = {key: item for key, item in inner.items() if item is not getattr(value, key)}
        return value.model_copy(update=new) if new else value
    return value


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
