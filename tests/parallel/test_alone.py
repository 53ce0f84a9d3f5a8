"""Nothing of MPI where nothing is shared; and scenes, processes and launchers that are refused, in one line."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from parallel.test_shared import INERTIA, STOKES

import ibfil
from ibfil.case.reading import parse_case
from ibfil.commands.main import main
from ibfil.errors import CaseError
from ibfil.parallel import launch, ranks
from ibfil.parallel.division import Division
from ibfil.simulation.simulation import Simulation

PACKAGE = Path(ibfil.__file__).parent
STRAIGHT = STOKES.replace('curvature = ["6*sin(4*pi*s - 10*t)", 0]\nshape = { kind = "relaxed" }', "")


def test_one_function_names_mpi4py_and_a_run_of_one_process_does_not_call_it(tmp_path):
    naming = [
        path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("*.py") if "import MPI" in path.read_text()
    ]
    assert naming == ["parallel/ranks.py"]
    at_load = ast.parse((PACKAGE / "parallel/ranks.py").read_text()).body
    assert not any(isinstance(node, ast.ImportFrom) and node.module == "mpi4py" for node in at_load)
    code = (
        "import sys; from ibfil.commands.main import main; "
        "assert main(['run', 'stokes.toml', 'time.end=0.0125', 'output.every=0.0125']) == 0; "
        "assert not any('mpi' in name.split('.')[0].lower() for name in sys.modules), sorted(sys.modules)"
    )
    (tmp_path / "stokes.toml").write_text(STOKES)
    alone = {key: value for key, value in os.environ.items() if not key.startswith(("PMI", "OMPI"))}
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=surroundings(alone), check=True)


def surroundings(variables: dict[str, str]) -> dict[str, str]:
    return {**variables, "PYTHONPATH": os.pathsep.join([str(PACKAGE.parent), variables.get("PYTHONPATH", "")])}


@pytest.mark.parametrize("rank", [0, 1])
def test_without_mpi4py_it_is_said_once_what_to_install(tmp_path, rank):
    (tmp_path / "mpi4py").mkdir()
    (tmp_path / "mpi4py" / "__init__.py").write_text("raise ImportError('none')")
    started = {**os.environ, "OMPI_COMM_WORLD_SIZE": "4", "OMPI_COMM_WORLD_RANK": str(rank)}
    words = [sys.executable, "-m", "ibfil", "run", "swimmer"]
    env = surroundings(started | {"PYTHONPATH": str(tmp_path)})
    env["PYTHONPATH"] = f"{tmp_path}{os.pathsep}{env['PYTHONPATH']}"
    done = subprocess.run(words, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    line = "ibfil: mpiexec: started 4 processes, and to make one run they need mpi4py and an MPI library (none); "
    assert done.stderr == ("" if rank else line + "install them: pip install 'ibfil[mpi]' mpich\n")
    assert done.returncode == (0 if rank else 2)
    assert not list(tmp_path.glob("*.h5"))


@pytest.mark.parametrize("rank", [0, 1])
def test_what_each_process_would_do_all_of_is_refused_once(tmp_path, monkeypatch, capsys, rank):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "4")
    monkeypatch.setenv("OMPI_COMM_WORLD_RANK", str(rank))
    (tmp_path / "stokes.toml").write_text(STOKES)
    words = ["sweep", "stokes.toml", "--vary", "fluid.viscosity=1,2"]
    if rank:
        with pytest.raises(SystemExit, match="0"):
            main(words)
    else:
        assert main(words) == 2
    line = (
        "ibfil: sweep: found 4 processes (OMPI_COMM_WORLD_SIZE), each of which would do all of it; allowed: 1 process"
    )
    told = capsys.readouterr().err
    assert told.count("\n") == (0 if rank else 1)
    assert told.startswith("" if rank else line)
    assert [path.name for path in tmp_path.iterdir()] == ["stokes.toml"]


def test_a_run_that_processes_were_not_all_asked_for_is_refused(monkeypatch):
    words = (["a.toml"], None, False, None)
    ranks.agree(SimpleNamespace(size=2, allgather=lambda mine: [mine, words]), words)
    with pytest.raises(CaseError, match="2 processes with different words"):
        ranks.agree(SimpleNamespace(size=2, allgather=lambda mine: [mine, (["b.toml"], *words[1:])]), words)


def test_the_launcher_is_known_by_its_own_variables(monkeypatch):
    for name in (*launch._SIZES, *launch._RANKS):
        monkeypatch.delenv(name, raising=False)
    assert (launch.processes(), launch.place()) == (1, 0)
    monkeypatch.setenv("SLURM_NTASKS", "8")  # which a batch script has that runs ibfil by itself
    assert launch.processes() == 1
    monkeypatch.setenv("SLURM_STEP_NUM_TASKS", "8")
    monkeypatch.setenv("SLURM_PROCID", "5")
    assert (launch.processes(), launch.place()) == (8, 5)
    monkeypatch.setenv("PMI_SIZE", "3")
    monkeypatch.setenv("PMI_RANK", "2")
    assert (launch.processes(), launch.place()) == (3, 2)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (STOKES.replace("krylov", "table"), 'fluid.method = "table": 2 processes share whole transforms'),
        (STOKES.replace("krylov", "pruned"), 'fluid.method = "pruned": 2 processes share whole transforms'),
        (STOKES.replace("krylov", "auto"), "for 27 nodes the exact table is the quickest"),
        (STRAIGHT + "[thermal]\nenergy = 1e-3\nseed = 1", "thermal: 2 processes share no thermal forces"),
        (STOKES.replace("[2.5, 2.75, 2.0]\ncells = [10, 11, 8]", '"free"\nspacing = 0.25'), "no periodic grid"),
        (
            STOKES.split("[fluid]")[0]
            + '[fluid]\nmodel = "rft"\nviscosity = 1.0\n[time]\nend = 1.0\n[output]\nevery = 1.0',
            "no periodic grid",
        ),
    ],
)
def test_scenes_with_nothing_to_share_are_refused_in_one_line(monkeypatch, text, found):
    monkeypatch.setattr(ranks, "_ours", SimpleNamespace(size=2))
    with pytest.raises(CaseError) as refused:
        Simulation(parse_case(text, "case.toml"))
    (line,) = refused.value.faults
    assert line.startswith("case.toml: ")
    assert found in line
    assert line.endswith("nothing to share; run it with one process, without mpiexec")


@pytest.mark.parametrize("text", [STOKES, INERTIA])
def test_more_processes_than_planes_are_refused(monkeypatch, text):
    monkeypatch.setattr(ranks, "_ours", SimpleNamespace(size=11))
    with pytest.raises(CaseError, match="10 is the least along x and y; allowed: mpiexec -n 10 at most"):
        Simulation(parse_case(text, "case.toml"))


def test_a_division_leaves_out_no_row_and_is_even():
    for rows, processes in ((10, 3), (7, 7), (64, 5), (4, 1)):
        counts = Division.of(rows, processes).counts
        assert sum(counts) == rows
        assert max(counts) - min(counts) <= 1
