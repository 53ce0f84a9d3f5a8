"""One run on many processes: the numbers of one, restarts, failures. Where MPI is not installed it says so."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

import ibfil
from ibfil.running.run import resume_run

HERE = Path(__file__).parent
MPIEXEC = shutil.which("mpiexec", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}")
ABSENT = MPIEXEC is None or importlib.util.find_spec("mpi4py") is None
needs_mpi = pytest.mark.skipif(ABSENT, reason="needs mpi4py and mpiexec: pip install 'ibfil[test]'")

STOKES = """
[filament.rod]
length = 1.0
nodes = 9
bending = 1.0
stretching = 400
curvature = ["6*sin(4*pi*s - 10*t)", 0]
shape = { kind = "relaxed" }
start = { end = "clamped" }
copies = { count = 3, seed = 5, region = [[-0.8, -0.8, -0.4], [0.8, 0.8, 0.4]] }
[fluid]
model = "stokes"
method = "krylov"
viscosity = 1.0
box = [2.5, 2.75, 2.0]
cells = [10, 11, 8]
[time]
end = 0.05
step = 0.0125
[output]
every = 0.025
"""
INERTIA = STOKES.replace('model = "stokes"', 'model = "navier-stokes"\ndensity = 5.0').replace("krylov", "fft")
FLOW = 'rotation = "grid"\nflow = ["0.3*sin(2*pi*y/2.75)*cos(3*t)", "0.1*sin(2*pi*x/2.5)", 0]\n[time]'
TWISTED = INERTIA.replace("[time]", FLOW).replace("bending = 1.0", "bending = 1.0\ntwisting = 1.0\nradius = 0.02")
UNPARTED = INERTIA.replace("[time]", 'flow = ["sin(2*pi*y/2.75 - 3*t)*exp(cos(2*pi*y/2.75 + t))", 0, 0]\n[time]')


def together(count: int, *words: object, folder: Path, status: int = 0) -> str:
    """The lines that so many processes print, to both streams; they end with ``status``."""
    surroundings = {"OMP_NUM_THREADS": "1", **os.environ, "PYTHONPATH": str(Path(ibfil.__file__).parent.parent)}
    line = [MPIEXEC, "-n", str(count), sys.executable, *map(str, words)]
    done = subprocess.run(line, cwd=folder, env=surroundings, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == status, done.stdout + done.stderr
    return done.stdout + done.stderr


def run(count: int, folder: Path, *words: object, status: int = 0) -> str:
    return together(count, "-m", "ibfil", "run", *words, folder=folder, status=status)


def numbers(path: Path, fields: bool) -> dict[str, np.ndarray]:
    """The recorded motion of all filaments; or the fields, which are of single precision."""
    found: dict[str, np.ndarray] = {}

    def look(name: str, item: object) -> None:
        wanted = ("velocity", "vorticity", "pressure") if fields else ("position", "velocity", "force", "strain")
        if name.split("/")[-1] in wanted and name.startswith("grid/") == fields:
            found[name] = item[()]

    with h5py.File(path) as file:
        file.visititems(look)
    assert len(found) == (3 if fields else 12)
    return found


def same_to(error: float, one: Path, other: Path, fields: bool = False) -> bool:
    """Whether two runs have the same numbers, relative to the largest of each kind."""
    a, b = numbers(one, fields), numbers(other, fields)
    assert a.keys() == b.keys()
    return all(np.abs(a[name] - b[name]).max() <= error * np.abs(a[name]).max() for name in a)


@needs_mpi
def test_solves_are_those_of_one_process_and_their_bits_do_not_depend_on_how_many_there_are(tmp_path):
    lines = {count: together(count, HERE / "on_processes.py", "solves", folder=tmp_path) for count in (2, 3)}
    errors = [float(line.split()[0]) for line in lines[2].splitlines()]
    assert len(errors) == 15
    assert max(errors) < 1e-13
    assert lines[2] == lines[3]


@needs_mpi
@pytest.mark.parametrize("text", [STOKES, pytest.param(UNPARTED, marks=pytest.mark.slow)], ids=["stokes", "no product"])
def test_runs_have_the_numbers_of_one_process(tmp_path, text):
    (tmp_path / "case.toml").write_text(text)
    ibfil.run(tmp_path / "case.toml", tmp_path / "one.h5", progress=False, log=lambda line: None)
    run(3, tmp_path, "case.toml", "-o", "three.h5")
    assert same_to(1e-12, tmp_path / "one.h5", tmp_path / "three.h5")


@needs_mpi
def test_a_run_of_two_processes_goes_on_with_three_and_has_the_bits_of_one_that_was_not_cut(tmp_path):
    (tmp_path / "case.toml").write_text(TWISTED)
    ibfil.run(tmp_path / "case.toml", tmp_path / "one.h5", progress=False, log=lambda line: None)
    run(3, tmp_path, "case.toml", "-o", "three.h5")
    run(2, tmp_path, "case.toml", "-o", "cut.h5", "time.end=0.025")
    told = run(3, tmp_path, "--resume", "cut.h5", "time.end=0.05")
    assert told.count("going on with cut.h5") == 1
    assert same_to(1e-12, tmp_path / "one.h5", tmp_path / "three.h5")
    assert same_to(0.0, tmp_path / "three.h5", tmp_path / "cut.h5")


@needs_mpi
@pytest.mark.slow
def test_one_process_takes_up_what_two_began(tmp_path):
    fields = '[output]\nfields = ["velocity", "vorticity", "pressure"]\ngrid_every = 0.025'
    (tmp_path / "case.toml").write_text(TWISTED.replace("[output]", fields))
    ibfil.run(tmp_path / "case.toml", tmp_path / "one.h5", progress=False, log=lambda line: None)
    run(2, tmp_path, "case.toml", "-o", "two.h5", "time.end=0.025")
    resume_run(tmp_path / "two.h5", overrides=["time.end=0.05"], progress=False, log=lambda line: None)
    assert same_to(1e-12, tmp_path / "one.h5", tmp_path / "two.h5")
    assert same_to(1e-6, tmp_path / "one.h5", tmp_path / "two.h5", fields=True)


@needs_mpi
@pytest.mark.slow
def test_single_precision_is_kept(tmp_path):
    (tmp_path / "case.toml").write_text(TWISTED.replace("[time]", 'precision = "single"\n[time]'))
    ibfil.run(tmp_path / "case.toml", tmp_path / "one.h5", progress=False, log=lambda line: None)
    run(2, tmp_path, "case.toml", "-o", "two.h5")
    assert same_to(1e-5, tmp_path / "one.h5", tmp_path / "two.h5")


@needs_mpi
@pytest.mark.parametrize("where", [0, 1])
def test_a_failure_on_any_process_ends_all_with_one_message(tmp_path, where):
    line = [MPIEXEC, "-n", "2", sys.executable, str(HERE / "on_processes.py"), "fails", str(where)]
    surroundings = {**os.environ, "PYTHONPATH": str(Path(ibfil.__file__).parent.parent)}
    done = subprocess.run(
        line, cwd=tmp_path, env=surroundings, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode != 0
    words = done.stdout + done.stderr
    assert words.count(f"process {where} of 2 failed: not enough memory" if where else "\nMemoryError\n") == 1


@needs_mpi
def test_a_run_that_fails_says_so_once_and_ends(tmp_path):
    (tmp_path / "case.toml").write_text(STOKES)
    explicit = ("time.scheme=explicit", "time.step=2.0", "time.end=8", "output.every=2")
    told = run(2, tmp_path, "case.toml", *explicit, status=1)
    assert told.count("the run stopped at t = ") == 1
    assert told.count("what to change: ") == 1


@needs_mpi
def test_members_of_a_study_go_to_the_workers_of_mpi4py(tmp_path):
    """As ibfil/studies/README.md has it."""
    (tmp_path / "case.toml").write_text(STOKES)
    words = (
        "-m",
        "mpi4py.futures",
        "-m",
        "ibfil",
        "sweep",
        "case.toml",
        "--vary",
        "fluid.viscosity=1,2",
        "-o",
        "study",
    )
    told = together(3, *words, "--executor", "mpi4py.futures:MPIPoolExecutor", "--jobs", "2", folder=tmp_path)
    assert told.count(": finished in ") == 2
    assert len(list((tmp_path / "study").glob("*.h5"))) == 2


@needs_mpi
def test_processes_with_a_case_each_are_refused_in_one_line(tmp_path):
    for name in ("0", "1"):
        (tmp_path / f"{name}.toml").write_text(STOKES)
    each = (
        "import sys; from ibfil.commands.main import main; from ibfil.parallel.launch import place; "
        "sys.exit(main(['run', f'{place()}.toml']))"
    )
    told = together(2, "-c", each, folder=tmp_path, status=2)
    assert told.count("2 processes with different words") == 1
    assert not list(tmp_path.glob("*.h5"))
