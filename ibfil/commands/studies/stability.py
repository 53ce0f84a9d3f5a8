"""`ibfil stability`: which settings are stable and right."""

from __future__ import annotations

import argparse

from ...screen import tell
from .arguments import add_study, add_vary, axes, begin, print_table

NAME, HELP = "stability", "which settings are stable and right: a map, with the predicted limit"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    add_study(command, "stability")
    add_vary(command)


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case, changes, folder = begin(arguments, "stability")
    varied = axes(arguments.vary)
    from ...studies.executors import opened
    from ...studies.stability import study

    with opened(arguments.executor, arguments.jobs) as pool:
        result = study.stability(case, varied, folder, changes, jobs=arguments.jobs, executor=pool, log=tell)
    print_table(study.rows(result), ("message", "predicted from"))
    tell(
        "against a finer run, the largest over outputs: place and shape (without rigid motion), rms of nodes/L; "
        "turn, rad; stretch; force, ratio"
    )
    tell(f"{result.foretold} of {len(result.cells)} as predicted")
    tell(f"{folder / study.TABLE}, {study.DETAILS}, {study.FIGURE}")
    return 0
