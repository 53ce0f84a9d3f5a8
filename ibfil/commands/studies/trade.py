"""`ibfil trade`: error against the time it takes."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ...screen import tell, warn
from ..arguments import count, duration, positive
from .arguments import add_study, add_vary, axes, begin, print_table

if TYPE_CHECKING:
    from ...studies.trade.results import Trade

NAME, HELP = "trade", "error against wall time over settings, with a proved reference and the Pareto front"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    add_study(command, "trade")
    add_vary(command)
    command.add_argument("--observe", metavar="NAME,...", help="errors of what: position, observables (default: all)")
    command.add_argument("--repeat", type=count, default=3, metavar="N", help="runs of each setting, for the noise")
    command.add_argument(
        "--clock",
        choices=("wall", "processor"),
        default="wall",
        help="whose seconds count; on a busy machine: processor",
    )
    command.add_argument("--budget", type=duration, metavar="10m", help="stop after this time: 90s, 10m, 2h")
    command.add_argument(
        "--for", dest="wanted", type=positive, metavar="1e-3", help="deprecated: ibfil tune CASE --for OBSERVABLE=1%%"
    )


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case, changes, folder = begin(arguments, "trade")
    varied = axes(arguments.vary)
    from ...studies.executors import opened
    from ...studies.trade import study

    with opened(arguments.executor, arguments.jobs) as pool:
        result = study.trade(
            case,
            varied,
            folder,
            changes,
            observe=arguments.observe.split(",") if arguments.observe else (),
            repeat=arguments.repeat,
            clock=arguments.clock,
            budget=arguments.budget,
            jobs=arguments.jobs,
            executor=pool,
            log=tell,
        )
    print_table(study.rows(result), ("message",))
    tell(f"{folder / study.TABLE}, {study.DETAILS}, {study.FIGURE}")
    if arguments.wanted is None:
        return 0
    warn(
        f"ibfil: trade --for is deprecated; ibfil tune {arguments.words[0]} --for OBSERVABLE=1% chooses step and nodes"
    )
    best = result.cheapest(arguments.wanted)
    if best is None:
        return _none_within(result, arguments.wanted)
    tell(f"the cheapest within {arguments.wanted:g}:")
    tell(" ".join(best.setting.overrides))
    return 0


def _none_within(result: Trade, wanted: float) -> int:
    """Say how near the settings came."""
    message = f"ibfil: no setting comes within {wanted:g} in {', '.join(result.measures)}"
    done = [one for one in result.trials if one.errors]
    if done:
        best = min(done, key=lambda one: max(result.error(one, measure) for measure in result.measures))
        worst = max(result.measures, key=lambda measure: result.error(best, measure))
        named = " ".join(best.setting.overrides)
        message += (
            f"; the nearest, {named}, is {result.error(best, worst):.2g} off in {worst}, with the reference's own"
        )
    warn(message)
    warn("ibfil: what to change: vary other keys, or shorter steps")
    return 1
