"""`ibfil check`: what a scene is, costs and may mean, without a run."""

from __future__ import annotations

import argparse

from ..screen import tell
from .arguments import DONE, add_case, read_case

NAME, HELP = "check", "run nothing: what is modelled, sizes, stable steps, estimated time, warnings"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    add_case(command)
    command.add_argument("--rest", action="store_true", help="say too whether the scene is stable where it rests")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case = read_case(arguments.words)
    from ..check.report import report

    tell(report(case))
    if arguments.rest:
        from ..studies.modes.verdict import at_rest

        tell("\n".join(["", "at rest:", *(f"  {line}" for line in at_rest(case))]))
    return DONE
