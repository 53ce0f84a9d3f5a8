"""The summary of a run file as text, JSON or a table: `ibfil show`."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..io.overwriting import replacing, table_of
from ..io.reader import RunFile
from ..io.units import label
from ..observables.base import Observable
from ..observables.copies import series_parts
from ..observables.expectations import check
from ..observables.factory import numbers_of, observers
from ..observables.observers import Summary


def digest(run: RunFile) -> dict[str, Any]:
    """All that is told of a run, ready for JSON: a number that is not finite is None, a vector a list."""
    case = run.case
    observables, found = observers(case).observables, numbers_of(case, run.time, run.observables)
    extra = set(run.observables) - {case.observe[name].recorded(name) for name in observables}  # made in Python
    return {
        "file": str(run.path),
        "title": case.title,
        "source": case.source,
        "status": run.status,
        "reason": run.reason,
        "created": run.created,
        "finished": run.finished,
        "outputs": len(run),
        "time": [float(run.time[0]), float(run.time[-1])],
        "units": case.units.model_dump(),
        "steps": run.steps,
        "wall_time": run.wall_time,
        "fluid": case.fluid.words,
        "method": run.method,
        "groups": run.groups,
        "filaments": {name: columns["position"].shape[1] for name, columns in run.filaments.items()},
        "copies_every": case.output.copies_every if any(f.copies for f in case.filaments.values()) else 1,
        "fields": {} if run.grid is None else {name: len(column) for name, column in run.grid.fields.items()},
        "observables": {name: _observed(run, name, observables[name], found[name]) for name in observables}
        | {name: _last(run, name) for name in run.observables if name in extra},
        "diagnostics": {name: _extent(run, name) for name in run.diagnostics},
        "expected": [
            {
                "name": held.name,
                "observe": held.observe,
                "expected": held.expected,
                "found": _plain(held.found),
                "error": _plain(held.error),
                "passed": held.passed,
                "source": held.source,
                "note": held.note,
            }
            for held in check(case, found)
        ],
        "versions": run.versions,
        "case": run.case_text,
    }


def _observed(run: RunFile, name: str, observable: Observable, found: Summary) -> dict[str, Any]:
    """The number of one observable of the case."""
    units = label(run.case.units, observable.summary_dimension)
    words = getattr(observable, "words", observable.description)
    return {
        "value": _plain(found.value),
        "standard_error": None if found.error is None else _plain(found.error),
        "units": units,
        "description": words,
        "note": found.note or found.doubt,
        "quality": found.quality,
    }


def _last(run: RunFile, name: str) -> dict[str, Any]:
    """The last value of an observable that was added from Python."""
    path, last = f"observables/{name}", _plain(run.observables[name][-1])
    known = {"units": run.units(path), "description": run.description(path), "note": "", "quality": ""}
    return {"value": last, "standard_error": None, **known}


def _plain(value: float | np.ndarray) -> float | list[float | None] | None:
    numbers = [float(v) if np.isfinite(v) else None for v in np.atleast_1d(value)]
    return numbers if np.ndim(value) else numbers[0]


def _extent(run: RunFile, name: str) -> dict[str, Any]:
    """The range of a diagnostic over the run: of a vector, of its size."""
    values = np.asarray(run.diagnostics[name])
    size = np.linalg.norm(values, axis=-1) if values.ndim > 1 else values
    return {"min": _plain(size.min()), "max": _plain(size.max()), "units": run.units(f"diagnostics/{name}")}


def as_text(told: Mapping[str, Any]) -> str:
    """The digest of a run for the eye."""
    unit = "" if told["units"]["time"] == "1" else " " + told["units"]["time"]
    end = f", until {told['finished']}" if told["finished"] else ""
    nodes = listed([f"{name} ({count} nodes)" for name, count in told["filaments"].items()])
    every = told["copies_every"]
    some = f"; of copies one in {every} is written, and observed (output.copies_every)" if every > 1 else ""
    start, stop = told["time"]
    about = [
        ("run", f"{told['file']}: {told['status']}" + (f" ({told['reason']})" if told["reason"] else "")),
        ("begun", told["created"] + end),
        ("time", f"{start:g} to {stop:g}{unit}, {told['outputs']} outputs"),
        ("steps", f"{told['steps']} in {duration(told['wall_time'])}"),
        ("fluid", f"{told['fluid']}, method {told['method']}"),
        ("groups", "  ".join(f"{name} = {value:.4g}" for name, value in told["groups"].items()) or "none"),
        ("filaments", nodes + some),
        ("fields", ", ".join(f"{name} at {count} times" for name, count in told["fields"].items()) or "none"),
        ("versions", ", ".join(f"{name} {version}" for name, version in told["versions"].items())),
    ]
    ranges = [
        (name, "", f"{_number(d['min'])} to {_number(d['max'])}", d["units"], "")
        for name, d in told["diagnostics"].items()
    ]
    head = [line for line in (told["title"], told["source"]) if line]
    return "\n".join(
        [
            *head,
            "",
            *table(about),
            "",
            results(told),
            "",
            "over the run (of a vector its size)",
            *_unit_rows(ranges),
        ]
    )


def results(told: Mapping[str, Any], changes: str = "") -> str:
    """The observables and what was expected of them, of the case without ``changes``, as `ibfil run` ends with."""
    rows = [
        (name, "=", _with_error(found), found["units"], _words(found)) for name, found in told["observables"].items()
    ]
    lines = ["observables", *_unit_rows(rows)] if rows else ["no observables in this case"]
    if told["expected"]:
        lines += [
            "",
            f"expected of the case without {changes}" if changes else "expected",
            *table(_held(one) for one in told["expected"]),
        ]
    return "\n".join(lines)


def _words(found: Mapping[str, Any]) -> str:
    """The words beside a number: that it does not cover what was asked for, else what it is; and how well it fits."""
    return (found["note"] or found["description"]) + (f" ({found['quality']})" if found["quality"] else "")


def _held(one: Mapping[str, Any]) -> tuple[str, ...]:
    """The columns of one expectation."""
    verdict = "ok" if one["passed"] else "differs"
    source = f"({one['source']})" if one["source"] else ""
    return verdict, one["name"], _number(one["found"]), f"expected {one['expected']}", one["note"] or source


def _unit_rows(rows: Iterable[tuple[str, str, str, str, str]]) -> list[str]:
    """A table of name, sign, number, unit, words, in which the unit "1" is not written."""
    return table((name, sign, number, "" if unit == "1" else unit, words) for name, sign, number, unit, words in rows)


def table(rows: Iterable[Iterable[str]]) -> list[str]:
    """Lines with columns set flush, two blanks apart; a column that is empty throughout is left out."""
    cells = [list(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    kept = [i for i, width in enumerate(widths) if width]
    return ["  " + "  ".join(row[i].ljust(widths[i]) for i in kept).rstrip() for row in cells]


def listed(names: Sequence[str], most: int = 4) -> str:
    """All names, or of many the first ones, the last and how many they are."""
    if len(names) <= most:
        return ", ".join(names)
    return f"{', '.join(names[: most - 2])}, ..., {names[-1]}; {len(names)} in all"


def _number(value: float | list[float | None] | None) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(map(_number, value)) + "]"
    return "none" if value is None else f"{value:.6g}"


def _with_error(found: Mapping[str, Any]) -> str:
    """A number, and its standard error where it has one."""
    if found["standard_error"] is None:
        return _number(found["value"])
    errors = [None if value is None else float(f"{value:.2g}") for value in np.atleast_1d(found["standard_error"])]
    return f"{_number(found['value'])} +- {_number(errors if isinstance(found['value'], list) else errors[0])}"


def duration(seconds: float) -> str:
    """A wall time for the eye: 0.42 s, 12 s, 3 min 20 s, 2 h 5 min."""
    if seconds < 60:
        return f"{seconds:.2g} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def as_json(told: Mapping[str, Any]) -> str:
    """The digest as JSON."""
    return json.dumps(told, indent=2, ensure_ascii=False, allow_nan=False)


TABLE = table_of("time")  # what `write_csv` writes


def write_csv(run: RunFile, path: Path) -> None:
    """Time and all observables as a table under one row of names, all digits; a vector in three columns.

    Copies of a filament have a column each. A name has its units behind it, "speed (um/s)", where the case labels any.
    """
    columns: dict[str, np.ndarray] = {_heading("time", run.units("time")): run.time}
    for name, column in run.observables.items():
        values, units = np.asarray(column), run.units(f"observables/{name}")
        columns |= {
            _heading(f"{name}_{part}" if part else name, units): series
            for part, series in series_parts(run.case, name, values).items()
        }
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as out:
        writer = csv.writer(out)
        writer.writerow(columns)
        writer.writerows(zip(*(map(repr, c.tolist()) for c in columns.values()), strict=True))


def _heading(name: str, units: str) -> str:
    return name if units == "1" else f"{name} ({units})"
