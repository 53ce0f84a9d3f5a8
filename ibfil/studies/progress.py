"""How many members of a study have ended, and the time left for the others."""

from __future__ import annotations

import sys
from collections.abc import Callable
from time import monotonic
from types import TracebackType
from typing import Any

from ..screen import on_terminal


class MemberProgress:
    """Of ``count`` members ``ended`` before: a line for each that ends, with the time left; on a terminal a bar too."""

    def __init__(self, count: int, ended: int) -> None:
        self._count, self._before, self._ended = count, ended, ended
        self._began = monotonic()
        self._bar: Any = None

    def __enter__(self) -> MemberProgress:
        if on_terminal() and self._count - self._before > 1:
            from tqdm import tqdm

            form = "{percentage:3.0f}% |{bar}| {n_fmt} of {total_fmt} runs [{elapsed}<{remaining}]"
            self._bar = tqdm(
                total=self._count, initial=self._before, bar_format=form, file=sys.stderr, leave=False, smoothing=0
            )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.close()

    def tell(self, line: str, ended: bool, log: Callable[[str], object]) -> None:
        """Tell a line of a member, which has ``ended`` or has to be run again."""
        self._ended += ended
        left = self.left(monotonic() - self._began)
        words = "" if left is None else f", some {clock(left)} left"
        if self._bar is not None:
            self._bar.clear()
        log(f"{line} ({self._ended} of {self._count}{words})")
        if self._bar is not None:
            self._bar.update(ended)
            self._bar.refresh()

    def left(self, spent: float) -> float | None:
        """Seconds left if the others take as long as those that ended in the seconds ``spent``.

        None where none has ended, or nothing is left.
        """
        now = self._ended - self._before
        return spent / now * (self._count - self._ended) if now and self._ended < self._count else None


def clock(seconds: float) -> str:
    """The time in words, to the unit that matters: 40 s, 12 min, 3.5 h."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
