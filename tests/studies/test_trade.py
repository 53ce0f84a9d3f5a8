"""`ibfil trade`: the reference proves its order or is refused, the front, the noise, the budget, the cheapest."""

from __future__ import annotations

import csv
import json
import re
import signal
from dataclasses import replace

import numpy as np
import pytest
from helpers.made_run import BENT

from ibfil.commands import main
from ibfil.errors import CaseError, Interrupted, RunFailed
from ibfil.io.reader import RunFile
from ibfil.studies.distance import superpose
from ibfil.studies.members import run_members
from ibfil.studies.settings import axis
from ibfil.studies.trade import figure as trade_figure
from ibfil.studies.trade import reference
from ibfil.studies.trade.study import front, trade

WAVE = BENT.replace('kind = "circle", curvature = 1.0', 'kind = "relaxed"').replace(
    "bending = 1.0", 'bending = 1.0\ncurvature = ["2*sin(6*t + 3*s)", 0]'
)  # smooth from the start on: bent as it wants to be


def quiet(line: str) -> None:
    """Say nothing."""


def runner(members, folder):
    return run_members(members, folder, log=quiet)


@pytest.fixture(scope="module")
def proved(tmp_path_factory):
    """The reference of a rod that bends itself, nodes varied."""
    folder = tmp_path_factory.mktemp("proved")
    return reference.prove(
        WAVE, ("time.end=1", "time.step=0.02", "output.every=0.2"), folder, ("position", "span"), True, runner
    )


def test_the_reference_shows_both_orders_and_is_finest_in_both(proved):
    for name in ("position", "span"):
        in_time, in_space = proved.proofs[name]
        assert in_time.order == pytest.approx(2.0, abs=0.25)
        assert in_space.order == pytest.approx(2.0, abs=0.25)
        assert proved.estimate(name) == in_time.estimate + in_space.estimate
    assert proved.refused == ()
    with RunFile(proved.path) as run:
        assert run.case.time.step == 0.02 / 4
        assert run.case.filaments["rod"].nodes == 33


def test_its_own_estimate_is_that_of_a_run_much_finer(proved, tmp_path):
    """Of the estimate in space, which is the larger: against 129 nodes, which leave a sixteenth of the error of 33.

    It takes errors to fall by four a level; how far they fell by another factor is how far it may be off.
    """
    overrides = ("time.end=1", "time.step=5e-3", "output.every=0.2", "filament.rod.nodes=129")
    (outcome,) = runner([reference.Member("finer", WAVE, overrides)], tmp_path)
    with RunFile(proved.path) as ours, RunFile(outcome.path) as finer:
        left = reference.distances(ours, finer)
    for name in ("position", "span"):
        proof = proved.proofs[name][1]
        assert proof.error == pytest.approx(left[name] * 16 / 15, rel=abs(2**proof.order - 4) / 3)


def test_a_reference_without_its_order_is_refused(tmp_path, monkeypatch):
    """Distances that fall by 1.9 a level are order 0.93, less than 0.65 of two; by 3, order 1.6, enough."""
    for ratio, refused in ((1.9, ("position",)), (3.0, ())):
        falls = iter(ratio ** -np.arange(100.0))
        monkeypatch.setattr(reference, "distances", lambda a, b, falls=falls: {"position": next(falls)})
        found = reference.prove(BENT, (), tmp_path, ("position",), False, runner)
        assert found.refused == refused
        assert found.proofs["position"][0].order == pytest.approx(np.log2(ratio))
    monkeypatch.setattr(reference, "distances", lambda a, b: {"position": 1.0})
    with pytest.raises(RunFailed, match="shows its order in none"):
        trade(BENT, [axis("time.step=1e-3")], tmp_path, observe=["position"], log=quiet)


def test_thermal_and_adaptive_cases_have_no_reference(tmp_path):
    with pytest.raises(CaseError, match=r"time\.tolerance"):
        trade(BENT, [axis("time.order=1,2")], tmp_path, ["time.tolerance=1e-2"], log=quiet)
    noisy = BENT + "\n[thermal]\nenergy = 1e-3\n"
    with pytest.raises(CaseError, match=r"semi-implicit|random run"):
        trade(noisy, [axis("time.step=1e-3,2e-3")], tmp_path, log=quiet)


