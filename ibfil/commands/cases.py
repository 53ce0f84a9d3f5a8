"""`ibfil cases`: the shipped cases."""

from __future__ import annotations

import argparse

from ..screen import tell
from .arguments import DONE

NAME, HELP = "cases", "list the shipped cases"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    del command  # it has none


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    from ..case.library import listing

    rows = listing()
    width = max((len(row.name) for row in rows), default=0)
    group = None
    for row in rows:
        if row.group != group:
            group = row.group
            tell(f"{group}/")
        tell(f"  {row.name:{width}}  {row.title}")
        tell(f"  {'':{width}}    {row.source}")
    return DONE
