"""The members of a study: side by side, skipped when done, gone on with when cut; one never takes others down."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.made_run import BENT
from helpers.runs import content, wait_for

from ibfil.errors import CaseError, Interrupted
from ibfil.io.paths import checkpoint_path
from ibfil.io.reader import RunFile
from ibfil.running.run import run
from ibfil.studies import members as module
from ibfil.studies.member import Member, Outcome
from ibfil.studies.members import run_members, work

ROOT = Path(__file__).parents[2]
GOOD = Member("good", BENT)
STIFF = Member("stiff", BENT, ("filament.rod.bending=2", "time.end=0.01"))
BAD = Member("bad", BENT, ("filament.rod.stretching=1e5", "time.scheme=explicit", "time.order=1", "time.step=0.005"))
ODD = Member("odd", BENT, ("fluid.viscosty=2",))


@pytest.fixture
def said():
    return []


def statuses(outcomes: list[Outcome]) -> dict[str, str]:
    return {outcome.member.name: outcome.status for outcome in outcomes}


def test_each_member_is_the_run_of_its_case(tmp_path, said):
    """The same bits as `ibfil run` of the same case; in the order given."""
    outcomes = run_members([STIFF, GOOD], tmp_path / "study", log=said.append)
    assert statuses(outcomes) == {"stiff": "finished", "good": "finished"}
    assert [outcome.member for outcome in outcomes] == [STIFF, GOOD]
    for outcome in outcomes:
        alone = tmp_path / f"{outcome.member.name}.h5"
        run(outcome.member.resolved(), alone, progress=False, log=lambda line: None)
        assert content(outcome.path) == content(alone)
    assert said[-1].startswith("good: finished in ")
    assert said[-1].endswith("(2 of 2)")


def test_in_processes_it_is_bit_for_bit_the_same_and_a_failure_stays_alone(tmp_path, said):
    here = run_members([GOOD, BAD, ODD, STIFF], tmp_path / "here", log=said.append)
    there = run_members([GOOD, BAD, ODD, STIFF], tmp_path / "there", jobs=2, log=said.append)
    wanted = {"good": "finished", "bad": "failed", "odd": "failed", "stiff": "finished"}
    assert statuses(here) == statuses(there) == wanted
    for a, b in zip(here, there, strict=True):
        assert a.message == b.message
        if a.done:
            assert content(a.path) == content(b.path)
    by_name = {outcome.member.name: outcome for outcome in there}
    assert by_name["bad"].message.startswith("the run stopped at t = ")
    assert "viscosty" in by_name["odd"].message
    assert not by_name["odd"].path.exists()
    assert not [line for line in said if "Traceback" in line]


def test_what_is_done_or_known_to_fail_is_not_run_again(tmp_path, said, monkeypatch):
    run_members([GOOD, BAD], tmp_path, log=said.append)
    before = {path: path.read_bytes() for path in tmp_path.glob("*.h5")}
    monkeypatch.setattr(module, "_run", lambda case, path: pytest.fail("run again"))
    said.clear()
    outcomes = run_members([GOOD, BAD], tmp_path, log=said.append)
    assert statuses(outcomes) == {"good": "finished", "bad": "failed"}
    assert all(outcome.seconds == 0 for outcome in outcomes)
    assert {path: path.read_bytes() for path in tmp_path.glob("*.h5")} == before
    assert len(said) == 1
    assert said[0].startswith("bad: failed: the run stopped")


def test_a_file_of_another_case_is_computed_anew_and_that_is_told(tmp_path, said):
    run_members([GOOD], tmp_path, log=said.append)
    changed = Member("good", BENT, ("fluid.viscosity=3",))
    (outcome,) = run_members([changed], tmp_path, log=said.append)
    assert any("fluid.viscosity" in line and "computed again" in line for line in said)
    with RunFile(outcome.path) as file:
        assert file.case.fluid.viscosity == 3.0
    renamed = Member("good", BENT.replace('title = "', 'title = "again: '), ("fluid.viscosity=3",))
    (outcome,) = run_members([renamed], tmp_path, log=said.append)
    assert outcome.seconds == 0  # what a case is called changes no result


def test_a_damaged_file_is_computed_anew(tmp_path, said):
    (outcome,) = run_members([GOOD], tmp_path, log=said.append)
    outcome.path.write_bytes(outcome.path.read_bytes()[:2000])
    (outcome,) = run_members([GOOD], tmp_path, log=said.append)
    assert outcome.status == "finished"
    assert any("damaged" in line for line in said)


def test_names_must_be_those_of_files_and_differ(tmp_path):
    with pytest.raises(CaseError, match=r"a/b.*letters"):
        run_members([Member("a/b", BENT)], tmp_path)
    with pytest.raises(CaseError, match="good: found twice"):
        run_members([GOOD, GOOD], tmp_path)
    assert not list(tmp_path.iterdir())


class Pickling(Executor):
    """An executor that is as far away as a cluster's: all that goes to it and comes back is pickled."""

    def __init__(self) -> None:
        self.sent = 0

    def submit(self, function, /, *given, **named):
        function, given = pickle.loads(pickle.dumps((function, given)))
        self.sent += 1
        future: Future = Future()
        future.set_result(pickle.loads(pickle.dumps(function(*given))))
        return future


