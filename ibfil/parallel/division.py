"""The division of the rows of an axis over processes: whole rows, in order, as even as they go."""

from __future__ import annotations

from typing import NamedTuple


class Division(NamedTuple):
    """``starts`` (P + 1,): process r has the rows from starts[r] up to, and without, starts[r + 1]."""

    starts: tuple[int, ...]

    @classmethod
    def of(cls, rows: int, processes: int) -> Division:
        """That of so many ``rows``: those who come first have one more where they do not go evenly."""
        whole, more = divmod(rows, processes)
        return cls(tuple(r * whole + min(r, more) for r in range(processes + 1)))

    def rows(self, rank: int) -> slice:
        """Those of a process."""
        return slice(self.starts[rank], self.starts[rank + 1])

    def count(self, rank: int) -> int:
        """How many it has."""
        return self.starts[rank + 1] - self.starts[rank]

    @property
    def counts(self) -> list[int]:
        """How many each has."""
        return [self.count(rank) for rank in range(len(self.starts) - 1)]
