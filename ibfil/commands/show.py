"""`ibfil show`: what is in a run."""

from __future__ import annotations

import argparse

from .arguments import DONE

NAME, HELP = "show", "what is in a run: case, versions, summary, observables"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.add_argument("run", metavar="RUN.h5")
    command.add_argument("--json", action="store_true", help="the summary as JSON")
    command.add_argument("--plot", metavar="FILE.png", help="draw the run (png, pdf or svg)")
    command.add_argument("--csv", metavar="FILE.csv", help="write time and all observables as a table")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    from ..analysis import summary
    from ..io.reader import RunFile

    with RunFile(arguments.run) as run:
        told = summary.digest(run)
        print(summary.as_json(told) if arguments.json else summary.as_text(told))
        if arguments.csv:
            summary.write_csv(run, arguments.csv)
        if arguments.plot:
            from ..visualization.run_figure import draw

            draw(run, arguments.plot)
    return DONE
