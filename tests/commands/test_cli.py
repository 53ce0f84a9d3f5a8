"""The command line: words, exit status, what goes to which stream, and what is not loaded."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.made_run import BENT, make_run
from helpers.runs import wait_for

from ibfil.case import library
from ibfil.commands import arguments, main, run
from ibfil.io.reader import RunFile
from ibfil.observables.base import KINDS

ROOT = Path(__file__).parents[2]


pytestmark = pytest.mark.usefixtures("environment")


def ibfil(*words: str, **more) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | more.pop("env", {})
    command = [sys.executable, "-m", "ibfil", *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment, **more)


# --- what is loaded, and when

HEAVY = ("numpy", "numba", "h5py", "pyvista", "vtk", "pydantic", "scipy", "matplotlib", "pyfftw")


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["check", "--help"], ["--version"]])
def test_help_loads_nothing_heavy(words):
    code = (
        "import sys; from ibfil.commands.main import main\n"
        "try: main(sys.argv[1:])\n"
        "except SystemExit as done: assert not done.code, done.code\n"
        "print('loaded:', *sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, cwd=ROOT, check=True)
    loaded = done.stdout.split("loaded:")[1].split()
    assert "ibfil.commands.main" in loaded
    assert not {name.split(".")[0] for name in loaded} & set(HEAVY)


def test_threads_are_set_before_numpy_is_loaded(here):
    """An import hook looks at the environment when numpy is first asked for."""
    code = """
import os, sys
class Look:
    def find_spec(self, name, path=None, target=None):
        if name == "numpy":
            sys.meta_path.remove(self)
            names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_WAIT_POLICY")
            print("seen:", *(os.environ.get(name) for name in names))
