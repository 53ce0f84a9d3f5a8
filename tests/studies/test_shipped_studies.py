"""The shipped studies: their commands can be run, and what they measured says when, with what and on what machine."""

from __future__ import annotations

import csv
import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from ibfil.case.reading import read_case
from ibfil.commands import main
from ibfil.studies.compare.fluids import known_fluids
from ibfil.studies.settings import axis, combinations
from ibfil.studies.tables import study_members
from postprocess.studies import tracked

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


def test_the_swimmers_error_bar_has_all_of_its_runs():
    message = json.loads((HERE / "results" / "swimmer_uncertainty.json").read_text())
    assert message["failures"] == []


def test_the_fit_of_tracked_shapes_has_the_truth_in_its_intervals():
    truth = read_case(HERE / "whip.toml").parameters
    with (HERE / "results" / "whip_fit.csv").open(newline="") as file:
        found = {row["key"].partition(".")[2]: row for row in csv.DictReader(file)}
    assert found.keys() == truth.keys()
    for name, row in found.items():
        assert float(row["low"]) < truth[name] < float(row["high"])
        assert float(row["high"]) - float(row["low"]) < 0.1 * truth[name]


def test_the_tracked_shapes_are_those_of_the_truth_with_noise():
    there = (HERE / "tracked.csv").read_text().splitlines()
    made = list(tracked.lines())
    assert there[0] == made[0]
    numbers = [np.array([line.split(",") for line in lines[1:]], float) for lines in (there, made)]
    assert numbers[0] == pytest.approx(numbers[1], abs=2e-4)  # the last digit
