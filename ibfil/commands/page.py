"""`ibfil page`: a run as a page for a browser."""

from __future__ import annotations

import argparse

from ..screen import tell
from .arguments import DONE

NAME, HELP = "page", "write a run as one file that turns in any browser, without a network"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.add_argument("run", metavar="RUN.h5")
    command.add_argument("-o", dest="output", metavar="FILE.html", required=True, help="the page")
    command.add_argument("--force", action="store_true", help="write over a page that is there already")
    command.add_argument("--colour", default="tension", metavar="WHAT", help="the quantity that is shown first")
    command.add_argument("--most", type=float, default=20.0, metavar="MB", help="its size; outputs are left out (20)")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    from ..visualization.web.page import write_page

    a = arguments
    write_page(a.run, a.output, colour=a.colour, most=a.most, log=tell, overwrite=a.force)
    return DONE
