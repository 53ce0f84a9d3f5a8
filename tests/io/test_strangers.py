"""Run files that come from anyone: nothing in them is followed out of the file, and no claim is believed."""

from __future__ import annotations

import os
import resource
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.fake_simulation import case
from helpers.runs import go_on, interrupted, run
from helpers.written import write

from ibfil.commands.main import main
from ibfil.errors import CaseError
from ibfil.io.paths import checkpoint_path, journal_path
from ibfil.io.reader import RunFile


def link_to_another_file(file: h5py.File, other: Path) -> None:
    file["observables/other"] = h5py.ExternalLink(str(other), "time")


def soft_link(file: h5py.File, other: Path) -> None:
    file["observables/tip2"] = h5py.SoftLink("/observables/tip")


def link_in_a_round(file: h5py.File, other: Path) -> None:
    file["filaments/rod/again"] = file["filaments"]


def second_name(file: h5py.File, other: Path) -> None:
    file["observables/tip2"] = file["observables/tip"]


def numbers_of_a_virtual_dataset(file: h5py.File, other: Path) -> None:
    layout = h5py.VirtualLayout(shape=(3,), dtype=float)
    layout[:] = h5py.VirtualSource(str(other), "time", shape=(3,))
    file["observables"].create_virtual_dataset("v", layout)


def numbers_of_another_file(file: h5py.File, other: Path) -> None:
    file["observables"].create_dataset("e", (3,), float, external=[(str(other), 0, 24)])


def terabytes_of_nothing(file: h5py.File, other: Path) -> None:
    file["observables"].create_dataset("n", (10**12,), float, chunks=(4096,))


def zeros_that_shrink_to_nothing(file: h5py.File, other: Path) -> None:
    """Compressed, and all but one block of them left out."""
    file["observables"].create_dataset("z", (10**9,), float, chunks=(2**16,), compression="gzip")[0] = 1.0


def texts(file: h5py.File, other: Path) -> None:
    file["observables/words"] = ["a", "b", "c"]


def groups_in_groups(file: h5py.File, other: Path) -> None:
    file["filaments/rod/more/position"] = np.zeros(3)


TRICKS = (
    link_to_another_file,
    soft_link,
    link_in_a_round,
    second_name,
    numbers_of_a_virtual_dataset,
    numbers_of_another_file,
    terabytes_of_nothing,
    zeros_that_shrink_to_nothing,
    texts,
    groups_in_groups,
)


@pytest.mark.parametrize("trick", TRICKS)
def test_a_file_that_points_out_of_itself_or_claims_what_it_has_not_is_refused(tmp_path, trick, capsys):
    """Before it is followed: the other file is a pipe, which a reader would wait for."""
    path, other = tmp_path / "run.h5", tmp_path / "pipe"
    os.mkfifo(other)
    write(path, 3)
    with h5py.File(path, "r+") as file:
        trick(file, other)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(CaseError, match=r"which ibfil does not write|claims to hold"):
        RunFile(path)
    assert main(["show", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("ibfil: ")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # kB


@pytest.mark.parametrize("trick", [link_to_another_file, link_in_a_round])
def test_a_checkpoint_that_points_out_of_itself_is_refused(tmp_path, trick):
    path, other = tmp_path / "run.h5", tmp_path / "pipe"
    os.mkfifo(other)
    interrupted(path, 60)
    with h5py.File(checkpoint_path(path), "r+") as file:
        for name in ("observables/tip", "filaments/rod/x"):
            file[name] = 1.0
        trick(file, other)
    with pytest.raises(CaseError, match="which ibfil does not write"):
        go_on(path)


def test_pipes_in_the_places_of_a_runs_files_are_not_waited_for(tmp_path):
    path = tmp_path / "run.h5"
    write(path, 3)
    os.mkfifo(journal_path(path))
    with RunFile(path) as file:
        assert file.status == "finished"
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(CaseError, match="there is no such file"):
        RunFile(path)
    with pytest.raises(CaseError, match="is not a file"):
        run(case(), path, overwrite=True)


def test_words_of_a_file_do_nothing_to_a_terminal(tmp_path, capsys):
    """An escape in a title could clear the screen, or write over what stands there."""
    path = tmp_path / "run.h5"
    run(case("", 'title="fine\\u001b[2J\\u0007 \\u202e txt"', "time.end=0.1"), path)
    for words in ([], ["--json"]):
        assert main(["show", str(path), *words]) == 0
        out = capsys.readouterr().out
        assert "fine\\u001b[2J\\u0007 \\u202e txt" in out
        assert all(letter.isprintable() or letter == "\n" for letter in out)


def test_a_run_may_be_open_more_than_once_and_in_h5py_too(tmp_path):
    path = tmp_path / "run.h5"
    write(path, 3)
    with RunFile(path) as one, h5py.File(path) as plain, RunFile(path) as other:
        assert np.array_equal(one.time, plain["time"][:])
        assert np.array_equal(one.time, other.time)
    with RunFile(path) as one, h5py.File(path, "r+") as plain:
        plain.attrs["note"] = "mine"
        assert one.status == "finished"


def test_a_file_cut_short_while_it_is_read_is_an_error_and_no_zeros(tmp_path):
    path = tmp_path / "run.h5"
    write(path, 400)
    with RunFile(path) as file:
        os.truncate(path, path.stat().st_size // 3)
        with pytest.raises(OSError, match=r"cut short|read"):
            np.asarray(file.filaments["rod"]["position"])


def test_a_run_goes_on_where_only_its_own_files_are(tmp_path):
    """The looks above hinder no run of our own, compressed fields included."""
    path = tmp_path / "run.h5"
    interrupted(path, 60, case(grid=True))
    assert go_on(path).status == "finished"
    with RunFile(path) as file:
        assert file.grid is not None
        assert len(file.grid.time) > 3
