"""New cases for the physics that is named: each passes `ibfil check`, and explains every key of its tables."""

from __future__ import annotations

from itertools import combinations

import pytest

from ibfil import parse_case
from ibfil.case.blank.physics import PHYSICS
from ibfil.case.blank.writing import CONFLICT, blank
from ibfil.case.fluid import Fluid
from ibfil.check.report import report
from ibfil.commands import main
from ibfil.errors import CaseError

# Pairs that no run can have, whatever the scene: each is refused in a line that names both.
_APART = (
    "rft free,rft wall,rft inertia,rft fields,free fields,wall fields,free inertia,wall inertia,closed clamped,"
    "thermal inertia,thermal mass,closed mass,body closed,body mass,body thermal"
)
APART = {frozenset(pair.split()) for pair in _APART.split(",")}


def refused(words) -> bool:
    """Whether these words do not go together, which is told."""
    try:
        text = blank(words)
    except CaseError as error:
        return CONFLICT in error.faults[0]
    parse_case(text, "new.toml")
    return False


@pytest.mark.parametrize("word", ["", *PHYSICS])
def test_each_word_alone_passes_check(word):
    text = blank([word] if word else [])
    told = report(parse_case(text, "new.toml"))
    assert "modelled:" in told


def test_pairs_pass_or_are_those_that_no_run_can_have():
    assert {frozenset(pair) for pair in combinations(PHYSICS, 2) if refused(pair)} == APART


def test_every_key_of_a_table_is_explained():
    text = blank(["wall"])
    for name, info in Fluid.model_fields.items():
        assert f"\n{name} = " in text or f"\n# {name} = " in text or f"[fluid.{name}]" in text
        assert info.description.split()[0] in text


def test_the_command_writes_it_once_and_lists_what_it_offers(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main.main(["new", "--with", "wall,copies", "mine.toml"]) == 0
    assert main.main(["check", "mine.toml"]) == 0
    assert main.main(["new", "--with", "wall", "mine.toml"]) == 2
    assert main.main(["new", "--with", "walls", "other.toml"]) == 2
    assert 'did you mean "wall"?' in capsys.readouterr().err
    assert main.main(["new", "--list"]) == 0
    told = capsys.readouterr()
    assert all(word in told.out + told.err for word in PHYSICS)
    assert main.main(["new", "mine.toml"]) == 2
