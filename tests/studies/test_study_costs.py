"""Costs of studies, in counts of runs, which no machine changes, and in the processor time of one sitting."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.io.reader import RunFile
from ibfil.studies.fit.results import Parameter
from ibfil.studies.fit.search import Search, search
from ibfil.studies.member import Member, Outcome
from ibfil.studies.uncertainty.study import uncertainty

BARS_TWELVE, FIT_FIFTY = 12.0, 50
CASE = "[filament.rod]\n"


def test_no_fit_of_three_parameters_takes_more_than_fifty_runs(tmp_path):
    """Not where every step of least squares is taken and none is the last: 47, and two that tell step and nodes."""
    made: list[Member] = []

    def make(members):
        made.extend(members)
        return [Outcome(member, "finished", tmp_path, "") for member in members]

    def flat(outcome):  # a third of the way is left by each step
        values = np.array([float(word.partition("=")[2]) for word in outcome.member.overrides])
        return np.log(values / 3.0) ** 3

    three = [Parameter(f"parameters.{name}", 0.1, 10.0) for name in "abc"]
    found = search(Search(CASE, (), three, make, flat), np.zeros(3))
    assert not found.converged
    assert found.runs == len(made) == len({member.name for member in made})
    assert found.runs == 11 * 4 + 3
    assert found.runs + 2 <= FIT_FIFTY


@pytest.mark.slow
def test_the_error_bar_of_the_swimmer_takes_at_most_twelve_of_its_runs(tmp_path):
    """By steps times nodes, which is more than they cost, and by processor time, run by run beside the scene's own."""
    found = uncertainty("swimmer_stokes", tmp_path, meant=True, log=lambda line: None)
    assert not found.failures
    assert all(bar.whole for bar in found.bars)
    work = {}
    for path in (tmp_path / "runs").glob("*.h5"):
        if not path.name.endswith(".ckpt.h5"):
            with RunFile(path) as run:
                work[path.stem] = run.steps * len(run.arclength("swimmer"))
    assert len(work) == found.runs
    assert sum(work.values()) <= BARS_TWELVE * work["base"]
    assert found.cost <= BARS_TWELVE
