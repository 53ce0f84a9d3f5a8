"""The files of `ibfil uncertainty`: a table, all of it as JSON, the figure."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..tables import write_csv, write_json

if TYPE_CHECKING:
    from .results import Bar, Source, Uncertainty

TABLE, DETAILS, FIGURE = "uncertainty.csv", "uncertainty.json", "uncertainty.png"


def write(result: Uncertainty, folder: Path) -> None:
    """Write them all into ``folder``."""
    from .figure import draw

    write_csv(folder / TABLE, rows(result))
    write_json(folder / DETAILS, details(result))
    draw(result, folder / FIGURE)


def rows(result: Uncertainty) -> list[dict[str, Any]]:
    """The table: a row a number and source."""
    return [{"observable": bar.name, "value": bar.value, **row(one)} for bar in result.bars for one in bar.sources]


def row(source: Source) -> dict[str, Any]:
    """A source of error, as the table has it."""
    told = source.estimate
    out: dict[str, Any] = {"source": source.name, "kind": "numerical" if source.numerical else "choice"}
    if told is not None:
        out |= {"error": told.error, "doubt": told.doubt, "order": told.order, "word": told.word}
        out["levels"] = " ".join(repr(value) for value in told.values)
    return {**out, "from": source.words}


def details(result: Uncertainty) -> dict[str, Any]:
    """Everything, ready for JSON."""
    return {
        "title": result.title,
        **result.about,
        "runs": result.runs,
        "cost_in_base_runs": result.cost,
        "failures": list(result.failures),
        "numbers": [_number(bar) for bar in result.bars],
    }


def _number(bar: Bar) -> dict[str, Any]:
    (corrected, doubt), meant = bar.corrected, bar.meant
    return {
        "name": bar.name,
        "value": bar.value,
        "unit": bar.unit,
        "words": bar.words,
        "bar": bar.bar,
        "bar_is_whole": bar.whole,
        "corrected": {"value": corrected, "bar": doubt},
        "as_meant": None if meant is None else {"value": meant[0], "bar": meant[1]},
        "no_number": bar.nothing,
        "halves_of_its_window": bar.halves,
        "sources": [
            {**row(one), "sizes": None if one.estimate is None else asdict(one.estimate)["sizes"]}
            for one in bar.sources
        ],
    }
