"""kill -9 at any moment, torn files, and reading while it is written."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from time import sleep

import h5py
import numpy as np
import pytest
from helpers.fake_simulation import ALWAYS, FakeSimulation, case
from helpers.runs import HERE, content, go_on, interrupted, run, signalling, wait_for

from ibfil.errors import CaseError, Interrupted
from ibfil.io import checkpoint
from ibfil.io import writer as io_writer
from ibfil.io.paths import checkpoint_path, journal_path
from ibfil.io.reader import RunFile


def killed_over_and_over(path: Path, kills: int, seed: int) -> int:
    """Run the fake case in processes that are killed after a random while, until one comes to its end; the kills."""
    what, done, rng = "start", 0, random.Random(seed)
    while True:
        victim = subprocess.Popen(
            [sys.executable, HERE / "helpers/fake_simulation.py", path, what],
            env=os.environ | {"PYTHONPATH": f"{HERE}{os.pathsep}{HERE.parent}"},
            stdout=subprocess.DEVNULL,
        )
        if done < kills:
            while victim.poll() is None and not journal_path(path).exists():  # until it has got to writing
                sleep(0.005)
            sleep(rng.uniform(0.0, 0.25))
            victim.kill()
            assert victim.wait() in (0, -signal.SIGKILL)
            done += victim.returncode != 0
            what = "resume" if checkpoint_path(path).exists() else "start"
            if what == "start" and path.exists():
                path.unlink()
        else:
            assert victim.wait(300) == 0
            return done


def test_killed_at_any_moment_it_goes_on_from_its_checkpoint(path, uncut):
    assert killed_over_and_over(path, 5, seed=1) == 5
    assert content(path) == content(uncut)


def test_a_fluid_with_a_past_goes_on_after_kill_as_if_never_killed(tmp_path):
    short = ["time.end=0.4", "time.step='auto'", "fluid.cells=[32,32,32]", "output.every=0.02"]
    case_file, command = HERE.parent / "cases/inertia/swimmer_re_10.toml", [sys.executable, "-m", "ibfil", "run"]
    env = os.environ | {"PYTHONPATH": str(HERE.parent)}
    whole, killed = tmp_path / "whole.h5", tmp_path / "killed.h5"
    changes = [*short, "output.checkpoint_every=1e-9"]
    subprocess.run([*command, case_file, *changes, "-o", whole], env=env, check=True, capture_output=True)
    victim = subprocess.Popen([*command, case_file, *changes, "-o", killed], env=env, stdout=subprocess.DEVNULL)
    at = checkpoint_path(killed)
    wait_for(lambda: at.exists() and checkpoint.read(at).steps > 2, victim)
    victim.kill()
    assert victim.wait() == -signal.SIGKILL
    subprocess.run([*command, "--resume", killed], env=env, check=True, capture_output=True)
    assert content(killed) == content(whole)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 8))
def test_killed_many_times_over(path, uncut, seed):
    killed_over_and_over(path, 25, seed)
    assert content(path) == content(uncut)


def dies_in_call(dies_at: int, work) -> bool:
    """Do the work in a forked process that is gone at its ``dies_at``-th call that writes or syncs; whether it was."""
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 9
    try:
        count = 0

        def mortal(call):
            def called(*args):
                nonlocal count
                count += 1
                if count == dies_at:
                    os._exit(9)
                return call(*args)

            return called

        for name in ("pwrite", "ftruncate", "fsync", "replace"):
            setattr(os, name, mortal(getattr(os, name)))
        io_writer._PAUSE = io_writer._SHARE = 0
        work()
        os._exit(0)
    finally:
        os._exit(1)


def test_nothing_before_the_checkpoint_is_lost_by_death_within_a_write(path, uncut):
    """Death at one system call after another, from the first checkpoint on."""
    deaths, torn = 0, 0
    short = case("", "time.end=0.1", ALWAYS)
    for dies_at in range(100, 3000, 61):
        if not dies_in_call(dies_at, lambda: run(short, path, overwrite=True)):
            break
        if not checkpoint_path(path).exists():
            continue
        deaths += 1
        said = []
        torn += journal_path(path).stat().st_size > 0
        with RunFile(path) as file:
            assert len(file) >= checkpoint.read(checkpoint_path(path)).outputs
        go_on(path, log=said.append)
        assert not any("rebuilt" in line for line in said)
        with RunFile(path) as file, RunFile(uncut) as whole:
            assert np.array_equal(file.position(), whole.position()[:3])
    assert deaths > 5
    assert torn > 1


@pytest.mark.parametrize("damage", ["half", "end", "middle", "empty", "text", "gone", "older"])
def test_a_damaged_file_is_rebuilt_and_it_says_so(path, uncut, damage):
    older = path.with_name("older")
    interrupted(path, 60)
    older.write_bytes(path.read_bytes())
    with pytest.raises(Interrupted):
        go_on(path, build=signalling(FakeSimulation, 200))
    data = bytearray(path.read_bytes())
    if damage == "half":
        path.write_bytes(data[: len(data) // 2])
    elif damage == "end":
        path.write_bytes(data[:-1000])
    elif damage == "middle":
        data[300:30_000] = bytes(29_700)
        path.write_bytes(data)
    elif damage in ("empty", "text"):
        path.write_bytes(b"" if damage == "empty" else b"not a run file\n")
    elif damage == "gone":
        path.unlink()
    else:
        path.write_bytes(older.read_bytes())
    said = []
    if damage == "text":  # no damage, but a file of somebody's
        with pytest.raises(CaseError, match="is there, and not a run file of ibfil: it is not replaced"):
            go_on(path, log=said.append)
        assert path.read_bytes() == b"not a run file\n"
        return
    result = go_on(path, log=said.append)
    assert any("rebuilt by computing it again" in line for line in said)
    assert result.status == "finished"
    assert content(path) == content(uncut)


def test_outputs_after_the_checkpoint_are_cut_and_made_again(path, uncut):
    interrupted(path, 100)
    kept = checkpoint_path(path).read_bytes()
    with pytest.raises(Interrupted):
        go_on(path, build=signalling(FakeSimulation, 300))
    with RunFile(path) as file:
        assert len(file) == 18
    checkpoint_path(path).write_bytes(kept)  # as if killed before the next one
    said = []
    go_on(path, log=said.append)
    assert any("from t = 0.295, after 6 outputs" in line for line in said)
    assert content(path) == content(uncut)


def test_the_file_can_be_read_while_it_is_written(path, uncut):
    """By h5py in another process than the writer, at any time, the outputs so far whole and right.

    The writer takes a line of its input for an output, so that however slow the reader is, it sees many states of
    the file; and it writes on while it is looked at.
    """
    code = """
