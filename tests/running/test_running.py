"""The run loop: outputs at their times, stop rules, failures."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import time

import numpy as np
import pytest
from helpers.fake_simulation import ALWAYS, FakeSimulation, case, look
from helpers.runs import HERE, content, go_on, interrupted, run

from ibfil.errors import CaseError, RunFailed
from ibfil.io import checkpoint, writer
from ibfil.io.paths import checkpoint_path
from ibfil.io.reader import RunFile
from ibfil.running import run as running_run
from ibfil.simulation.schedule import due_times

# --- outputs ---------------------------------------------------------------------------------------------------------


def test_outputs_are_at_their_exact_times(path):
    began = time.monotonic()
    result = run(case(), path)
    assert np.array_equal(result.times, [0.05 * k for k in range(20)] + [1.0])
    assert (result.status, result.reason, result.path, result.steps) == ("finished", "", path, 340)
    with RunFile(path) as file:
        assert np.array_equal(file.time, result.times)
        assert (file.status, file.steps, file.method, file.wisdom) == ("finished", 340, "fake", "(fake wisdom)")
        assert 0 < file.wall_time < time.monotonic() - began
        assert file.finished > file.created
    assert {entry.name for entry in path.parent.iterdir()} == {"run.h5", "run.ckpt.h5"}  # no journal


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        (["time.end=1.0", "output.every=0.3"], [0, 0.3, 0.6, 0.3 * 3, 1.0]),  # the end is always put out
        (["time.end=pi", "output.every=pi/10"], [k * (np.pi / 10) for k in range(10)] + [np.pi]),
        (["time.end=0.3", "output.every=0.1"], [0, 0.1, 0.2, 0.3]),  # 3 * 0.1 is not 0.3
        (["time.end=0.5", "output.every=2"], [0, 0.5]),
    ],
)
def test_times_of_outputs(overrides, expected):
    due = due_times(case("", *overrides), grid=False)
    assert [d.time for d in due] == expected
    assert all(d.output and not d.fields for d in due)


def test_given_times_are_put_out_with_start_and_end():
    text = case().text.replace("every = 0.05", "times = [0.25, 0.5]")
    given = running_run.parse_case(text, "fake.toml")
    assert [d.time for d in due_times(given, grid=False)] == [0, 0.25, 0.5, 1.0]


def test_fields_have_times_of_their_own():
    given = case("", "output.every=0.25", "output.grid_every=0.1", "time.end=0.5", grid=True)
    due = due_times(given, grid=True)
    assert [d.time for d in due if d.output] == [0, 0.25, 0.5]
    assert [d.time for d in due if d.fields] == [0, 0.1, 0.2, 0.1 * 3, 0.4, 0.5]
    assert [d.time for d in due] == [0, 0.1, 0.2, 0.25, 0.1 * 3, 0.4, 0.5]  # 5 * 0.1 and 2 * 0.25 are one


def test_fields_are_written_at_their_times(path):
    run(case("", "output.every=0.25", grid=True), path)
    with RunFile(path) as file:
        assert np.array_equal(file.grid.time, [0.1 * k for k in range(10)] + [1.0])
        # The fake's field grows by the time from one output to the next.
        growth = file.grid.fields["velocity"][:, 0, 0, 0, 0]
        assert np.array_equal(growth, np.asarray(file.grid.time).astype(np.float32))
        assert len(file) == 5


def test_without_a_file_nothing_is_written_and_all_is_known(tmp_path, monkeypatch, uncut):
    monkeypatch.chdir(tmp_path)
    result = run(case())
    assert list(tmp_path.iterdir()) == []
    assert result.path is None
    with RunFile(uncut) as file:
        assert np.array_equal(result.series("tip"), file.observables["tip"])
        assert np.array_equal(result.snapshot.filaments["rod"].position, file.position()[-1])


def test_progress_is_told_in_a_few_lines_and_changes_nothing(path, uncut):
    lines = []
    running_run.run(case(), path, build=lambda *given: FakeSimulation(*given, pause=0.004), look=look, log=lines.append)
    assert content(path) == content(uncut)
    assert lines[:2] == ["a fake", "fluid rft, method fake, implicit of order 2"]
    assert "sperm number = 2.5" in lines[2]
    assert lines[3] == "warning: nothing is solved"
    told = [line for line in lines[4:] if line.startswith("t = ")]
    assert 3 <= len(told) <= 10
    assert all(" of 1 (" in line and " steps, " in line for line in told)


def test_a_run_loads_no_pictures():
    code = (
        "import sys; sys.path[:0] = sys.argv[1:]; from helpers import fake_simulation; import ibfil.running.run\n"
        "fake = fake_simulation\n"
        "ibfil.running.run.run(fake.case(), build=fake.FakeSimulation, look=fake.look, log=id)\n"
        "print([name for name in ('pyvista', 'vtk', 'vtkmodules', 'matplotlib') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code, HERE, HERE.parent], capture_output=True, text=True, timeout=300)
    assert done.stdout == "[]\n", done.stderr


def test_observables_made_in_python_are_recorded(path):
    class Height:
        dimension, summary_dimension, description = "length", "length", "greatest height"

        def sample(self, snapshot):
            return float(snapshot.filaments["rod"].position[:, 2].max())

        def summary(self, times, samples):
            return float(samples.mean())

    result = run(case(), path, observables={"height": Height()})
    with RunFile(path) as file:
        assert np.array_equal(file.observables["height"], file.position()[:, :, 2].max(axis=1))
        assert file.units("observables/height") == "um"
    assert result.summaries["height"].value == result.series("height").mean()


# --- failures --------------------------------------------------------------------------------------------------------


def test_a_failed_run_says_what_and_leaves_what_was_written(path, uncut):
    with pytest.raises(RunFailed) as caught:
        run(case("", ALWAYS), path, build=lambda *given: FakeSimulation(*given, fails_at=0.42))
    told = str(caught.value)
    assert "at t = 0.421 on filament rod, node 3: it diverged" in told
    assert "a shorter step; the last good checkpoint is" in told
    good = checkpoint.read(checkpoint_path(path))
    assert f"run.ckpt.h5, t = {good.time:.6g}" in told
    assert 0.35 < good.time < 0.42
    with RunFile(path) as file, RunFile(uncut) as whole:
        assert file.status == "failed"
        assert "it diverged" in file.reason
        assert np.array_equal(file.position(), whole.position()[:9])


def test_a_run_that_fails_at_its_start_writes_nothing(path):
    def build(*given):
        raise RunFailed("it cannot be built")

    with pytest.raises(RunFailed, match="cannot be built"):
        run(case(), path, build=build)
    assert list(path.parent.iterdir()) == []


def test_any_other_error_is_recorded_and_goes_up(path):
    class Broken(FakeSimulation):
        def snapshot(self, fields=()):
            if self.time > 0.2:
                raise ZeroDivisionError("a fault of the program")
            return super().snapshot(fields)

    with pytest.raises(ZeroDivisionError):
        run(case(), path, build=Broken)
    with RunFile(path) as file:
        assert (file.status, file.reason, len(file)) == ("failed", "ZeroDivisionError: a fault of the program", 5)


def test_a_disk_that_fills_up_fails_the_run_and_it_goes_on_with_room(path, monkeypatch):
    real, limit, many = os.pwrite, 400_000, case("", "output.every=0.002")

    def pwrite(handle, data, at):
        if at + len(data) > limit and os.fstat(handle).st_size < at + len(data):
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(handle, data, at)

    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", pwrite)
        for name in ("_PAUSE", "_SHARE"):
            patch.setattr(writer, name, 0)
        with pytest.raises(RunFailed, match="No space left on device") as caught:
            run(many, path)
    assert "the last good checkpoint is" in str(caught.value)
    with RunFile(path) as file:
        assert file.status == "failed"
        assert "No space left on device" in file.reason
        assert 100 < len(file) < 300
    assert np.array_equal(go_on(path).series("tip"), run(many).series("tip"))
    with RunFile(path) as file:
        assert (file.status, len(file)) == ("finished", 501)


def test_a_checkpoint_that_cannot_be_written_fails_the_run(path, monkeypatch):
    def full(*given):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(checkpoint, "write", full)
        with pytest.raises(RunFailed, match=r"run\.ckpt\.h5 cannot be written .No space left"):
            run(case(), path)
    with RunFile(path) as file:
        assert file.status == "failed"


def test_bad_input_writes_nothing(path):
    with pytest.raises(CaseError):
        run(case('[observe.bad]\nkind = "twist"\nat = "centroid"\n'), path)
    assert list(path.parent.iterdir()) == []
    path.write_text("something of the user's")
    for asked in (False, True):
        with pytest.raises(CaseError, match="is there, and not a run file of ibfil: it is not replaced"):
            run(case(), path, overwrite=asked)
    assert path.read_text() == "something of the user's"


# --- stop rules ------------------------------------------------------------------------------------------------------


class Gliding(FakeSimulation):
    """The tip's height is a given function of time: a straight line down from 1, flat from 0.6 on."""

    def snapshot(self, fields=()):
        kept, self.y = self.y, np.full(len(self.y), max(1 - self.time, 0.4))
        snapshot = super().snapshot(fields)
        self.y = kept
        return snapshot


