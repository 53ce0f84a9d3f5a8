"""`ibfil sweep`: a run for each combination of settings."""

from __future__ import annotations

import argparse
from typing import Any

from ...errors import Interrupted, RunFailed
from ...screen import tell
from .arguments import add_study, add_vary, axes, begin, print_table

NAME, HELP = "sweep", "a run for each combination of settings, and a table of all observables"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    add_study(command, "sweep")
    add_vary(command)
    command.add_argument("--list", action="store_true", help="only list the combinations and their indices")
    command.add_argument("--index", type=int, metavar="K", help="run that combination alone: a task of a job array")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case, changes, folder = begin(arguments, "sweep")
    varied = axes(arguments.vary)
    from ...studies import sweep
    from ...studies.executors import opened

    if arguments.list:
        tell("\n".join(sweep.listing(case, varied, changes)))
        return 0
    if arguments.index is not None:
        return _one(sweep.run_one(case, varied, folder, arguments.index, changes))
    with opened(arguments.executor, arguments.jobs) as pool:
        rows = sweep.sweep(case, varied, folder, changes, jobs=arguments.jobs, executor=pool, log=tell)
    print_table([row.row() for row in rows], ("run", "message"))
    summed = sweep.means_over_seeds(rows)
    if summed:
        tell("means over the seeds of thermal forces, and their standard errors")
        print_table([mean.row() for mean in summed])
    tell(", ".join([str(folder / sweep.TABLE), *([sweep.MEANS] if summed else [])]))
    return 0 if all(row.outcome.done for row in rows) else 1


def _one(outcome: Any) -> int:
    """The end of one member, told as that of a run."""
    if outcome.status == "interrupted":
        raise Interrupted(f"{outcome.member.name}: {outcome.message}")
    if not outcome.done:
        raise RunFailed(f"{outcome.member.name}: {outcome.status}: {outcome.message}")
    tell(f"{outcome.path}: {outcome.status}")
    return 0