import sys; sys.path[:0] = sys.argv[2:]
from helpers.fake_simulation import *
from ibfil.io import writer as recorder
from ibfil.running import loop, run as running
loop._LOOK = recorder._PAUSE = recorder._SHARE = 0
class Paced(FakeSimulation):
    def snapshot(self, *fields):
        sys.stdin.readline()
        return super().snapshot(*fields)
build = lambda *given: Paced(*given, pause=0.001)
running.run(case("", "output.checkpoint_every=1000"), sys.argv[1], build=build, look=look, progress=False, log=id)
"""
    with h5py.File(uncut) as file:
        expected = file["filaments/rod/position"][()]
    writer = subprocess.Popen([sys.executable, "-c", code, path, HERE, HERE.parent], stdin=subprocess.PIPE, bufsize=0)
    lengths = []

    def plain() -> bool:
        """Whether h5py alone can read it: not in the midst of a write, but then soon after."""
        try:
            with h5py.File(path, "r", locking=False) as file:
                assert np.array_equal(file["filaments/rod/e1"][0], 4 * expected[0])
        except OSError:
            return False
        return True

    try:
        writer.stdin.write(b"\n")
        wait_for(checkpoint_path(path).exists, writer)
        while writer.poll() is None:
            with suppress(BrokenPipeError):  # it has ended since
                writer.stdin.write(b"\n")
            with RunFile(path) as file:
                status, position = file.status, file.position()
            assert status in ("running", "finished")
            assert np.array_equal(position, expected[: len(position)])
            lengths.append(len(position))
            wait_for(plain)
    finally:
        writer.kill()
        writer.communicate()
    assert lengths == sorted(lengths)
    assert len(set(lengths)) > 10  # of 21