def test_the_front_is_what_nothing_beats():
    costs = [1.0, 2.0, 3.0, 4.0, 0.5, 2.0]
    errors = [0.5, 0.4, 0.45, 0.1, None, 0.3]
    assert front(costs, errors) == (0, 5, 3)
    assert front([], []) == ()
    assert front([1.0], [None]) == ()


VARY = ["--vary", "time.step=5e-3,1e-3", "--vary", "time.scheme=implicit,explicit&time.order=1,1"]


def test_a_trade_has_a_table_a_figure_and_ends_with_the_cheapest(here, capsys):
    command = ["trade", "bent.toml", "time.end=0.1", *VARY, "--repeat", "2", "--observe", "position", "-o", "out"]
    assert main.main([*command, "--for", "0.01"]) == 0
    said = capsys.readouterr()
    assert "trade --for is deprecated; ibfil tune bent.toml --for OBSERVABLE=1%" in said.err
    *_, last = said.out.splitlines()
    assert last.split() in (["time.step=5e-3", *IMPLICIT], ["time.step=1e-3", *IMPLICIT])
    with open("out/trade.csv", newline="") as file:
        rows = {(row["time.step"], row["time.scheme"]): row for row in csv.DictReader(file)}
    assert rows["5e-3", "explicit"]["status"] == "failed"
    assert "diverged" in rows["5e-3", "explicit"]["message"] or "rest length" in rows["5e-3", "explicit"]["message"]
    assert rows["5e-3", "explicit"]["position"] == ""
    errors = [float(rows[step, "implicit"]["position"]) for step in ("5e-3", "1e-3")]
    assert np.log(errors[0] / errors[1]) / np.log(5) == pytest.approx(1.0, abs=0.2)  # of first order, steps 5 apart
    with RunFile("out/runs/step=1e-3,scheme=implicit,order=1.2.h5") as run:
        seconds, processor, covered = run.pace
    assert float(rows["1e-3", "implicit"]["seconds_most"]) >= seconds / covered
    assert main.main([*command, "--clock", "processor"]) == 0  # nothing is run again
    with open("out/trade.csv", newline="") as file:
        by_processor = next(row for row in csv.DictReader(file) if row["time.step"] == "1e-3")
    assert float(by_processor["seconds"]) == float(by_processor["processor"]) <= processor / covered
    message = json.loads((here / "out/trade.json").read_text())
    assert message["machine"]
    assert message["versions"]["ibfil"]
    assert [len(one["seconds"]) for one in message["settings"] if one["status"] == "finished"] == [2, 2]
    assert (here / "out/trade.png").read_bytes().startswith(b"\x89PNG")
    assert main.main([*command, "--for", "1e-12"]) == 1  # nothing is so good
    err = capsys.readouterr().err
    assert "no setting comes within 1e-12" in err
    assert re.search(r"; the nearest, time.step=1e-3 time.scheme=implicit.*, is [\d.e-]+ off in ", err)
    assert "the run stopped" not in err


IMPLICIT = ["time.scheme=implicit", "time.order=1"]


def test_the_budget_ends_it_and_the_same_call_goes_on(tmp_path):
    """The alarm is set off by hand when the first of two settings is done: the other is left out, and made later."""
    with pytest.raises(Interrupted, match="budget was used up by the reference"):
        trade(BENT, [axis("time.step=1e-3")], tmp_path / "none", budget=1e-3, log=quiet)
    said: list[str] = []

    def ring(line: str) -> None:
        said.append(line)
        if line.startswith("step=1e-3.1: finished"):
            signal.raise_signal(signal.SIGALRM)

    two = [axis("time.step=1e-3,5e-4")]
    result = trade(BENT, two, tmp_path, repeat=1, budget=1e6, observe=["position"], log=ring)
    assert [one.status for one in result.trials] == ["finished", "left out"]
    assert any("budget" in line for line in said)
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0
    result = trade(BENT, two, tmp_path, repeat=1, observe=["position"], log=quiet)
    assert [one.status for one in result.trials] == ["finished", "finished"]


