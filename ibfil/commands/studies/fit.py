"""`ibfil fit`: parameters from tracked shapes or measured numbers, with intervals."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...errors import CaseError
from ...screen import tell
from ..arguments import DONE
from .arguments import add_study, begin

if TYPE_CHECKING:
    from ...studies.fit.results import Fit, Fitted

NAME, HELP = "fit", "parameters from tracked shapes or measured numbers, with intervals"
DATA = (
    "tracked points, a text table: headings t or frame, x, y, z (two at least; or psi), s or node where there is "
    "one, weight, filament; units after a name, x_um; or a row (or a column) a frame, t, x0, y0, x1, y1, ..."
)


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    add_study(command, "fit")
    command.add_argument(
        "--vary",
        action="append",
        required=True,
        metavar="KEY=LOW,HIGH",
        help="a parameter and its bounds, any number of times; by its logarithm if both are above 0; the search "
        "begins at the case's own value",
    )
    command.add_argument("--data", metavar="FILE", help=DATA)
    command.add_argument(
        "--observe", action="append", default=[], metavar="NAME=VALUE+-ERROR", help="a measured number, any times"
    )
    command.add_argument("--error", type=float, metavar="E", help="standard error of a point, with --observe as well")
    command.add_argument(
        "--align",
        default="none",
        metavar="none|start|each",
        help="take out the rigid motion of the first frame, or of each (default: none)",
    )
    command.add_argument("--scale", type=float, metavar="F", help="lengths in FILE times F are in the case's unit")
    command.add_argument("--rate", type=float, metavar="R", help="frames a unit of the case's time")
    command.add_argument(
        "--headings",
        default="",
        metavar="NAME,NAME,...",
        help="what the columns of FILE are, in order (frame,x_um,,y_um), in place of its headings; empty: left alone",
    )


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case, changes, folder = begin(arguments, "fit")
    from ...studies.executors import opened
    from ...studies.fit import data, files, study

    with opened(arguments.executor, arguments.jobs) as pool:
        result = study.fit(
            case,
            bounds(arguments.vary),
            folder,
            arguments.data,
            changes,
            observe=data.observed(arguments.observe),
            error=arguments.error,
            align=arguments.align,
            scale=arguments.scale,
            rate=arguments.rate,
            headings=[name.strip() for name in arguments.headings.split(",")] if arguments.headings else (),
            jobs=arguments.jobs,
            executor=pool,
            log=tell,
        )
    tell("\n".join(lines(result)))
    tell(f"{folder / files.TABLE}, {files.DETAILS}, {files.FIGURE}")
    return DONE


def bounds(words: list[str]) -> dict[str, tuple[float, float]]:
    """Read KEY=LOW,HIGH. Raises CaseError."""
    out: dict[str, tuple[float, float]] = {}
    for word in words:
        key, _, values = (part.strip() for part in word.partition("="))
        try:
            low, high = map(float, values.split(","))
        except ValueError:
            raise CaseError([f"--vary {word}: found no two bounds; allowed: KEY=LOW,HIGH, two numbers"]) from None
        if not key or key in out:
            raise CaseError([f"--vary {word}: found {'no key' if not key else 'it twice'}; allowed: each key once"])
        out[key] = (low, high)
    return out


def lines(result: Fit) -> Iterator[str]:
    """The lines for the eye."""
    from ...analysis.summary import table

    yield result.title
    yield from table([["", "value", "95 %", "", ""], *(_row(one) for one in result.parameters)])
    for line in result.tied:
        yield f"  {line}"
    data, spread, unit = result.data, result.spread, "" if result.unit == "1" else f" {result.unit}"
    if data is not None and result.rms is not None:
        noise = f"noise goes together over {result.remembered:.1f} frames, {spread.blocks} blocks"
        yield (
            f"residual {result.rms:.3g}{unit} rms, {100 * result.rms / result.length:.2g} % of the length; "
            f"{data.count} points at {len(data.times)} times; {noise if spread.blocks else 'independent points'}"
        )
    for name, (value, error, own) in result.observables.items():
        away = (value - own) / error
        yield f"{name}: measured {value:.5g} +- {error:.2g}, run {own:.5g}, {away:+.1f} standard errors"
    for line in result.notes:
        yield f"note: {line}"
    if not result.converged:
        yield "NOT at the least: the most looks were taken; go on from the values below"
    yield f"{result.runs} runs"
    yield " ".join(f"{key}={value:.6g}" for key, value in result.values.items())


def _row(one: Fitted) -> list[str]:
    if one.interval is None:
        return [one.parameter.key, f"{one.value:.4g}", "", "", one.word]
    low, high = one.interval
    share = "" if one.half_width is None or one.word else f"half-width {100 * one.half_width:.2g} %"
    return [one.parameter.key, f"{one.value:.4g}", f"{low:.4g} to {high:.4g}", share, one.word]
