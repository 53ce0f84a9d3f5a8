"""Runs whose files are taken away, cut, replaced, or on a disk that has gone bad: said in time, and nothing lost."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import numpy as np
import pytest
from helpers.fake_simulation import ALWAYS, FakeSimulation, case, look
from helpers.made_run import BENT
from helpers.runs import content, go_on, meddling, real, run

from ibfil.case.reading import read_case
from ibfil.errors import CaseError, RunFailed
from ibfil.io import writer
from ibfil.io.paths import checkpoint_path, journal_path
from ibfil.io.reader import RunFile
from ibfil.running import run as running

SHORT = (ALWAYS, "time.end=0.12")


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    """Outputs are written as they come."""
    monkeypatch.setattr(writer, "_PAUSE", 0)
    monkeypatch.setattr(writer, "_SHARE", 0)


@pytest.mark.parametrize("how", ["removed", "moved", "all removed"])
def test_a_run_whose_file_was_taken_away_is_written_again_and_that_is_told(tmp_path, how):
    path, whole, said = tmp_path / "run.h5", tmp_path / "whole.h5", []

    def meddle():
        if how == "moved":
            path.rename(tmp_path / "elsewhere.h5")
        else:
            for one in tmp_path.glob("run.*") if how == "all removed" else [path]:
                one.unlink()

    run(case("", *SHORT), whole)
    given = case("", *SHORT)
    result = running.run(
        given, path, build=meddling(FakeSimulation, 22, meddle), look=look, progress=False, log=said.append
    )
    assert result.status == "finished"
    assert any("was removed or moved while it was being written; it was written again" in line for line in said)
    assert content(path) == content(whole)
    if how == "moved":
        with RunFile(tmp_path / "elsewhere.h5") as file:
            assert 0 < len(file) < len(result.times)


def test_a_run_whose_file_another_took_the_place_of_fails_and_leaves_that_alone(tmp_path):
    path = tmp_path / "run.h5"

    def meddle():
        path.unlink()
        path.write_text("mine")

    with pytest.raises(RunFailed, match="another file was put in its place") as failed:
        run(case("", *SHORT), path, build=meddling(FakeSimulation, 22, meddle))
    assert "leave the run file and its folder where they are" in str(failed.value)
    assert path.read_text() == "mine"


def test_a_run_whose_folder_is_gone_says_so(tmp_path):
    path = tmp_path / "here" / "run.h5"
    path.parent.mkdir()
    with pytest.raises(RunFailed, match=r"run\.h5 cannot be written \(No such file or directory\)"):
        run(case("", *SHORT), path, build=meddling(FakeSimulation, 22, lambda: path.parent.rename(tmp_path / "there")))
    with RunFile(tmp_path / "there" / "run.h5") as file:
        assert len(file) > 1


def test_a_file_cut_short_while_it_is_written_is_an_error_and_no_endless_loop(tmp_path):
    path = tmp_path / "run.h5"
    with pytest.raises(RunFailed, match="it was cut short by another program while it was being written") as failed:
        run(case("", *SHORT), path, build=meddling(FakeSimulation, 22, lambda: os.truncate(path, 100)))
    assert "the last good checkpoint is" in str(failed.value)
    said = []
    assert go_on(path, log=said.append).status == "finished"
    assert any("rebuilt" in line for line in said)


class Bad:
    """A disk that reports an error at every call from the ``first`` on."""

    def __init__(self, patch: pytest.MonkeyPatch, folder: Path, first: int) -> None:
        self.calls, self._first, self._folder = 0, first, folder
        for name in ("pwrite", "pread", "fsync", "ftruncate", "replace", "fstat"):
            patch.setattr(os, name, self._called(getattr(os, name)))

    def _called(self, call):
        def called(*args):
            if isinstance(args[0], int) and not os.readlink(f"/proc/self/fd/{args[0]}").startswith(str(self._folder)):
                return call(*args)
            self.calls += 1
            if self.calls >= self._first:
                raise OSError(errno.EIO, "Input/output error")
            return call(*args)

        return called


def test_a_disk_that_stays_bad_ends_a_run_with_its_file_its_checkpoint_and_advice(tmp_path, monkeypatch):
    """From one system call after another on; and what was written before is there when the disk is well again."""
    short, failed = case("", *SHORT), 0
    for number, first in enumerate(range(1, 4000, 150)):
        path = tmp_path / f"{number}" / "run.h5"
        path.parent.mkdir()
        with monkeypatch.context() as patch:
            bad = Bad(patch, path.parent, first)
            try:
                run(short, path)
            except RunFailed as failure:
                told = str(failure)
            else:
                break
        assert bad.calls >= first
        failed += 1
        assert f"{path.parent}/run." in told
        assert "Input/output error" in told
        assert "what to change: " in told
        if checkpoint_path(path).exists():
            assert f"the last good checkpoint is {checkpoint_path(path)}" in told
            assert go_on(path).status == "finished"
        else:
            assert run(short, path).status == "finished"  # nothing is in the way of it
        assert not journal_path(path).exists()
    assert failed > 5


def test_a_run_killed_at_its_start_is_not_in_the_way_of_the_next(tmp_path):
    """Whatever it was at: the file appears with its first output, and may be replaced as long as there is no more."""
    path = tmp_path / "run.h5"
    for calls in range(1, 60, 4):
        child = os.fork()
        if not child:
            left = [calls]

            def mortal(call, left=left):
                def called(*args):
                    left[0] -= 1
                    if left[0] < 0:
                        os._exit(9)
                    return call(*args)

                return called

            for name in ("open", "pwrite", "ftruncate", "fsync", "replace", "unlink"):
                setattr(os, name, mortal(getattr(os, name)))
            try:
                run(case("", "time.end=0.1"), path)
            finally:
                os._exit(0)
        os.waitpid(child, 0)
        if path.exists():
            with RunFile(path) as file:
                assert len(file) >= 1
                if len(file) > 1 or file.status not in ("cut", "failed"):
                    break
        assert run(case("", "time.end=0.1"), path).status == "finished"
        with pytest.raises(CaseError, match="exists already"):
            run(case("", "time.end=0.1"), path)
        path.unlink()
    assert calls > 20


def test_a_run_that_fails_at_its_start_is_not_in_the_way_of_the_next(path):
    class Fails(FakeSimulation):
        def advance(self, until, after_step):
            raise RunFailed("no", time=0.0)

    class Stumbles(FakeSimulation):
        def snapshot(self, *fields):
            raise ZeroDivisionError

    with pytest.raises(RunFailed):
        run(case(), path, build=Fails)
    with RunFile(path) as file:
        assert (file.status, len(file)) == ("failed", 1)
    with pytest.raises(ZeroDivisionError):
        run(case(), path, build=Stumbles)
    assert run(case("", "time.end=0.1"), path).status == "finished"
    with RunFile(path) as file:
        assert np.isclose(file.time[-1], 0.1)


def test_a_run_is_not_written_over_what_it_reads(tmp_path, monkeypatch):
    """By whatever name: the run a shape is taken from, a table of points, the case itself."""
    monkeypatch.chdir(tmp_path)
    old = tmp_path / "old.h5"
    (tmp_path / "bent.toml").write_text(BENT)
    run(read_case("bent.toml"), old, real)
    text = BENT.replace('{ kind = "circle", curvature = 1.0 }', '{ kind = "run", path = "old.h5" }')
    assert "old.h5" in text
    (tmp_path / "next.toml").write_text(text)
    (tmp_path / "link.h5").symlink_to(old)
    before = old.read_bytes()
    for name in ("old.h5", "link.h5"):
        with pytest.raises(CaseError, match=f"{name}: is read for this, and not written over"):
            run(read_case("next.toml"), Path(name), real, overwrite=True)
    for name in ("next.toml", "old.h5/x.h5"):
        with pytest.raises((CaseError, RunFailed)):
            run(read_case("next.toml"), Path(name), real, overwrite=True)
    assert old.read_bytes() == before
    assert (tmp_path / "next.toml").read_text() == text
