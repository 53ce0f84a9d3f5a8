"""The files of `ibfil modes`: a table, all of it as JSON, the modes as filaments, and the figure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..tables import write_csv, write_json
from .run_file import swings
from .run_file import write as write_run

if TYPE_CHECKING:
    from ...simulation.at_rest import SceneAtRest
    from .results import Found, Mode

TABLE, DETAILS, RUN, FIGURE = "modes.csv", "modes.json", "modes.h5", "modes.png"


def write(found: Found, scene: SceneAtRest, folder: Path) -> None:
    """Write them all into ``folder``."""
    from .figure import draw

    folder.mkdir(parents=True, exist_ok=True)
    write_csv(folder / TABLE, rows(found))
    write_json(folder / DETAILS, details(found))
    if found.modes:
        words = (
            f"the {len(found.modes)} modes of modes.csv about the rest, each over one period, mode k from k - 1 to k"
        )
        write_run(folder / RUN, scene, swings(scene, found.rest.configuration, found.modes), "modes", words)
    draw(found, scene, folder / FIGURE)


def rows(found: Found) -> list[dict[str, Any]]:
    """The table: a row a mode."""
    return [{"mode": number, **_row(mode)} for number, mode in enumerate(found.modes, 1)]


def _row(mode: Mode) -> dict[str, Any]:
    corrected = mode.corrected
    out: dict[str, Any] = {
        "growth": corrected.real,
        "growth +-": None if mode.growth is None else mode.growth.doubt,
        "frequency": abs(corrected.imag),
        "frequency +-": None if mode.frequency is None else mode.frequency.doubt,
        "kind": mode.kind.word,
        "count": mode.count,
        "growth at the case's nodes": mode.value.real,
        "frequency at the case's nodes": abs(mode.value.imag),
    }
    for name, value in mode.seen.items():
        out[f"growth seen, {name}"] = value.real
        out[f"frequency seen, {name}"] = abs(value.imag)
    return out


def details(found: Found) -> dict[str, Any]:
    """Everything, ready for JSON."""
    limit = found.threshold
    return {
        "title": found.title,
        **found.about,
        "rest": {
            "residual": found.rest.residual,
            "round_off": found.round_off,
            "steps": found.rest.steps,
            "unstable": found.unstable,
        },
        "nodes": found.nodes,
        "step": found.step,
        "zero_modes": found.zeros,
        "left_out": found.left_out,
        "notes": found.notes,
        "modes": [
            {**row, "levels": _levels(mode), "energy": mode.kind.energy, "across": mode.kind.across}
            for row, mode in zip(rows(found), found.modes, strict=True)
        ],
        "threshold": None if limit is None else {**asdict(limit), "word": limit.word},
    }


def _levels(mode: Mode) -> Mapping[str, Any]:
    parts = {"growth": mode.growth, "frequency": mode.frequency}
    return {name: None if part is None else asdict(part) for name, part in parts.items()}