def test_any_executor_can_be_handed_in(tmp_path, said):
    far = Pickling()
    outcomes = run_members([GOOD, ODD], tmp_path, executor=far, log=said.append)
    assert statuses(outcomes) == {"good": "finished", "odd": "failed"}
    assert far.sent == 1  # what cannot be read is not sent
    assert work(GOOD, str(tmp_path)).seconds == 0  # and again does nothing


LONG = ("time.end=0.05", "output.every=0.01")
SCRIPT = f"""
import sys, time
sys.path[:0] = {[str(ROOT), str(ROOT / "tests")]!r}
from ibfil.running import loop
from ibfil.errors import Interrupted
from ibfil.studies.members import Member, run_members
from helpers.made_run import BENT
class Waiting(loop.Loop):  # here and in each worker, which reads this script: a run waits in a step for the signal
    def _after_step(self):
        while not self._signals.caught:
            time.sleep(0.01)
        super()._after_step()
loop.Loop = Waiting
if __name__ == "__main__":
    many = [Member(name, BENT, {LONG!r}) for name in ("one", "two", "three")]
    try:
        run_members(many, sys.argv[1], jobs=int(sys.argv[2]))
    except Interrupted as cut:
        print(cut)
        sys.exit(130)
"""


def test_a_script_without_a_main_guard_is_told_in_a_sentence(tmp_path):
    """Its processes would begin others as they read it: no pages of multiprocessing, and no want of memory."""
    unguarded = SCRIPT.replace('if __name__ == "__main__":', "if True:").replace("loop.Loop = Waiting\n", "")
    (tmp_path / "script.py").write_text(unguarded)
    command = [sys.executable, str(tmp_path / "script.py"), str(tmp_path / "out"), "2"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 1
    assert "multiprocessing" not in done.stderr
    last = done.stderr.strip().splitlines()[-1]
    assert last.endswith('allowed: what runs members under `if __name__ == "__main__":`')


@pytest.mark.parametrize("jobs", [1, 2])
def test_after_a_signal_everything_can_be_gone_on_with(tmp_path, jobs, said):
    """Of three runs those under way leave a checkpoint, the third is not begun; and all go on, to the same bits."""
    (tmp_path / "study.py").write_text(SCRIPT)
    folder = tmp_path / "runs"
    command = [sys.executable, "study.py", str(folder), str(jobs)]
    study = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True, start_new_session=True)
    begun = [folder / f"{name}.h5" for name in ("one", "two")[:jobs]]
    wait_for(lambda: all(path.exists() and path.stat().st_size for path in begun), study)
    os.killpg(study.pid, signal.SIGINT)  # as Ctrl-C does
    out, _ = study.communicate(timeout=300)
    assert study.returncode == 130, out
    assert "interrupted; 0 of 3 runs are done" in out
    assert sorted(folder.glob("*.h5")) == sorted([*begun, *map(checkpoint_path, begun)])
    with RunFile(begun[0]) as file:
        assert file.status == "interrupted"
        created = file.created
    (outcome,) = run_members([Member("one", BENT, LONG)], folder, log=said.append)
    assert outcome.status == "finished"
    with RunFile(outcome.path) as file:
        assert file.created == created  # gone on with, not begun anew
    alone = tmp_path / "alone.h5"
    run(outcome.member.resolved(), alone, progress=False, log=said.append)
    assert content(alone) == content(outcome.path)


