"""The command line: bad input in a line, and files that are not written over."""

from __future__ import annotations

import pytest
from helpers.made_run import make_run

from ibfil.commands import main
from ibfil.io.reader import RunFile

pytestmark = pytest.mark.usefixtures("environment")


def test_an_existing_run_is_replaced_only_with_force(here, capsys):
    assert main.main(["run", "bent.toml"]) == 0
    before = (here / "bent.h5").read_bytes()
    assert main.main(["run", "bent.toml", "title=changed"]) == 2
    assert (here / "bent.h5").read_bytes() == before
    assert "--force" in capsys.readouterr().err
    assert main.main(["run", "bent.toml", "title=changed", "--force"]) == 0
    with RunFile("bent.h5") as run:
        assert run.case.title == "changed"


def test_no_command_writes_over_a_file_of_another_kind_or_one_that_it_reads(here, capsys):
    """Not with --force either: a case, a run, a picture, notes."""
    make_run(here / "made.h5")
    (here / "notes.csv").write_text("date,medium\nMonday,3 mM ATP\n")
    (here / "notes.png").write_text("no picture")
    (here / "bent").mkdir()
    before = {path: path.read_bytes() for path in here.iterdir() if path.is_file()}
    for words in (
        ["run", "bent.toml", "-o", "bent.toml"],
        ["run", "bent.toml", "-o", "notes.csv"],
        ["show", "made.h5", "--csv", "bent.toml"],
        ["show", "made.h5", "--csv", "made.h5"],
        ["show", "made.h5", "--csv", "notes.csv"],
        ["show", "made.h5", "--plot", "notes.png"],
        ["render", "made.h5", "-o", "notes.png"],
    ):
        for force in ([], ["--force"]):
            assert main.main([*words, *force]) == 2
            (line,) = capsys.readouterr().err.splitlines()
            assert f"{words[-1]}: is " in line
            assert "--force" not in line
    (here / "sweep.csv").write_text("date,medium\n")
    assert main.main(["sweep", "bent.toml", "--vary", "fluid.viscosity=1,2", "-o", "."]) == 2
    assert "sweep.csv: is there, and no study wrote it" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in before} == before
    assert {path.name for path in here.iterdir()} == {path.name for path in before} | {"bent", "sweep.csv"}


def test_tables_and_pictures_are_replaced_only_with_force(here, capsys):
    make_run(here / "made.h5")
    for words in (["--csv", "a.csv"], ["--plot", "a.png"]):
        assert main.main(["show", "made.h5", *words]) == 0
        before = (here / words[1]).read_bytes()
        assert main.main(["show", "made.h5", *words]) == 2
        assert f"{words[1]}: exists already; --force writes over it" in capsys.readouterr().err
        assert main.main(["show", "made.h5", *words, "--force"]) == 0
        assert (words[0] == "--plot") or (here / words[1]).read_bytes() == before
    (here / "link.csv").symlink_to("a.csv")
    assert main.main(["show", "made.h5", "--csv", "link.csv", "--force"]) == 0
    assert (here / "link.csv").is_symlink()
    assert {path.name for path in here.iterdir()} == {"made.h5", "bent.toml", "a.csv", "a.png", "link.csv"}


def test_a_scene_for_paraview_that_was_changed_is_kept(here):
    make_run(here / "made.h5")
    assert main.main(["vtk", "made.h5"]) == 0
    scene = here / "made" / "made_paraview.py"
    written = scene.read_text()
    assert main.main(["vtk", "made.h5"]) == 0
    assert scene.read_text() == written
    scene.write_text(written.replace("ViewSize = [1280, 960]", "ViewSize = [640, 480]"))
    assert main.main(["vtk", "made.h5"]) == 0
    assert "[640, 480]" in scene.read_text()
    scene.unlink()
    (here / "made" / "made.pvd").write_text("mine")
    assert main.main(["vtk", "made.h5"]) == 2
    assert (here / "made" / "made.pvd").read_text() == "mine"


def test_all_faults_are_told_at_once_and_nothing_is_written(here, capsys):
    assert main.main(["run", "bent.toml", "fluid.viscosty=2", "filament.rod.nodes=3", "time.end=-1"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    lines = err.splitlines()
    assert all(line.startswith("ibfil: bent.toml: ") for line in lines)
    for key in ("viscosity", "filament.rod.nodes", "time.end"):
        assert sum(key in line for line in lines) == 1
    assert {path.name for path in here.iterdir()} == {"bent.toml"}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["run", "bend.toml"], "bend.toml: no such file"),
        (["run", "swimer_stokes"], "did you mean 'swimmer_stokes'?"),
        (["run"], "found no case"),
        (["run", "bent.toml", "nonsense"], "nonsense: found a word; allowed: KEY=VALUE"),
        (["run", "bent.toml", "-o", "no/such/x.h5"], "no/such/x.h5: there is no folder no/such"),
        (["run", "--resume", "gone.h5"], "gone.h5"),
        (["run", "--resume", "bent.toml", "-o", "x.h5"], "-o"),
        (["show", "bent.toml"], "is a case, not a run file; `ibfil run bent.toml` makes one of it"),
        (["vtk", "gone.h5"], "gone.h5: there is no such file"),
        (["new", "swimmer_stokes", "bent.toml"], "is there already"),
        (["new", "swimmer", "x.toml"], "no shipped case"),
        (["verify", "gone"], "gone: no such file"),
    ],
)
def test_bad_input_is_one_line_and_no_traceback(here, capsys, words, said):
    before = {path.name: path.read_bytes() for path in here.iterdir()}
    status = main.main(words)
    out, err = capsys.readouterr()
    assert said in err
    assert len(err.splitlines()) == 1
    assert status == 2
    assert "finished" not in out
    assert {path.name: path.read_bytes() for path in here.iterdir()} == before


@pytest.mark.parametrize("words", [["rum"], ["run", "bent.toml", "--frce"], ["show"], ["cases", "stray"], []])
def test_words_the_parser_does_not_know(here, capsys, words):
    with pytest.raises(SystemExit) as done:
        main.main(words)
    assert done.value.code == 2
    assert "usage: ibfil" in capsys.readouterr().err
