"""The commands of the studies, `ibfil sweep`, `compare`, `trade`, `stability`: words to calls, results to lines.

As in cli.py only the standard library is imported here.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import CaseError, Interrupted, RunFailed
from .threads import set_threads

if TYPE_CHECKING:
    from .study import Axis

CASE = "the case, a file or a shipped name, and changes to it that hold for all runs"
VARY = "what is varied: KEY=V1,V2,..., any number of times; keys that change together: KEY=V1,V2&OTHER=W1,W2"


def add_studies(add: Callable[..., argparse.ArgumentParser]) -> None:
    """Add the commands, by the function that adds one."""
    sweep = add("sweep", _sweep, "a run for each combination of settings, and a table of all observables")
    _common(sweep, "sweep")
    sweep.add_argument("--vary", action="append", required=True, metavar="KEY=V1,V2,...", help=VARY)
    sweep.add_argument("--list", action="store_true", help="only list the combinations and their indices")
    sweep.add_argument("--index", type=int, metavar="K", help="run that combination alone: a task of a job array")


def _common(command: argparse.ArgumentParser, kind: str) -> None:
    command.epilog = "Done runs are kept, cut ones gone on with: the same command again finishes a study."
    command.add_argument("words", nargs="+", metavar="CASE [KEY=VALUE ...]", help=CASE)
    command.add_argument("-o", dest="folder", metavar="DIR", help=f"the folder (default: the case's name -{kind})")
    command.add_argument("--jobs", type=_jobs, default=1, metavar="N", help="runs side by side, one thread each")


def _jobs(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 0 < int(text) <= 4096:
        raise argparse.ArgumentTypeError(f"found {text}; allowed: a whole number from 1 to 4096")
    return int(text)


def _begin(arguments: argparse.Namespace, kind: str) -> tuple[str, list[str], Path]:
    """The case, its overrides and the folder; the libraries not loaded yet get one thread."""
    set_threads(1)
    case, *changes = arguments.words
    stray = [f"{word}: found a word; allowed: KEY=VALUE" for word in changes if "=" not in word]
    if stray:
        raise CaseError(stray)
    return case, changes, Path(arguments.folder or f"{Path(case).stem}-{kind}")


def _axes(words: Sequence[str]) -> list[Axis]:
    from .study import axis

    return [axis(word) for word in words]


def _say(line: str) -> None:
    print(line, flush=True)


def _print_table(rows: Sequence[Mapping[str, Any]], left_out: Sequence[str] = ()) -> None:
    """Rows under the union of their columns."""
    from .show import table
    from .study import shown

    columns = [key for key in dict.fromkeys(key for row in rows for key in row) if key not in left_out]
    print("\n".join(table([columns, *([shown(row.get(key)) for key in columns] for row in rows)])))


def _sweep(arguments: argparse.Namespace) -> int:
    case, changes, folder = _begin(arguments, "sweep")
    axes = _axes(arguments.vary)
    from . import sweep

    if arguments.list:
        print("\n".join(sweep.listing(case, axes, changes)))
        return 0
    if arguments.index is not None:
        return _one(sweep.run_one(case, axes, folder, arguments.index, changes))
    rows = sweep.sweep(case, axes, folder, changes, jobs=arguments.jobs, say=_say)
    _print_table([row.row() for row in rows], ("run", "message"))
    print(folder / sweep.TABLE)
    return 0 if all(row.outcome.done for row in rows) else 1


def _one(outcome: Any) -> int:
    """The end of one member, told as that of a run."""
    if outcome.status == "interrupted":
        raise Interrupted(f"{outcome.member.name}: {outcome.message}")
    if not outcome.done:
        raise RunFailed(f"{outcome.member.name}: {outcome.status}: {outcome.message}")
    print(f"{outcome.path}: {outcome.status}")
    return 0
