"""How fast an expression changes, window by window of the run, and when it jumps: from its structure, not from samples.

The run is bisected wherever the bounds of an interval (intervals.py) leave open what happens within it, so that a pulse
is found however short it is, and a sinusoid of a million periods is one window.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ...case.expressions import Tree
from .intervals import Range, bounds

TIGHT = 1.25  # a bound that is known to be met to this factor
RESOLVED = 0.1  # of the range of values, to which it is found
STEP = 1e-6  # of the range of values: a jump below it is none
FINEST = 2.0**-40  # of the run: the shortest window
MOST = 1 << 15  # windows times places that are looked at in a level of bisection
BREAKS = 1000  # jumps that are told apart, at most
_BISECTIONS = 60
_SAMPLES = (0.0, 0.381966, 0.723607)  # of an interval: where its slopes are looked at; no part of a period
_ALIKE = 1.1  # rates of windows that may stand as one
_SHORT = 1e-9  # of the run: a window about a jump
_PLACES = 5  # at which a jump is looked at alone


@dataclass(frozen=True)
class Windows:
    """How fast a quantity changes. Windows are [edges[k], edges[k + 1]]; rates (k,) are radians a time.

    ``size`` is half its range of values, ``jumps`` (j,) the last times before it jumps, ``times`` some at which it is
    near its largest and least.
    """

    size: float
    edges: np.ndarray
    rates: np.ndarray
    jumps: np.ndarray
    times: np.ndarray

    @property
    def fastest(self) -> float:
        """The largest rate of all windows."""
        return float(np.max(self.rates))

    def over(self, size: float) -> Windows:
        """The same with rates relative to another size."""
        return replace(self, rates=self.rates * self.size / size) if size > 0 else self

    def rate(self, begin: float, end: float) -> float:
        """The largest rate of the windows that meet [begin, end]."""
        first = max(int(np.searchsorted(self.edges, begin, "right")) - 1, 0)
        last = max(int(np.searchsorted(self.edges, end, "left")), first + 1)
        return float(np.max(self.rates[first:last], initial=0.0))


class _Search:
    """Bisects [0, end] until values, slopes and jumps of a tree are known; ``largest`` caps its range of values."""

    def __init__(self, tree: Tree, end: float, places: Mapping[str, np.ndarray], largest: float) -> None:
        self.tree, self.end, self.places, self._largest = tree, end, places, largest
        self.least, self.most = np.inf, -np.inf  # sampled values (p,)
        self.low_at = self.high_at = 0.0
        self.slope = 0.0  # the largest that was sampled
        self.low, self.high = np.inf, -np.inf  # bounds of all values (p,), as far as intervals were not opened

    @property
    def size(self) -> float:
        """Half the range of the values sampled, the largest of all places; no more than what it is to be."""
        return min(0.5 * float(np.max(self.most - self.least)), self._largest)

    @property
    def whole_size(self) -> float:
        """The same of the values that bounds leave open, which for a sinusoid are those it has."""
        bounded = 0.5 * float(np.max(self.high - self.low))
        return self.size if not bounded <= (1 + RESOLVED) * self.size else min(bounded, self._largest)

    def sample(self, times: np.ndarray, found: Range) -> None:
        """Takes note of values at times (k,)."""
        values = np.where(np.isfinite(found.low), found.low, np.nan)
        if np.isfinite(values).any():
            low, high = np.fmin.reduce(values, axis=0), np.fmax.reduce(values, axis=0)
            if np.nanmin(low) < np.min(self.least):
                self.low_at = times[int(np.nanargmin(np.fmin.reduce(values, axis=1)))]
            if np.nanmax(high) > np.max(self.most):
                self.high_at = times[int(np.nanargmax(np.fmax.reduce(values, axis=1)))]
            self.least, self.most = np.fmin(self.least, low), np.fmax(self.most, high)

    def look(self, begin: np.ndarray, end: np.ndarray) -> tuple[Range, np.ndarray]:
        """The ranges over intervals (k,), and the steepest slopes (k,) at some points within."""
        times = np.concatenate([begin + part * (end - begin) for part in _SAMPLES])
        found = bounds(self.tree, np.append(begin, times), np.append(end, times), self.places)
        k = len(begin)
        whole, points = Range(*(part[:k] for part in found)), Range(*(part[k:] for part in found))
        self.sample(times, points)
        steepest = np.where(np.isfinite(points.steepest), points.steepest, 0.0)
        return whole, np.max(steepest.reshape(len(_SAMPLES), k, -1), axis=(0, 2))

    def run(self, jumps: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Windows (k,) by their begins and ends, the steepest slope in each, and whether it may hold a jump.

        ``jumps``: they are to be found; else windows that may hold some stay as they are.
        """
        begin, end = np.zeros(1), np.full(1, self.end)
        done: list[tuple[np.ndarray, ...]] = []
        cuts = np.linspace(0.0, self.end, 9)
        self.look(cuts[:-1], cuts[1:])
        while len(begin):
            found, met = self.look(begin, end)
            self.slope = max(self.slope, float(np.max(met)))
            steepest, jump = np.max(found.steepest, axis=1), np.max(found.jump, axis=1) > STEP * max(self.size, 1e-300)
            open_ = self._open(found, steepest, met, end - begin) | (jump & jumps)
            middle = 0.5 * (begin + end)
            fine = (end - begin <= FINEST * self.end) | (middle <= begin) | (middle >= end)
            full = 2 * np.count_nonzero(open_ & ~fine) * found.low.shape[1] > MOST
            closed = ~open_ | fine | full
            # What stays open (too many windows) is as steep as the many samples found, or its bound if that is less.
            known = np.where(open_, np.minimum(steepest, TIGHT * self.slope), steepest)
            known = np.where(fine & ~jump & open_, met, known)
            known = np.where(np.isfinite(known), known, met)
            self.low = np.fmin(self.low, np.min(found.low[closed], axis=0, initial=np.inf))
            self.high = np.fmax(self.high, np.max(found.high[closed], axis=0, initial=-np.inf))
            done.append((begin[closed], end[closed], known[closed], jump[closed]))
            begin, middle, end = begin[~closed], middle[~closed], end[~closed]
            begin, end = np.concatenate([begin, middle]), np.concatenate([middle, end])
        parts = [np.concatenate(column) for column in zip(*done, strict=True)]
        order = np.argsort(parts[0], kind="stable")
        return tuple(part[order] for part in parts)  # type: ignore[return-value]

    def _open(self, found: Range, steepest: np.ndarray, met: np.ndarray, width: np.ndarray) -> np.ndarray:
        """Whether an interval may still hide values or slopes that matter."""
        room = RESOLVED * np.max(self.most - self.least)
        values = np.max(np.maximum(found.high - self.most, self.least - found.low), axis=1) > room
        slopes = (steepest > TIGHT * met) & (steepest * width > self.size)
        return np.asarray((values & (steepest > 0)) | slopes)


