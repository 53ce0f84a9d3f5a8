"""`ibfil new`: a copy of a shipped case, or a new one for the physics that is named, with every key explained."""

from __future__ import annotations

import argparse

from ..errors import CaseError
from ..screen import tell
from .arguments import DONE

NAME, HELP = "new", "copy a shipped case to a file, to edit it; or write a new one with every key explained"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.add_argument(
        "names",
        metavar="NAME",
        nargs="*",
        help="a shipped case (`ibfil cases` lists them) and the file to make; with --with the file alone; one that is "
        "there is not replaced",
    )
    command.add_argument(
        "--with", dest="physics", metavar="WORD,...", help='the physics of a new case, such as wall,copies; "" for none'
    )
    command.add_argument("--list", action="store_true", help="the words that --with takes, and what they are")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status. Raises CaseError for words that are not known or do not go together."""
    from ..case import library

    if arguments.list:
        from ..case.blank.writing import offers

        tell(offers())
        return DONE
    wanted = 2 if arguments.physics is None else 1
    if len(arguments.names) != wanted:
        form = "NAME FILE, or --with WORD,... FILE, or --list"
        raise CaseError([f"new: found {len(arguments.names)} names; allowed: {form}"])
    if arguments.physics is None:
        name, file = arguments.names
        tell(f"{name} -> {library.copy(name, file)}")
        return DONE
    from ..case.blank.writing import blank

    (file,) = arguments.names
    words = [word.strip() for word in arguments.physics.split(",") if word.strip()]
    tell(f"a new case -> {library.write(blank(words), file)}")
    return DONE