sys.meta_path.insert(0, Look())
from ibfil.commands.main import main
sys.exit(main(sys.argv[1:]))
"""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "7"}
    run = ["run", "bent.toml", "compute.threads=2", "time.end=0.01"]
    for words in (run, ["run", "--resume", "bent.h5"]):
        command = [sys.executable, "-c", code, *words]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
        if words is run:
            assert done.returncode == 0, done.stderr
            assert "seen: 2 2 passive" in done.stdout
    # The finished run is to be no longer than it is: there is nothing to do, which is one line and no traceback.
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1


def test_a_run_that_goes_on_has_the_threads_it_began_with(cut_here):
    assert run._threads_of("bent.h5") == 2
    assert run._threads_of("nothing.h5") == 1


# --- run


def test_run_writes_the_run_file_and_tells_the_result(here, capsys):
    assert main.main(["run", "bent.toml"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("A bent rod straightens\n")
    assert "finished: 20 steps" in out
    assert [line.split()[:2] for line in out.splitlines() if " span " in line][-1] == ["ok", "span"]
    with RunFile("bent.h5") as run:
        assert run.status == "finished"
        assert len(run) == 5
    assert {path.name for path in here.iterdir()} == {"bent.toml", "bent.h5", "bent.ckpt.h5"}


def test_what_was_expected_of_the_case_before_it_was_changed(here, capsys):
    assert main.main(["run", "bent.toml", "filament.rod.shape.curvature=3", "output.checkpoint_every=9"]) == 0
    out = capsys.readouterr().out
    assert "expected of the case without filament.rod.shape.curvature=3\n" in out
    assert [line.split()[:2] for line in out.splitlines() if " span " in line][-1] == ["differs", "span"]


def test_a_finished_run_is_made_longer_or_says_how_to_begin_where_it_ended(here, capsys):
    assert main.main(["run", "bent.toml"]) == 0
    assert "(longer: ibfil run --resume bent.h5 time.end=...)" in capsys.readouterr().out
    with RunFile("bent.h5") as run:
        longer = f"time.end={2 * run.time[-1]}"
    assert main.main(["run", "--resume", "bent.h5", longer]) == 0
    assert main.main(["run", "bent.toml", longer, "-o", "whole.h5"]) == 0
    with RunFile("bent.h5") as run, RunFile("whole.h5") as whole:
        assert len(run) == len(whole) == 9
        for name, columns in whole.filaments.items():
            assert all(np.array_equal(columns[key], run.filaments[name][key]) for key in columns)
    (here / "bent.ckpt.h5").unlink()
    assert main.main(["run", "--resume", "bent.h5", "time.end=9"]) == 2
    assert 'a new one may start from its last output: shape = { kind = "run"' in capsys.readouterr().err


def test_words_may_stand_before_and_after_options(here, capsys):
    assert main.main(["run", "bent.toml", "-o", "other.h5", "time.end=0.01", "title=changed"]) == 0
    assert main.main(["run", "-o", "third.h5", "bent.toml", "time.end=0.015"]) == 0
    with RunFile("other.h5") as run:
        assert run.time[-1] == 0.01
        assert run.case.title == "changed"
    with RunFile("third.h5") as run:
        assert run.time[-1] == 0.015


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


def test_a_run_that_diverges(here, capsys):
    words = ["time.scheme=explicit", "time.step=0.005", "filament.rod.stretching=1e5"]
    assert main.main(["run", "bent.toml", *words]) == 1
    err = capsys.readouterr().err
    assert "the run stopped at t = " in err
    assert "what to change: " in err
    assert "Traceback" not in err
    with RunFile("bent.h5") as run:
        assert run.status == "failed"
        assert len(run) >= 1


@pytest.fixture(scope="module")
def cut(tmp_path_factory) -> tuple[Path, str]:
    """A long run on two threads that was ended by Ctrl-C: its folder, what it said to standard error."""
    folder = tmp_path_factory.mktemp("cut")
    (folder / "bent.toml").write_text(BENT)
    long = ["bent.toml", "time.end=1e4", "output.every=0.5", "compute.threads=2"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(
        [sys.executable, "-m", "ibfil", "run", *long], stderr=subprocess.PIPE, text=True, env=environment, cwd=folder
    )
    wait_for((folder / "bent.ckpt.h5").exists, process)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=300)
    assert process.returncode == 130, err
    return folder, err


@pytest.fixture
def cut_here(here, cut) -> str:
    """That run in the folder we are in; what it said."""
    for file in cut[0].iterdir():
        shutil.copy(file, here)
    return cut[1]


def test_ctrl_c_says_how_to_go_on_and_that_works(here, cut_here):
    err = cut_here
    assert "Traceback" not in err
    (line,) = (line for line in err.splitlines() if "interrupted" in line)
    words = line.split("go on with: ibfil ")[1].split()
    with RunFile("bent.h5") as run:
        assert run.status == "interrupted"
        reached = float(run.time[-1])
    end = f"time.end={2 * (int(reached) + 1)}"
    done = ibfil(*words, end)
    assert done.returncode == 0, done.stderr
    with RunFile("bent.h5") as run:
        assert run.status == "finished"
        assert run.time[-1] > reached
    assert (here / "bent.ckpt.h5").exists()  # to make it longer


def test_a_change_that_may_not_be_made_on_the_way(cut_here, capsys):
    assert main.main(["run", "--resume", "bent.h5", "fluid.viscosity=2"]) == 2
    assert "fluid.viscosity" in capsys.readouterr().err


def test_a_disk_that_is_full(here, capsys):
    make_run(here / "made.h5")
    assert main.main(["show", "made.h5", "--csv", "/dev/full"]) == 1
    assert capsys.readouterr().err.splitlines() == ["ibfil: No space left on device"]


@pytest.mark.parametrize("words", [["schema"], ["schema", "--json"], ["cases"], ["show", "made.h5", "--json"]])
def test_a_reader_that_stops_early_hears_nothing(here, words):
    make_run(here / "made.h5")
    command = [sys.executable, "-u", "-m", "ibfil", *words]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None
    process.stdout.close()  # before anything was printed, as `| head -0` does
    assert process.stderr is not None
    assert process.stderr.read() == ""
    assert process.wait() == 1


def test_a_run_whose_reader_stops_is_cut_and_can_go_on(here):
    command = [sys.executable, "-m", "ibfil", "run", "bent.toml", "time.end=20", "output.every=1"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None
    while not process.stdout.readline().startswith("t = "):
        assert process.poll() is None
    process.stdout.close()  # as `| head -4` does, before the next tenth is told
    assert process.stderr is not None
    err = process.stderr.read()
    assert process.wait() == 130
    assert "Traceback" not in err
    assert "interrupted at t = " in err
    with RunFile("bent.h5") as run:
        assert run.status == "interrupted"
    assert main.main(["run", "--resume", "bent.h5"]) == 0
    with RunFile("bent.h5") as run:
        assert run.status == "finished"


@pytest.mark.parametrize(("ours", "said"), [(True, False), (False, True), (None, True)])
def test_a_first_run_is_told_that_it_compiles(here, capsys, monkeypatch, ours, said):
    """It is not where numba has kept the kernels of this very package; those of another one do not count."""
    package = here / "ibfil" / "rods"
    monkeypatch.setattr(arguments, "__file__", str(here / "ibfil" / "commands" / "arguments.py"))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(here))
    if ours is not None:
        digest = hashlib.sha1(str(package if ours else here / "rods").encode()).hexdigest()
        (here / f"rods_{digest}").mkdir()
        (here / f"rods_{digest}" / "geometry._measured-9.py311.nbi").touch()
    arguments.say_if_cold()
    assert ("compiling" in capsys.readouterr().err) == said


# --- the other commands


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
