"""The period with which a scene is driven: proposed by the structure of its expressions, decided by their values.

Sines, cosines and tangents whose argument is linear in t propose a period; so does a steady spin. Whether the
expressions repeat after it, and from when on (a soft start is over at some time), their values over the run tell, and
whether they repeat sooner.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache, reduce
from math import gcd, lcm
from typing import NamedTuple

import numpy as np

from ...case.expressions import Tree, of_tree

SAME = 1e-6  # of the range of values: the values after a period are the same
LARGEST_RATIO = 60  # of two periods' whole multiples that still have a common period
SOONER = 24  # parts of a period that may be one
PERIODS = 4  # over which expressions are compared at least
SAMPLES = 2000  # times at which values are compared
_PLACES = 5  # and places
_GOLDEN = 0.5 * (5**0.5 - 1)

Sampled = tuple[Tree, Mapping[str, np.ndarray]]  # a tree, and the values (p,) of its variables beside t
_Plain = tuple[Tree, tuple[tuple[str, bytes], ...]]  # the same, as a key of what is known


class Period(NamedTuple):
    """The scene repeats itself after ``length`` from the time ``since`` on."""

    length: float
    since: float


def common_period(drives: Sequence[Sampled], turns: Sequence[float], end: float) -> Period | None:
    """The period of expressions that use t, and of ends that turn at steady rates; None where they have none.

    They are compared up to ``end``, and over some periods at least. Runs of a study ask it of the same expressions.
    """
    plain = tuple((tree, tuple((name, v.tobytes()) for name, v in places.items())) for tree, places in drives)
    return _common_period(plain, tuple(turns), float(end))


@lru_cache(maxsize=64)
def _common_period(plain: tuple[_Plain, ...], turns: tuple[float, ...], end: float) -> Period | None:
    """The same, of drives whose values are bytes."""
    drives = [(tree, {name: np.frombuffer(values) for name, values in places}) for tree, places in plain]
    lengths = [
        np.pi / abs(rate) if half else 2 * np.pi / abs(rate) for tree, _ in drives for rate, half in _rates(tree)
    ]
    whole = _multiple([*lengths, *(2 * np.pi / abs(rate) for rate in turns)])
    if whole is None or whole <= 0.0:
        return None
    end = max(end, PERIODS * whole)
    since = _since(drives, whole, end)
    if since + 2 * whole > end:
        return None
    if not turns:
        for parts in range(SOONER, 1, -1):
            if _since(drives, whole / parts, end) <= since + whole:
                return Period(whole / parts, since)
    return Period(whole, since)


def _rates(tree: Tree) -> Iterator[tuple[float, bool]]:
    """The angular rates of all sines, cosines and tangents of a tree that are linear in t; True with tangents'."""
    if not isinstance(tree, tuple):
        return
    op, *children = tree
    if op in ("sin", "cos", "tan"):
        rate = _slope(children[0])
        if rate:
            yield rate, op == "tan"
            return
    for child in children:
        if isinstance(child, tuple):
            yield from _rates(child)


def repeats(tree: Tree) -> bool:
    """Whether a tree has a sine, cosine or tangent of t in it, so that it may go on changing for ever."""
    if not isinstance(tree, tuple):
        return False
    if tree[0] in ("sin", "cos", "tan"):
        return "t" in of_tree(tree).variables
    return any(repeats(child) for child in tree[1:])


def _slope(tree: Tree) -> float | None:
    """The slope in t of a tree that is linear in it, the same everywhere; None where it is not."""
    if not isinstance(tree, tuple):
        return 1.0 if tree == "t" else 0.0
    op, *children = tree
    if "t" not in of_tree(tree).variables:
        return 0.0
    slopes = [_slope(child) for child in children] if op in ("+", "-", "*", "/", "neg") else [None]
    known = [slope for slope in slopes if slope is not None]
    if len(known) < len(slopes):
        return None
    first, *rest = known
    if op == "neg":
        return -first
    if op in ("+", "-"):
        return first + rest[0] if op == "+" else first - rest[0]
    left, right = children
    if isinstance(right, float):
        return first * right if op == "*" else first / right
    return left * rest[0] if op == "*" and isinstance(left, float) else None


def _multiple(lengths: Sequence[float]) -> float | None:
    """The least common multiple of periods; None where they have none, or there is no period."""
    if not lengths:
        return None
    ratios = [Fraction(length / lengths[0]).limit_denominator(LARGEST_RATIO) for length in lengths]
    for ratio, length in zip(ratios, lengths, strict=True):
        if ratio == 0 or abs(float(ratio) * lengths[0] / length - 1.0) > 1e-9:
            return None
    times = Fraction(lcm(*(r.numerator for r in ratios)), reduce(gcd, (r.denominator for r in ratios)))
    return float(times) * lengths[0]


def _since(drives: Sequence[Sampled], period: float, end: float) -> float:
    """The time from which on all repeat after ``period``, to their end; that end where they never do."""
    if not end > period:
        return end
    # At no even distance, which some period might be a part of.
    times = (end - period) * np.sort(np.append(0.0, np.arange(1, SAMPLES) * _GOLDEN % 1.0))
    last = -1
    for tree, places in drives:
        function = of_tree(tree).bind("t", *places)
        before, after = (_values(function, at, places) for at in (times, times + period))
        size = float(np.max(np.ptp(np.concatenate([before, after]), axis=0)))
        other = ~(np.max(np.abs(after - before), axis=1) <= SAME * size)
        # A jump may fall between the two by rounding: values that differ at one time alone do not tell.
        other[1:-1] &= other[:-2] | other[2:]
        if other.any():
            last = max(last, int(np.flatnonzero(other)[-1]))
    if last == len(times) - 1:
        return end
    return 0.0 if last < 0 else float(times[last + 1])


def _values(function: Callable[..., np.ndarray], times: np.ndarray, places: Mapping[str, np.ndarray]) -> np.ndarray:
    """The values (k, p) at times (k,) and at some of the places."""
    count = max((len(values) for values in places.values()), default=1)
    some = sorted({round(k * (count - 1) / (_PLACES - 1)) for k in range(_PLACES)})
    columns = [np.ascontiguousarray(np.broadcast_to(v, count)[some]) for v in places.values()]
    return np.asarray(function(*np.broadcast_arrays(times[:, None], *(column[None] for column in columns))))
