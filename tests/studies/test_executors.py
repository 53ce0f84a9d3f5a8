"""Executors that a user names, with real processes: faults of the name, members that fail, workers that die."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from concurrent.futures import CancelledError, Executor, Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import ClassVar

import pytest
from helpers.made_run import BENT

from ibfil.commands import main
from ibfil.errors import CaseError, Interrupted
from ibfil.studies import progress
from ibfil.studies.executors import opened
from ibfil.studies.member import Member
from ibfil.studies.members import run_members

ROOT = Path(__file__).parents[2]
README = ROOT / "ibfil" / "studies" / "README.md"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("loky", "allowed: MODULE:FACTORY"),
        (":x", "allowed: MODULE:FACTORY"),
        ("no_such_module:x", "no_such_module cannot be imported"),
        ("math:pie", "math has no function pie"),
        ("math:pi", "math has no function pi"),
        ("math:sqrt", r"cannot be begun \(AttributeError"),
        ("builtins:open", "cannot be begun"),
        ("threading:Semaphore", "found bool; allowed"),
    ],
)
def test_what_is_no_executor_is_one_line(name, words):
    with pytest.raises(CaseError, match=words) as told, opened(name, 10**6):
        pass
    assert len(told.value.faults) == 1


def test_a_command_with_a_wrong_executor_runs_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bent.toml").write_text(BENT)
    words = ["bent.toml", "--vary", "time.end=0.01,0.02", "--executor", "math:pie"]
    for kind in ("sweep", "stability", "trade"):
        assert main.main([kind, *words]) == 2
        assert "math has no function pie" in capsys.readouterr().err
    targets = {"fit": ["--vary", "fluid.viscosity=1,2", "--data", "none.csv"], "tune": ["--for", "span=1%"]}
    for kind in ("compare", "uncertainty", "tune", "fit"):
        assert main.main([kind, "bent.toml", *targets.get(kind, ()), "--executor", "math:pie"]) == 2
        assert "math has no function pie" in capsys.readouterr().err
    assert sorted(tmp_path.iterdir()) == [tmp_path / "bent.toml"]


class Losing(Executor):
    """Gives up what it is handed, with an exception; takes nothing more after the first."""

    def __init__(self, error: BaseException, takes: int) -> None:
        self.error, self.takes = error, takes

    def submit(self, function, /, *given, **named):
        if self.takes == 0:
            raise BrokenProcessPool("no more")
        self.takes -= 1
        future: Future = Future()
        future.set_exception(self.error)
        return future


@pytest.mark.parametrize(
    ("error", "takes", "words"),
    [
        (BrokenProcessPool("died"), 2, r"one: waiting: the executor broke \(BrokenProcessPool: died\)"),
        (CancelledError(), 2, "two: waiting: the executor gave it up"),
        (CancelledError(), 1, "two: waiting: the executor takes no more: no more"),
    ],
)
def test_where_an_executor_breaks_the_members_wait_for_the_same_call(tmp_path, error, takes, words):
    said: list[str] = []
    members = [Member(name, BENT, ("time.end=0.01",)) for name in ("one", "two")]
    with pytest.raises(Interrupted, match="0 of 2 runs are done; the same command goes on"):
        run_members(members, tmp_path, executor=Losing(error, takes), log=said.append)
    assert any(re.match(words, line) for line in said), said
    assert all(outcome.done for outcome in run_members(members, tmp_path, log=said.append))


def test_an_error_of_one_member_is_its_own(tmp_path):
    said: list[str] = []
    (outcome,) = run_members([Member("one", BENT)], tmp_path, executor=Losing(MemoryError("x"), 1), log=said.append)
    assert (outcome.status, outcome.message) == ("failed", "its process died: MemoryError: x")


STUDY = """
import os, signal, sys
from pathlib import Path
from ibfil.errors import Interrupted
from ibfil.studies.executors import opened
from ibfil.studies.member import Member
from ibfil.studies.members import run_members
from mortal import Mortal

