"""The common arguments of the studies: the case and its folder, what is varied, tables on the screen."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...screen import tell
from ...threads import set_threads
from ..arguments import count, only_changes

if TYPE_CHECKING:
    from ...studies.settings import Axis

CASE = "the case, a file or a shipped name, and changes to it that hold for all runs"
VARY = (
    "what is varied: KEY=V1,V2,..., any number of times; a range START:STOP:N or START:STOP:N:log among values; keys "
    "that change together: KEY=V1,V2&OTHER=W1,W2; or @POINTS.csv, a table with keys above and a point in each row"
)

EXECUTOR = "runs go to the executor of FACTORY(N of --jobs): a cluster's, loky's ... (ibfil/studies/README.md)"


def add_study(command: argparse.ArgumentParser, kind: str) -> None:
    """Add the case, the folder and the jobs of a study."""
    command.epilog = "Done runs are kept, cut ones resumed: the same command again finishes a study."
    command.add_argument("words", nargs="+", metavar="CASE [KEY=VALUE ...]", help=CASE)
    command.add_argument("-o", dest="folder", metavar="DIR", help=f"the folder (default: the case's name -{kind})")
    command.add_argument("--jobs", type=count, default=1, metavar="N", help="runs side by side, one thread each")
    command.add_argument("--executor", metavar="MODULE:FACTORY", help=EXECUTOR)


def add_vary(command: argparse.ArgumentParser) -> None:
    """Add what is varied."""
    command.add_argument("--vary", action="append", required=True, metavar="KEY=V1,V2,...", help=VARY)


def begin(arguments: argparse.Namespace, kind: str) -> tuple[str, list[str], Path]:
    """The case, its overrides and the folder; the libraries not loaded yet get one thread."""
    set_threads(1)
    case, *changes = arguments.words
    only_changes(changes)
    return case, changes, Path(arguments.folder or f"{Path(case).stem}-{kind}")


def axes(words: Sequence[str]) -> list[Axis]:
    """The axes of --vary."""
    from ...studies.settings import axis

    return [axis(word) for word in words]


def print_table(rows: Sequence[Mapping[str, Any]], left_out: Sequence[str] = ()) -> None:
    """Print rows under the union of their columns."""
    from ...analysis.summary import table
    from ...studies.tables import shown

    columns = [key for key in dict.fromkeys(key for row in rows for key in row) if key not in left_out]
    tell("\n".join(table([columns, *([shown(row.get(key)) for key in columns] for row in rows)])))
