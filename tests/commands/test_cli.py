"""The command line: words, exit status, what goes to which stream, and what is not loaded."""

from __future__ import annotations

import hashlib
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.made_run import BENT, make_run
from helpers.runs import wait_for

from ibfil.commands import arguments, main, run
from ibfil.io.reader import RunFile

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
