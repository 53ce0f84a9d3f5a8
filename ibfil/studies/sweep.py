"""A run for each combination of settings, and one table of all their observables: `ibfil sweep`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import CaseError
from ..screen import tell
from .member import Member, Outcome
from .members import of_other_cases, run_members, work
from .replicas import Mean, means
from .settings import Axis, Setting, combinations
from .tables import measured, numbers_with_errors, refuse_strangers, study_members, write_csv, write_json

TABLE, DETAILS, MEANS = "sweep.csv", "sweep.json", "sweep_means.csv"


@dataclass(frozen=True)
class Swept:
    """One combination, how its run ended, and its observables, empty where there is no result.

    ``errors`` are their standard errors, of those that have one.
    """

    setting: Setting
    outcome: Outcome
    numbers: dict[str, float]
    errors: dict[str, float]
    about: dict[str, Any]  # steps, wall_time, method
    thermal: bool = False  # there are random forces

    def row(self) -> dict[str, Any]:
        """Return its row of the table."""
        found: dict[str, float] = {}
        for name, value in self.numbers.items():
            found[name] = value
            if name in self.errors:
                found[f"{name} +-"] = self.errors[name]
        return {
            "run": self.setting.name,
            **self.setting.values,
            "status": self.outcome.status,
            **found,
            **self.about,
            "message": self.outcome.message,
        }


def sweep(
    case: str,
    axes: Sequence[Axis],
    folder: str | Path,
    overrides: Sequence[str] = (),
    *,
    jobs: int = 1,
    executor: Executor | None = None,
    log: Callable[[str], object] = tell,
    overwrite: bool = False,
) -> list[Swept]:
    """Run every combination that is not done yet, and write ``folder``/sweep.csv and .json (with versions, machine).

    Thermal runs that differ in their seed alone are summed up in ``folder``/sweep_means.csv. ``case`` is a file, a
    shipped name or a text, ``overrides`` hold for all. Raises CaseError where the case or all combinations are at
    fault, and where runs in ``folder`` are of another case and ``overwrite`` is not set; Interrupted as `run_members`.
    """
    settings = combinations(axes)
    refuse_strangers(Path(folder), DETAILS, TABLE, MEANS)
    members = study_members(case, overrides, settings)
    if not overwrite:
        refuse_other_cases(members, Path(folder))
    outcomes = run_members(members, folder, jobs=jobs, executor=executor, log=log)
    rows = [_swept(setting, outcome) for setting, outcome in zip(settings, outcomes, strict=True)]
    table, summed = [row.row() for row in rows], [mean.row() for mean in means_over_seeds(rows)]
    more = {"means": summed} if summed else {}
    write_json(Path(folder) / DETAILS, {**measured(), "overrides": list(overrides), "runs": table, **more})
    write_csv(Path(folder) / TABLE, table)
    if summed:
        write_csv(Path(folder) / MEANS, summed)
    return rows


def refuse_other_cases(members: Sequence[Member], folder: Path) -> None:
    """Raise OtherCases where runs of another case would be computed over."""
    found = of_other_cases(members, folder)
    if found:
        name, keys = next(iter(found.items()))
        most = ", ".join(keys[:4]) + (", ..." if len(keys) > 4 else "")
        many = f"{len(found)} of {len(members)} runs are of another case; {name} differs in {most}"
        raise OtherCases([f"{folder}: {many}; allowed: another folder, or overwrite=True to compute over them"])


class OtherCases(CaseError):
    """Runs of another case stand where those of a sweep are to be."""


def means_over_seeds(rows: Sequence[Swept]) -> list[Mean]:
    """Means and standard errors over the runs that differ in the seed of their thermal forces alone; [] if none do."""
    done = [row for row in rows if row.outcome.done and row.thermal]
    return means([(row.outcome.member.resolved(), row.setting.values, row.numbers) for row in done])


def _swept(setting: Setting, outcome: Outcome) -> Swept:
    from ..io.reader import RunFile

    if not outcome.done:
        return Swept(setting, outcome, {}, {}, {})
    with RunFile(outcome.path) as run:
        about = {"steps": run.steps, "wall_time": run.wall_time, "method": run.method}
        found = numbers_with_errors(run)
        errors = {name: error for name, (_, error) in found.items() if error is not None}
        numbers, thermal = {name: value for name, (value, _) in found.items()}, run.case.thermal is not None
        return Swept(setting, outcome, numbers, errors, about, thermal)


def listing(case: str, axes: Sequence[Axis], overrides: Sequence[str] = ()) -> list[str]:
    """A line for each combination, with the index that `run_one` takes. Raises CaseError as `sweep`."""
    members = study_members(case, overrides, combinations(axes))
    return [f"{index}  {member.name}" for index, member in enumerate(members)]


def run_one(
    case: str,
    axes: Sequence[Axis],
    folder: str | Path,
    index: int,
    overrides: Sequence[str] = (),
    *,
    overwrite: bool = False,
) -> Outcome:
    """Run the combination of that ``index`` alone, as a task of a cluster's array does. Raises CaseError as `sweep`."""
    members = study_members(case, overrides, combinations(axes))
    if not 0 <= index < len(members):
        raise CaseError([f"--index {index}: found no such combination; allowed: 0 to {len(members) - 1}"])
    if not overwrite:
        refuse_other_cases([members[index]], Path(folder))
    Path(folder).mkdir(parents=True, exist_ok=True)
    return work(members[index], str(folder))
