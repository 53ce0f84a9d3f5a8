"""Parameters of a scene from tracked shapes or measured numbers, with intervals: `ibfil fit`.

The run puts out exactly at the times of the data, and is compared at their arclengths: no interpolation in time.
Residuals are those of points (residuals.py) and of observables, (run - measured)/error; with both, points count in
units of ``error``.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import CaseError
from ...io.reader import RunFile
from ...io.units import label
from ...screen import tell
from ..member import Member
from ..members import run_members
from ..settings import source
from ..tables import measured, numbers, refuse_strangers
from . import files
from .data import Data, read
from .intervals import memory, spread, weakest
from .residuals import ALIGNED, Seen, look, residuals
from .resolution import errors
from .resolution import notes as too_coarse
from .results import Errors, Fit, Parameter, fitted, tied
from .search import Found, Search, search

if TYPE_CHECKING:
    from ...case.schema import Case
    from ..member import Outcome

RUNS = "runs"
_PLACES = 9  # arclengths at which the memory of residuals is looked at
_SHORTEST = 1e-9  # of the last time: frames that are one


class _Target:
    """The data and the measured numbers, and the residuals of a run from them."""

    def __init__(self, data: Data | None, align: str, observables: Mapping[str, tuple[float, float]], error: float):
        self.data, self.align, self.observables, self.error = data, align, dict(observables), error

    def seen(self, run: RunFile) -> list[Seen]:
        """The run at the frames."""
        return [] if self.data is None else look(run, self.data, self.align)

    def of(self, outcome: Outcome) -> np.ndarray:
        """The residuals (n,): points frame by frame, then observables."""
        with RunFile(outcome.path) as run:
            parts = [] if self.data is None else residuals(self.seen(run), self.data)
            found = self.found(run)
        own = [(found[name] - value) / error for name, (value, error) in self.observables.items()]
        return np.concatenate([*(part.ravel() / self.error for part in parts), np.array(own)])

    def found(self, run: RunFile) -> dict[str, float]:
        """The run's observables, of those that were measured."""
        there = numbers(run) if self.observables else {}
        strange = [name for name in self.observables if name not in there]
        if strange:
            raise CaseError([f"--observe {strange[0]}: found no such number; allowed: {', '.join(there) or 'none'}"])
        return {name: there[name] for name in self.observables}


def fit(
    case: str,
    vary: Mapping[str, tuple[float, float]],
    folder: str | Path,
    data: str | Path | None = None,
    overrides: Sequence[str] = (),
    *,
    observe: Mapping[str, tuple[float, float]] | None = None,
    error: float | None = None,
    align: str = "none",
    scale: float | None = None,
    rate: float | None = None,
    headings: Sequence[str] = (),
    jobs: int = 1,
    executor: Executor | None = None,
    log: Callable[[str], object] = tell,
) -> Fit:
    """The parameters, each key of ``vary`` between its two bounds, from tracked shapes and measured numbers.

    ``data`` is a table of tracked points (data.py), ``observe`` observables of the case as (value, standard error);
    ``error`` that of points, needed where both are given. ``align``: none, start (the rigid motion of the first
    frame is taken out) or each (of every frame). ``scale`` times lengths and 1/``rate`` times frame numbers or times
    are in case units; ``headings`` stand for those of the file. The search begins at the case's own values, so
    ``overrides`` move it. Writes fit.csv, fit.json, fit.png.

    Raises CaseError; RunFailed where the run fails at the start or beside the best place; Interrupted: the same call
    goes on.
    """
    folder = Path(folder)
    refuse_strangers(folder, files.DETAILS, files.TABLE, files.FIGURE)
    whole, changes = source(case), tuple(overrides)
    base = Member("case", whole, changes).resolved()
    _refuse(base, data, observe, error, align, scale, rate)
    parameters, start = _parameters(base, vary)
    tracked = None if data is None else _read(base, Path(data), scale, rate, headings)
    target = _Target(tracked, align, observe or {}, error or 1.0)
    if tracked is not None:
        changes += _at_times(base, tracked.times, bool(observe))
    runs = Search(whole, changes, parameters, _maker(folder / RUNS, jobs, executor, log), target.of)
    runs.member(runs.values(start)).resolved()  # a key that the case does not have
    found = search(runs, start)
    result = _result(base, parameters, target, found, errors(runs, found))
    files.write(result, folder)
    return result


