"""`ibfil compare`: one scene under several fluids."""

from __future__ import annotations

import argparse
from typing import Any

from ...screen import tell
from ..arguments import positive
from .arguments import add_study, begin

_SCATTER = (
    "+- their standard error, from the scatter between these, not that of steps, nodes or cells: --bars looks at those"
)
_SMALL = 0.05  # of a bar: scatter that is not told beside it
_BARS = (
    "+- the bar of step, nodes and place in a cell, as ibfil uncertainty has it; scatter: standard error between these"
)
NAME, HELP = "compare", "one scene under several fluids: table, CSV and a figure"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    add_study(command, "compare")
    command.add_argument(
        "--fluids",
        metavar="rft,stokes,...",
        default="rft,matched,stokes",
        help="rft, matched (drag of the grid), slender, stokes, navier-stokes (default: %(default)s)",
    )
    command.add_argument("--period", type=positive, metavar="T", help="of the motion (default: of what drives it)")
    command.add_argument(
        "--bars",
        action="store_true",
        help="error bars on all rows, as ibfil uncertainty has them: some five times the runs",
    )
    command.add_argument("--transient", type=positive, metavar="T", help="left out at the start (default: a third)")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    case, changes, folder = begin(arguments, "compare")
    from ...studies.compare import study
    from ...studies.executors import opened

    with opened(arguments.executor, arguments.jobs) as pool:
        result = study.compare(
            case,
            arguments.fluids.split(","),
            folder,
            changes,
            period=arguments.period,
            transient=arguments.transient,
            bars=arguments.bars,
            jobs=arguments.jobs,
            executor=pool,
            log=tell,
        )
    _print_comparison(result)
    tell(f"{folder / study.TABLE}, {study.DETAILS}, {study.FIGURE}")
    return 0 if all(column.outcome.done for column in result.columns) else 1


def _print_comparison(result: Any) -> None:
    """The table for the eye, and what each fluid models that not all do."""
    from ...analysis.summary import table
    from ...studies.tables import with_bar

    barred = any(one.sources for column in result.columns for one in column.numbers.values())

    def cell(found: Any) -> str:
        if found is None:
            return "-"
        if found.sources:
            told = found.error and not found.error < _SMALL * (found.bar or 0.0)
            stated = with_bar(found.value, float("inf") if found.bar is None else found.bar)
            return stated + (f" (scatter {found.error:.1g})" if told else "")
        if barred:
            return f"{found.value:.4g}" + (f" (scatter {found.error:.1g})" if found.error else "")
        return f"{found.value:.4g}" + ("" if found.error is None else f" +- {found.error:.1g}")

    names = list(dict.fromkeys(key for column in result.columns for key in column.numbers))
    lines = [["", *(column.fluid for column in result.columns)]]
    lines += [[name, *(cell(column.numbers.get(name)) for column in result.columns)] for name in names]
    tell("\n".join(table(lines)))
    window = result.window
    tell(
        f"means over {window.count} {'parts' if window.why else 'periods'} of {window.period:.4g}"
        f"{f' (no periods: {window.why})' if window.why else ''}, from t = {window.start:.4g} to {window.end:.4g}; "
        + (_BARS if barred else _SCATTER)
    )
    for column in result.columns:
        for line in column.own or (column.outcome.message or "nothing that the others do not model",):
            tell(f"  {column.fluid}: {line}")
    for column in result.columns:
        for line in column.shares:
            tell(f"  {column.fluid}: {line}")
