"""The shipped studies: their commands can be run, and what they measured says when, with what and on what machine."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest

from ibfil.commands import main
from ibfil.studies.compare.fluids import known_fluids
from ibfil.studies.settings import axis, combinations
from ibfil.studies.tables import study_members

HERE = Path(__file__).parents[2] / "postprocess" / "studies"
RESULTS = sorted((HERE / "results").glob("*.json"))


def commands() -> list[list[str]]:
    """The words of every study in run.sh, the loop over pitch written out."""
    text = (HERE / "run.sh").read_text().replace("\\\n", " ")
    found = []
    for line in text.splitlines():
        words = line.strip()
        if words.startswith("study ") and "()" not in words:
            pitches = re.findall(r"for pitch in (.*);", text)[0].split() if "$pitch" in words else [""]
            found += [shlex.split(words.replace("$pitch", p).replace("$here", str(HERE)))[1:] for p in pitches]
    return found


@pytest.mark.parametrize("words", commands(), ids=lambda words: words[0])
def test_every_setting_of_every_study_is_a_case(words):
    arguments = main.parse([*words[1:], "-o", "nowhere"])
    case, *changes = arguments.words
    axes = [axis(text) for text in getattr(arguments, "vary", ())]
    for member in study_members(case, changes, combinations(axes)):
        member.resolved()
    if "fluids" in arguments:
        assert set(arguments.fluids.split(",")) <= set(known_fluids())


def test_there_are_results_of_every_study():
    assert {path.stem for path in (HERE / "results").glob("*.csv")} == {words[0] for words in commands()}


@pytest.mark.parametrize("path", RESULTS, ids=lambda path: path.stem)
def test_what_was_measured_says_when_with_what_and_where(path):
    message = json.loads(path.read_text())
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", message["date"])
    assert {"ibfil", "python", "numpy"} <= set(message["versions"])
    assert "cores" in message["machine"]
    assert not re.search(r'"[^"]*/(tmp|home|work)/', path.read_text())


def test_the_error_bar_of_the_swimmer_took_at_most_twelve_of_its_runs():
    """As recorded by the study, in processor time of one sitting; run.sh measures it again."""
    message = json.loads((HERE / "results" / "swimmer_uncertainty.json").read_text())
    assert message["cost_in_base_runs"] <= 12
    assert message["failures"] == []