def _maker(folder: Path, jobs: int, executor: Executor | None, log: Callable[[str], object]) -> Any:
    def make(members: Sequence[Member]) -> list[Outcome]:
        return run_members(members, folder, jobs=jobs, executor=executor, log=log) if members else []

    return make


def _refuse(
    case: Case,
    data: str | Path | None,
    observe: Mapping[str, tuple[float, float]] | None,
    error: float | None,
    align: str,
    scale: float | None,
    rate: float | None,
) -> None:
    """Raise CaseError where what is asked for cannot be."""
    faults = []
    if data is None and not observe:
        faults.append("fit: found neither --data nor --observe; allowed: one of them, or both")
    if data is not None and observe and error is None:
        faults.append("fit: found --data and --observe; allowed: with --error, the standard error of the points")
    if align not in ALIGNED:
        faults.append(f"--align {align}: found no such; allowed: {', '.join(ALIGNED)}")
    for name, value in (("--scale", scale), ("--rate", rate), ("--error", error)):
        if value is not None and not 0 < value < math.inf:
            faults.append(f"{name} {value:g}: found no number above 0; allowed: above 0")
    if case.thermal is not None and case.thermal.energy > 0:
        faults.append(
            "thermal.energy: found thermal forces; allowed: 0 in a fit, runs must follow from parameters alone"
        )
    if faults:
        raise CaseError(faults)


def _parameters(case: Case, vary: Mapping[str, tuple[float, float]]) -> tuple[list[Parameter], np.ndarray]:
    """The parameters, and where the search begins: the case's own values, else the middle. Raises CaseError."""
    if not vary:
        raise CaseError(["--vary: found none; allowed: KEY=LOW,HIGH, one or more"])
    parameters, start, raw = [], [], tomllib.loads(case.text)
    for key, (low, high) in vary.items():
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise CaseError([f"--vary {key}={low:g},{high:g}: allowed: two numbers, the lower one first"])
        one, own = Parameter(key, float(low), float(high)), _own(raw, key)
        if own is not None and not low <= own <= high:
            raise CaseError([f"--vary {key}={low:g},{high:g}: the case has {own:g}; allowed: bounds around it, "
                             f"or another start, {key}=VALUE after the case"])  # fmt: skip
        parameters.append(one)
        middle = 0.5 * (one.inner(one.low) + one.inner(one.high))
        start.append(middle if own is None else one.inner(own))
    return parameters, np.array(start)


def _own(raw: Any, key: str) -> float | None:
    """The case's own number for a key; None for a formula of parameters, or what it leaves to its default."""
    from ...case.expressions import ExpressionError, parse

    for word in key.split("."):
        raw = raw[int(word)] if isinstance(raw, list) and word.isdigit() and int(word) < len(raw) else (
            raw.get(word) if isinstance(raw, dict) else None)  # fmt: skip
    if isinstance(raw, bool | dict | list):
        raise CaseError([f"--vary {key}: found what is no number; allowed: keys of one number"])
    if not isinstance(raw, str):
        return None if raw is None else float(raw)
    try:
        return parse(raw).constant
    except ExpressionError:
        pass
    if raw.isidentifier() and not key.startswith("parameters"):
        raise CaseError([f"--vary {key}: found the word {raw!r}; allowed: keys of a number, or the parameter itself"])
    return None


def _read(case: Case, path: Path, scale: float | None, rate: float | None, headings: Sequence[str]) -> Data:
    lengths = {name: float(one.length) for name, one in case.filaments.items()}
    units = (label(case.units, "length"), label(case.units, "time"))
    data = read(path, lengths, units, scale=scale, rate=rate, named=headings)
    first, last, end = data.frames[0].time, data.frames[-1].time, float(case.time.end)
    if first < 0 or last > end * (1 + _SHORTEST):
        wrong = first if first < 0 else last
        raise CaseError(
            [f"--data: found t = {wrong:g}; allowed: 0 to time.end = {end:g}; --rate is frames a unit of time"]
        )
    return data


