"""Where settings are stable and right: `ibfil stability`.

Each cell of the map is a run, held at its outputs against a finer one: a quarter of its step (in an explicit scheme,
whose step is small for stability's sake, a quarter of the default scheme's automatic one), by the default scheme, and
on a grid with a slip of at least 0.01, which keeps rods from locking. The first that is true names the cell:

    diverged    the run failed
    stretched   a segment's stretch differs by more than 0.02
    locked      nodal forces are more than ten times as large (rms): they fight each other between grid points
    turned      the filament is turned by more than 0.1 radians against the finer run
    wrong       nodes are more than 0.05 L away (rms)
    stable      none of these

What is foretold of it without a run is in predictions.py.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import CaseError
from ...screen import tell
from ..member import Member, Outcome
from ..members import run_members
from ..settings import Axis, Setting, combinations
from ..tables import measured, refuse_strangers, study_members, write_csv, write_json
from .predictions import Prediction, Rests, predicted
from .results import LOCKED, PLACE, STRETCH, TURN, Map, MapCell

if TYPE_CHECKING:
    from ...io.reader import RunFile


TABLE, DETAILS, FIGURE = "stability.csv", "stability.json", "stability.png"
FINER, SLIP = 4, 0.01

Log = Callable[[str], object]


def stability(
    case: str,
    axes: Sequence[Axis],
    folder: str | Path,
    overrides: Sequence[str] = (),
    *,
    jobs: int = 1,
    executor: Executor | None = None,
    log: Log = tell,
) -> Map:
    """Run every cell and its finer run; write stability.csv, stability.json and stability.png into ``folder``.

    Raises CaseError where the case or all settings are at fault, or it has thermal noise; Interrupted.
    """
    folder, settings = Path(folder), combinations(axes)
    members = study_members(case, overrides, settings)
    refuse_strangers(folder, DETAILS, TABLE, FIGURE)
    finer, predictions, rests = [], [], Rests()
    shared: dict[str, Member] = {}  # by the case: cells that differ in nothing it keeps have one, called as the first
    for member in members:
        reference, foretold = _prepared(member, rests)
        finer.append(None if reference is None else shared.setdefault(reference.resolved().text, reference))
        predictions.append(foretold)
    references = list(shared.values())
    run_members(
        references, folder / "finer", jobs=jobs, executor=executor, log=lambda line: log(f"finer run of {line}")
    )
    outcomes = run_members(members, folder / "runs", jobs=jobs, executor=executor, log=log)
    cells = tuple(
        _cell(setting, outcome, None if best is None else folder / "finer" / f"{best.name}.h5", foretold)
        for setting, outcome, best, foretold in zip(settings, outcomes, finer, predictions, strict=True)
    )
    title = next((_title(member) for member in members if _title(member)), "")
    result = Map(title, tuple(axes), cells, measured())
    _write(result, folder)
    return result


def _title(member: Member) -> str:
    try:
        return member.resolved().title
    except CaseError:
        return ""


def _prepared(member: Member, rests: Rests) -> tuple[Member | None, Prediction]:
    """The finer run of a member and what is predicted of it; no run where its case is at fault."""
    from ...simulation.simulation import Simulation

    try:
        case = member.resolved()
        if case.thermal is not None:
            raise CaseError(
                [f"{case.file}: [thermal]: found thermal noise; allowed: none, two random runs differ anyway"]
            )
        simulation = Simulation(case)
    except CaseError as error:
        if "random runs" in str(error):
            raise
        return None, Prediction()
    explicit = case.time.explicit
    default = ("time.scheme=implicit", "time.order=2")
    if explicit:
        automatic = (*member.overrides, *default, "time.step=auto")
        step = Simulation(Member("auto", member.case, automatic).resolved()).step_length / FINER
    else:
        step = simulation.step_length / FINER
    overrides = (*member.overrides, *default, f"time.step={step!r}")
    if case.fluid.on_grid:
        overrides += (f"fluid.slip={max(case.fluid.slip, SLIP)!r}",)
    return Member(member.name, member.case, overrides), predicted(simulation, rests)


def _cell(setting: Setting, outcome: Outcome, finer: Path | None, foretold: Prediction) -> MapCell:
    from ...io.reader import RunFile

    if not outcome.done:
        return MapCell(setting, "diverged", {}, *foretold, outcome.message)
    if finer is None or not finer.exists():
        return MapCell(setting, "no reference", {}, *foretold, "the finer run could not be made")
    with RunFile(outcome.path) as run, RunFile(finer) as best:
        if best.status not in ("finished", "stopped"):
            return MapCell(setting, "no reference", {}, *foretold, f"the finer run: {best.reason}")
        found = compared(run, best)
    return MapCell(setting, classed(found), found, *foretold, "")


def compared(run: RunFile, best: RunFile) -> dict[str, float]:
    """The numbers that class a run, the largest over the outputs and filaments."""
    from ..distance import common_outputs, rms, rms_of_shape

    mine, theirs = common_outputs(run, best)
    shape, turn = rms_of_shape(run, best)
    stretch, forces = 0.0, []
    for name, columns in run.filaments.items():
        rest = np.diff(run.arclength(name))
        other = best.filaments[name]
        pair = (np.asarray(columns["position"])[mine], np.asarray(other["position"])[theirs])
        a, b = (np.linalg.norm(np.diff(r, axis=1), axis=2) / rest for r in pair)
        stretch = max(stretch, float(np.max(np.abs(a - b))))
        # The force of the start is that of the start shape, in both.
        sizes = [float(np.mean(np.asarray(c["force"])[at][1:] ** 2)) for c, at in ((columns, mine), (other, theirs))]
        forces.append(np.sqrt(sizes[0] / sizes[1]) if sizes[1] > 0 else 1.0)
    return {
        "place": float(np.max(rms(run, best))),
        "shape": float(np.max(shape)),
        "turn": float(np.max(turn)),
        "stretch": stretch,
        "force": float(max(forces)),
    }


def classed(found: Mapping[str, float]) -> str:
    """Return the name of the first thing that is amiss, or stable."""
    if found["stretch"] > STRETCH:
        return "stretched"
    if found["force"] > LOCKED:
        return "locked"
    if found["turn"] > TURN:
        return "turned"
    return "wrong" if found["place"] > PLACE else "stable"


def rows(result: Map) -> list[dict[str, Any]]:
    """Return the table: a row a cell."""
    return [
        {
            **cell.setting.values,
            "class": cell.kind,
            "predicted": cell.predicted or "stable",
            "predicted from": cell.why,
            **cell.numbers,
            "message": cell.message,
        }
        for cell in result.cells
    ]


def _write(result: Map, folder: Path) -> None:
    from .figure import draw

    limits = {"stretch": STRETCH, "force": LOCKED, "turn": TURN, "place": PLACE}
    write_json(folder / DETAILS, {"title": result.title, **result.about, "limits": limits, "cells": rows(result)})
    write_csv(folder / TABLE, rows(result))
    draw(result, folder / FIGURE)
