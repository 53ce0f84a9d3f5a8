"""The files of `ibfil fit`: a table, all of it as JSON, the figure."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..tables import write_csv, write_json

if TYPE_CHECKING:
    from .results import Fit

TABLE, DETAILS, FIGURE = "fit.csv", "fit.json", "fit.png"


def write(result: Fit, folder: Path) -> None:
    """Write them all into ``folder``."""
    from .figure import draw

    write_json(folder / DETAILS, details(result))
    write_csv(folder / TABLE, rows(result))
    draw(result, folder / FIGURE)


def rows(result: Fit) -> list[dict[str, Any]]:
    """The table: a row a parameter."""
    out: list[dict[str, Any]] = []
    for one in result.parameters:
        low, high = one.interval or (None, None)
        out.append({"key": one.parameter.key, "value": one.value, "low": low, "high": high, "word": one.word})
    return out


def details(result: Fit) -> dict[str, Any]:
    """Everything, ready for JSON. Covariances and errors are of logarithms where ``by_log``, else of value/range."""
    spread, data = result.spread, result.data
    return {
        "title": result.title,
        **result.about,
        "runs": result.runs,
        "converged": result.converged,
        "parameters": [
            {**row, "bounds": [one.parameter.low, one.parameter.high], "by_log": one.parameter.by_log}
            for row, one in zip(rows(result), result.parameters, strict=True)
        ],
        "errors_of_the_run": {
            name: error if isinstance(error, str) else error.tolist() for name, error in result.numerical.items()
        },
        "level": 0.95,
        "half_width_in_standard_errors": spread.factor,
        "covariance": spread.covariance.tolist(),
        "covariance_if_points_were_independent": spread.white.tolist(),
        "correlation": spread.correlation.tolist(),
        "singular_values": result.singular.tolist(),
        "not_told_apart": list(result.tied),
        "rms_of_points": result.rms,
        "noise_remembers_frames": result.remembered,
        "blocks": spread.blocks,
        "frames_a_block": spread.frames_a_block,
        "points": 0 if data is None else data.count,
        "frames": 0 if data is None else len(data.frames),
        "observables": {
            name: {"measured": value, "error": error, "run": own}
            for name, (value, error, own) in result.observables.items()
        },
        "notes": list(result.notes),
    }
