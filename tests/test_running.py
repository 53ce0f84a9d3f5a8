"""The run loop: outputs, stop rules, Ctrl-C, kill -9, torn files, and going on bit for bit."""

from __future__ import annotations

import errno
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from fake_simulation import ALWAYS, FakeSimulation, case
from ibfil import checkpoint, recorder, running
from ibfil.errors import CaseError, Interrupted, RunFailed
from ibfil.record import RunFile, RunFileError, checkpoint_path, journal_path
from ibfil.schedule import due_times

HERE = Path(__file__).parent
# What going on bit for bit is tested with: (case, how its simulation is made, steps at which it is cut).
SCENES = {
    "fake": (lambda: case(), FakeSimulation, (1, 17, 18, 200, 339)),
    "fake with fields": (lambda: case(grid=True), FakeSimulation, (1, 33, 34, 35, 299)),
}


def quiet(line: str) -> None:
    """Say nothing."""


def run(given, path=None, build=FakeSimulation, **more):
    return running.run(given, path, build=build, progress=False, log=quiet, **more)


def go_on(path, *given, build=FakeSimulation, log=quiet, **more):
    return running.resume_run(path, *given, build=build, progress=False, log=log, **more)


def signalling(build, step: int, number: int = signal.SIGINT):
    """Makes simulations that send this process a signal after a step."""

    def make(*given):
        simulation = build(*given)
        inner = simulation.advance

        def advance(until, after_step):
            def counted():
                if simulation.steps == step:
                    os.kill(os.getpid(), number)
                after_step()

            inner(until, counted)

        simulation.advance = advance
        return simulation

    return make


def content(path: Path) -> dict[str, tuple]:
    """Every dataset of a run file: shape, type and bytes."""
    found = {}

    def take(name, item):
        if isinstance(item, h5py.Dataset):
            found[name] = (item.shape, item.dtype, item[()].tobytes())

    with h5py.File(path, locking=False) as file:
        file.visititems(take)
    return found


def interrupted(path: Path, step: int, given=None, build=FakeSimulation) -> None:
    with pytest.raises(Interrupted):
        run(given or case(), path, build=signalling(build, step))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "run.h5"


@pytest.fixture(scope="module")
def uncut(tmp_path_factory) -> Path:
    """The fake case, run without a break."""
    path = tmp_path_factory.mktemp("uncut") / "uncut.h5"
    run(case(), path)
    return path


# --- outputs --------------------------------------------------------------------------------------------------------


def test_outputs_are_at_their_exact_times(path):
    result = run(case(), path)
    assert np.array_equal(result.times, [0.05 * k for k in range(20)] + [1.0])
    assert (result.status, result.reason, result.path, result.steps) == ("finished", "", path, 340)
    with RunFile(path) as file:
        assert np.array_equal(file.time, result.times)
        assert (file.status, file.steps, file.method, file.wisdom) == ("finished", 340, "fake", "(fake wisdom)")
        assert 0 < file.wall_time < 60
        assert file.finished > file.created
    assert [entry.name for entry in path.parent.iterdir()] == ["run.h5"]  # no checkpoint, no journal


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
    given = running.parse_case(text, "fake.toml")
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
        assert np.array_equal(result.frame.filaments["rod"].position, file.position()[-1])


def test_progress_is_told_in_a_few_lines_and_changes_nothing(path, uncut):
    lines = []
    running.run(case(), path, build=lambda *given: FakeSimulation(*given, pause=0.004), log=lines.append)
    assert content(path) == content(uncut)
    assert lines[:2] == ["a fake", "fluid rft, method fake, implicit of order 2"]
    assert "sperm number = 2.5" in lines[2]
    assert lines[3] == "warning: nothing is solved"
    told = [line for line in lines[4:] if line.startswith("t = ")]
    assert 3 <= len(told) <= 10
    assert all(" of 1 (" in line and " steps, " in line for line in told)


