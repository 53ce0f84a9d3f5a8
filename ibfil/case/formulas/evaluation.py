"""A checked tree as a function of arrays, by NumPy.

The function is Python that is written from the tree: names of variables, numbers, and functions of the list below,
never a text of a user's. No state is kept between two calls, so any threads may call it at the same time. For short
arrays a call takes some microseconds.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, reduce
from typing import Any

import numpy as np


def _power(x: Any, count: int) -> Any:
    """x times itself, ``count`` of them: as exact as a power, and several times as fast."""
    product = None
    while count:
        if count & 1:
            product = x if product is None else product * x
        count >>= 1
        x = x * x if count else x
    return np.ones_like(x) if product is None else product


_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "sinh": np.sinh,
    "cosh": np.cosh,
    "tanh": np.tanh,
    "exp": np.exp,
    "log": np.log,
    "sqrt": np.sqrt,
    "abs": np.abs,
    "sign": np.sign,
    "min": lambda *values: reduce(np.minimum, values),
    "max": lambda *values: reduce(np.maximum, values),
    "where": np.where,
    "step": lambda x: np.where(x < 0.0, 0.0, 1.0),
    "power": np.power,
    "product": _power,
}


@lru_cache(maxsize=256)
def function_of(tree: Any, names: tuple[str, ...]) -> Callable[..., np.ndarray]:
    """The function of ``names``, all of which the tree uses: floats or arrays in, an array of their shape out."""
    source = f"lambda {', '.join(names)}: {_source(tree)}"
    whole: Callable[..., Any] = eval(source, {"__builtins__": {}, **_FUNCTIONS})
    alone = isinstance(tree, str)

    @np.errstate(all="ignore")
    def function(*given: Any) -> np.ndarray:
        found = np.asarray(whole(*[np.asarray(value, float)[()] for value in given]))
        return found.copy() if alone else found

    return function


def _source(tree: Any) -> str:
    """The tree as Python, every operation in brackets."""
    if not isinstance(tree, tuple):
        return tree if isinstance(tree, str) else f"({tree!r})"
    op, *children = tree
    if op == "**":
        return _source_of_power(_source(children[0]), children[1])
    parts = [_source(child) for child in children]
    if op == "neg":
        return f"(-{parts[0]})"
    return f"{op}({', '.join(parts)})" if op in _FUNCTIONS else f"({parts[0]}{op}{parts[1]})"


def _source_of_power(base: str, exponent: float) -> str:
    if exponent == 0.5:
        return f"sqrt({base})"
    if not exponent.is_integer():
        return f"power({base}, {exponent!r})"
    product = f"product({base}, {int(abs(exponent))})"
    return product if exponent >= 0 else f"(1.0/{product})"
