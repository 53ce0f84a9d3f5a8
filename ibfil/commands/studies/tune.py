"""`ibfil tune`: the cheapest step and nodes for an error that is allowed."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...screen import tell
from ..arguments import DONE
from .arguments import add_study, begin

if TYPE_CHECKING:
    from ...studies.tune.choice import Settings
    from ...studies.tune.results import Tuned

NAME, HELP = "tune", "the cheapest step and nodes for an error that is allowed, confirmed by a run"
SHOWN = 3  # candidates


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    add_study(command, "tune")
    command.add_argument(
        "--for",
        dest="wanted",
        action="append",
        required=True,
        metavar="OBSERVABLE=1%",
        help="the error that is allowed, any number of times; without %% in the unit of the observable",
    )
    command.add_argument(
        "--quiet", action="store_true", help="write KEY=VALUE only: ibfil run CASE $(ibfil tune CASE --for ... --quiet)"
    )


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case, changes, folder = begin(arguments, "tune")
    from ...studies.executors import opened
    from ...studies.tune import files, study

    log = _nothing if arguments.quiet else tell
    with opened(arguments.executor, arguments.jobs) as pool:
        result = study.tune(case, arguments.wanted, folder, changes, jobs=arguments.jobs, executor=pool, log=log)
    if arguments.quiet:
        tell(" ".join(result.overrides))
        return DONE
    tell("\n".join(lines(result)))
    tell(f"{', '.join(str(folder / name) for name in (files.TABLE, files.DETAILS, files.FIGURE))}")
    tell(f"{folder / files.SCENE}: the case with these settings; or as a line to type:")
    tell(" ".join(["ibfil run", *arguments.words, *result.overrides]))
    return DONE


def _nothing(line: object = "") -> None:
    """Say nothing."""


def lines(result: Tuned) -> Iterator[str]:
    """The lines for the eye."""
    yield result.title
    for one in result.targets:
        yield f"{one}"
    yield from _table(result)
    yield f"chosen: {' '.join(result.overrides)}"
    for aim in result.aims:
        yield from _of(aim.number, abs(aim.nodes.coarsest.values[-1]), result)
    if result.unplaced:
        yield f"the place in a cell is not in these bars: {result.unplaced}"
    ratio = result.own.seconds / result.answer.seconds
    words = f"{ratio:.2g} times less than" if ratio >= 1 else f"{1 / ratio:.2g} times more than"
    yield f"cost, from counts: {result.answer.seconds:.2g} s, {words} with the case's own settings"
    yield f"it took {result.runs} runs to find, {result.spent:.2g} s of processor time: it pays where many runs follow"
    yield "kept, being choices: fluid, box, cells, slip, kernel, scheme, order (ibfil uncertainty CASE --meant)"


def _table(result: Tuned) -> Iterator[str]:
    """The cheapest candidates, those with nodes that were run, and the case's own settings."""
    from ...analysis.summary import table

    some = [one for i, one in enumerate(result.candidates) if i < SHOWN or one.nodes in result.probed]
    head = ["", "step", "nodes", *(f"bar of {aim.number}" for aim in result.aims), "seconds"]
    named = [*(("chosen" if one is result.answer else "", one) for one in some), ("the case's own", result.own)]
    yield from table([head, *([word, *_row(one, result)] for word, one in named)])


def _row(one: Settings, result: Tuned) -> list[str]:
    sizes = [(one.bar(aim.number), abs(aim.nodes.coarsest.values[-1])) for aim in result.aims]
    return [f"{one.step:.4g}", str(one.nodes), *(_amount(*size) for size in sizes), f"{one.seconds:.2g}"]


def _of(number: str, value: float, result: Tuned) -> Iterator[str]:
    """The bar of a number and its parts; how far a run is from the corrected value."""
    from ...studies.tables import with_bar

    found, right, doubt = result.checks[number]
    nodes, step, rest = (_amount(part, value) for part in result.answer.bars[number])
    stated = with_bar(found, result.answer.bar(number))
    yield f"  {number} = {stated}: nodes {nodes}, step {step}, place and outputs {rest}"
    yield f"  a run with them is {_amount(abs(found - right), value)} from the corrected {with_bar(right, doubt)}"


def _amount(size: float, value: float) -> str:
    """In per cent of the number, or as it is where the number is no larger."""
    if not size < float("inf"):
        return "not known"
    return f"{100 * size / value:.2g} %" if value > size else f"{size:.2g}"
