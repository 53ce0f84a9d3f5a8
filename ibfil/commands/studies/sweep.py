"""`ibfil sweep`: a run for each combination of settings."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from ...errors import CaseError, Interrupted, RunFailed
from ...screen import tell
from .arguments import add_study, add_vary, axes, begin, print_table

NAME, HELP = "sweep", "a run for each combination of settings, and a table of all observables"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    add_study(command, "sweep")
    add_vary(command)
    command.add_argument("--figure", action="append", default=[], metavar="OBSERVABLE", help="draw it against the keys")
    command.add_argument("--against", action="append", default=[], metavar="KEY", help="of the figure: one key, or two")
    command.add_argument("--force", action="store_true", help="compute over runs of another case without asking")
    command.add_argument("--list", action="store_true", help="only list the combinations and their indices")
    command.add_argument("--index", type=int, metavar="K", help="run that combination alone: a task of a job array")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case, changes, folder = begin(arguments, "sweep")
    varied = axes(arguments.vary)
    from ...studies import sweep, sweep_figure
    from ...studies.executors import opened

    if arguments.list:
        tell("\n".join(sweep.listing(case, varied, changes)))
        return 0
    keys = sweep_figure.check(arguments.figure, arguments.against, [key for axis in varied for key in axis.keys])
    if arguments.index is not None:
        return _one(sweep.run_one(case, varied, folder, arguments.index, changes, overwrite=arguments.force))

    def all_of_it(force: bool) -> list[Any]:
        with opened(arguments.executor, arguments.jobs) as pool:
            more: dict[str, Any] = {"jobs": arguments.jobs, "executor": pool, "log": tell, "overwrite": force}
            return sweep.sweep(case, varied, folder, changes, **more)

    try:
        rows = all_of_it(arguments.force)
    except sweep.OtherCases as found:
        if not _asked(found):
            raise
        rows = all_of_it(True)
    print_table([row.row() for row in rows], ("run", "message"))
    summed = sweep.means_over_seeds(rows)
    if summed:
        tell("means over the seeds of thermal forces, and their standard errors")
        print_table([mean.row() for mean in summed])
    tell(", ".join([str(folder / sweep.TABLE), *([sweep.MEANS] if summed else [])]))
    for name in arguments.figure:
        tell(f"{sweep_figure.draw(rows, name, keys, Path(case).stem, folder)}, and as pdf")
    return 0 if all(row.outcome.done for row in rows) else 1


def _asked(found: CaseError) -> bool:
    """Whether a user at a terminal says yes; False where nobody can be asked."""
    if not (sys.stdin and sys.stdin.isatty()):
        return False
    tell("; ".join(found.faults).partition("; allowed:")[0])
    try:
        return input("compute over them? [y/N] ").strip().lower() in ("y", "yes")
    except EOFError:
        return False


def _one(outcome: Any) -> int:
    """The end of one member, told as that of a run."""
    if outcome.status == "interrupted":
        raise Interrupted(f"{outcome.member.name}: {outcome.message}")
    if not outcome.done:
        raise RunFailed(f"{outcome.member.name}: {outcome.status}: {outcome.message}")
    tell(f"{outcome.path}: {outcome.status}")
    return 0