def test_a_run_loads_no_pictures():
    code = (
        "import sys; sys.path[:0] = sys.argv[1:]; import fake_simulation, ibfil.running\n"
        "ibfil.running.run(fake_simulation.case(), build=fake_simulation.FakeSimulation, log=id)\n"
        "print([name for name in ('pyvista', 'vtk', 'vtkmodules', 'matplotlib') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code, HERE, HERE.parent], capture_output=True, text=True, timeout=60)
    assert done.stdout == "[]\n", done.stderr


def test_observables_made_in_python_are_recorded(path):
    class Height:
        dimension, summary_dimension, description = "length", "length", "greatest height"

        def sample(self, frame):
            return float(frame.filaments["rod"].position[:, 2].max())

        def summary(self, times, samples):
            return float(samples.mean())

    result = run(case(), path, observables={"height": Height()})
    with RunFile(path) as file:
        assert np.array_equal(file.observables["height"], file.position()[:, :, 2].max(axis=1))
        assert file.units("observables/height") == "um"
    assert result.summaries["height"].value == result.series("height").mean()


# --- Ctrl-C, and going on -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", SCENES)
def test_cut_and_gone_on_with_is_as_never_cut(tmp_path, scene):
    given, build, steps = SCENES[scene]
    whole, path = tmp_path / "whole.h5", tmp_path / "run.h5"
    expected = run(given(), whole, build=build)
    interrupted(path, steps[0], given(), build)
    for step in steps[1:]:
        with RunFile(path) as file:
            assert file.status == "interrupted"
        with pytest.raises(Interrupted):
            go_on(path, build=signalling(build, step))
    result = go_on(path, build=build)
    assert content(path) == content(whole)
    assert (result.status, result.steps) == ("finished", expected.steps)
    for name, summary in expected.summaries.items():
        assert np.array_equal(result.summaries[name].value, summary.value)
    assert not checkpoint_path(path).exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_run_between_two_steps_and_says_how_to_go_on(path, number):
    before = signal.getsignal(number)
    with pytest.raises(Interrupted, match=r"interrupted at t = 0\.3; go on with: ibfil run --resume .*run\.h5"):
        run(case(), path, build=signalling(FakeSimulation, 102, number))
    assert signal.getsignal(number) is before
    assert checkpoint.read(checkpoint_path(path)).steps == 102
    with RunFile(path) as file:
        assert (file.status, len(file)) == ("interrupted", 6)  # the output at t = 0.3 was not taken yet


def test_an_interrupted_run_without_a_file_says_so():
    with pytest.raises(Interrupted, match="nothing was written"):
        run(case(), build=signalling(FakeSimulation, 3))


def test_a_second_ctrl_c_kills(path):
    code = (
        "import sys; sys.path[:0] = sys.argv[2:]; from fake_simulation import *; from ibfil import running\n"
        "build = lambda *given: FakeSimulation(*given, pause=60)\n"
        "running.run(case(), sys.argv[1], build=build, progress=False)"
    )
    victim = subprocess.Popen([sys.executable, "-c", code, path, HERE, HERE.parent])
    try:
        wait_for(checkpoint_path(path).exists)
        victim.send_signal(signal.SIGINT)
        with pytest.raises(subprocess.TimeoutExpired):  # a step is taken to its end
            victim.wait(0.5)
        victim.send_signal(signal.SIGINT)
        assert victim.wait(10) == -signal.SIGINT
    finally:
        victim.kill()
        victim.wait()


def wait_for(condition, seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


def test_run_with_resume_begins_or_goes_on(path, uncut):
    with pytest.raises(Interrupted):
        run(case(), path, build=signalling(FakeSimulation, 100), resume=True)
    result = run(case(), path, resume=True)
    assert result.steps == 340
    assert content(path) == content(uncut)


def test_wall_time_and_steps_add_up(path):
    interrupted(path, 100)
    with RunFile(path) as file:
        spent = file.wall_time
    assert spent > 0
    assert go_on(path).wall_time > spent


# --- what may differ ------------------------------------------------------------------------------------------------


def test_a_longer_end_goes_on_as_if_it_had_been_asked_for_first(path, tmp_path):
    longer = tmp_path / "longer.h5"
    run(case("", "time.end=1.5"), longer)
    interrupted(path, 100)
    go_on(path, None, ["time.end=1.5"])
    assert content(path) == content(longer)
    with RunFile(path) as file:
        assert file.case.time.end == 1.5


def test_other_outputs_from_here_on(path):
    interrupted(path, 100)  # t = 0.295
    go_on(path, None, ["output.every=0.1"])
    with RunFile(path) as file:
        assert np.allclose(file.time, [0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])


def test_another_scene_is_refused_with_its_keys(path):
    interrupted(path, 100)
    before = path.read_bytes(), checkpoint_path(path).read_bytes()
    with pytest.raises(CaseError) as caught:
        go_on(path, None, ["fluid.viscosity=2", "time.step=0.004", "time.end=3", "filament.rod.length=2"])
    told = "\n".join(caught.value.faults)
    assert len(caught.value.faults) == 3
    assert all(key in told for key in ("fluid.viscosity", "time.step", "filament.rod.length"))
    with pytest.raises(CaseError, match=r"fluid\.viscosity"):
        go_on(path, case("", "fluid.viscosity=2"))
    with pytest.raises(CaseError, match=r"time\.end: found 0\.1; allowed: at least 0\.295"):
        go_on(path, None, ["time.end=0.1"])
    assert (path.read_bytes(), checkpoint_path(path).read_bytes()) == before


def test_nothing_to_go_on_from_is_one_line(path, tmp_path):
    with pytest.raises(RunFileError, match=r"no checkpoint run\.ckpt\.h5"):
        go_on(path)
    run(case(), path)
    with pytest.raises(RunFileError, match="its run is finished"):
        go_on(path)
    other = tmp_path / "other.h5"
    interrupted(other, 50)
    time.sleep(0.002)  # runs are told apart by the millisecond they began in
    checkpoint_path(other).rename(checkpoint_path(path))
    with pytest.raises(CaseError, match="belongs to another run"):
        go_on(path)


def test_a_run_that_is_running_is_not_gone_on_with(path):
    shared = {}

    class Asking(FakeSimulation):
        def advance(self, until, after_step):
            if not shared:
                for attempt in (lambda: go_on(path), lambda: run(case(), path, overwrite=True)):
                    with pytest.raises(RunFileError, match="is being written by another ibfil"):
                        attempt()
                shared["asked"] = True
            super().advance(until, after_step)

    run(case(), path, build=Asking)
    assert shared


# --- kill -9, and torn files ----------------------------------------------------------------------------------------


def killed_over_and_over(path: Path, kills: int, seed: int) -> int:
    """Run the fake case in processes that are killed after a random while, until one comes to its end; the kills."""
    what, done, rng = "start", 0, random.Random(seed)
    while True:
        victim = subprocess.Popen(
            [sys.executable, HERE / "fake_simulation.py", path, what],
            env=os.environ | {"PYTHONPATH": f"{HERE}{os.pathsep}{HERE.parent}"},
            stdout=subprocess.DEVNULL,
        )
        if done < kills:
            wait_for(lambda: journal_path(path).exists() or victim.poll() is not None)  # it has got to writing
            time.sleep(rng.uniform(0.0, 0.25))
            victim.kill()
            if victim.wait() == -signal.SIGKILL:
                done += 1
            what = "resume" if checkpoint_path(path).exists() else "start"
            if what == "start" and path.exists():
                path.unlink()
        elif victim.wait(60) == 0:
            return done


def test_killed_at_any_moment_it_goes_on_from_its_checkpoint(path, uncut):
    assert killed_over_and_over(path, 5, seed=1) == 5
    assert content(path) == content(uncut)


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
        recorder._PAUSE = recorder._SHARE = 0
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
    """By h5py in another process than the writer, at any time, the outputs so far whole and right."""
    code = (
        "import sys; sys.path[:0] = sys.argv[2:]; from fake_simulation import *; from ibfil import recorder, running\n"
        "recorder._PAUSE = recorder._SHARE = 0\n"
        "build = lambda *given: FakeSimulation(*given, pause=0.003)\n"
        "running.run(case('', 'output.checkpoint_every=1000'), sys.argv[1], build=build, progress=False)"
    )
    with h5py.File(uncut) as file:
        expected = file["filaments/rod/position"][()]
    writer = subprocess.Popen([sys.executable, "-c", code, path, HERE, HERE.parent], stdout=subprocess.DEVNULL)
    lengths, failures = [], 0
    try:
        wait_for(checkpoint_path(path).exists)
        while writer.poll() is None:
            with RunFile(path) as file:
                status, position = file.status, file.position()
            assert status in ("running", "finished")
            assert np.array_equal(position, expected[: len(position)])
            lengths.append(len(position))
            try:
                with h5py.File(path, "r", locking=False) as plain:
                    assert np.array_equal(plain["filaments/rod/e1"][0], 4 * expected[0])
            except OSError:
                failures += 1  # h5py alone may come in the midst of a write
    finally:
        writer.kill()
        writer.wait()
    assert len(set(lengths)) > 5
    assert lengths == sorted(lengths)
    assert failures < 0.05 * len(lengths) + 1


# --- failures -------------------------------------------------------------------------------------------------------


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
        def frame(self, fields=()):
            if self.time > 0.2:
                raise ZeroDivisionError("a fault of the program")
            return super().frame(fields)

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
            patch.setattr(recorder, name, 0)
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
        patch.setattr(os, "replace", full)
        with pytest.raises(RunFailed, match=r"run\.ckpt\.h5 cannot be written .No space left"):
            run(case(), path)
    with RunFile(path) as file:
        assert file.status == "failed"


def test_bad_input_writes_nothing(path):
    with pytest.raises(CaseError):
        run(case('[observe.bad]\nkind = "twist"\nat = "centroid"\n'), path)
    assert list(path.parent.iterdir()) == []
    path.write_text("something of the user's")
    with pytest.raises(CaseError, match="exists already"):
        run(case(), path)
    assert path.read_text() == "something of the user's"


# --- stop rules -----------------------------------------------------------------------------------------------------


class Gliding(FakeSimulation):
    """The tip's height is a given function of time: a straight line down from 1, flat from 0.6 on."""

    def frame(self, fields=()):
        kept, self.y = self.y, np.full(len(self.y), max(1 - self.time, 0.4))
        frame = super().frame(fields)
        self.y = kept
        return frame


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
