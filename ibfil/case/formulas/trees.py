"""Checked trees of expressions: their functions, and the walks that work out, change and write them."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

MAX_EXPONENT = 16.0

# A number; a variable's name; (operator or function, arguments ...); (comparison, left, right) in where
Tree = float | str | tuple[Any, ...]


class ExpressionError(ValueError):
    """A fault of an expression, as a clause that fits in brackets."""


def _sign(x: float) -> float:
    return float((x > 0.0) - (x < 0.0))


def _step(x: float) -> float:
    return 0.0 if x < 0.0 else 1.0


class _Function(NamedTuple):
    """One function: its least and largest number of arguments, its value."""

    least: int
    most: int
    value: Callable[..., float]


FUNCTIONS: dict[str, _Function] = {
    "sin": _Function(1, 1, math.sin),
    "cos": _Function(1, 1, math.cos),
    "tan": _Function(1, 1, math.tan),
    "asin": _Function(1, 1, math.asin),
    "acos": _Function(1, 1, math.acos),
    "atan": _Function(1, 1, math.atan),
    "atan2": _Function(2, 2, math.atan2),
    "sinh": _Function(1, 1, math.sinh),
    "cosh": _Function(1, 1, math.cosh),
    "tanh": _Function(1, 1, math.tanh),
    "exp": _Function(1, 1, math.exp),
    "log": _Function(1, 1, math.log),
    "sqrt": _Function(1, 1, math.sqrt),
    "abs": _Function(1, 1, abs),
    "sign": _Function(1, 1, _sign),
    "min": _Function(2, 8, min),
    "max": _Function(2, 8, max),
    "where": _Function(3, 3, lambda chosen, yes, no: yes if chosen else no),
    "step": _Function(1, 1, _step),  # 0 below 0, 1 from 0 on
}
BINARY: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
}
COMPARE: dict[type[ast.cmpop], str] = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="}
_VALUES: dict[str, Callable[..., float | bool]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "**": math.pow,
    "neg": lambda a: -a,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    **{name: function.value for name, function in FUNCTIONS.items()},
}


def replaced(tree: Tree, values: Mapping[str, float]) -> Tree:
    """The tree with numbers in place of some variables."""
    if isinstance(tree, tuple):
        return (tree[0], *(replaced(child, values) for child in tree[1:]))
    return values.get(tree, tree) if isinstance(tree, str) else tree


def fold(tree: Tree) -> Tree:
    """The tree with its constant parts worked out; of a where with a constant condition, the branch."""
    if not isinstance(tree, tuple):
        return tree
    op, *children = tree
    if op == "where":
        _, left, right = children[0]
        left, right = fold(left), fold(right)
        if isinstance(left, float) and isinstance(right, float):
            return fold(children[1 if _VALUES[children[0][0]](left, right) else 2])
        return (op, (children[0][0], left, right), fold(children[1]), fold(children[2]))
    children = [fold(child) for child in children]
    if op == "/" and children[1] == 0.0:
        raise ExpressionError("division by zero")
    if op == "**" and not (isinstance(children[1], float) and abs(children[1]) <= MAX_EXPONENT):
        raise ExpressionError(f"an exponent must be a number, at most {MAX_EXPONENT:g} in size")
    if all(isinstance(child, float) for child in children):
        return _apply(op, children)
    return (op, *children)


def _apply(op: str, values: list[float]) -> float:
    """One operation on numbers; ExpressionError where it has no finite value."""
    try:
        result = float(_VALUES[op](*values))
    except (ValueError, ZeroDivisionError, OverflowError):
        result = math.nan
    if not math.isfinite(result):
        shown = f" {op} ".join(f"{v:.6g}" for v in values) if op in BINARY.values() else f"{op}({values[0]:.6g})"
        raise ExpressionError(f"{shown} has no finite value")
    return result


def value_of(tree: Tree, values: Mapping[str, float]) -> float:
    """The value of the tree by ``math``, where each variable has the given value."""
    if isinstance(tree, float):
        return tree
    if isinstance(tree, str):
        return float(values[tree])
    op, *children = tree
    if op == "where":
        compare, left, right = children[0]
        chosen = _VALUES[compare](value_of(left, values), value_of(right, values))
        return value_of(children[1 if chosen else 2], values)
    return _apply(op, [value_of(child, values) for child in children])


def leaves(tree: Tree) -> Iterator[float | str]:
    """The numbers and variables of the tree."""
    if isinstance(tree, tuple):
        for child in tree[1:]:
            yield from leaves(child)
    else:
        yield tree


def text_of(tree: Tree) -> str:
    """The tree as a text that `parse` reads, every operation in brackets."""
    if not isinstance(tree, tuple):
        return tree if isinstance(tree, str) else f"({tree!r})"
    op, *children = tree
    parts = [text_of(child) for child in children]
    if op == "neg":
        return f"(-{parts[0]})"
    return f"{op}({', '.join(parts)})" if op in FUNCTIONS else f"({parts[0]}{op}{parts[1]})"
