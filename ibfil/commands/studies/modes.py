"""`ibfil modes`: growth rates, mode shapes and thresholds about a state of rest."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...screen import tell
from ..arguments import CHANGES, DONE, count, positive
from .arguments import begin

if TYPE_CHECKING:
    from ...studies.modes.results import Found, Mode, Threshold

NAME, HELP = "modes", "growth rates and modes of a scene at rest, with error bars; thresholds with --critical"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.epilog = CHANGES
    command.add_argument("words", nargs="+", metavar="CASE [KEY=VALUE ...]", help="the case, and changes to it")
    command.add_argument("-o", dest="folder", metavar="DIR", help="the folder (default: the case's name -modes)")
    command.add_argument("--count", type=count, default=6, metavar="N", help="how many modes (default: %(default)s)")
    command.add_argument(
        "--critical", type=between, metavar="KEY=LO,HI", help="the value of KEY at which growth changes its sign"
    )
    command.add_argument(
        "--step", type=positive, metavar="DT", help="foretell what a run with this step shows (default: the case's)"
    )


def between(text: str) -> tuple[str, float, float]:
    """KEY=LO,HI."""
    key, _, values = text.partition("=")
    try:
        low, high = (float(value) for value in values.split(","))
    except ValueError:
        low = high = 0.0
    if not key or not low != high:
        raise argparse.ArgumentTypeError(f"found {text}; allowed: KEY=LO,HI, two numbers that differ")
    return key, min(low, high), max(low, high)


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case, changes, folder = begin(arguments, "modes")
    from ...studies.modes import files, study

    found = study.modes(
        case,
        folder,
        changes,
        count=arguments.count,
        step=arguments.step,
        critical=arguments.critical,
        log=tell,
    )
    tell("\n".join(lines(found)))
    tell(f"{folder / files.TABLE}, {files.DETAILS}, {files.RUN} (for vtk and render), {files.FIGURE}")
    return DONE


def lines(found: Found) -> Iterator[str]:
    """The lines for the eye."""
    from ...analysis.summary import table

    word = "UNSTABLE" if found.unstable else "stable"
    yield found.title
    rest = found.rest
    yield (
        f"rest: |v| T/L = {rest.residual:.1e} (round-off {found.round_off:.0e}), {rest.steps} Newton steps; {word}"
        + (f"; {found.zeros} modes neither grow nor decay" if found.zeros else "")
    )
    seen = [f"growth seen, dt = {found.step:.4g}: {found.schemes[0]}", *found.schemes[1:]]
    counts = ", ".join(map(str, found.nodes))
    head = ["mode", "growth", "frequency", "kind", "at its own nodes", *seen]
    yield from table([head, *(_row(number, mode, found) for number, mode in enumerate(found.modes, 1))])
    yield f"growth (per time) and frequency (radians per time) of many nodes, +- from {counts} nodes"
    yield from found.notes
    if found.threshold is not None:
        yield from _limit(found.threshold)


def _row(number: int, mode: Mode, found: Found) -> list[str]:
    from ...studies.tables import with_bar

    value, corrected = mode.value, mode.corrected
    kind = mode.kind.word + {1: "", 2: " (double)"}.get(mode.count, f" ({mode.count} alike)")
    own = f"{value.real:+.5g}" + (f" {abs(value.imag):+.5g}i" if value.imag else "")
    growth = with_bar(corrected.real, math.inf if mode.growth is None else mode.growth.doubt, "+")
    frequency = with_bar(abs(corrected.imag), math.inf if mode.frequency is None else mode.frequency.doubt)
    seen = [
        "not known" if mode.seen[name] != mode.seen[name] else f"{mode.seen[name].real:+.5g}" for name in found.schemes
    ]
    return [str(number), growth, frequency if corrected.imag else "", kind, own, *seen]


def _limit(limit: Threshold) -> Iterator[str]:
    from ...studies.tables import with_bar

    told = limit.estimate
    counts = ", ".join(map(str, limit.nodes))
    values = "" if told is None else ", ".join(f"{value:.6g}" for value in told.values)
    order = "" if told is None or told.order is None else f"; order {told.order:.2f}, {told.word}"
    at = f", frequency {limit.frequency:.5g}" if limit.frequency else ""
    side = "above" if limit.grows_above else "below"
    yield (
        f"threshold: {limit.key} = {with_bar(limit.value, limit.bar)} ({counts} nodes: {values}{order}){at}; "
        f"{limit.word}; grows {side}"
    )
