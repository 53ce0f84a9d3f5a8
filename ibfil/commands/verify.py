"""`ibfil verify`: cases against the numbers that they expect."""

from __future__ import annotations

import argparse

from ..screen import tell
from ..threads import set_threads
from .arguments import say_if_cold

NAME, HELP = "verify", "run shipped or given cases and hold their [expect] numbers against the result"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.add_argument("cases", nargs="*", metavar="CASE")
    command.add_argument("--quick", action="store_true", help="the quick form of each case")
    command.add_argument(
        "--bars",
        action="store_true",
        help="an error bar on every number found, as ibfil uncertainty has it: some eight times the runs",
    )


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    set_threads(1)
    say_if_cold()
    from ..studies.verify import verify

    return verify(arguments.cases, arguments.quick, tell, bars=arguments.bars)
