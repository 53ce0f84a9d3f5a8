"""`ibfil new`: a copy of a shipped case."""

from __future__ import annotations

import argparse

from ..screen import tell
from .arguments import DONE

NAME, HELP = "new", "copy a shipped case to a file, to edit it"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.add_argument("name", metavar="NAME", help="a shipped case (`ibfil cases` lists them)")
    command.add_argument("file", metavar="FILE", help="the file to make; one that is there is not replaced")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    from ..case import library

    tell(f"{arguments.name} -> {library.copy(arguments.name, arguments.file)}")
    return DONE
