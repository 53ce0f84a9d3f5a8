"""Interval arithmetic of expressions over intervals of time: values, slopes in t, jumps. Nothing falls between samples.

Each operation bounds the value, the slope d/dt and the size of a jump of its result by those of its arguments
(interval extension of forward differentiation; Moore, Kearfott & Cloud, Introduction to Interval Analysis, SIAM 2009).
An interval of no width gives the value and the exact slope. Bounds are not rounded outwards: they steer a search, and
prove nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from typing import NamedTuple

import numpy as np

from ...case.expressions import Tree

Bounds = tuple[np.ndarray, np.ndarray]
_ONE, _HALF, _MINUS_ONE = ((np.full(1, c), np.full(1, c)) for c in (1.0, 0.5, -1.0))


class Range(NamedTuple):
    """Bounds (k, p) over k intervals of time at p places: of the value, of its slope d/dt, of the size of a jump."""

    low: np.ndarray
    high: np.ndarray
    slope_low: np.ndarray
    slope_high: np.ndarray
    jump: np.ndarray

    @property
    def value(self) -> Bounds:
        """Of the value."""
        return self.low, self.high

    @property
    def slope(self) -> Bounds:
        """Of the slope."""
        return self.slope_low, self.slope_high

    @property
    def steepest(self) -> np.ndarray:
        """The largest size of the slope."""
        return np.maximum(np.abs(self.slope_low), np.abs(self.slope_high))


def bounds(tree: Tree, begin: np.ndarray, end: np.ndarray, places: Mapping[str, np.ndarray]) -> Range:
    """The range of a tree over the intervals [begin, end] (k,), where other variables have values (p,) by name.

    Where it may have no value (1/0, sqrt(-1)) bounds are infinite.
    """
    count = max((len(values) for values in places.values()), default=1)
    shape = (len(begin), count)
    time = np.broadcast_to(begin[:, None], shape), np.broadcast_to(end[:, None], shape)
    fixed = {name: np.broadcast_to(values[None], shape) for name, values in places.items()}
    with np.errstate(all="ignore"):
        found = _Evaluation(time, fixed, np.zeros(shape)).range(tree)
    low, high, slope_low, slope_high, jump = (np.broadcast_to(part, shape) for part in found)
    lost = np.isnan(low) | np.isnan(high) | np.isnan(slope_low) | np.isnan(slope_high)
    return Range(
        np.where(lost, -np.inf, low),
        np.where(lost, np.inf, high),
        np.where(lost, -np.inf, slope_low),
        np.where(lost, np.inf, slope_high),
        np.where(np.isnan(jump), np.inf, jump),
    )


# --- intervals ----------------------------------------------------------------------------------------------------


def _add(a: Bounds, b: Bounds) -> Bounds:
    return a[0] + b[0], a[1] + b[1]


def _negative(a: Bounds) -> Bounds:
    return -a[1], -a[0]


def _times(a: Bounds, b: Bounds) -> Bounds:
    """0 times infinity is 0: a factor that is zero throughout leaves nothing."""
    products = [np.where((x == 0) | (y == 0), 0.0, x * y) for x in a for y in b]
    return np.minimum.reduce(products), np.maximum.reduce(products)


def _reciprocal(a: Bounds) -> Bounds:
    through = (a[0] <= 0) & (a[1] >= 0)
    return np.where(through, -np.inf, 1.0 / a[1]), np.where(through, np.inf, 1.0 / a[0])


def _hull(a: Bounds, b: Bounds) -> Bounds:
    return np.minimum(a[0], b[0]), np.maximum(a[1], b[1])


def _size(a: Bounds) -> np.ndarray:
    return np.maximum(np.abs(a[0]), np.abs(a[1]))


def _rising(function: Callable[[np.ndarray], np.ndarray]) -> Callable[[Bounds], Bounds]:
    return lambda a: (function(a[0]), function(a[1]))


def _even(function: Callable[[np.ndarray], np.ndarray]) -> Callable[[Bounds], Bounds]:
    """Of a function that is even and grows with the size of its argument."""

    def of(a: Bounds) -> Bounds:
        least = np.where((a[0] <= 0) & (a[1] >= 0), 0.0, np.minimum(np.abs(a[0]), np.abs(a[1])))
        return function(least), function(_size(a))

    return of


def _wave(a: Bounds, crest: float) -> Bounds:
    """Of the sine whose crest stands at ``crest``: 1 where an interval has a crest in it, -1 where a hollow."""
    low, high = np.cos(a[0] - crest), np.cos(a[1] - crest)

    def passes(phase: float) -> np.ndarray:
        return np.floor((a[1] - phase) / (2 * np.pi)) >= np.ceil((a[0] - phase) / (2 * np.pi))

    known = np.isfinite(a[0]) & np.isfinite(a[1])
    least = np.where(~known | passes(crest + np.pi), -1.0, np.minimum(low, high))
    return least, np.where(~known | passes(crest), 1.0, np.maximum(low, high))


def _sine(a: Bounds) -> Bounds:
    return _wave(a, 0.5 * np.pi)


def _cosine(a: Bounds) -> Bounds:
    return _wave(a, 0.0)


def _tangent(a: Bounds) -> Bounds:
    pole = np.floor((a[1] - 0.5 * np.pi) / np.pi) >= np.ceil((a[0] - 0.5 * np.pi) / np.pi)
    pole |= ~np.isfinite(a[0]) | ~np.isfinite(a[1])
    return np.where(pole, -np.inf, np.tan(a[0])), np.where(pole, np.inf, np.tan(a[1]))


def _power(a: Bounds, exponent: float) -> Bounds:
    if exponent == 0.0:
        return np.ones_like(a[0]), np.ones_like(a[0])
    if exponent < 0.0:
        return _reciprocal(_power(a, -exponent))
    if exponent % 2 == 0:
        return _even(lambda x: x**exponent)(a)
    return a[0] ** exponent, a[1] ** exponent


def _one_over_root(a: Bounds) -> Bounds:
    """1/sqrt(1 - x^2), the slope of asin."""
    return _reciprocal(_rising(np.sqrt)(_add(_ONE, _negative(_power(a, 2.0)))))


# Of x: the range of f(x), and that of its slope f'(x).
_SMOOTH: dict[str, tuple[Callable[[Bounds], Bounds], Callable[[Bounds], Bounds]]] = {
    "sin": (_sine, _cosine),
    "cos": (_cosine, lambda a: _negative(_sine(a))),
    "tan": (_tangent, lambda a: _add(_ONE, _power(_tangent(a), 2.0))),
    "asin": (_rising(np.arcsin), _one_over_root),
    "acos": (lambda a: (np.arccos(a[1]), np.arccos(a[0])), lambda a: _negative(_one_over_root(a))),
    "atan": (_rising(np.arctan), lambda a: _reciprocal(_add(_ONE, _power(a, 2.0)))),
    "sinh": (_rising(np.sinh), _even(np.cosh)),
    "cosh": (_even(np.cosh), _rising(np.sinh)),
    "tanh": (_rising(np.tanh), lambda a: _negative(_add(_MINUS_ONE, _power(_rising(np.tanh)(a), 2.0)))),
    "exp": (_rising(np.exp), _rising(np.exp)),
    "log": (_rising(np.log), _reciprocal),
    "sqrt": (_rising(np.sqrt), lambda a: _times(_HALF, _reciprocal(_rising(np.sqrt)(a)))),
    "abs": (_even(np.abs), lambda a: (np.where(a[0] < 0, -1.0, 1.0), np.where(a[1] > 0, 1.0, -1.0))),
}
# Of functions that jump where their argument passes 0: the values before, at and after.
_JUMPS = {"sign": (-1.0, 0.0, 1.0), "step": (0.0, 1.0, 1.0)}


# --- trees --------------------------------------------------------------------------------------------------------


class _Evaluation:
    """Evaluates trees over intervals ``time`` at ``fixed`` values of the other variables."""

    def __init__(self, time: Bounds, fixed: Mapping[str, np.ndarray], zero: np.ndarray) -> None:
        self._time, self._fixed, self._zero = time, fixed, zero

    def range(self, tree: Tree) -> Range:
        zero = self._zero
        if isinstance(tree, float):
            return Range(zero + tree, zero + tree, zero, zero, zero)
        if isinstance(tree, str):
            if tree == "t":
                return Range(*self._time, zero + 1.0, zero + 1.0, zero)
            return Range(self._fixed[tree], self._fixed[tree], zero, zero, zero)
        op, *children = tree
        if op == "where":
            return self._where(children[0], self.range(children[1]), self.range(children[2]))
        if op == "**":
            return _raised(self.range(children[0]), children[1])
        parts = [self.range(child) for child in children]
        if op in _SMOOTH:
            return _smooth(op, parts[0])
        if op in _JUMPS:
            return _jumping(op, parts[0])
        return _OPERATIONS[op](*parts)

    def _where(self, condition: tuple, yes: Range, no: Range) -> Range:
        """Both branches where the condition may be true and false, and a jump from one to the other."""
        compare, left, right = condition
        a, b = self.range(left), self.range(right)
        if compare in (">", ">="):
            a, b, compare = b, a, {">": "<", ">=": "<="}[compare]
        always = a.high < b.low if compare == "<" else a.high <= b.low
        never = a.low >= b.high if compare == "<" else a.low > b.high
        return _chosen(always, never, yes, no)


def _chosen(always: np.ndarray, never: np.ndarray, yes: Range, no: Range) -> Range:
    apart = np.maximum(np.abs(yes.high - no.low), np.abs(no.high - yes.low))
    both = Range(
        *_hull(yes.value, no.value), *_hull(yes.slope, no.slope), np.maximum(apart, np.maximum(yes.jump, no.jump))
    )
    parts = zip(yes, no, both, strict=True)
    return Range(*(np.where(always, y, np.where(never, n, b)) for y, n, b in parts))


def _minus(a: Range) -> Range:
    return Range(*_negative(a.value), *_negative(a.slope), a.jump)


def _sum(a: Range, b: Range) -> Range:
    return Range(*_add(a.value, b.value), *_add(a.slope, b.slope), a.jump + b.jump)


def _product(a: Range, b: Range) -> Range:
    slope = _add(_times(a.slope, b.value), _times(a.value, b.slope))
    jump = [np.where((x == 0) | (y == 0), 0.0, x * y) for x, y in ((_size(a.value), b.jump), (a.jump, _size(b.value)))]
    return Range(*_times(a.value, b.value), *slope, jump[0] + jump[1])


def _inverse(a: Range) -> Range:
    value = _reciprocal(a.value)
    slope = _negative(_times(a.slope, _power(value, 2.0)))
    return Range(*value, *slope, np.where(a.jump == 0, 0.0, value[1] - value[0]))


def _raised(a: Range, exponent: float) -> Range:
    value = _power(a.value, exponent)
    slope = _times(_times((np.full(1, exponent),) * 2, _power(a.value, exponent - 1.0)), a.slope)
    return Range(*value, *slope, np.where(a.jump == 0, 0.0, value[1] - value[0]))


def _smooth(op: str, a: Range) -> Range:
    of_value, of_slope = _SMOOTH[op]
    value = of_value(a.value)
    return Range(*value, *_times(of_slope(a.value), a.slope), np.where(a.jump == 0, 0.0, value[1] - value[0]))


def _jumping(op: str, a: Range) -> Range:
    before, at, after = _JUMPS[op]
    low = np.where(a.low < 0, before, np.where(a.low > 0, after, at))
    high = np.where(a.high > 0, after, np.where(a.high < 0, before, at))
    return Range(low, high, 0 * low, 0 * low, high - low)


def _lesser(a: Range, b: Range) -> Range:
    first, second = a.high < b.low, b.high < a.low
    value = np.minimum(a.low, b.low), np.minimum(a.high, b.high)
    both = Range(*value, *_hull(a.slope, b.slope), np.maximum(a.jump, b.jump))
    return Range(*(np.where(first, x, np.where(second, y, z)) for x, y, z in zip(a, b, both, strict=True)))


def _angle(y: Range, x: Range) -> Range:
    """atan2: a corner is farthest, unless the interval holds the cut, the negative x axis, or the origin."""
    corners = [np.arctan2(b, a) for b in y.value for a in x.value]
    low, high = np.minimum.reduce(corners), np.maximum.reduce(corners)
    cut = (x.low <= 0) & (y.low <= 0) & (y.high >= 0) & ((y.low < y.high) | (x.low < x.high))
    square = _add(_power(x.value, 2.0), _power(y.value, 2.0))
    turn = _add(_times(x.value, y.slope), _negative(_times(y.value, x.slope)))
    slope = _times(turn, _reciprocal(square))
    jump = np.where((x.jump == 0) & (y.jump == 0), 0.0, high - low)
    return Range(
        np.where(cut, -np.pi, low), np.where(cut, np.pi, high), *slope, np.where(cut & (y.low < 0), 2 * np.pi, jump)
    )


_OPERATIONS: dict[str, Callable[..., Range]] = {
    "+": _sum,
    "-": lambda a, b: _sum(a, _minus(b)),
    "neg": _minus,
    "*": _product,
    "/": lambda a, b: _product(a, _inverse(b)),
    "atan2": _angle,
    "min": lambda *parts: reduce(_lesser, parts),
    "max": lambda *parts: _minus(reduce(_lesser, map(_minus, parts))),
}
