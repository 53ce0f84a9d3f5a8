"""The run file, the journal and the checkpoint: what is written is what is read, whatever happens in between."""

from __future__ import annotations

import errno
import io
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from fake_simulation import FakeSimulation, case
from ibfil import checkpoint, journal, recorder
from ibfil.errors import CaseError, RunFailed
from ibfil.journal import Busy, JournaledFile
from ibfil.record import RunFile, RunFileError, checkpoint_path, journal_path
from ibfil.recorder import GridPlace, Meaning, Recorder

MEANINGS = {"tip": Meaning("length", "position of the tip")}


def frames(count: int, given=None):
    """``count`` frames of a fake run, 0.05 apart."""
    simulation = FakeSimulation(given or case())
    for i in range(count):
        simulation.advance(0.05 * i, lambda: None)
        yield simulation.frame()


def series(frame) -> dict[str, np.ndarray]:
    return {"tip": frame.filaments["rod"].position[-1]}


def begin(path: Path, frame, **more) -> Recorder:
    return Recorder.create(path, case(), frame, series(frame), MEANINGS, **more)


def write(path: Path, count: int, **more) -> list:
    """A finished run file of ``count`` outputs; the frames in it."""
    shown = list(frames(count))
    record = begin(path, shown[0], **more)
    for frame in shown[1:]:
        record.append(frame, series(frame))
    record.finish("finished", steps=7, wall_time=1.5)
    return shown


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "run.h5"


# --- what is in the file --------------------------------------------------------------------------------------------


def test_every_array_is_read_back_bit_for_bit(path):
    shown = write(path, 5)
    with RunFile(path) as run:
        assert len(run) == 5
        assert list(run.filaments) == ["rod"]
        for i, (back, frame) in enumerate(zip(run.frames(), shown, strict=True)):
            assert back.time == frame.time == run.time[i]
            assert back.diagnostics.keys() == frame.diagnostics.keys()
            for name, value in frame.diagnostics.items():
                assert np.array_equal(back.diagnostics[name], value)
            ours, theirs = vars(back.filaments["rod"]), vars(frame.filaments["rod"])
            assert ours.keys() == theirs.keys()
            for name, value in theirs.items():
                assert (value is None) == (ours[name] is None)
                assert value is None or np.array_equal(ours[name], value)
        assert np.array_equal(run.observables["tip"], run.position()[:, -1])
        assert np.array_equal(run.frame(-2).filaments["rod"].strain, shown[3].filaments["rod"].strain)


def test_layout_is_that_of_the_contract(path):
    write(path, 3)
    with h5py.File(path) as file:
        assert file.attrs["format"] == "ibfil-run"
        assert file.attrs["format_version"] == 1
        assert {"ibfil_version", "case", "created", "finished", "versions", "method", "wisdom", "status"} <= set(file.attrs)
        assert case().text == file.attrs["case"]
        shapes = {name: file["filaments/rod"][name].shape for name in file["filaments/rod"]}
        full = (3, 9, 3)
        assert shapes == dict.fromkeys(["position", "velocity", "force", "e1", "moment", "strain"], full) | {
            "tension": (3, 8),
            "reaction_start": (3, 3),  # the start is held, the finish is not
        }
        assert file["time"].shape == (3,)
        assert file["observables/tip"].shape == (3, 3)
        assert file["diagnostics/net_force"].shape == (3, 3)
        assert file["diagnostics/power"].shape == (3,)


def test_every_dataset_has_units_of_the_case_and_a_description(path):
    write(path, 2)
    expected = {
        "time": "s",
        "filaments/rod/velocity": "um/s",
        "filaments/rod/moment": "pN um",
        "filaments/rod/strain": "1/um",
        "filaments/rod/e1": "1",
        "diagnostics/power": "pN um/s",
        "observables/tip": "um",
    }
    with RunFile(path) as run:
        assert {name: run.units(name) for name in expected} == expected
    with h5py.File(path) as file:
        found = []
        file.visititems(lambda _, item: found.append(item) if isinstance(item, h5py.Dataset) else None)
        assert len(found) > 10
        assert all(item.attrs["units"] and item.attrs["description"] for item in found)


