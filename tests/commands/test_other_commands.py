"""The command line: the commands beside `run`, and their help."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from helpers.made_run import BENT, make_run

from ibfil.case import library
from ibfil.commands import main
from ibfil.observables.base import KINDS

pytestmark = pytest.mark.usefixtures("environment")


def test_cases_lists_every_shipped_case_with_its_title(capsys):
    assert main.main(["cases"]) == 0
    out = capsys.readouterr().out
    rows = library.listing()
    assert len(rows) > 0
    for row in rows:
        assert row.name in out
        assert row.title in out
        assert row.source in out


def test_shipped_names_are_unique_and_say_their_source():
    files = list(library.folder().rglob("*.toml"))
    assert len(library.paths()) == len(files)
    assert all(row.title and row.source for row in library.listing())


def test_new_copies_a_shipped_case(here, capsys):
    assert main.main(["new", "swimmer_stokes", "mine.toml"]) == 0
    assert (here / "mine.toml").read_bytes() == library.paths()["swimmer_stokes"].read_bytes()


def test_a_folder_is_no_case(here, capsys):
    (here / "d.toml").mkdir()
    assert main.main(["check", "d.toml"]) == 2
    assert "d.toml: is a folder; allowed: a case file" in capsys.readouterr().err


def test_a_file_wins_over_a_shipped_name(here):
    assert library.find("swimmer_stokes") == library.paths()["swimmer_stokes"]
    (here / "swimmer_stokes").write_text(BENT)
    assert library.find("swimmer_stokes") == Path("swimmer_stokes")


def test_schema_is_text_or_json_schema(capsys):
    assert main.main(["schema"]) == 0
    text = capsys.readouterr().out
    assert main.main(["schema", "--json"]) == 0
    schema = json.loads(capsys.readouterr().out)
    for key in ("title", "filament", "fluid", "compute"):
        assert key in schema["properties"]
    for name in schema["properties"]:
        assert name in text
    assert set(KINDS) >= {"drift", "position"}
    for kind in KINDS:  # says of each what it is and which keys it has
        assert re.search(rf"\n  {kind}: [A-Z|][^\0]*?\((\w+,\s+)*\w+\)", text), kind


def test_check_runs_nothing_and_tells(here, capsys):
    assert main.main(["check", "bent.toml", "fluid.viscosity=3"]) == 0
    assert capsys.readouterr().out.strip()
    assert {path.name for path in here.iterdir()} == {"bent.toml"}


def test_show_writes_what_it_is_asked_for(here, capsys):
    make_run(here / "made.h5")
    assert main.main(["show", "made.h5", "--json", "--csv", "made.csv", "--plot", "made.pdf"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "Two made filaments"
    assert (here / "made.csv").read_text().startswith("time (s),")
    assert (here / "made.pdf").read_bytes().startswith(b"%PDF")


def test_vtk_says_what_to_open(here, capsys):
    make_run(here / "made.h5")
    assert main.main(["vtk", "made.h5"]) == 0
    assert "made/made.pvd" in capsys.readouterr().out
    assert (here / "made" / "made.pvd").exists()


@pytest.mark.parametrize(("command", "words"), [("check", "CASE [KEY=VALUE ...]"), ("run", "[CASE [KEY=VALUE ...]]")])
def test_usage_says_a_case_and_its_changes_once(capsys, command, words):
    with pytest.raises(SystemExit):
        main.main([command, "--help"])
    usage = capsys.readouterr().out.partition("\n\n")[0]
    assert usage.endswith(words)
    assert usage.count("CASE") == 1
