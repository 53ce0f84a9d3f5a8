"""`ibfil uncertainty`: an error bar on every number, and where it comes from."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...screen import tell
from ..arguments import DONE
from .arguments import add_study, begin

if TYPE_CHECKING:
    from ...studies.uncertainty.results import Bar, Source, Uncertainty

NAME, HELP = "uncertainty", "an error bar on every number of a scene, and where it comes from"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    add_study(command, "uncertainty")
    command.add_argument("--observe", metavar="NAME,...", help="which observables (default: all)")
    command.add_argument("--fine", action="store_true", help="finer levels in every direction: dearer, surer")
    command.add_argument(
        "--meant", action="store_true", help="look at choices too: images of the box, slip, stretching"
    )


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case, changes, folder = begin(arguments, "uncertainty")
    from ...studies.executors import opened
    from ...studies.uncertainty import files, study

    with opened(arguments.executor, arguments.jobs) as pool:
        result = study.uncertainty(
            case,
            folder,
            changes,
            observe=arguments.observe.split(",") if arguments.observe else (),
            fine=arguments.fine,
            meant=arguments.meant,
            jobs=arguments.jobs,
            executor=pool,
            log=tell,
        )
    tell("\n".join(lines(result)))
    tell(f"{folder / files.TABLE}, {files.DETAILS}, {files.FIGURE}")
    return DONE


def lines(result: Uncertainty) -> Iterator[str]:
    """The lines for the eye."""
    yield result.title
    for bar in result.bars:
        yield ""
        yield from _of(bar)
    yield ""
    yield f"{result.runs} runs, {result.cost:.1f} times the processor time of the scene's own"


def _of(bar: Bar) -> Iterator[str]:
    """A number, its sources, its corrected value, what to do first."""
    from ...studies.tables import with_bar

    if bar.nothing:
        yield f"{bar.name}: {bar.nothing}"
        return
    share = f" ({100 * bar.bar / abs(bar.value):.2g} %)" if abs(bar.value) > bar.bar else ""
    least = "" if bar.whole else "at least "
    value, _, width = with_bar(bar.value, bar.bar).partition(" +- ")
    yield f"{bar.name} = {value} +- {least}{width}{share}   {bar.words}"
    yield from _table(bar, True)
    yield f"  corrected: {with_bar(*bar.corrected)}"
    if bar.meant is not None:
        yield "  as meant, the choices taken out:"
        yield from _table(bar, False)
        unknown = [one.name for one in bar.sources if not one.numerical and one.estimate is None]
        yield f"  as meant: {with_bar(*bar.meant)}" + (f", but for {', '.join(unknown)}" if unknown else "")
    if bar.halves is not None and not bar.settled:
        both = " and ".join(f"{value:.4g}" for value in bar.halves)
        yield f"  not settled: over the two halves of its window it is {both}; the bar is for the window as it is"
    first = _first(bar)
    if first:
        yield f"  what to do first: {first}"


def _table(bar: Bar, numerical: bool) -> Iterator[str]:
    from ...analysis.summary import table

    head = ["", "error of the run", "doubt", ""]
    kept = [one for one in bar.sources if one.numerical is numerical]
    yield from table([head, *(_row(one, bar) for one in kept)])


def _row(source: Source, bar: Bar) -> list[str]:
    told = source.estimate
    if told is None:
        return [source.name, "not known", "", source.words]
    return [source.name, _amount(told.error, bar, "+"), _amount(told.doubt, bar), source.words]


def _amount(value: float, bar: Bar, sign: str = "") -> str:
    """A size in per cent of the number, or as it is where the number is not told from zero."""
    if abs(bar.value) <= bar.bar:
        return f"{value:{sign}.2g}"
    share = 100 * value / bar.value if sign else 100 * value / abs(bar.value)
    return "0" if abs(share) < 5e-7 else f"{share:{sign}.2g} %"


REMEDIES = {
    "step": "a shorter time.step",
    "nodes": "more nodes",
    "place in a cell": "the mean with a run half a cell away, which `corrected` has",
    "outputs": "a shorter output.every",
    "seeds": "a longer run, or more seeds (--fine)",
}


def _first(bar: Bar) -> str:
    """The remedy of the largest sources, the first two."""
    known = [one for one in bar.sources if one.numerical and one.estimate is not None and one.size > 0.2 * bar.bar]
    found = []
    for one in sorted(known, key=lambda one: -one.size)[:2]:
        words = REMEDIES.get(one.name, one.name)
        if one.estimate is not None and one.estimate.word == "unseen":
            words += " (its levels show no order: the bar may not shrink much)"
        found.append(words)
    return "; then ".join(found)
