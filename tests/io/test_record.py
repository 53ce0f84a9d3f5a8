"""The run file: what is written is what is read, and what is no run file is refused."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.fake_simulation import FakeSimulation, case
from helpers.written import begin, series, snapshots, write

from ibfil.errors import CaseError, RunFileError
from ibfil.io.reader import RunFile
from ibfil.io.writer import GridPlace, Recorder


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "run.h5"


# --- what is in the file ---------------------------------------------------------------------------------------------


def test_every_array_is_read_back_bit_for_bit(path):
    shown = write(path, 5)
    with RunFile(path) as run:
        assert len(run) == 5
        assert list(run.filaments) == ["rod"]
        for i, (back, snapshot) in enumerate(zip(run.snapshots(), shown, strict=True)):
            assert back.time == snapshot.time == run.time[i]
            assert back.diagnostics.keys() == snapshot.diagnostics.keys()
            for name, value in snapshot.diagnostics.items():
                assert np.array_equal(back.diagnostics[name], value)
            ours, theirs = vars(back.filaments["rod"]), vars(snapshot.filaments["rod"])
            assert ours.keys() == theirs.keys()
            for name, value in theirs.items():
                assert (value is None) == (ours[name] is None)
                assert value is None or np.array_equal(ours[name], value)
        assert np.array_equal(run.observables["tip"], run.position()[:, -1])
        assert np.array_equal(run.snapshot(-2).filaments["rod"].strain, shown[3].filaments["rod"].strain)


def test_layout_is_that_of_the_contract(path):
    write(path, 3)
    with h5py.File(path) as file:
        assert file.attrs["format"] == "ibfil-run"
        assert file.attrs["format_version"] == 1
        assert {"ibfil_version", "case", "created", "finished", "versions", "method", "wisdom", "status"} <= set(
            file.attrs
        )
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
    first = simulation.snapshot(("velocity",))
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
        for key in (
            3,
            -1,
            slice(None),
            slice(1, 6, 2),
            slice(None, None, -1),
            slice(5, 2),
            (2, 4),
            (slice(1, 3), 0),
            ...,
        ):
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
    (snapshot, after) = snapshots(2)
    record = begin(path, snapshot)
    position = after.filaments["rod"].position
    kept = position.copy()
    record.append(after, series(after))
    position[:] = 0  # as a simulation that goes on in the same memory
    record.finish("finished")
    with RunFile(path) as run:
        assert np.array_equal(run.position()[1], kept)


def test_an_output_unlike_the_first_is_an_error(path):
    snapshot, after = snapshots(2)
    record = begin(path, snapshot)
    with pytest.raises(ValueError, match="observables/other was not in the first output"):
        record.append(after, {"other": 1.0})
    record.close()


# --- what is refused -------------------------------------------------------------------------------------------------


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
        "import sys; sys.path[:0] = sys.argv[2:]; from helpers.written import *\n"
        "record = begin(Path(sys.argv[1]), next(snapshots(1))); print('open', flush=True); sys.stdin.read()"
    )
    here = Path(__file__).parents[1]
    other = subprocess.Popen(
        [sys.executable, "-c", script, str(path), str(here), str(here.parent)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    try:
        assert other.stdout.readline() == b"open\n"
        before = path.read_bytes()
        for attempt in (
            lambda: begin(path, next(snapshots(1)), overwrite=True),
            lambda: Recorder.resume(path, case(), 0, 0),
        ):
            with pytest.raises(RunFileError, match="is being written by another ibfil") as caught:
                attempt()
            assert len(caught.value.faults) == 1
        assert path.read_bytes() == before
        with RunFile(path) as run:  # but reading is free
            assert run.status == "running"
    finally:
        other.communicate(timeout=300)
    with RunFile(path) as run:
        assert run.status == "cut"  # it never said how it ended
    begin(path, next(snapshots(1)), overwrite=True).close()


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
