"""Ctrl-C and going on bit for bit, and what may differ then."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest
from helpers.fake_simulation import FakeSimulation, case
from helpers.runs import HERE, SCENES, content, go_on, interrupted, run, signalling

from ibfil.case.reading import parse_case
from ibfil.errors import CaseError, Interrupted, RunFileError
from ibfil.io import checkpoint
from ibfil.io.paths import checkpoint_path
from ibfil.io.reader import RunFile

LONGER = {
    name: SCENES[name]
    for name in (
        "fake",
        "rft",
        "table",
        "navier-stokes",
        "tolerance, rft",
        "tolerance, navier-stokes",
        "thermal",
        "contact",
    )
}

# --- Ctrl-C, and going on --------------------------------------------------------------------------------------------


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
        assert np.array_equal(result.summaries[name].value, summary.value, equal_nan=True)
    assert checkpoint.read(checkpoint_path(path)).time <= result.case.time.end


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
    """The first one only leaves word, and the step goes on; by then the second one ends the process."""
    code = """
import signal, sys, time; sys.path[:0] = sys.argv[2:]
from helpers.fake_simulation import *
from ibfil.running import run as running
class Endless(FakeSimulation):
    def advance(self, until, after_step):
        print("in a step", flush=True)
        while signal.getsignal(signal.SIGINT) is not signal.SIG_DFL:
            time.sleep(0.01)
        print("still in it", flush=True)
        time.sleep(1e4)
running.run(case(), sys.argv[1], build=Endless, look=look, progress=False, log=id)
"""
    command = [sys.executable, "-c", code, path, HERE, HERE.parent]
    victim = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        for told in ("in a step\n", "still in it\n"):
            assert victim.stdout.readline() == told
            victim.send_signal(signal.SIGINT)
        assert victim.wait(300) == -signal.SIGINT
    finally:
        victim.kill()
        victim.communicate()


def test_other_versions_are_told(path):
    interrupted(path, 100)
    said = []
    with h5py.File(path, "r+") as file:
        file.attrs["versions"] = file.attrs["versions"].replace('"numpy": "', '"numpy": "1.')
    go_on(path, log=said.append)
    assert f"warning: numpy is {np.__version__}, was 1.{np.__version__}" in said[0]


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


# --- what may differ -------------------------------------------------------------------------------------------------


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
    assert "fluid.viscosity: found 2.0; the run began with 1.0, and only time.end and times of output may" in told
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
    with pytest.raises(RunFileError, match=r"is finished; time\.end: found 1; allowed: above 1, to make it longer"):
        go_on(path)
    checkpoint_path(path).unlink()
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


# --- a finished run made longer --------------------------------------------------------------------------------------


def half(given):
    """The case, and the same with half of its outputs: two times the second make the first."""
    whole = given()
    return whole, parse_case(whole.text, whole.file, [f"time.end={whole.time.end / 2!r}"])


@pytest.mark.parametrize("scene", LONGER)
def test_a_finished_run_is_made_longer_bit_for_bit(tmp_path, scene):
    given, build, _ = LONGER[scene]
    whole, path = tmp_path / "whole.h5", tmp_path / "run.h5"
    long, short = half(given)
    expected = run(long, whole, build=build)
    told = []
    run(short, path, build=build)
    assert checkpoint.read(checkpoint_path(path)).time <= short.time.end
    result = go_on(path, None, [f"time.end={long.time.end!r}"], build=build, log=told.append)
    assert content(path) == content(whole)
    assert result.steps == expected.steps
    assert not any("warning" in line for line in told)
    for name, summary in expected.summaries.items():
        assert np.array_equal(result.summaries[name].value, summary.value, equal_nan=True)


@pytest.mark.parametrize("end", ["0.15", "0.2", "0.52", "0.01"])  # 3*0.05 is not 0.15, 0.52 no output of longer ones
def test_an_end_that_is_no_output_of_the_longer_run_leaves_no_trace(path, uncut, end):
    run(case("", f"time.end={end}"), path)
    go_on(path, None, ["time.end=0.7"])
    go_on(path, None, ["time.end=1.0"])
    assert content(path) == content(uncut)


def test_outputs_of_the_longer_part_may_be_at_other_times(path):
    run(case("", "time.end=0.5"), path)
    go_on(path, None, ["time.end=1.0", "output.every=0.25"])
    with RunFile(path) as file:
        assert np.allclose(file.time, [*np.arange(0, 0.51, 0.05), 0.75, 1.0])
        assert file.case.output.every == 0.25


def test_a_finished_run_is_not_made_shorter_or_run_again(path):
    run(case("", "time.end=0.52"), path)
    before = path.read_bytes()
    for end in ("0.51", "0.52"):
        with pytest.raises(RunFileError, match=r"is finished; time\.end: found 0\.5\d*; allowed: above 0\.52"):
            go_on(path, None, [f"time.end={end}"])
    with pytest.raises(CaseError, match="exists"):
        run(case("", "time.end=0.52"), path, resume=True)
    assert path.read_bytes() == before
    assert run(case(), path, resume=True).steps == 340


def test_a_run_cut_on_its_way_to_an_end_that_moves_is_told_of(path):
    with pytest.raises(Interrupted):
        run(case("", "time.end=0.52"), path, build=signalling(FakeSimulation, 174))
    told = []
    go_on(path, None, ["time.end=1.0"], log=told.append)
    assert any("was cut on its way to its end" in line for line in told)


def test_steps_chosen_for_the_shorter_run_are_told_of(tmp_path):
    given, build, _ = SCENES["rft"]
    told, path = [], tmp_path / "run.h5"
    still = ["curvature=[0,0]", "start={end='clamped'}"]
    keys = [f"filament.rod.{key}" for key in still] + ["time.step=auto"]
    short = parse_case(given().text, "rod.toml", [*keys, "time.end=0.004"])
    run(short, path, build=build)
    go_on(path, None, ["time.end=0.008"], build=build, log=told.append)
    assert any("time.step is auto" in line for line in told)
