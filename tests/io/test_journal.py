"""A file that changes all at once, whenever its writer dies and however full the disk is."""

from __future__ import annotations

import errno
import functools
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.written import begin, series, snapshots

from ibfil.errors import CaseError, RunFailed
from ibfil.io import journal, writer
from ibfil.io.journal import JournaledFile
from ibfil.io.ownership import Busy
from ibfil.io.reader import RunFile


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "run.h5"


# --- a file that changes all at once ---------------------------------------------------------------------------------


def test_journaled_file_is_a_file(tmp_path):
    """Against a plain buffer: random writes, reads, truncations and commits give the same bytes."""
    file, plain = JournaledFile(tmp_path / "f", tmp_path / "j", create=True), bytearray()
    random = np.random.default_rng(3)
    for _ in range(2000):
        what, at = random.integers(10), int(random.integers(0, 40_000))
        size = int(random.integers(1, 9000))
        if what < 5:
            data = random.bytes(size)
            file.seek(at)
            assert file.write(data) == size
            plain.extend(bytes(max(0, at - len(plain))))
            plain[at : at + size] = data
        elif what < 7:
            file.seek(at)
            assert file.read(size) == bytes(plain[at : at + size]).ljust(size, b"\0")
        elif what < 8 and at < len(plain):
            file.truncate(at)
            del plain[at:]
            file.seek(0, os.SEEK_END)
            assert file.tell() == at
            file.commit()
        elif what == 8:
            file.commit()
            assert (tmp_path / "f").read_bytes() == bytes(plain)
    file.commit()
    file.close()
    assert (tmp_path / "f").read_bytes() == bytes(plain)
    assert not (tmp_path / "j").exists()


class Dies(Exception):
    """The process is gone."""


