"""The ways in which ibfil says no: a bad case or file, a failed run, an interrupted run."""

from __future__ import annotations

from collections.abc import Sequence


class CaseError(Exception):
    """A case file that cannot be run. ``faults`` holds one line for each thing found wrong (exit status 2)."""

    def __init__(self, faults: Sequence[str]) -> None:
        super().__init__("\n".join(faults))
        self.faults = list(faults)


class RunFileError(CaseError):
    """A file of a run that cannot be read, or not be written as asked: one line (exit status 2)."""

    def __init__(self, line: str) -> None:
        super().__init__([line])


class RunFailed(Exception):
    """A run that had to stop (exit status 1).

    ``time`` is in the case's unit of time, ``node`` counts from 0 at ``start``, ``cause`` is the likely one, ``advice``
    says what to change.
    """

    def __init__(
        self,
        message: str,
        *,
        time: float | None = None,
        filament: str | None = None,
        node: int | None = None,
        cause: str = "",
        advice: str = "",
    ) -> None:
        super().__init__(message)
        self.message, self.time, self.filament, self.node = message, time, filament, node
        self.cause, self.advice = cause, advice

    def __str__(self) -> str:
        """Message, time and place; the likely cause; the remedy: a line each."""
        where = ""
        if self.filament is not None:
            where = f" on filament {self.filament}" + ("" if self.node is None else f", node {self.node}")
        when = "" if self.time is None else f" at t = {self.time:.6g}"
        lines = [f"the run stopped{when}{where}: {self.message}"]
        if self.cause:
            lines.append(f"likely cause: {self.cause}")
        if self.advice:
            lines.append(f"what to change: {self.advice}")
        return "\n".join(lines)


class StepFailed(Exception):
    """A step that could not be taken; ``node`` is where, in the stack of all rods. It may be tried again, shorter."""

    def __init__(self, message: str, node: int) -> None:
        super().__init__(message)
        self.node = node


class Stopped(Exception):
    """A run that ends before its time because its case says so; the text is the reason (exit status 0)."""


class Interrupted(Exception):
    """Ctrl-C or SIGTERM, raised between two steps (exit status 130)."""