def windows(tree: Tree, end: float, places: Mapping[str, np.ndarray], largest: float = np.inf) -> Windows:
    """The windows of a tree over [0, end]; variables beside t have values (p,) by name.

    Rates are slopes over half the range of values, and over ``largest`` at the most. A quantity that jumps between
    levels changes as fast as its shortest stay at one of them is half a period.
    """
    search = _Search(tree, end, places, largest)
    alone = max((len(values) for values in places.values()), default=1) == 1
    begin, finish, slope, jump = search.run(alone)
    times, size = np.array([search.low_at, search.high_at]), search.whole_size
    if not (np.isfinite(size) and size > 1e-12 * max(np.max(np.abs(search.most)), 1e-300)):
        return Windows(0.0, np.array([0.0, end]), np.zeros(1), np.zeros(0), times)
    rates = np.where(jump & alone, 0.0, slope / size)
    smooth = Windows(size, *_merged(np.append(begin, finish[-1]), rates), np.zeros(0), times)
    if not jump.any():
        return smooth
    if not alone:
        return _over_places(tree, end, places, largest, smooth)
    groups = _groups(begin[jump], finish[jump])
    stays = _stays(groups, end)
    if len(groups) > BREAKS:
        return Windows(size, smooth.edges, np.maximum(smooth.rates, np.pi / np.min(stays)), np.zeros(0), times)
    for (_, left), (right, _), stay in zip([(0.0, 0.0), *groups], [*groups, (end, end)], stays, strict=True):
        inside = (begin >= left) & (finish <= right)
        rates[inside] = np.maximum(rates[inside], np.pi / stay)
    return Windows(size, *_merged(np.append(begin, finish[-1]), rates), _last_before(search, groups), times)


