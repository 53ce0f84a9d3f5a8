"""One scene under several fluids, in one table: `ibfil compare`.

The fluids are those of the schema, and two more ways of resistive-force theory: `matched`, with the drag of a straight
rod dragged through the case's grid, and `slender`. Numbers are means over whole periods after the transient; their
errors come from the scatter between periods.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import CaseError, RunFailed
from ...io.reader import RunFile
from ...screen import tell
from ..member import Member, Outcome
from ..members import run_members
from ..runs import Runs
from ..settings import source
from ..tables import measured, refuse_strangers, write_csv, write_json
from ..uncertainty.files import row as source_row
from .bars import OBSERVED, observed, with_bars
from .fluids import fluid_overrides, known_fluids
from .quantities import Quantity, Window, quantities
from .results import Column, Comparison

if TYPE_CHECKING:
    from ...case.schema import Case


TABLE, DETAILS, FIGURE = "compare.csv", "compare.json", "compare.png"
LEVELS = "levels"  # the folder of the runs that bars are told from
BLOCKS = 4  # parts of the second half of a run without a period
_SLACK = 1e-6  # of a period: rounding
_TRANSIENT = 1 / 3  # of a run, at least, and a whole period

Log = Callable[[str], object]


def _members(case: str, overrides: Sequence[str], fluids: Sequence[str]) -> tuple[Case, list[Member]]:
    """The case as it is, and a member a fluid, each with its dissipation looked at."""
    known = known_fluids()
    faults = [f"--fluids: found {name}; allowed: {', '.join(known)}" for name in fluids if name not in known]
    if len(set(fluids)) < max(len(fluids), 2):
        faults.append(f"--fluids: found {', '.join(fluids)}; allowed: two or more, each once")
    if faults:
        raise CaseError(faults)
    whole = source(case)
    base = Member("case", whole, tuple(overrides)).resolved()
    seen: tuple[str, ...] = ()
    if not base.dissipation_observed:
        first = next(iter(base.filaments))
        seen = ("observe.dissipation.kind=dissipation", f"observe.dissipation.filament={first}")
    return base, [Member(name, whole, (*overrides, *seen, *fluid_overrides(name, base))) for name in fluids]


def compare(
    case: str,
    fluids: Sequence[str],
    folder: str | Path,
    overrides: Sequence[str] = (),
    *,
    period: float | None = None,
    transient: float | None = None,
    bars: bool = False,
    jobs: int = 1,
    executor: Executor | None = None,
    log: Log = tell,
) -> Comparison:
    """Run the scene under each fluid and write compare.csv, compare.json and compare.png into ``folder``.

    ``period`` is by default that of all that drives the scene; where it has none, the second half of the run is cut
    into four parts, whose scatter is the uncertainty. ``transient`` is what is left out at the start, by default a
    third of the run, at least a period, and until a soft start is over. ``bars`` runs each fluid at other levels of
    step and nodes too, and on a grid half a cell aside. Raises CaseError, before anything runs where no period would
    be left, RunFailed where no run came to an end, Interrupted.
    """
    folder, (base, members) = Path(folder), _members(case, overrides, fluids)
    refuse_strangers(folder, DETAILS, TABLE, FIGURE)
    if bars and base.thermal is not None:
        raise CaseError([f"{base.file}: [thermal]: found thermal noise; allowed: none with --bars (ibfil uncertainty)"])
    choose_window(base, base.time.end, period, transient)
    outcomes = run_members(members, folder, jobs=jobs, executor=executor, log=log)
    if not any(outcome.done for outcome in outcomes):
        raise RunFailed("no fluid's run came to an end: " + "; ".join(outcome.message for outcome in outcomes))
    with ExitStack() as stack:
        runs = {one.member.name: stack.enter_context(RunFile(one.path)) for one in outcomes if one.done}
        end = min(float(run.time[-1]) for run in runs.values())
        window = choose_window(next(iter(runs.values())).case, end, period, transient)
        own = only_here({name: run.case for name, run in runs.items()})
        first = next(iter(runs))

        def runs_of(name: str, inner: ExitStack) -> Runs:
            return Runs(folder / LEVELS / name, jobs, executor, lambda line: log(f"{name}, {line}"), inner)

        columns = tuple(_column(one, runs, first, window, own, runs_of if bars else None) for one in outcomes)
        title = next(iter(runs.values())).case.title
        result = Comparison(title, window, columns, measured())
        _write(result, folder, runs)
    return result


def _column(
    outcome: Outcome,
    runs: Mapping[str, RunFile],
    first: str,
    window: Window,
    own: Mapping[str, tuple[str, ...]],
    runs_of: Callable[[str, ExitStack], Runs] | None,
) -> Column:
    from ...check.report import share_lines
    from ...simulation.simulation import Simulation

    name = outcome.member.name
    if name not in runs:
        return Column(name, outcome, "", {}, (), ())
    run = runs[name]
    found = quantities(run, window, None if name == first else runs[first])
    found |= {OBSERVED + key: Quantity(value, None, "") for key, value in observed(run).items()}
    if runs_of is not None:
        found = with_bars(found, outcome, window, runs_of)
    seconds, _, covered = run.pace
    unit = "s" if run.case.units.time == "1" else f"s/{run.case.units.time}"
    if covered > 0:
        found["wall time a unit of time"] = Quantity(seconds / covered, None, unit)
    found["steps"] = Quantity(float(run.steps), None, "1")
    return Column(name, outcome, run.method, found, own[name], tuple(share_lines(Simulation(run.case))))


def choose_window(case: Case, end: float, period: float | None, transient: float | None) -> Window:
    """The whole periods that count of a run up to ``end``, or the parts of it where there are no periods.

    Raises CaseError where not one period is left.
    """
    since, why = 0.0, ""
    if period is None:
        period, since, why = _driven_period(case)
    if period is None:
        begin = transient if transient is not None else 0.5 * end
        if not begin < end:
            raise CaseError([f"--transient: found {begin:g}; allowed: below time.end = {end:g}"])
        return Window(end, (end - begin) / BLOCKS, BLOCKS, why)
    begin = transient if transient is not None else max(period, since, _TRANSIENT * end)
    count = int(np.floor((end - begin) / period + _SLACK))
    if count < 1:
        least = begin + period if transient is not None else max(since, period) + period
        raise CaseError(
            [
                f"time.end: found {end:g}; allowed: at least {least:.6g}: a whole period ({period:.6g}) after the "
                f"transient, or --period and --transient of your own"
            ]
        )
    return Window(end, period, count)


def _driven_period(case: Case) -> tuple[float | None, float, str]:
    """The period of what drives the scene and when it begins; None, and why, where there is none."""
    from ...simulation.simulation import Simulation

    drivers = Simulation(case).drivers
    if drivers.period is not None:
        return *drivers.period, ""
    return None, 0.0, "what drives never repeats itself" if drivers.windows else "nothing drives in time"


def only_here(cases: Mapping[str, Case]) -> dict[str, tuple[str, ...]]:
    """Return for each fluid what it models that not all of them do."""
    from ...check.report import modelled

    lines = {name: modelled(case) for name, case in cases.items()}
    everywhere = set.intersection(*(set(found) for found in lines.values()))
    return {name: tuple(line for line in found if line not in everywhere) for name, found in lines.items()}


def rows(result: Comparison) -> list[dict[str, Any]]:
    """Return the table: a row a quantity, and for each fluid its value and error."""
    names = list(dict.fromkeys(key for column in result.columns for key in column.numbers))
    out = []
    for name in names:
        unit = next(column.numbers[name].unit for column in result.columns if name in column.numbers)
        row: dict[str, Any] = {"quantity": name, "unit": unit}
        for column in result.columns:
            found = column.numbers.get(name)
            row |= {
                column.fluid: None if found is None else found.value,
                f"{column.fluid} +-": None if found is None else found.error,
            }
            if any(one.sources for one in column.numbers.values()):
                row[f"{column.fluid} bar"] = None if found is None else found.bar
        out.append(row)
    return out


def details(result: Comparison) -> dict[str, Any]:
    """Return everything, ready for JSON."""
    return {
        "title": result.title,
        **result.about,
        "window": None if result.window is None else asdict(result.window),
        "fluids": [
            {
                "fluid": column.fluid,
                "status": column.outcome.status,
                "message": column.outcome.message,
                "overrides": column.outcome.member.overrides,
                "method": column.method,
                "models_alone": column.own,
                "shares": column.shares,
                "numbers": {name: _number(found) for name, found in column.numbers.items()},
            }
            for column in result.columns
        ],
    }


def _number(found: Quantity) -> dict[str, Any]:
    out: dict[str, Any] = {"value": found.value, "error": found.error, "unit": found.unit}
    if found.sources:
        out |= {"bar": found.bar, "sources": [source_row(one) for one in found.sources]}
    return out


def _write(result: Comparison, folder: Path, runs: Mapping[str, RunFile]) -> None:
    from .figure import draw

    write_json(folder / DETAILS, details(result))
    write_csv(folder / TABLE, rows(result))
    draw(result, runs, folder / FIGURE)
