"""`ibfil schema`: every table and key of a case."""

from __future__ import annotations

import argparse

from ..screen import tell
from .arguments import DONE

NAME, HELP = "schema", "print every table and key of a case"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.add_argument("--json", action="store_true", help="as JSON Schema")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    import json

    from ..case.listing import schema_json, schema_text

    if arguments.json:
        tell(json.dumps(schema_json(), indent=2))
        return DONE
    from ..observables.factory import kinds_text

    tell(schema_text())
    tell(kinds_text())
    return DONE
