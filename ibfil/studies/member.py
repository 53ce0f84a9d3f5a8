"""One run of a study, and how it ended."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..case.schema import Case


@dataclass(frozen=True)
class Member:
    """One run of a study: its ``name`` (of its file, NAME.h5), its case and ``KEY=VALUE`` overrides.

    ``case`` is the path of a case file, the name of a shipped case, or, where it has more than one line, the
    text of a case.
    """

    name: str
    case: str
    overrides: tuple[str, ...] = ()

    def resolved(self) -> Case:
        """Return the case that is run, on one thread. Raises CaseError, one line a fault."""
        from ..case.reading import parse_case, read_case

        overrides = (*self.overrides, "compute.threads=1")
        if "\n" in self.case:
            return parse_case(self.case, f"{self.name}.toml", overrides)
        return read_case(self.case, overrides)


@dataclass(frozen=True)
class Outcome:
    """How a member ended.

    ``status`` is that of its run: finished | stopped (by a stop rule) | failed | interrupted | running (written
    by another process) | waiting (not begun). ``path`` is its run file, which need not be there where it failed
    or waits; ``message`` the reason; ``seconds`` what was spent on it now, zero where it was done before.
    """

    member: Member
    status: str
    path: Path
    message: str = ""
    seconds: float = 0.0

    @property
    def done(self) -> bool:
        """Whether there is a result: finished, or stopped by a rule of the case."""
        return self.status in ("finished", "stopped")
