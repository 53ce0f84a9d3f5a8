"""How fast a run steps: seconds a unit of simulated time, without start-up and outputs."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_PACE = ("pace_seconds", "pace_processor", "pace_time")  # attributes of a run file


class Pace:
    """Seconds, processor seconds and simulated time of the steps after the first; ``before`` those of earlier parts."""

    def __init__(self, before: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        self._before = before
        self._from: tuple[float, float, float] | None = None

    def step(self, time: float) -> None:
        """Take note of a step that led to ``time``: the first one starts the clocks."""
        if self._from is None:
            self._from = (clock.monotonic(), clock.process_time(), time)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Within it nothing counts."""
        before = (clock.monotonic(), clock.process_time())
        yield
        if self._from is not None:
            seconds, processor, time = self._from
            spent = (clock.monotonic() - before[0], clock.process_time() - before[1])
            self._from = (seconds + spent[0], processor + spent[1], time)

    def attributes(self, time: float) -> dict[str, float]:
        """Return what the run file keeps, at simulated ``time``."""
        now = (clock.monotonic(), clock.process_time(), time)
        since = self._from or now
        spent = (b + n - s for b, n, s in zip(self._before, now, since, strict=True))
        return dict(zip(_PACE, spent, strict=True))


def pace_of(file: Any) -> tuple[float, float, float]:
    """Seconds, processor seconds and simulated time noted in an open run file; zeros where there are none."""
    seconds, processor, time = (float(file.attrs.get(name, 0.0)) for name in _PACE)
    return seconds, processor, time
