"""`ibfil show`: what is in a run."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import CaseError
from ..screen import tell
from .arguments import DONE

NAME, HELP = "show", "what is in a run: case, versions, summary, observables"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.add_argument("run", metavar="RUN.h5")
    command.add_argument("--json", action="store_true", help="the summary as JSON")
    command.add_argument("--plot", metavar="FILE.png", help="draw the run (png, pdf or svg)")
    command.add_argument("--from", dest="begin", type=float, metavar="T", help="of the plot: its first time")
    command.add_argument("--to", dest="end", type=float, metavar="T", help="of the plot: its last time")
    command.add_argument("--shapes", type=int, metavar="N", help="of the plot: shapes of a filament, over one period")
    command.add_argument("--co-moving", action="store_true", help="of the plot: shapes as seen from their centroid")
    command.add_argument("--csv", metavar="FILE.csv", help="write time and all observables as a table")
    command.add_argument("--force", action="store_true", help="write over a picture or table that is there already")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    from ..analysis import summary
    from ..io.overwriting import refuse
    from ..io.reader import RunFile
    from ..visualization.moments import Look

    run_file, force = Path(arguments.run), arguments.force
    if arguments.csv:
        refuse(Path(arguments.csv), summary.TABLE, force, [run_file])
    look = Look(arguments.begin, arguments.end, arguments.shapes, arguments.co_moving)
    if look != Look() and not arguments.plot:
        raise CaseError(["--from, --to, --shapes, --co-moving: found without --plot; allowed: with it"])
    if arguments.plot:
        from ..visualization.run_figure import draw, kind_of

        refuse(Path(arguments.plot), kind_of(Path(arguments.plot)), force, [run_file])
    with RunFile(arguments.run) as run:
        told = summary.digest(run)
        tell(summary.as_json(told) if arguments.json else summary.as_text(told))
        if arguments.csv:
            summary.write_csv(run, Path(arguments.csv))
        if arguments.plot:
            draw(run, arguments.plot, look)
    return DONE
