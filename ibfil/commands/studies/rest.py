"""`ibfil rest`: where a scene comes to rest."""

from __future__ import annotations

import argparse

from ...screen import tell
from ..arguments import CHANGES, DONE
from .arguments import begin

NAME, HELP = "rest", "where a scene comes to rest, and whether it is stable there"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.epilog = CHANGES
    command.add_argument("words", nargs="+", metavar="CASE [KEY=VALUE ...]", help="the case, and changes to it")
    command.add_argument("-o", dest="folder", metavar="DIR", help="the folder (default: the case's name -rest)")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case, changes, folder = begin(arguments, "rest")
    from ...studies.modes import rest

    found = rest.rest(case, folder, changes)
    tell(found.title)
    rows = zip(found.settled.rests, found.settled.leading, found.observables, strict=True)
    for number, (one, leading, seen) in enumerate(rows):
        grows = leading.real > 0 and number < len(found.settled.rests) - 1
        word = f"UNSTABLE: grows at {leading.real:.4g}; pushed off it" if grows else "stable: nothing grows"
        if leading.real < 0:
            word += f"; the slowest to decay goes at {leading.real:.4g}"
        tell(
            f"rest {number + 1}: |v| T/L = {one.residual:.1e} (round-off {found.round_off:.0e}), {one.steps} steps, "
            f"{one.solves} linear solves; {word}"
        )
        for name, value in seen.items():
            parts = value if isinstance(value, list) else [value]
            tell(f"  {name} = {', '.join(f'{part:.6g}' for part in parts)}")
    tell(f'{folder / rest.RUN}, {rest.DETAILS}; shape = {{ kind = "run", path = "{folder / rest.RUN}" }} starts there')
    return DONE
