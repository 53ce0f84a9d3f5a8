"""The result of a run."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..observables.expectations import Check, check
from ..observables.observers import ObservableSet, Summary

if TYPE_CHECKING:
    from ..case.schema import Case
    from ..io.snapshots import Snapshot


@dataclass(frozen=True)
class Result:
    """The result of a run. ``status`` is finished, or stopped for the ``reason`` of a stop rule.

    ``snapshot`` is the last output; ``path`` the run file, None where none was written; ``wall_time`` in
    seconds.
    """

    case: Case
    status: str
    reason: str
    path: Path | None
    steps: int
    wall_time: float
    snapshot: Snapshot
    observers: ObservableSet

    def __repr__(self) -> str:
        found = ", ".join(
            f"{name} = {np.array2string(np.asarray(one.value), precision=6)}" for name, one in self.summaries.items()
        )
        return f"<Result {self.status}: {self.steps} steps, t = {self.snapshot.time:g}; {found or 'no observables'}>"

    def _repr_html_(self) -> str:
        """Its line, and a table of the observables, in a notebook."""
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{escape(np.array2string(np.asarray(one.value), precision=6))}</td>"
            f"<td>{escape(one.note)}</td></tr>"
            for name, one in self.summaries.items()
        )
        line = f"{self.status}: {self.steps} steps, t = {self.snapshot.time:g} {self.reason}"
        return f"<p>{escape(line)}</p><table><tr><th>observable</th><th>value</th><th></th></tr>{rows}</table>"

    @property
    def times(self) -> np.ndarray:
        """Times of the outputs (T,)."""
        return self.observers.times

    def series(self, name: str) -> np.ndarray:
        """The values (T,) or (T, 3) of a series; of a drift U that is U.position, and U a number in ``summaries``.

        Raises KeyError, with a sentence, for a name that has no series.
        """
        known = {self.observers.recorded(own): own for own in self.observers.observables}
        if name not in known:
            raise KeyError(f"{name} has no series; there are {', '.join(known) or 'none'}")
        return self.observers.series(known[name])

    @property
    def summaries(self) -> dict[str, Summary]:
        """The number of every observable."""
        return self.observers.summaries()

    @property
    def checks(self) -> list[Check]:
        """The case's expectations held against them."""
        return check(self.case, self.summaries)