def test_a_budget_whose_interrupt_is_lost_ends_with_the_run_under_way(tmp_path, monkeypatch):
    """As where it comes while the garbage collector calls back: no KeyboardInterrupt is raised at all."""
    monkeypatch.setattr("os.kill", lambda process, number: None)

    def ring(line: str) -> None:
        if line.startswith("step=1e-3.1: finished"):
            signal.raise_signal(signal.SIGALRM)

    result = trade(BENT, [axis("time.step=1e-3,5e-4")], tmp_path, repeat=1, budget=1e6, observe=["position"], log=ring)
    assert [one.status for one in result.trials] == ["finished", "left out"]


def test_what_the_reference_cannot_tell_is_marked_and_counts_against_a_setting(tmp_path):
    result = trade(BENT, [axis("time.step=1e-3,1.25e-4")], tmp_path, repeat=1, log=quiet, observe=["position"])
    coarse, fine = result.trials
    assert result.uncertain(fine, "position") or fine.errors["position"] < coarse.errors["position"]
    own = result.reference.estimate("position")
    assert result.cheapest(coarse.errors["position"] + 1.01 * own) is not None
    exact = replace(coarse, errors={"position": 0.0})
    assert replace(result, trials=(exact,)).cheapest(0.9 * own) is None


def test_one_setting_alone_has_room_in_the_figure(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(trade_figure, "save", lambda figure, path: drawn.append(figure))
    result = trade(BENT, [axis("time.step=1e-3")], tmp_path, repeat=1, observe=["position"], log=quiet)
    for seconds in (0.08, 3.0, 5.0, 12.0):
        trade_figure.draw(
            replace(result, trials=(replace(result.trials[0], seconds=(seconds,)),)), tmp_path / "trade.png"
        )
        low, high = drawn[-1].axes[0].get_xlim()
        assert low < 0.9 * seconds
        assert 1.1 * seconds < high


@pytest.mark.parametrize("words", [["--observe", "nothing"], ["--budget", "ten"], ["--repeat", "0"], ["--for", "-1"]])
def test_what_makes_no_sense_is_refused(here, words, capsys):
    try:
        status = main.main(["trade", "bent.toml", "--vary", "time.step=1e-3", *words])
    except SystemExit as end:
        status = end.code
    assert status == 2
    assert "allowed" in capsys.readouterr().err


def test_superposing_finds_a_turn_and_what_is_left():
    random = np.random.default_rng(1)
    p = random.standard_normal((9, 3))
    angle = 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    q = p @ turn + [1.0, 2.0, 3.0]
    distance, found = superpose(p, q)
    assert distance < 1e-13
    assert found == pytest.approx(angle)
    mirrored = p * [1, 1, -1]
    assert superpose(p, mirrored)[0] > 0.1  # a mirror image is no turn
    line = np.outer(np.linspace(0, 1, 9), [1, 0, 0])
    assert superpose(line, line @ turn)[1] == pytest.approx(angle)


@pytest.mark.parametrize(("width", "rolled"), [(0.02, 0.0), (0.2, np.pi)])
def test_how_a_nearly_straight_rod_is_turned_about_itself_does_not_count(width, rolled):
    """Two shapes that are mirror images, half a turn about the rod: one that is wider is turned by that."""
    x = np.linspace(0, 1, 17)
    left, right = (np.stack([x, side * width * np.sin(np.pi * x), 0 * x], axis=1) for side in (1, -1))
    distance, angle = superpose(left, right)
    assert distance < 1e-13
    assert angle == pytest.approx(rolled, abs=1e-6)
    turn = np.array([[np.cos(0.3), -np.sin(0.3), 0], [np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]])
    assert superpose(left @ turn, left)[1] == pytest.approx(0.3)
