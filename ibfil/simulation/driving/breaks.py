"""The times at which something that drives a scene jumps: steps end there, and the next looks back at none before."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence

SAME = 1e-9  # of the run: two times are one


class Breaks:
    """The last times before jumps. One that is also the time of an output goes by that output's time."""

    def __init__(self, times: Sequence[float], end: float) -> None:
        self._times, self._slack = list(times), SAME * end

    def goal(self, time: float, until: float) -> float:
        """Where steps from ``time`` lead: to ``until``, or to the first break before it."""
        first = bisect_right(self._times, time + self._slack)
        if first < len(self._times) and self._times[first] < until - self._slack:
            return self._times[first]
        return until

    def before(self, time: float) -> float:
        """The time at which a step that begins or ends at ``time`` sees what drives: before a jump that is there."""
        first = bisect_left(self._times, time - self._slack)
        return self._times[first] if self.at(time) and self._times[first] <= time else time

    def at(self, time: float) -> bool:
        """Whether something jumps at that time."""
        first = bisect_left(self._times, time - self._slack)
        return first < len(self._times) and self._times[first] <= time + self._slack