def test_a_process_that_is_killed_is_told_and_the_others_go_on(tmp_path, said):
    """The run that shot its own process down is named; nothing else is lost."""
    outcomes = run_members([GOOD, Killer("killer", BENT), STIFF], tmp_path, jobs=2, log=said.append)
    assert statuses(outcomes) == {"good": "finished", "killer": "failed", "stiff": "finished"}
    assert "was killed" in outcomes[1].message


class Killer(Member):
    """A member whose process is killed when it is about to be run; in this process it is as any other."""

    def resolved(self):
        if multiprocessing.parent_process() is not None:
            time.sleep(0.2)
            os.kill(os.getpid(), signal.SIGKILL)
        return super().resolved()


def test_the_pace_of_a_run_leaves_its_start_out_and_adds_its_parts_up(tmp_path):
    path = tmp_path / "run.h5"
    result = run(STIFF.resolved(), path, progress=False, log=lambda line: None)
    with RunFile(path) as file:
        seconds, processor, covered = file.pace
    assert 0 < covered < result.case.time.end
    assert covered == pytest.approx(result.case.time.end * (1 - 1 / result.steps))
    assert 0 < seconds <= result.wall_time
    assert processor > 0


def test_a_member_writes_checkpoints_only_where_it_takes_long_and_keeps_none(tmp_path, monkeypatch):
    written = []
    monkeypatch.setattr("ibfil.running.loop.checkpoint.write", lambda path, one: written.append(one.time))
    assert work(GOOD, str(tmp_path)).done
    assert not written
    long = replace(GOOD, name="long", overrides=(*GOOD.overrides, "output.checkpoint_every=1e-9"))
    assert work(long, str(tmp_path)).done
    assert 0 < written[0] < long.resolved().time.end
    count = len(written)
    run(GOOD.resolved(), tmp_path / "whole.h5", progress=False, log=lambda line: None)
    assert len(written) == count + 2  # at the start and at the end of one that may be made longer
    assert content(tmp_path / "good.h5") == content(tmp_path / "whole.h5")


def test_the_cases_of_members_without_a_file_are_read_where_they_are_run(tmp_path, monkeypatch, said):
    read = []
    monkeypatch.setattr(Member, "resolved", lambda self, real=Member.resolved: read.append(self.name) or real(self))
    run_members([GOOD, ODD], tmp_path, log=said.append)
    assert read == ["good", "odd"]


def test_ctrl_c_before_the_first_step_is_no_failure(tmp_path, monkeypatch, said):
    def cut(case, path):
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "_run", cut)
    with pytest.raises(Interrupted, match="0 of 2 runs are done"):
        run_members([GOOD, STIFF], tmp_path, log=said.append)


def test_a_process_pool_can_be_handed_in(tmp_path, said):
    """One of concurrent.futures itself, whose processes begin with nothing of this one."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        outcomes = run_members([GOOD, ODD, STIFF], tmp_path, executor=pool, log=said.append)
    assert statuses(outcomes) == {"good": "finished", "odd": "failed", "stiff": "finished"}
    assert all(outcome.path.is_file() for outcome in outcomes if outcome.done)
