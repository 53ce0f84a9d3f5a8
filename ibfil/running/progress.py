"""How far a run is, how fast it steps, and Ctrl-C between two steps.

Progress is a bar on a terminal and in a notebook, a line now and then elsewhere. The pace, which `ibfil trade` puts
against the error, is taken without start-up: its clocks start when the first step of a process is taken, so that
loading, compiling and planning are left out, and stand still at outputs; the parts of a run that was cut are added
up.
"""

from __future__ import annotations

import signal
import sys
import threading
import time as clock
from collections.abc import Callable
from types import FrameType
from typing import Any

from ..screen import in_notebook, on_terminal

_LINE_EVERY = 60.0  # seconds at most between two lines
_TENTHS = 10  # lines of a short run


class Progress:
    """Tells how far a run from ``start`` to ``end`` is; of no influence on it.

    ``show`` False: says nothing.
    """

    def __init__(self, start: float, end: float, log: Callable[[str], object], show: bool) -> None:
        self._end, self._log, self._show = end, log, show
        self._began = self._said = clock.monotonic()
        self._tenth = int(_TENTHS * start / end)
        self._bar = self._make_bar(start) if show and (on_terminal() or in_notebook()) else None

    def _make_bar(self, start: float) -> Any:
        from tqdm import tqdm

        form = "{percentage:3.0f}% |{bar}| t = {n:.4g} of {total:.4g} [{elapsed}<{remaining}{postfix}]"
        stream = sys.stdout if in_notebook() else sys.stderr  # which a notebook shows in red
        return tqdm(total=self._end, initial=start, bar_format=form, file=stream, leave=False)

    def tell(self, time: float, steps: int) -> None:
        """Move the bar; or say a line where a tenth more is done, or a minute has passed."""
        if self._bar is not None:
            self._bar.set_postfix_str(f"{steps} steps", refresh=False)
            self._bar.update(time - self._bar.n)
            return
        now, tenth = clock.monotonic(), int(_TENTHS * time / self._end)
        if self._show and (tenth > self._tenth or now - self._said > _LINE_EVERY):
            self._tenth, self._said = tenth, now
            percent = 100 * time / self._end
            spent = now - self._began
            self._log(f"t = {time:.6g} of {self._end:.6g} ({percent:.0f} %), {steps} steps, {spent:.1f} s")

    def close(self) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.close()


class Signals:
    """Ctrl-C and SIGTERM set ``caught`` within the ``with``; a second one kills. In the main thread only."""

    def __init__(self) -> None:
        self.caught = False
        self._before: dict[int, Any] = {}

    def _catch(self, number: int, snapshot: FrameType | None) -> None:
        self.caught = True
        for caught in self._before:
            signal.signal(caught, signal.SIG_DFL)

    def __enter__(self) -> Signals:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._before[number] = signal.signal(number, self._catch)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            if handler is not None:  # as of one that was not set from Python
                signal.signal(number, handler)
