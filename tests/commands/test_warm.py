"""`ibfil warm`: afterwards a run of the case compiles nothing, and nothing is left where it was called."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.made_run import BENT

from ibfil.commands import main
from ibfil.simulation.simulation import Simulation

ROOT = Path(__file__).parents[2]


@pytest.fixture
def bent(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bent.toml").write_text(BENT)
    return tmp_path


def test_it_takes_a_few_steps_and_writes_no_run(bent, monkeypatch, capsys):
    taken = []
    accept = Simulation.accept
    monkeypatch.setattr(Simulation, "accept", lambda self, step, time: (taken.append(time), accept(self, step, time)))
    assert main.main(["warm", "bent.toml"]) == 0
    assert len(taken) == 3
    assert ": warm; its first step was done after " in capsys.readouterr().out
    assert list(bent.iterdir()) == [bent / "bent.toml"]


def test_a_run_shorter_than_that_is_taken_to_its_end(bent, capsys):
    assert main.main(["warm", "bent.toml", "time.end=1e-6"]) == 0
    assert "warm" in capsys.readouterr().out


def test_faults_are_those_of_the_case(bent, capsys):
    assert main.main(["warm", "bent.toml", "fluid.viscosty=2"]) == 2
    assert "fluid.viscosty" in capsys.readouterr().err


@pytest.mark.slow
def test_after_it_a_run_compiles_nothing(bent):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(bent / "kernels")}

    def compiled(*words: str) -> set[str]:
        subprocess.run([sys.executable, "-m", "ibfil", *words], env=environment, check=True, capture_output=True)
        return {path.name for path in (bent / "kernels").rglob("*.nbc")}

    ahead = compiled("warm", "bent.toml")
    assert len(ahead) > 10
    assert compiled("run", "bent.toml", "time.end=0.02") == ahead