def test_fields_lie_where_their_attributes_say(path):
    given = case(grid=True)
    simulation = FakeSimulation(given)
    first = simulation.frame(("velocity",))
    place = GridPlace(simulation.grid.origin, simulation.grid.spacing, 3)
    record = begin(path, first, grid=place)
    record.append_fields(0.0, first.grid)
    record.append_fields(0.5, {"velocity": first.grid["velocity"] + 1})
    record.finish("finished")
    with RunFile(path) as run:
        assert np.array_equal(run.grid.time, [0.0, 0.5])
        velocity = run.grid.fields["velocity"]
        assert velocity.shape == (2, 3, 3, 3, 3)
        assert velocity.dtype == np.float32
        # Value [g, i, j, k] is that of the whole grid's point at origin + spacing (i, j, k).
        x = run.grid.origin + run.grid.spacing * (2, 1, 0)
        i, j, k = np.rint((x - simulation.grid.origin) / simulation.grid.spacing).astype(int)
        assert np.array_equal(velocity[1][2, 1, 0], first.grid["velocity"][i, j, k] + 1)
    with h5py.File(path) as file:
        assert file["grid/velocity"].compression == "gzip"
        assert file["grid/velocity"].shuffle


def test_small_runs_stay_small(path):
    write(path, 20, expected=20)
    data = 20 * 8 * (1 + 6 * 27 + 8 + 3 + 3 + 5)
    assert path.stat().st_size < data + 60_000


def test_columns_index_as_arrays_do_and_hide_what_is_not_whole(path):
    write(path, 7)
    with RunFile(path) as run:
        column, array = run.filaments["rod"]["position"], run.position()
        for key in (3, -1, slice(None), slice(1, 6, 2), slice(None, None, -1), slice(5, 2), (2, 4), (slice(1, 3), 0), ...):
            assert np.array_equal(column[key], array[key])
        for key in (7, -8):
            with pytest.raises(IndexError):
                column[key]
    # A reader may come while the last output is in some datasets and not in others.
    with h5py.File(path, "r+") as file:
        file["filaments/rod/force"].resize(5, axis=0)
    with RunFile(path) as run:
        assert len(run) == len(run.time) == len(run.observables["tip"]) == 5


def test_append_copies(path):
    (frame, after) = frames(2)
    record = begin(path, frame)
    position = after.filaments["rod"].position
    kept = position.copy()
    record.append(after, series(after))
    position[:] = 0  # as a simulation that goes on in the same memory
    record.finish("finished")
    with RunFile(path) as run:
        assert np.array_equal(run.position()[1], kept)


def test_an_output_unlike_the_first_is_an_error(path):
    frame, after = frames(2)
    record = begin(path, frame)
    with pytest.raises(ValueError, match="observables/other was not in the first output"):
        record.append(after, {"other": 1.0})
    record.close()


# --- what is refused ------------------------------------------------------------------------------------------------


def test_a_run_file_is_not_written_over_unless_asked(path):
    write(path, 3)
    before = path.read_bytes()
    with pytest.raises(RunFileError, match="exists already"):
        write(path, 2)
    assert path.read_bytes() == before
    write(path, 2, overwrite=True)
    with RunFile(path) as run:
        assert len(run) == 2


