"""What the world does to a run: full disks, folders one may not write to, files of other versions."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.fake_simulation import case
from helpers.runs import HERE, ROD, go_on, interrupted, run

from ibfil.commands.main import main
from ibfil.errors import CaseError
from ibfil.io.paths import checkpoint_path
from ibfil.io.reader import RunFile

MANY = "output.every=0.002"


def limited(path: Path, size: int) -> subprocess.CompletedProcess:
    """Run the fake case in a process that the system lets write files of so many bytes only."""
    code = textwrap.dedent(f"""
        import sys; sys.path[:0] = {[str(HERE), str(HERE.parent)]!r}
        from helpers.fake_simulation import *
        from ibfil.io import writer as recorder
        from ibfil.running import run as running
        from ibfil.commands.main import main
        import ibfil.commands.run
        recorder._PAUSE = recorder._SHARE = 0
        ibfil.commands.run.read_case = lambda words: case("", {MANY!r})
        real = running.run
        running.run = lambda *given, **more: real(*given, **more, build=FakeSimulation, look=look, progress=False)
        raise SystemExit(main(["run", "fake.toml", "-o", {str(path)!r}]))
    """)

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # then writes fail, as on a full disk
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, preexec_fn=limit, timeout=300, check=False)


@pytest.mark.parametrize("size", [400_000, 500_000])
def test_a_file_that_may_not_grow_fails_the_run_and_all_before_is_there(path, size):
    done = limited(path, size)
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert "cannot be written (File too large)" in done.stderr
    assert "the last good checkpoint is" in done.stderr
    with RunFile(path) as file:
        assert file.status == "failed"
        rows, position = len(file), file.position()
    assert rows > 20
    assert go_on(path, None, [MANY]).status == "finished"
    with RunFile(path) as file:
        assert len(file) == 501
        assert np.array_equal(file.position()[:rows], position)


def test_a_folder_one_may_not_write_to_is_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rod.toml").write_text(ROD)
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o555)
    if os.getuid() == 0:  # who may write everywhere but where the system has no files to make
        closed = Path("/sys")
    assert main(["run", "rod.toml", "-o", str(closed / "rod.h5")]) in (1, 2)
    lines = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("compiling")]
    assert lines[0].startswith("ibfil: ")
    assert "rod.h5 cannot be written (Permission denied)" in lines[0]
    assert "write elsewhere with -o" in lines[1]
    assert not any("Traceback" in line for line in lines)
    for words in (["vtk", "rod.h5", "-o", str(closed / "out")], ["show", "rod.h5", "--csv", str(closed / "a.csv")]):
        main(["run", "rod.toml", "-o", "rod.h5", "--force"])
        capsys.readouterr()
        assert main(words) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "Permission denied" in line or "Operation not permitted" in line


def test_a_disk_too_full_to_begin_is_told(path):
    done = limited(path, 50_000)
    assert done.returncode == 1
    assert "run.h5 cannot be written (File too large)" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("version", "told"),
    [
        (9, r"has format 9, written by ibfil 8\.1; this ibfil reads format \d+: read it with ibfil 8\.1 or later"),
        (0, r"has format 0, written by ibfil 8\.1; .*: read it with ibfil 8\.1, or run its case again"),
    ],
)
def test_a_run_of_another_format_says_what_to_do(path, version, told):
    run(case("", "time.end=0.1"), path)
    with h5py.File(path, "r+") as file:
        file.attrs["format_version"], file.attrs["ibfil_version"] = version, "8.1"
    with pytest.raises(CaseError, match=told):
        RunFile(path)


def test_a_checkpoint_of_another_format_says_what_to_do(path):
    interrupted(path, 60)
    with h5py.File(checkpoint_path(path), "r+") as file:
        file.attrs["format_version"] = 77
    before = path.read_bytes()
    with pytest.raises(CaseError, match=r"is a checkpoint of format 77; .*go on with the ibfil that `ibfil show` says"):
        go_on(path)
    assert path.read_bytes() == before


def test_a_checkpoint_that_lacks_something_is_one_line(tmp_path):
    from helpers.runs import real, rod

    path = tmp_path / "rod.h5"
    interrupted(path, 3, rod()(), real)
    with h5py.File(checkpoint_path(path), "r+") as file:
        del file["state/y_old"]
    with pytest.raises(CaseError, match="has no 'y_old' in its state; another version of ibfil wrote it"):
        go_on(path, build=real)


def test_a_changed_case_is_refused_with_what_has_changed(path, capsys):
    interrupted(path, 60)
    words = ["run", "--resume", str(path), "filament.rod.bending=[1, '2 + s']", "filament.rod.position=[0, 1, 0]"]
    assert main(words) == 2
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 2
    assert "filament.rod.position.1: found 1.0; the run began with 0.0" in told[1]
    assert "filament.rod.bending.1: found 2 + s; the run began with 1, and only time.end and times of" in told[0]
