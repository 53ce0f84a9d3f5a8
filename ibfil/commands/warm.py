"""`ibfil warm`: what a case compiles, plans and keeps, ahead of its runs."""

from __future__ import annotations

import argparse
from contextlib import suppress
from time import monotonic

from ..screen import tell
from .arguments import DONE, add_case, read_case

NAME, HELP = "warm", "compile the kernels that a case needs, plan its transforms and keep its tables; no run is written"
_STEPS = 3  # the first has no step before it; from the second on all there is is in use


class _EnoughError(Exception):
    """These were the steps."""


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.epilog = "Once before many runs begin at the same time (a job array, a cluster), or in an image."
    add_case(command)


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case, began = read_case(arguments.words), monotonic()
    from ..check.overview import overview_of
    from ..simulation.simulation import Simulation

    simulation = Simulation(case)
    overview_of(simulation)
    fields = case.output.fields if simulation.grid is not None else ()
    simulation.snapshot(fields)  # the motion before any step is found in another way
    first: list[float] = []

    def count() -> None:
        first.append(monotonic() - began)
        if len(first) == _STEPS:
            raise _EnoughError

    with suppress(_EnoughError):
        simulation.advance(case.time.end, count)
    simulation.snapshot(fields)
    tell(f"{case.title or arguments.words[0]}: warm; its first step was done after {first[0]:.1f} s")
    return DONE