def test_two_writers_on_one_file_are_refused(path):
    script = (
        "import sys; sys.path[:0] = sys.argv[2:]; from test_record import *; r = begin(Path(sys.argv[1]), next(frames(1)));"
        "print('open', flush=True); sys.stdin.read()"
    )
    here = Path(__file__).parent
    other = subprocess.Popen(
        [sys.executable, "-c", script, str(path), str(here), str(here.parent)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    try:
        assert other.stdout.readline() == b"open\n"
        before = path.read_bytes()
        for attempt in (
            lambda: begin(path, next(frames(1)), overwrite=True),
            lambda: Recorder.resume(path, case(), 0, 0),
        ):
            with pytest.raises(RunFileError, match="is being written by another ibfil") as caught:
                attempt()
            assert len(caught.value.faults) == 1
        assert path.read_bytes() == before
        with RunFile(path) as run:  # but reading is free
            assert run.status == "running"
    finally:
        other.communicate(timeout=30)
    with RunFile(path) as run:
        assert run.status == "cut"  # it never said how it ended
    begin(path, next(frames(1)), overwrite=True).close()


def test_what_is_no_run_file_is_refused_in_one_line(tmp_path):
    def other(name: str, content: bytes) -> Path:
        (tmp_path / name).write_bytes(content)
        return tmp_path / name

    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        file["x"] = 1.0
    write(tmp_path / "newer.h5", 1)
    with h5py.File(tmp_path / "newer.h5", "r+") as file:
        file.attrs["format_version"] = 2
        file.attrs["ibfil_version"] = "9.9"
    write(tmp_path / "half.h5", 30)
    half = (tmp_path / "half.h5").read_bytes()
    for path, words in {
        tmp_path / "none.h5": "no such file",
        tmp_path: "no such file",
        other("text.h5", b"hello\n"): "not a run file",
        other("empty.h5", b""): "not a run file",
        other("hdf5.h5", image.getvalue()): "not a run file",
        tmp_path / "newer.h5": "format 2, written by ibfil 9.9",
        other("half.h5", half[: len(half) // 2]): "damaged or cut short",
    }.items():
        with pytest.raises(CaseError, match=words) as caught:
            RunFile(path)
        assert len(caught.value.faults) == 1
        assert path.name in caught.value.faults[0]


# --- a file that changes all at once --------------------------------------------------------------------------------


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


@pytest.mark.parametrize("torn", [False, True])
def test_a_commit_cut_anywhere_is_the_old_file_or_the_new(tmp_path, monkeypatch, torn):
    """Die at each system call of a commit in turn; ``torn``: a write that dies has done half of its work."""
    path, side = tmp_path / "f", tmp_path / "j"
    old = np.random.default_rng(1).bytes(30_000)
    new = bytearray(old[:20_000] + bytes(7000))
    calls = {name: getattr(os, name) for name in ("pwrite", "ftruncate", "fsync")}
    for dies_at in range(1000):
        count = 0

        def dying(name, *args):
            nonlocal count
            count += 1
            if count > dies_at:
                if torn and name == "pwrite":
                    calls[name](args[0], args[1][: len(args[1]) // 2], args[2])
                raise Dies
            return calls[name](*args)

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
            for name in calls:
                patch.setattr(os, name, lambda *args, name=name: dying(name, *args))
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
    for content in (b"x", b"ibfiljnl", np.random.default_rng(1).bytes(5000)):
        side.write_bytes(content)
        assert journal.recover(path, side) is False
        assert path.read_bytes() == b"a" * 10_000
        assert not side.exists()


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


# --- a disk that is full --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("room", [0, 1, 5, 20])
def test_a_full_disk_leaves_what_was_written(path, monkeypatch, room):
    """The disk takes ``room`` more pages of 4 kB, in whole or in part, and then no more."""
    monkeypatch.setattr(recorder, "_PAUSE", 0)
    monkeypatch.setattr(recorder, "_SHARE", 0)
    shown = list(frames(90))
    record = begin(path, shown[0], expected=4)  # small chunks, so that every few outputs need new room
    for frame in shown[1:20]:
        record.append(frame, series(frame))
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
        with pytest.raises(RunFailed, match="run.h5 cannot be written .No space left on device") as caught:
            for frame in shown[20:]:
                record.append(frame, series(frame))
                written += 1
        assert "free some space" in str(caught.value)
        with pytest.raises(RunFailed):
            record.finish("failed")
        record.close()
    with RunFile(path) as run:
        assert len(run) == written
        for back, frame in zip(run.frames(), shown, strict=False):
            assert np.array_equal(back.filaments["rod"].position, frame.filaments["rod"].position)
    recorder.record_end(path, "failed", "the disk was full")
    with RunFile(path) as run:
        assert (run.status, run.reason, len(run)) == ("failed", "the disk was full", written)


def test_a_limit_of_the_system_is_a_failure_and_no_crash(path):
    """The same with the operating system's own limit on the size of files, in a process of its own."""
    script = (
        "import resource, sys; sys.path[:0] = sys.argv[2:]; from test_record import *\n"
        "recorder._PAUSE = recorder._SHARE = 0; shown = list(frames(60)); record = begin(Path(sys.argv[1]), shown[0], expected=4)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))\n"
        "try:\n    for frame in shown[1:]: record.append(frame, series(frame))\n"
        "except RunFailed as error: print(record.outputs - 1, error); record.close()\n"
    )
    here = Path(__file__).parent
    done = subprocess.run(
        [sys.executable, "-c", script, str(path), str(here), str(here.parent)], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    assert "run.h5 cannot be written (File too large)" in done.stdout
    with RunFile(path) as run:
        assert len(run) == int(done.stdout.split()[0])


def test_a_place_that_cannot_be_written_is_told_at_once(tmp_path, monkeypatch):
    with pytest.raises(RunFailed, match="cannot be written .No such file or directory"):
        begin(tmp_path / "nowhere" / "run.h5", next(frames(1)))
    real = os.open

    def read_only(path, flags, *more):  # a test may run as root, who may write everywhere
        if flags & (os.O_RDWR | os.O_WRONLY):
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return real(path, flags, *more)

    monkeypatch.setattr(os, "open", read_only)
    with pytest.raises(RunFailed, match="cannot be written .Permission denied"):
        begin(tmp_path / "run.h5", next(frames(1)))
    assert list(tmp_path.iterdir()) == []


# --- the checkpoint -------------------------------------------------------------------------------------------------


def some_checkpoint(**more) -> checkpoint.Checkpoint:
    rest = {"outputs": 3, "fields": 1, "wall_time": 0.5, "case": "é", "file": "c", "wisdom": "", "created": "now"}
    return checkpoint.Checkpoint(state=more, time=0.1 + 0.2, steps=12, **rest)


def test_a_checkpoint_gives_every_bit_and_type_back(tmp_path):
    random = np.random.default_rng(5)
    state = {
        "r": random.random((5, 3)),
        "fortran": np.asfortranarray(random.random((4, 3))),
        "transform": random.random(4) + 1j * random.random(4),
        "flags": np.array([True, False]),
        "count": np.arange(3),
        "single": random.random(3).astype(np.float32),
        "nothing": np.zeros((0, 3)),
        "scalar": np.array(0.1),
        "time": 0.1 + 0.2,
        "not a number": float("nan"),
        "steps": 3,
        "random/state": 2**127 + 1,
        "kind": "PCG64 ü",
        "empty": "",
    }
    path = tmp_path / "run.ckpt.h5"
    checkpoint.write(path, some_checkpoint(**state))
    back = checkpoint.read(path)
    assert (back.time, back.steps, back.outputs, back.case) == (0.1 + 0.2, 12, 3, "é")
    assert back.state.keys() == state.keys()
    for name, value in state.items():
        found = back.state[name]
        assert type(found) is type(value)
        if isinstance(value, np.ndarray):
            assert (found.dtype, found.shape) == (value.dtype, value.shape)
            assert found.flags.f_contiguous == value.flags.f_contiguous
            assert found.tobytes() == value.tobytes()
        else:
            assert found == value or value != value


def test_a_checkpoint_that_fails_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "run.ckpt.h5"
    checkpoint.write(path, some_checkpoint(number=1))

    def full(handle):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space"):
            checkpoint.write(path, some_checkpoint(number=2))
    assert checkpoint.read(path).state == {"number": 1}
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.ckpt.h5"]


def test_what_is_no_checkpoint_is_refused_in_one_line(tmp_path):
    path = tmp_path / "run.ckpt.h5"
    with pytest.raises(RunFileError, match="no such checkpoint"):
        checkpoint.read(path)
    write(tmp_path / "run.h5", 1)
    for content in (b"", b"text", (tmp_path / "run.h5").read_bytes()):
        path.write_bytes(content)
        with pytest.raises(RunFileError, match="not a checkpoint"):
            checkpoint.read(path)


def test_names_of_the_files_beside_a_run():
    assert checkpoint_path(Path("a/b.h5")) == Path("a/b.ckpt.h5")
    assert journal_path(Path("a/b.h5")) == Path("a/b.journal")
    assert checkpoint_path(Path("a/b.2")) == Path("a/b.2.ckpt.h5")