if __name__ == "__main__":
    os.environ["STUDY"] = str(os.getpid())
    case = Path("bent.toml").read_text()
    members = [Member("one", case), Mortal("mortal", case), Member("odd", case, ("fluid.viscosty=2",))]
    unstable = ("filament.rod.stretching=1e5", "time.scheme=explicit", "time.order=1", "time.step=0.005")
    members += [Member("stiff", case, unstable)]
    try:
        with opened(sys.argv[1], 2) as pool:
            for outcome in run_members(members, "runs", executor=pool):
                print("END", outcome.member.name, outcome.status)
    except Interrupted as cut:
        print("CUT", cut)
"""
MORTAL = """
import os, signal
from dataclasses import dataclass
from pathlib import Path
from ibfil.studies.member import Member

@dataclass(frozen=True)
class Mortal(Member):  # the first process that is about to run it is killed, and only that
    def resolved(self):
        if os.environ["STUDY"] != str(os.getpid()) and not Path("died").exists():
            Path("died").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().resolved()
"""
EXECUTORS = {  # and what each needs installed
    "concurrent.futures:ProcessPoolExecutor": "concurrent",
    "loky:get_reusable_executor": "loky",
    "cluster:local": "distributed",
}


def recipe() -> str:
    """The file for a Dask cluster, as the README has it."""
    (text,) = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    return text


@pytest.mark.parametrize("name", EXECUTORS)
def test_a_study_in_real_workers_of_which_one_dies_ends_with_every_member(tmp_path, name):
    """A member that fails takes no other with it; after a death the same command, at most, has to be given again."""
    if importlib.util.find_spec(EXECUTORS[name]) is None:
        pytest.skip(f"{EXECUTORS[name]} is not installed (pip install 'ibfil[cluster]'): {name} is not tested")
    for file, text in {"study.py": STUDY, "mortal.py": MORTAL, "cluster.py": recipe(), "bent.toml": BENT}.items():
        (tmp_path / file).write_text(text)
    path = os.pathsep.join(filter(None, [str(tmp_path), str(ROOT), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "study.py", name]
    ends: dict[str, str] = {}
    for _ in range(2):
        done = subprocess.run(
            command, cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, timeout=300
        )
        ends = dict(line.split()[1:3] for line in done.stdout.splitlines() if line.startswith("END"))
        if ends:
            break
        assert "the same command goes on" in done.stdout, done.stdout + done.stderr
    assert (tmp_path / "died").exists()
    assert ends == {"one": "finished", "mortal": "finished", "odd": "failed", "stiff": "failed"}, done.stderr


class Bar:
    """A terminal's bar, as the study moves it."""

    made: ClassVar[list[Bar]] = []

    def __init__(self, total, initial, **how) -> None:
        self.total, self.n, self.open = total, initial, True
        self.made.append(self)

    def update(self, step) -> None:
        self.n += step

    def clear(self) -> None: ...

    def refresh(self) -> None: ...

    def close(self) -> None:
        self.open = False


def test_a_terminal_has_a_bar_over_the_members_and_lines_say_the_time_left(tmp_path, monkeypatch):
    monkeypatch.setattr(progress, "on_terminal", lambda: True)
    monkeypatch.setattr("tqdm.tqdm", Bar)
    said: list[str] = []
    members = [Member(name, BENT, ("time.end=0.01",)) for name in ("a", "b", "c", "d")]
    run_members(members[:1], tmp_path, log=said.append)
    run_members(members, tmp_path, log=said.append)
    (bar,) = Bar.made  # one member alone has none
    assert (bar.total, bar.n, bar.open) == (4, 4, False)
    assert re.fullmatch(r"b: finished in .* s \(2 of 4, some \d+ s left\)", said[-3])
    assert said[-1].endswith("(4 of 4)")


def test_the_time_left_counts_what_ended_now_and_not_what_was_done_before():
    study = progress.MemberProgress(10, 4)
    assert study.left(30.0) is None
    study.tell("x", True, lambda line: None)
    study.tell("x", False, lambda line: None)  # one that was cut
    study.tell("x", True, lambda line: None)
    assert study.left(30.0) == 60.0
    assert [progress.clock(t) for t in (12.4, 100, 7200)] == ["12 s", "2 min", "2.0 h"]