def _merged(edges: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same windows with fewer of them: one that is as fast as the one before, or is too short to count, goes."""
    keep = [0]
    for k in range(1, len(rates)):
        last = keep[-1]
        if rates[k] == 0.0 and edges[k + 1] - edges[k] < _SHORT * edges[-1]:
            continue
        if not rates[last] / _ALIKE <= rates[k] <= rates[last]:
            keep.append(k)
    return np.append(edges[keep], edges[-1]), rates[keep]


def _over_places(tree: Tree, end: float, places: Mapping[str, np.ndarray], largest: float, smooth: Windows) -> Windows:
    """The windows of a tree that jumps, ``smooth`` without its jumps, from those at a few places alone.

    Jumps that come at the same time everywhere are jumps; others travel, and no step can end at them all.
    """
    count = max(len(values) for values in places.values())
    some = sorted({round(k * (count - 1) / (_PLACES - 1)) for k in range(_PLACES)})
    found = [windows(tree, end, {n: v[[min(k, len(v) - 1)]] for n, v in places.items()}, largest) for k in some]
    jumping = [one for one in found if len(one.jumps)]
    first = jumping[0].jumps if jumping else np.zeros(0)
    if all(len(one.jumps) == len(first) and np.allclose(one.jumps, first, rtol=1e-9) for one in jumping):
        steep = max(jumping, key=lambda one: one.fastest, default=smooth)
        rates = np.maximum(smooth.rates, [steep.rate(a, b) for a, b in pairwise(smooth.edges)])
        return replace(smooth, rates=rates, jumps=first)
    fastest = max(smooth.fastest, *(one.fastest for one in found))
    return replace(smooth, edges=np.array([0.0, end]), rates=np.array([fastest]))


def _groups(begin: np.ndarray, end: np.ndarray) -> list[tuple[float, float]]:
    """Windows that may hold a jump, those that touch as one."""
    out: list[tuple[float, float]] = []
    for a, b in zip(begin.tolist(), end.tolist(), strict=True):
        if out and a <= out[-1][1]:
            out[-1] = (out[-1][0], b)
        else:
            out.append((a, b))
    return out


def _stays(groups: list[tuple[float, float]], end: float) -> np.ndarray:
    """How long a quantity stays between jumps, before the first and after the last; those at the rims are whole ones.

    A run may begin and end within a stay, so the first and the last count as no shorter than their neighbour.
    """
    if not groups:
        return np.zeros(0)
    edges = np.array([0.0, *(0.5 * (a + b) for a, b in groups), end])
    stays = np.diff(edges)
    if len(groups) == 1:
        return np.full(2, np.inf)
    stays[0], stays[-1] = stays[1], stays[-2]
    return stays


def _last_before(search: _Search, groups: list[tuple[float, float]]) -> np.ndarray:
    """The last times (j,) before the first jump within each of some intervals, to rounding."""
    begin, end = np.array(groups).T
    for _ in range(_BISECTIONS):
        middle = 0.5 * (begin + end)
        inside = (begin < middle) & (middle < end)
        if not inside.any():
            break
        first = bounds(search.tree, begin, middle, search.places)
        early = np.max(first.jump, axis=1) > STEP * search.size
        begin, end = np.where(inside & ~early, middle, begin), np.where(inside & early, middle, end)
    return begin
