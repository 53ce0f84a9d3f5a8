"""A session of playing: what pages ask for, and how the played run goes on between."""

from __future__ import annotations

import json
import time as clock
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from ...errors import CaseError, RunFailed, Stopped
from .played import Played

if TYPE_CHECKING:
    from ...case.overrides import Overrides
    from ...case.schema import Case
    from .viewers import Viewers

PICTURES = 30.0  # a second, at most
PACE = 25.0  # outputs a second, unless a page asks for another pace
FASTEST = 1e6  # of a pace
SUMMED = 0.5  # seconds between two looks at all numbers so far
IDLE = 0.2  # seconds between two looks at whether it is to end


class _Turned(Exception):
    """Something else is to be done between two steps."""


class Session:
    """One case that is played for ``viewers``; ``colour`` is the quantity that is shown first.

    It goes on while a page looks. Raises CaseError where the case it begins with cannot be built.
    """

    def __init__(self, case: Case, viewers: Viewers, colour: str) -> None:
        self._original, self._case, self._viewers, self._colour = case, case, viewers, colour
        self._running, self._ended = True, ""
        self._pace = PACE
        self._next_output = self._next_picture = self._next_sum = 0.0
        self._stop: Callable[[], bool] = lambda: False
        self._began(Played(case, colour))

    @property
    def case(self) -> Case:
        """The case that is played at present."""
        return self._case

    def play(self, stop: Callable[[], bool]) -> None:
        """Play until ``stop`` is true."""
        self._stop = stop
        while not stop():
            orders = self._viewers.orders(self._patience(), lambda: self._moves and self._patience() == 0.0)
            changes: dict[str, Any] = {}
            for order in orders:
                changes |= order["set"] if isinstance(order.get("set"), dict) else {}
                self._obey(order)
            if changes:
                self._change(self._case, changes)
            elif self._moves and clock.monotonic() >= self._next_output:
                self._go_on()

    @property
    def _moves(self) -> bool:
        return self._running and not self._ended and len(self._viewers) > 0

    def _patience(self) -> float:
        return min(IDLE, max(0.0, self._next_output - clock.monotonic())) if self._moves else IDLE

    def _obey(self, order: Mapping[str, Any]) -> None:
        """Do what a page asks for, but for new values of controls, of which only the last ones count."""
        if isinstance(order.get("run"), bool):
            self._running = order["run"]
            self._say(running=self._running)
            if not self._running:
                self._summed()
        if order.get("again"):
            self._change(self._case, {})
        if order.get("original"):
            self._change(self._original, {})
        if isinstance(order.get("key"), str):
            self._change(self._case, [order["key"]])
        if isinstance(order.get("pace"), (int, float)) and 0 <= order["pace"] <= FASTEST:
            self._pace = float(order["pace"])  # 0: as fast as it goes
            self._next_output = 0.0

    def _change(self, case: Case, overrides: Overrides) -> None:
        """Begin again with another case. One that is at fault is told, and the run goes on as it was."""
        self._say(building=True)
        try:
            self._began(Played(case.with_(overrides) if overrides else case, self._colour))
        except CaseError as error:
            self._say(faults=[fault.removeprefix(f"{case.file}: ") for fault in error.faults])
        except (RunFailed, MemoryError, RecursionError) as error:  # the last where a value is nested too deeply
            self._say(faults=str(error).splitlines() or ["not enough memory"])

    def _began(self, played: Played) -> None:
        self._played, self._case, self._ended = played, played.case, ""
        self._viewers.begin(json.dumps({"scene": played.scene(), "running": self._running}, allow_nan=False))
        self._next_output = self._next_picture = 0.0
        self._next_sum = clock.monotonic() + SUMMED
        self._go_on()

    def _go_on(self) -> None:
        """To what is due next, or until a page asks for something."""
        began = clock.monotonic()
        try:
            row, reason = self._played.go_on(self._after_step)
        except _Turned:
            return
        except Stopped as stopped:
            row, _ = self._played.output()
            reason = str(stopped)
        except RunFailed as failure:
            row, reason = None, "\n".join(["failed", *str(failure).splitlines()])
        if row is not None:
            self._say(row=row)
            self._next_output = began + 1 / self._pace if self._pace else 0.0
        if reason or self._played.done:
            self._ended = reason or "finished"
        self._shown(wanted=bool(self._ended))
        if self._ended:
            self._summed()
            self._say(ended=self._ended)
        elif row is not None and clock.monotonic() >= self._next_sum:
            self._summed()

    def _after_step(self) -> None:
        for notice in self._played.notices():
            self._say(warning=notice)
        if self._viewers.asked or self._stop():
            raise _Turned
        self._shown()

    def _shown(self, wanted: bool = False) -> None:
        """Show the present where it is time for a picture, or ``wanted``."""
        now = clock.monotonic()
        if wanted or now >= self._next_picture:
            self._next_picture = now + 1 / PICTURES
            self._viewers.show(self._played.picture())

    def _summed(self) -> None:
        self._next_sum = clock.monotonic() + SUMMED
        self._say(numbers=self._played.numbers())

    def _say(self, **words: Any) -> None:
        self._viewers.tell(json.dumps(words, allow_nan=False))