def mortal(patch: pytest.MonkeyPatch, dies_at: int, torn: bool) -> None:
    """Let the process die after ``dies_at`` calls that write or sync."""
    count = 0

    def dying(call, name, *args):
        nonlocal count
        count += 1
        if count > dies_at:
            if torn and name == "pwrite":
                call(args[0], args[1][: len(args[1]) // 2], args[2])
            raise Dies
        return call(*args)

    for name in ("pwrite", "ftruncate", "fsync"):
        patch.setattr(os, name, functools.partial(dying, getattr(os, name), name))


@pytest.mark.parametrize("torn", [False, True])
def test_a_commit_cut_anywhere_is_the_old_file_or_the_new(tmp_path, monkeypatch, torn):
    """Die at each system call of a commit in turn; ``torn``: a write that dies has done half of its work."""
    path, side = tmp_path / "f", tmp_path / "j"
    old = np.random.default_rng(1).bytes(30_000)
    new = bytearray(old[:20_000] + bytes(7000))
    for dies_at in range(1000):
        path.write_bytes(old)
        side.unlink(missing_ok=True)
        file = JournaledFile(path, side)
        file.truncate(20_000)
        file.seek(4000)
        file.write(b"x" * 300)  # over the edge of two pages
        file.seek(20_000)
        file.write(bytes(7000))
        new[4000:4300] = b"x" * 300
        with monkeypatch.context() as patch:
            mortal(patch, dies_at, torn)
            try:
                file.commit()
                done = True
            except Dies:
                done = False
        os.close(file._file)  # as the kernel does for the dead, and lets go of the lock
        os.close(file._lock)
        journal.recover(path, side)
        assert path.read_bytes() in (old, bytes(new))
        assert not side.exists() or side.stat().st_size == 0
        if done:
            assert path.read_bytes() == bytes(new)
            assert dies_at > 6
            return
    raise AssertionError("the commit never ended")


def test_a_journal_that_is_not_whole_is_ignored(tmp_path):
    path, side = tmp_path / "f", tmp_path / "j"
    path.write_bytes(b"a" * 10_000)
    for content in (b"ibf", b"ibfiljnl", b"ibfiljnl" + np.random.default_rng(1).bytes(5000), bytes(3000)):
        side.write_bytes(content)
        assert journal.recover(path, side) is False
        assert path.read_bytes() == b"a" * 10_000
        assert not side.exists()


def test_a_file_of_a_user_beside_a_run_is_not_touched(tmp_path):
    """A journal or a part that is a link, a pipe, a folder, or has other bytes: refused by name, and as it was."""
    path, notes = tmp_path / "lab.h5", tmp_path / "notes.txt"
    notes.write_text("Monday: 3 mM ATP")
    for name in ("lab.journal", "lab.h5.part", "lab.ckpt.h5", "lab.ckpt.h5.part"):
        side = tmp_path / name
        for make in (
            lambda side: side.write_text("Tuesday: no ATP"),
            lambda side: side.symlink_to(notes),
            os.mkfifo,
            Path.mkdir,
        ):
            make(side)
            with pytest.raises(CaseError, match=rf"{name}: is (there, and no|a folder|not a file)"):
                begin(path, next(snapshots(1)))
            assert not path.exists()
            assert notes.read_text() == "Monday: 3 mM ATP"
            assert side.is_symlink() or not side.is_file() or side.read_text() == "Tuesday: no ATP"
            assert sorted(p.name for p in tmp_path.iterdir()) == sorted([name, "notes.txt"])
            side.rmdir() if side.is_dir() else side.unlink()


def test_a_file_is_locked_while_it_is_open(tmp_path):
    path, side = tmp_path / "f", tmp_path / "j"
    assert not journal.is_being_written(side)
    file = JournaledFile(path, side, create=True)
    assert journal.is_being_written(side)
    with pytest.raises(Busy):
        JournaledFile(path, side)
    assert journal.recover(path, side) is False
    file.close()
    assert not journal.is_being_written(side)


# --- a disk that is full ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("room", [0, 1, 5, 20])
def test_a_full_disk_leaves_what_was_written(path, monkeypatch, room):
    """The disk takes ``room`` more pages of 4 kB, in whole or in part, and then no more."""
    monkeypatch.setattr(writer, "_PAUSE", 0)
    monkeypatch.setattr(writer, "_SHARE", 0)
    shown = list(snapshots(90))
    record = begin(path, shown[0], expected=4)  # small chunks, so that every few outputs need new room
    for snapshot in shown[1:20]:
        record.append(snapshot, series(snapshot))
    left, real = room * 4096, os.pwrite
    ends: dict[int, int] = {}

    def pwrite(handle, data, at):
        nonlocal left
        end = ends.setdefault(handle, os.fstat(handle).st_size)
        new = max(0, at + len(data) - end)
        if new > left:
            raise OSError(errno.ENOSPC, "No space left on device")
        left -= new
        ends[handle] = max(end, at + len(data))
        return real(handle, data, at)

    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", pwrite)
        written = 20

        def append_all():
            nonlocal written
            for snapshot in shown[20:]:
                record.append(snapshot, series(snapshot))
                written += 1

        with pytest.raises(RunFailed, match=r"run\.h5 cannot be written \(No space left on device\)") as caught:
            append_all()
        assert "free some space" in str(caught.value)
        with pytest.raises(RunFailed):
            record.finish("failed")
        record.close()
    with RunFile(path) as run:
        assert len(run) == written
        for back, snapshot in zip(run.snapshots(), shown, strict=False):
            assert np.array_equal(back.filaments["rod"].position, snapshot.filaments["rod"].position)
    writer.record_end(path, "failed", "the disk was full")
    with RunFile(path) as run:
        assert (run.status, run.reason, len(run)) == ("failed", "the disk was full", written)


def test_a_limit_of_the_system_is_a_failure_and_no_crash(path):
    """The same with the operating system's own limit on the size of files, in a process of its own."""
    script = (
        "import resource, sys; sys.path[:0] = sys.argv[2:]; from helpers.written import *\n"
        "from ibfil import errors; from ibfil.io import writer as recorder\n"
        "recorder._PAUSE = recorder._SHARE = 0; shown = list(snapshots(60))\n"
        "record = begin(Path(sys.argv[1]), shown[0], expected=4)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))\n"
        "try:\n    for one in shown[1:]: record.append(one, series(one))\n"
        "except errors.RunFailed as error: print(record.outputs - 1, error); record.close()\n"
    )
    here = Path(__file__).parents[1]
    done = subprocess.run(
        [sys.executable, "-c", script, str(path), str(here), str(here.parent)],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert "run.h5 cannot be written (File too large)" in done.stdout
    with RunFile(path) as run:
        assert len(run) == int(done.stdout.split()[0])


def test_a_place_that_cannot_be_written_is_told_at_once(tmp_path, monkeypatch):
    with pytest.raises(RunFailed, match=r"cannot be written \(No such file or directory\)"):
        begin(tmp_path / "nowhere" / "run.h5", next(snapshots(1)))
    real = os.open

    def read_only(path, flags, *more):  # a test may run as root, who may write everywhere
        if flags & (os.O_RDWR | os.O_WRONLY):
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return real(path, flags, *more)

    monkeypatch.setattr(os, "open", read_only)
    with pytest.raises(RunFailed, match=r"cannot be written \(Permission denied\)"):
        begin(tmp_path / "run.h5", next(snapshots(1)))
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_is_full_from_the_start_keeps_no_empty_file(tmp_path, monkeypatch):
    """Which would refuse the next try."""

    def pwrite(handle, data, at):
        raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / "run.h5"
    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", pwrite)
        with pytest.raises(RunFailed, match="No space left on device") as caught:
            begin(path, next(iter(snapshots(2))))
    assert "nothing was written" in str(caught.value)
    assert list(tmp_path.iterdir()) == []
