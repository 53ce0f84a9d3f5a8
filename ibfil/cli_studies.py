"""The commands of the studies, `ibfil sweep`, `compare`, `trade`, `stability`: words to calls, results to lines.

As in cli.py only the standard library is imported here.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import CaseError, Interrupted, RunFailed
from .threads import set_threads

if TYPE_CHECKING:
    from .study import Axis
    from .trade import Trade

CASE = "the case, a file or a shipped name, and changes to it that hold for all runs"
VARY = "what is varied: KEY=V1,V2,..., any number of times; keys that change together: KEY=V1,V2&OTHER=W1,W2"


def add_studies(add: Callable[..., argparse.ArgumentParser]) -> None:
    """Add the commands, by the function that adds one."""
    sweep = add("sweep", _sweep, "a run for each combination of settings, and a table of all observables")
    _common(sweep, "sweep")
    sweep.add_argument("--vary", action="append", required=True, metavar="KEY=V1,V2,...", help=VARY)
    sweep.add_argument("--list", action="store_true", help="only list the combinations and their indices")
    sweep.add_argument("--index", type=int, metavar="K", help="run that combination alone: a task of a job array")
    trade = add("trade", _trade, "error against wall time over settings, with a proved reference and the Pareto front")
    _common(trade, "trade")
    trade.add_argument("--vary", action="append", required=True, metavar="KEY=V1,V2,...", help=VARY)
    trade.add_argument("--observe", metavar="NAME,...", help="errors of what: position, observables (default: all)")
    trade.add_argument("--repeat", type=_count, default=3, metavar="N", help="runs of each setting, for the noise")
    trade.add_argument(
        "--clock",
        choices=("wall", "processor"),
        default="wall",
        help="whose seconds count; on a busy machine: processor",
    )
    trade.add_argument("--budget", type=_duration, metavar="10m", help="stop after this time: 90s, 10m, 2h")
    trade.add_argument("--for", dest="wanted", type=_error, metavar="1e-3", help="end with the cheapest for this error")
    compare = add("compare", _compare, "one scene under several fluids: table, CSV and a figure")
    _common(compare, "compare")
    compare.add_argument(
        "--fluids",
        metavar="rft,stokes,...",
        default="rft,matched,stokes",
        help="rft, matched (drag of the grid), slender, stokes, navier-stokes (default: %(default)s)",
    )
    compare.add_argument("--period", type=_error, metavar="T", help="of the motion (default: of what drives it)")
    compare.add_argument("--transient", type=_error, metavar="T", help="left out at the start (default: a third)")
    stability = add("stability", _stability, "which settings are stable and right: a map, with the predicted limit")
    _common(stability, "stability")
    stability.add_argument("--vary", action="append", required=True, metavar="KEY=V1,V2,...", help=VARY)


def _common(command: argparse.ArgumentParser, kind: str) -> None:
    command.epilog = "Done runs are kept, cut ones gone on with: the same command again finishes a study."
    command.add_argument("words", nargs="+", metavar="CASE [KEY=VALUE ...]", help=CASE)
    command.add_argument("-o", dest="folder", metavar="DIR", help=f"the folder (default: the case's name -{kind})")
    command.add_argument("--jobs", type=_count, default=1, metavar="N", help="runs side by side, one thread each")


def _count(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 0 < int(text) <= 4096:
        raise argparse.ArgumentTypeError(f"found {text}; allowed: a whole number from 1 to 4096")
    return int(text)


def _duration(text: str) -> float:
    """Seconds of 90s, 10m, 2h."""
    scale = {"s": 1.0, "m": 60.0, "h": 3600.0}.get(text[-1:])
    value = _positive(text[:-1] if scale else text)
    if value is None:
        raise argparse.ArgumentTypeError(f"found {text}; allowed: a time such as 90s, 10m or 2h")
    return value * (scale or 1.0)


def _error(text: str) -> float:
    value = _positive(text)
    if value is None:
        raise argparse.ArgumentTypeError(f"found {text}; allowed: a number above 0")
    return value


def _positive(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if 0 < value < 1e12 else None


def _begin(arguments: argparse.Namespace, kind: str) -> tuple[str, list[str], Path]:
    """The case, its overrides and the folder; the libraries not loaded yet get one thread."""
    set_threads(1)
    case, *changes = arguments.words
    stray = [f"{word}: found a word; allowed: KEY=VALUE" for word in changes if "=" not in word]
    if stray:
        raise CaseError(stray)
    return case, changes, Path(arguments.folder or f"{Path(case).stem}-{kind}")


def _axes(words: Sequence[str]) -> list[Axis]:
    from .study import axis

    return [axis(word) for word in words]


def _say(line: str) -> None:
    print(line, flush=True)


def _print_table(rows: Sequence[Mapping[str, Any]], left_out: Sequence[str] = ()) -> None:
    """Rows under the union of their columns."""
    from .show import table
    from .study import shown

    columns = [key for key in dict.fromkeys(key for row in rows for key in row) if key not in left_out]
    print("\n".join(table([columns, *([shown(row.get(key)) for key in columns] for row in rows)])))


def _sweep(arguments: argparse.Namespace) -> int:
    case, changes, folder = _begin(arguments, "sweep")
    axes = _axes(arguments.vary)
    from . import sweep

    if arguments.list:
        print("\n".join(sweep.listing(case, axes, changes)))
        return 0
    if arguments.index is not None:
        return _one(sweep.run_one(case, axes, folder, arguments.index, changes))
    rows = sweep.sweep(case, axes, folder, changes, jobs=arguments.jobs, say=_say)
    _print_table([row.row() for row in rows], ("run", "message"))
    print(folder / sweep.TABLE)
    return 0 if all(row.outcome.done for row in rows) else 1


def _one(outcome: Any) -> int:
    """The end of one member, told as that of a run."""
    if outcome.status == "interrupted":
        raise Interrupted(f"{outcome.member.name}: {outcome.message}")
    if not outcome.done:
        raise RunFailed(f"{outcome.member.name}: {outcome.status}: {outcome.message}")
    print(f"{outcome.path}: {outcome.status}")
    return 0


def _trade(arguments: argparse.Namespace) -> int:
    case, changes, folder = _begin(arguments, "trade")
    axes = _axes(arguments.vary)
    from . import trade

    made = trade.trade(
        case,
        axes,
        folder,
        changes,
        observe=arguments.observe.split(",") if arguments.observe else (),
        repeat=arguments.repeat,
        clock=arguments.clock,
        budget=arguments.budget,
        jobs=arguments.jobs,
        say=_say,
    )
    _print_table(trade.rows(made), ("message",))
    print(f"{folder / trade.TABLE}, {trade.DETAILS}, {trade.FIGURE}")
    if arguments.wanted is None:
        return 0
    best = made.cheapest(arguments.wanted)
    if best is None:
        return _none_within(made, arguments.wanted)
    print(f"the cheapest within {arguments.wanted:g}:")
    print(*best.setting.overrides)
    return 0


def _none_within(made: Trade, wanted: float) -> int:
    """Say how near the settings came."""
    told = f"ibfil: no setting comes within {wanted:g} in {', '.join(made.measures)}"
    done = [one for one in made.tried if one.errors]
    if done:
        best = min(done, key=lambda one: max(made.error(one, measure) for measure in made.measures))
        worst = max(made.measures, key=lambda measure: made.error(best, measure))
        named = " ".join(best.setting.overrides)
        told += f"; the nearest, {named}, is {made.error(best, worst):.2g} off in {worst}, with the reference's own"
    print(told, file=sys.stderr)
    print("ibfil: what to change: vary other keys, or shorter steps", file=sys.stderr)
    return 1


def _compare(arguments: argparse.Namespace) -> int:
    case, changes, folder = _begin(arguments, "compare")
    from . import compare

    made = compare.compare(
        case,
        arguments.fluids.split(","),
        folder,
        changes,
        period=arguments.period,
        transient=arguments.transient,
        jobs=arguments.jobs,
        say=_say,
    )
    _print_comparison(made)
    print(f"{folder / compare.TABLE}, {compare.DETAILS}, {compare.FIGURE}")
    return 0 if all(column.outcome.done for column in made.columns) else 1


def _print_comparison(made: Any) -> None:
    """The table for the eye, and what each fluid models that not all do."""
    from .show import table

    def cell(found: Any) -> str:
        if found is None:
            return "-"
        return f"{found.value:.4g}" + ("" if found.error is None else f" +- {found.error:.1g}")

    names = list(dict.fromkeys(key for column in made.columns for key in column.numbers))
    lines = [["", *(column.fluid for column in made.columns)]]
    lines += [[name, *(cell(column.numbers.get(name)) for column in made.columns)] for name in names]
    print("\n".join(table(lines)))
    window = made.window
    print(
        f"means over {window.count} x {window.period:.4g}, from t = {window.start:.4g} to {window.end:.4g}; "
        "+- their standard error, from the scatter between these, not that of steps, nodes or cells"
    )
    for column in made.columns:
        for line in column.own or (column.outcome.message or "nothing that the others do not model",):
            print(f"  {column.fluid}: {line}")
    for column in made.columns:
        for line in column.shares:
            print(f"  {column.fluid}: {line}")


def _stability(arguments: argparse.Namespace) -> int:
    case, changes, folder = _begin(arguments, "stability")
    axes = _axes(arguments.vary)
    from . import stability

    made = stability.stability(case, axes, folder, changes, jobs=arguments.jobs, say=_say)
    _print_table(stability.rows(made), ("message",))
    print(
        "against a finer run, the largest over outputs: place and shape (without rigid motion), rms of nodes/L; "
        "turn, rad; stretch; force, ratio"
    )
    print(f"{made.foretold} of {len(made.cells)} as predicted")
    print(f"{folder / stability.TABLE}, {stability.DETAILS}, {stability.FIGURE}")
    return 0
