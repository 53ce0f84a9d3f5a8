"""Runs that a study makes when it asks for them: equal cases are one run, each is opened once, what failed says why."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from pathlib import Path

from ..errors import CaseError
from ..io.reader import RunFile
from .member import Member, Outcome
from .members import run_members

Log = Callable[[str], object]


class Runs:
    """The runs of one study in one folder; ``stack`` closes their files."""

    def __init__(self, folder: Path, jobs: int, executor: Executor | None, log: Log, stack: ExitStack) -> None:
        self.folder, self._jobs, self._executor, self._log, self._stack = folder, jobs, executor, log, stack
        self.outcomes: dict[str, Outcome] = {}  # by resolved text
        self.failures: list[str] = []
        self._texts: dict[str, str] = {}
        self._runs: dict[str, RunFile] = {}

    def make(self, members: Sequence[Member]) -> None:
        """Run those that are not there. Raises Interrupted."""
        new: dict[str, Member] = {}
        for member in members:
            try:
                text = self._texts[member.name] = member.resolved().text
            except CaseError as error:
                self.failures.append(f"{member.name}: {error.faults[0]}")
                continue
            if text not in self.outcomes and text not in new:
                new[text] = member
        found = run_members(list(new.values()), self.folder, jobs=self._jobs, executor=self._executor, log=self._log)
        for text, outcome in zip(new, found, strict=True):
            self.outcomes[text] = outcome
            if not outcome.done:
                self.failures.append(f"{outcome.member.name}: {outcome.message}")

    def take(self, outcome: Outcome) -> None:
        """Count a run that was made elsewhere."""
        text = self._texts[outcome.member.name] = outcome.member.resolved().text
        self.outcomes[text] = outcome

    def run(self, member: Member) -> RunFile | None:
        """The run of a member; None where it has no result."""
        outcome = self.outcomes.get(self._texts.get(member.name, ""))
        if outcome is None or not outcome.done:
            return None
        name = outcome.member.name
        if name not in self._runs:
            self._runs[name] = self._stack.enter_context(RunFile(outcome.path))
        return self._runs[name]

    def why(self, member: Member) -> str:
        """Why a member has no result."""
        outcome = self.outcomes.get(self._texts.get(member.name, ""))
        return next((line for line in self.failures if line.startswith(f"{member.name}: ")), "") or (
            "not run" if outcome is None else outcome.message
        )

    @property
    def cost(self) -> float:
        """Processor seconds of all runs."""
        done = [outcome for outcome in self.outcomes.values() if outcome.done]
        return sum(spent(self.run(outcome.member)) for outcome in done)


def spent(run: RunFile | None) -> float:
    """Processor seconds of a run's steps."""
    return 0.0 if run is None else float(run.pace[1])
