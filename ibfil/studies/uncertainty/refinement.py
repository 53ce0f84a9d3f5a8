"""The errors of the step and of the nodes: coarse levels first, finer ones where they do not settle it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from ..estimates import Estimate, estimate
from .levels import Base, Direction, level_member
from .numbers import Numbered, Numbers
from .results import Source

if TYPE_CHECKING:
    from ...io.reader import RunFile
    from ..member import Member

COARSE, FINE = (-1, 0, 1), (0, 1, 2)


class Ladder:
    """The levels of a base, run as they are needed."""

    def __init__(
        self,
        base: Base,
        recorded: Numbered,
        make: Callable[[Sequence[Member]], None],
        run: Callable[[Member], RunFile | None],
        why: Callable[[Member], str],
    ) -> None:
        self._base, self._make, self._run, self._why = base, make, run, why
        self._recorded, self._keys, self._scales = recorded, tuple(recorded.numbers()), recorded.scales()
        self._known: dict[tuple[str, int], tuple[Numbers, float, str]] = {}

    def climb(self, direction: Direction, fine: bool, beside: Sequence[Member] = ()) -> bool:
        """Run the levels of a direction, with other members ``beside`` them; whether the coarse ones settled it."""
        first = FINE if fine or not direction.coarser else COARSE
        self._make([*(self._member(direction, k) for k in first), *beside])
        settled = first == COARSE and self._settled(direction)
        if not settled and first == COARSE and direction.finest:
            self._make([self._member(direction, 2)])
        return settled

    def sources(self, direction: Direction) -> dict[str, Source]:
        """The estimate of each number in a direction."""
        return {key: self._source(direction, key) for key in self._keys}

    def _member(self, direction: Direction, level: int) -> Member:
        return level_member(self._base, direction, level)

    def _level(self, direction: Direction, level: int) -> tuple[Numbers, float, str] | None:
        """The numbers, the size and the words of a level; None where it was not run, or failed."""
        at = direction.name, level
        if at not in self._known:
            run = self._run(self._member(direction, level))
            if run is None:
                return None
            self._known[at] = self._recorded.of(run).numbers(), direction.size(run), direction.words(run)
        return self._known[at]

    def _estimate(self, direction: Direction, key: str, levels: Sequence[int]) -> Estimate | None:
        """That of three levels for the base; None where one is not there."""
        found = [self._level(direction, k) for k in levels]
        known = [one for one in found if one is not None]
        if len(known) < 3:
            return None
        sizes = [size for _, size, _ in known]
        if not sizes[0] >= sizes[1] >= sizes[2]:
            return None
        values = [numbers[key] for numbers, _, _ in known]
        return estimate(values, sizes, direction.nominal, levels.index(0), _scale(values, self._scales[key]))

    def _settled(self, direction: Direction) -> bool:
        """Whether the coarse levels settle every number."""
        found = [self._estimate(direction, key, COARSE) for key in self._keys]
        return all(one is not None and (one.settled or one.error != one.error) for one in found)

    def _source(self, direction: Direction, key: str) -> Source:
        """The coarse levels' estimate where it settles the matter, else the fine ones', else what there is."""
        coarse, fine = (self._estimate(direction, key, levels) for levels in (COARSE, FINE))
        told = coarse if coarse is not None and (coarse.settled or fine is None) else fine
        if told is None:
            told = self._pair(direction, key)
        if told is None:
            lost = next(self._why(self._member(direction, k)) for k in (0, 1, -1, 2) if not self._level(direction, k))
            return Source(direction.name, True, None, lost)
        return Source(direction.name, True, told, self._words(direction, key, told))

    def _pair(self, direction: Direction, key: str) -> Estimate | None:
        """From the base and one finer level: their distance, and twice that in doubt."""
        finer = self._level(direction, 1) or self._level(direction, 2)
        if finer is None:
            return None
        own = self._level(direction, 0)
        if own is None:
            return None
        apart = own[0][key] - finer[0][key]
        return Estimate(apart, 2 * abs(apart), None, "two levels", (own[0][key], finer[0][key]))

    def _words(self, direction: Direction, key: str, told: Estimate) -> str:
        """The levels and what they show, in words."""
        if told.word == "seen":
            return f"order {told.order:.2f} ({direction.nominal:g})"
        if told.word == "round-off":
            return "round-off"
        levels = [self._level(direction, k) for k in (*COARSE, 2)]
        shown = ", ".join(f"{one[2].split()[0]} {one[0][key]:.5g}" for one in levels if one is not None)
        order = "" if told.order is None or told.word == "unseen" else f", order {told.order:.2f}"
        word = {"unseen": "no order", "low": "a low order", "fast": "a high order"}.get(told.word, told.word)
        return f"{word}{order}: {shown}"


def _scale(values: Sequence[float], change: float) -> float:
    """The measure of round-off: the number itself, or the change of its series where it vanishes."""
    return max(*(abs(v) for v in values), change)
