"""The checkpoint gives back every bit and type, and is never half there."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import numpy as np
import pytest
from helpers.written import write

from ibfil.errors import RunFileError
from ibfil.io import checkpoint
from ibfil.io.paths import checkpoint_path, journal_path


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