def _at_times(case: Case, times: list[float], observed: bool) -> tuple[str, ...]:
    """Outputs at the data's times; where observables count, at the case's own too."""
    end = float(case.time.end)
    wanted = [min(time, end) for time in times]
    if observed:
        every = case.output.every
        wanted += [end, *(case.output.times or ())]
        wanted += [] if every is None else [k * every for k in range(int(end / every * (1 + _SHORTEST)) + 1)]
    kept: list[float] = []
    for time in sorted(wanted):
        if not kept or time - kept[-1] > _SHORTEST * end or time in times:
            kept.append(time)
    return ("output.every=absent", f"output.times={[float(time) for time in kept]}")


def _result(case: Case, parameters: list[Parameter], target: _Target, found: Found, off: Errors) -> Fit:
    with RunFile(found.outcome.path) as run:
        seen, own = target.seen(run), target.found(run)
    data, error = target.data, target.error
    points = 0 if data is None else data.count * len(data.axes)
    remembered = 1.0 if data is None else memory(_series(seen, data))
    parts = [] if data is None else _by_time(data)
    bars = spread(
        [found.jacobian[part] for part in parts],
        [found.residuals[part] for part in parts],
        found.jacobian[points:],
        remembered,
    )
    sizes, direction = weakest(found.jacobian)
    weights = 0.0 if data is None else sum(float(np.sum(frame.weight)) for frame in data.frames)
    rms = None if data is None else error * float(np.sqrt(np.sum(found.residuals[:points] ** 2) / weights))
    notes = list(data.notes if data is not None else ())
    if data is not None and bars.blocks == 0:
        notes.append("too few frames to see how noise goes together: points are taken as independent of each other")
    told = tuple(fitted(p, float(x), float(h)) for p, x, h in zip(parameters, found.inner, bars.half, strict=True))
    notes += too_coarse(off, told, bars.half)
    return Fit(
        title=case.title,
        parameters=told,
        spread=bars,
        singular=sizes,
        tied=tuple(tied(parameters, bars, sizes, direction)),
        rms=rms,
        length=max(float(one.length) for one in case.filaments.values()),
        remembered=remembered,
        data=data,
        seen=seen,
        observables={name: (*target.observables[name], own[name]) for name in own},
        runs=found.runs + len(off),
        numerical=off,
        converged=found.converged,
        unit=label(case.units, "length"),
        time_unit=label(case.units, "time"),
        notes=tuple(notes),
        about=measured(),
    )


def _by_time(data: Data) -> list[np.ndarray]:
    """Indices into the residuals of the points of each time; all filaments together."""
    ends = np.cumsum([0, *(frame.points.size for frame in data.frames)])
    places: dict[float, list[np.ndarray]] = {}
    for frame, a, b in zip(data.frames, ends, ends[1:], strict=False):
        places.setdefault(frame.time, []).append(np.arange(a, b))
    return [np.concatenate(parts) for parts in places.values()]


def _series(seen: list[Seen], data: Data) -> np.ndarray:
    """Residuals (frames, k) at the same places of each frame, of the filament with the most frames."""
    names = [frame.filament for frame in data.frames]
    name = max(dict.fromkeys(names), key=names.count)
    rows = []
    for one, frame in zip(seen, data.frames, strict=True):
        if frame.filament == name:
            order = np.argsort(frame.s)
            at = np.linspace(frame.s[order[0]], frame.s[order[-1]], min(_PLACES, len(frame.s)))
            gap = (one.model - one.data)[order]
            rows.append(np.stack([np.interp(at, frame.s[order], part) for part in gap.T], axis=1))
    least = min(len(row) for row in rows)
    return np.array([row[np.linspace(0, len(row) - 1, least).round().astype(int)].ravel() for row in rows])
