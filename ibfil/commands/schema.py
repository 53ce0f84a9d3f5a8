"""`ibfil schema`: every table and key of a case."""

from __future__ import annotations

import argparse

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
        print(json.dumps(schema_json(), indent=2))
        return DONE
    from ..observables.factory import kinds_text

    print(schema_text())
    print(kinds_text())
    return DONE
