"""The files of `ibfil tune`: the candidates as a table, all of it as JSON, the tuned case, the figure."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...io.overwriting import replacing
from ..tables import write_csv, write_json

if TYPE_CHECKING:
    from ..member import Member
    from .choice import Aim, Settings
    from .results import Tuned

TABLE, DETAILS, FIGURE, SCENE = "tune.csv", "tune.json", "tune.png", "tune.toml"


def write(result: Tuned, tuned: Member, folder: Path) -> None:
    """Write them all into ``folder``; ``tuned`` is the case with the answer."""
    from ...case.reading import parse_case, read_case
    from .figure import draw

    write_csv(folder / TABLE, rows(result))
    write_json(folder / DETAILS, details(result))
    case = (
        (parse_case(tuned.case, "case", tuned.overrides))
        if "\n" in tuned.case
        else read_case(tuned.case, tuned.overrides)
    )
    with replacing(folder / SCENE) as part:
        part.write_text(case.text, encoding="utf-8")
    draw(result, folder / FIGURE)


def rows(result: Tuned) -> list[dict[str, Any]]:
    """The table: the candidates, cheapest first, and the case's own settings at the end."""
    named = [*(("candidate", one) for one in result.candidates), ("own", result.own)]
    return [{"settings": word, **_row(one, result.aims)} for word, one in named]


def _row(one: Settings, aims: Any) -> dict[str, Any]:
    bars = {f"bar of {aim.number}": one.bar(aim.number) for aim in aims}
    return {"step": one.step, "nodes": one.nodes, "seconds": one.seconds, **bars}


def details(result: Tuned) -> dict[str, Any]:
    """Everything, ready for JSON."""
    return {
        "title": result.title,
        **result.about,
        "targets": [one._asdict() for one in result.targets],
        "overrides": list(result.overrides),
        "seconds": "of a run's steps, from counts",
        "answer": _row(result.answer, result.aims),
        "own": _row(result.own, result.aims),
        "numbers": [_number(one, result) for one in result.aims],
        "runs": result.runs,
        "processor_seconds": result.spent,
        "place_in_a_cell_not_known": result.unplaced,
    }


def _number(one: Aim, result: Tuned) -> dict[str, Any]:
    value, right, doubt = result.checks[one.number]
    nodes, step, rest = result.answer.bars[one.number]
    return {
        "name": one.number,
        "allowed": one.allowed,
        "value": value,
        "corrected": right,
        "doubt_of_corrected": doubt,
        "found_off_with_doubts": result.found(one.number),
        "bar": {"nodes": nodes, "step": step, "rest": rest},
        "levels": {
            name: {
                "sizes": law.sizes,
                "values": law.coarsest.values,
                "order": law.coarsest.order,
                "word": law.coarsest.word,
            }
            for name, law in (("step", one.step), ("nodes", one.nodes))
        },
    }
