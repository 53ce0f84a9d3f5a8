"""`ibfil bench`: pieces of a step against floors."""

from __future__ import annotations

import argparse

from ..threads import set_threads
from .arguments import DONE

NAME, HELP = "bench", "time the pieces of a step against floors measured in the same run"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    words = (
        "pieces, swimmer (the usual two), start, spaces, thermal, links, body, studies, large (1 GiB), "
        "threads, many (10 minutes, 2 GiB), members (3 minutes), mpi; million (never run to its end: 8 GB or more)"
    )
    command.add_argument("parts", nargs="*", metavar="PART", help=words)
    command.add_argument("--json", action="store_true", help="as JSON")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    set_threads(1)
    from ..bench import parts

    parts.main(json=arguments.json, parts=arguments.parts)
    return DONE