HEIGHT = '[observe.height]\nkind = "position"\nalong = [0, 1, 0]\n[[stop]]\nobserve = "height"\n'


@pytest.mark.parametrize(
    ("rule", "ends", "why"),
    [
        ("below = 0.72", 0.3, "is below 0.72"),
        ("below = 0.72\nafter = 0.5", 0.5, "is below 0.72"),
        ("below = 0.72\nhold = 0.1", 0.4, "is below 0.72"),
        ("below = 0.72\nafter = 0.35\nhold = 0.1", 0.45, "is below 0.72"),
        ("above = 0.99", 0.0, "is above 0.99"),
        ("above = 0.5\nafter = 0.1", 0.1, "is above 0.5"),
        ("steady = { over = 0.2, change = 1e-6 }", 0.8, "has changed by at most 1e-06 of itself over 0.2"),
        ("steady = { over = 0.2, change = 1e-6 }\nhold = 0.1", 0.9, "has changed by at most"),
        ("steady = { over = 0.1, change = 0.09 }", 0.7, "has changed by at most 0.09"),  # 0.05 of 0.45 is more
        ("below = 0.1", None, ""),
    ],
)
def test_stop_rules(path, rule, ends, why):
    result = run(case(HEIGHT + rule), path, build=Gliding)
    if ends is None:
        assert (result.status, result.times[-1]) == ("finished", 1.0)
        return
    assert result.status == "stopped"
    assert result.times[-1] == pytest.approx(ends, abs=1e-12)
    assert result.reason.startswith("stop.0: height = ")
    assert why in result.reason
    with RunFile(path) as file:
        assert (file.status, file.reason, len(file)) == ("stopped", result.reason, len(result.times))
    assert not checkpoint_path(path).exists()


def test_the_first_true_rule_is_named():
    rules = HEIGHT + "below = 0.3\n" + '[[stop]]\nobserve = "height"\nbelow = 0.6\n'
    result = run(case(rules), build=Gliding)
    assert result.reason.startswith("stop.1: height = 0.55 is below 0.6 at t = 0.45")


@pytest.mark.parametrize(
    ("rule", "step"),  # a step between the first truth and the end
    [("below = 0.72\nhold = 0.3", 150), ("steady = { over = 0.3, change = 1e-6 }", 250)],
)
def test_a_rule_remembers_across_a_cut(path, tmp_path, rule, step):
    whole = tmp_path / "whole.h5"
    expected = run(case(HEIGHT + rule), whole, build=Gliding)
    interrupted(path, step, case(HEIGHT + rule), Gliding)
    result = go_on(path, build=Gliding)
    assert (result.status, result.reason) == (expected.status, expected.reason)
    assert content(path) == content(whole)
