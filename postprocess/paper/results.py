"""What the figures are made of, the runs, and what they come to, rows of one table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ibfil.io.reader import RunFile
from ibfil.studies.member import Outcome


@dataclass(frozen=True)
class Row:
    """One number: what the paper prints, what theory asks for, what ibfil finds, and how far apart they may be.

    ``bar`` is relative to theory (to the paper where there is none), None where nothing is held against it.
    ``seconds`` is the wall time of the runs it comes from. ``note`` says what differs, and why.
    """

    where: str
    quantity: str
    paper: float | str
    theory: float | None
    found: float | str
    seconds: float
    bar: float | None = None
    error: float | None = None  # standard error of what was found; the bar is then three of these
    note: str = ""

    @property
    def difference(self) -> float | None:
        """Relative to theory, to the paper where there is none; None where there is no number to hold it against."""
        base = self.theory if self.theory is not None else self.paper
        if isinstance(base, str) or isinstance(self.found, str) or base == 0:
            return None
        return self.found / base - 1.0

    @property
    def verdict(self) -> str:
        """Whether it is within its bar: yes, no, or nothing where there is none."""
        if self.error is not None and self.theory is not None and not isinstance(self.found, str):
            return "yes" if abs(self.found - self.theory) <= 3 * self.error else "no"
        if self.bar is None or self.difference is None:
            return ""
        return "yes" if abs(self.difference) <= self.bar else "no"


class Runs:
    """The members of a figure that have a run file in the ``folder``, opened when they are first asked for."""

    def __init__(self, outcomes: Sequence[Outcome], folder: Path) -> None:
        self.folder = folder
        self.outcomes = {outcome.member.name: outcome for outcome in outcomes}
        self._open: dict[str, RunFile] = {}

    def __getitem__(self, name: str) -> RunFile:
        """The run file of a member, whole or cut short. Raises KeyError, RunFileError where there is none."""
        if name not in self._open:
            self._open[name] = RunFile(self.outcomes[name].path)
        return self._open[name]

    def __iter__(self) -> Iterator[str]:
        """Names of those with a run file."""
        return (name for name, outcome in self.outcomes.items() if Path(outcome.path).exists())

    def named(self, start: str) -> list[str]:
        """The names that begin so, of those with a run file."""
        return [name for name in self if name.startswith(start)]

    def seconds(self, start: str = "") -> float:
        """Wall time of the runs whose names begin so, whenever they were made."""
        return sum(self[name].wall_time for name in self.named(start))

    def close(self) -> None:
        """Close the files."""
        for run in self._open.values():
            run.close()


def shown(value: float | str | None) -> str:
    """A number to five digits, or what stands for it."""
    if value is None:
        return ""
    return value if isinstance(value, str) else f"{value:.5g}"


def columns(row: Row) -> list[str]:
    """The row as it is printed and written."""
    difference = "" if row.difference is None else f"{100 * row.difference:+.2f} %"
    error = "" if row.error is None else f" ± {row.error:.2g}"
    bar = "3 s.e." if row.error is not None else "" if row.bar is None else f"{100 * row.bar:g} %"
    return [
        row.where,
        row.quantity,
        shown(row.paper),
        shown(row.theory),
        shown(row.found) + error,
        difference,
        bar,
        row.verdict,
        f"{row.seconds:.0f} s",
        row.note,
    ]


HEADINGS = ["section", "quantity", "paper", "theory", "ibfil", "difference", "bar", "within", "wall time", "note"]


def markdown(rows: Sequence[Row]) -> str:
    """The table in Markdown."""
    lines = [HEADINGS, ["---"] * len(HEADINGS), *(columns(row) for row in rows)]
    return "\n".join("| " + " | ".join(cell.replace("|", "/") for cell in line) + " |" for line in lines) + "\n"


def plain(rows: Sequence[Row]) -> str:
    """The table for a terminal, notes left out."""
    lines = [HEADINGS[:-1], *(columns(row)[:-1] for row in rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) for line in lines)
