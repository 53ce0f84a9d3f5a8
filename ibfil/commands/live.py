"""`ibfil live`: a case that is played in a browser."""

from __future__ import annotations

import argparse

from ..screen import tell
from .arguments import DONE, add_case, port, read_case, say_if_cold

NAME, HELP = "live", "play with a case in a browser: sliders for its numbers, formulas and words"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    add_case(command)
    command.add_argument("--port", type=port, default=0, metavar="N", help="of the page (default: one that is free)")
    command.add_argument("--colour", default="tension", metavar="WHAT", help="the quantity that is shown first")
    command.add_argument("--open", action="store_true", help="open the browser of this machine too")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case = read_case(arguments.words)
    say_if_cold()
    from ..visualization.live.live import live

    live(case, port=arguments.port, colour=arguments.colour, browse=arguments.open, log=tell)
    return DONE
