"""`ibfil tune`: what it chooses meets its target against true numbers; the choice itself; refusals, files, the line."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from helpers.calibration import CLAMPED, RFT, SCENES, TIP, Z, rod, seen, truth, until

from ibfil.case.reading import parse_case, read_case
from ibfil.commands.main import main
from ibfil.errors import CaseError
from ibfil.io.reader import RunFile
from ibfil.studies.member import Member
from ibfil.studies.members import run_members
from ibfil.studies.tune.choice import Aim, Law, Limits, candidates, corrected, even, through
from ibfil.studies.tune.results import NoSettings
from ibfil.studies.tune.study import tune
from ibfil.studies.tune.targets import target
from ibfil.studies.uncertainty.numbers import Recorded

SWAY = (
    rod(33, 2e3, ends=CLAMPED + '[filament.rod.loads]\nforce = [0, 0, "4*cos(6*t)"]\n')
    + RFT
    + until(0.6, 0.005, 0.05)
    + seen("tip", "position", at=TIP, along=Z)
)


def quiet(line=""):
    """Say nothing."""


# --- the choice -------------------------------------------------------------------------------------------------------


def law(size_of_error, order, nominal=2.0, sizes=(1.0, 0.5, 0.25)):
    return Law([1.0 + size_of_error * h**order for h in sizes], sizes, nominal, 1.0)


def test_a_law_falls_with_its_order_and_is_inverted_by_the_size_that_it_allows():
    seen_one = law(0.04, 2.0)
    assert seen_one.bar(0.5) == pytest.approx(1.25 * 0.01, rel=1e-9)  # |e| + a quarter of it
    assert seen_one.bar(seen_one.largest(0.003)) == pytest.approx(0.003, rel=1e-12)
    first = law(0.04, 1.0, nominal=1.0)
    assert first.bar(0.1) == pytest.approx(1.25 * 0.004, rel=1e-9)


def test_a_law_without_an_order_has_the_bars_of_its_levels_only():
    """Levels 1, 1.01, 0.995: by the rule |f - f3| + 2 max(|d1|, |d2|)."""
    none = Law([1.0, 1.01, 0.995], (1.0, 0.5, 0.25), 2.0, 1.0)
    assert not none.seen
    assert [none.bar(h) for h in (1.0, 0.7, 0.5, 0.3, 0.25, 0.1)] == pytest.approx(
        [0.035, 0.035, 0.045, 0.045, 0.03, 0.03]
    )
    assert none.bar(1.1) == float("inf")
    assert none.largest(0.036) == 1.0
    assert none.largest(0.031) == 0.25
    assert none.largest(0.02) == 0


def test_the_cheapest_is_the_least_of_all_that_meet_the_target():
    """Against every step and count tried one by one; bars add, though errors of both directions have other signs."""
    aim = Aim(
        "x", 0.01, 0.001, law(0.08, 2.0, sizes=(0.1, 0.05, 0.025)), law(-30.0, 2.0, sizes=(1 / 32, 1 / 64, 1 / 128))
    )
    limits = Limits(17, 129, 0.1, 0.1, 1.0)
    cost = through([33, 65, 129], [2.0, 5.0, 17.0])
    assert cost(65) == pytest.approx(5.0, rel=1e-12)
    found = candidates([aim], limits, cost)
    tried = [
        (cost(n) / dt, n, dt)
        for n in range(17, 130, 2)
        for dt in 0.1 / np.arange(1, 60)
        if aim.nodes.bar(1 / (n - 1)) + aim.step.bar(dt) + aim.rest <= aim.allowed
    ]
    seconds, nodes, step = min(tried)
    assert (found[0].nodes, found[0].step, found[0].seconds) == (nodes, pytest.approx(step), pytest.approx(seconds))
    assert found[0].bar("x") <= 0.01
    harder = aim._replace(number="y", allowed=0.005)
    assert all(one.bar("y") <= 0.005 for one in candidates([aim, harder], limits, cost))
    assert candidates([aim._replace(allowed=0.0011)], limits, cost) == []


def test_the_corrected_value_has_neither_error_and_steps_divide_the_outputs():
    aim = Aim("x", 0.1, 0.0, law(0.04, 2.0), law(0.0, 2.0))
    value, doubt = corrected(aim)
    assert value == pytest.approx(1.0, rel=1e-12)
    assert doubt == pytest.approx(0.25 * 0.01, rel=1e-6)  # of the middle level
    assert even(0.3, 1.0) == 0.25
    assert even(0.1, 0.1) == 0.1
    assert even(0.0, 1.0) == 0.0


# --- runs -------------------------------------------------------------------------------------------------------------


def error_of(result, case, folder, true):
    """How far a run with the answer is from the true numbers, as shares of what was allowed."""
    outcome = run_members([Member("answer", case, result.overrides)], folder, log=quiet)[0]
    with RunFile(outcome.path) as run:
        numbers = Recorded(run, tuple(run.case.observe)).numbers()
    return {aim.number: abs(numbers[aim.number] - true[aim.number]) / aim.allowed for aim in result.aims}


def test_the_answer_meets_its_target_against_a_run_much_finer_and_is_cheaper(tmp_path):
    fine = run_members([Member("fine", SWAY, ("time.step=0.00125", "filament.rod.nodes=129"))], tmp_path, log=quiet)[0]
    with RunFile(fine.path) as run:
        true = Recorded(run, ("tip",)).numbers()
    for share in ("2%", "0.3%"):
        result = tune(SWAY, [f"tip={share}"], tmp_path / share, log=quiet)
        assert error_of(result, SWAY, tmp_path / share, true)["tip"] < 1
        assert result.answer.bar("tip") <= result.aims[0].allowed
        assert result.found("tip") <= result.aims[0].allowed
    coarse = tune(SWAY, ["tip=2%"], tmp_path / "2%", log=quiet)  # again: nothing is run
    assert coarse.answer.seconds < 0.3 * coarse.own.seconds
    assert coarse.answer.seconds < result.answer.seconds


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["sagging", "shaken", "first_order", "cilium", "wound", "corkscrew", "pulled", "sagging_grid"]
)
def test_answers_meet_their_targets_on_many_scenes(name, tmp_path):
    """Every observable of scenes that are not shipped, to 3 and to 1 %: the error against the true number."""
    true, case = truth(name, tmp_path / "truth"), parse_case(SCENES[name], name)
    met = refused = 0
    for share in (3, 1):
        for one in case.observe:
            where = tmp_path / f"{one}{share}"
            try:
                result = tune(SCENES[name], [f"{one}={share}%"], where, log=quiet)
            except NoSettings as refusal:
                refused += 1
                print(f"\n{name} {one} {share} %: {refusal}")
                said = refusal.message
                least = re.findall(r"a target above \S+ \((\S+) %\)", refusal.advice)
                assert min(map(float, least)) > share  # the advice: a target above what was asked
                assert case.fluid.on_grid or "its outputs, " in said  # off grids nothing else refuses
                continue
            off = error_of(result, SCENES[name], where, true)
            print(f"\n{name} {one} {share} %: {off}, {result.own.seconds / result.answer.seconds:.2g} times less")
            assert max(off.values()) <= 1
            met += 1
    assert met > (0 if case.fluid.on_grid else refused)  # on grids nodes show no order: many targets are refused there


def test_the_line_runs_and_the_files_say_the_same(tmp_path, capsys):
    case = tmp_path / "sway.toml"
    case.write_text(SWAY)
    out = tmp_path / "out"
    assert main(["tune", str(case), "--for", "tip=2%", "-o", str(out)]) == 0
    said = capsys.readouterr().out
    assert main(["tune", str(case), "--for", "tip=2%", "-o", str(out), "--quiet"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert said.splitlines()[-1].endswith(line)
    assert "times less than with the case's own" in said
    found = json.loads((out / "tune.json").read_text())
    assert found["overrides"] == line.split()
    tuned, by_hand = read_case(str(out / "tune.toml")), read_case(str(case), line.split())
    assert (tuned.time.step, tuned.filaments["rod"].nodes) == (by_hand.time.step, by_hand.filaments["rod"].nodes)
    assert (tuned.time.step, tuned.filaments["rod"].nodes) == (found["answer"]["step"], found["answer"]["nodes"])
    assert (out / "tune.png").stat().st_size > 10_000


def test_a_number_that_nodes_do_not_change_takes_the_fewest(tmp_path):
    """A straight rod towed along itself: no bending, so any number of nodes gives the speed of the others."""
    towed = rod(33, 1e3, 'anchor = "middle"\nloads = { weight = [5.0, 0, 0] }').replace(
        "normal", "direction = [1, 0, 0]\nnormal"
    )
    scene = (
        towed
        + RFT
        + until(0.2, 0.01, 0.02)
        + seen("speed", "drift", at='"middle"', along="[1, 0, 0]", over="[0.1, 0.2]")
    )
    result = tune(scene, ["speed=1%"], tmp_path, log=quiet)
    assert result.answer.nodes == 9
    assert result.answer.step == pytest.approx(0.02)


def test_refusals(tmp_path):
    for word in ("tip", "tip=", "tip=no%", "tip=0", "tip=-1%", "=1%"):
        with pytest.raises(CaseError, match=r"--for: found .*; allowed: OBSERVABLE=1%"):
            target(word)
    assert target("tip=0.5%").error == pytest.approx(0.005)
    assert not target("tip=0.5").relative
    with pytest.raises(CaseError, match="--for: found top; allowed: tip, as tip=1%"):
        tune(SWAY, ["top=1%"], tmp_path)
    with pytest.raises(CaseError, match=r"\[thermal\]: found thermal noise"):
        tune(SWAY + "[thermal]\nenergy = 1e-7\nseed = 1\n", ["tip=1%"], tmp_path)
    with pytest.raises(CaseError, match=r"time\.tolerance: found one"):
        tune(SWAY, ["tip=1%"], tmp_path, ["time.tolerance=1e-3"])
    with pytest.raises(CaseError, match=r"time\.scheme: found explicit"):
        tune(SWAY, ["tip=1%"], tmp_path, ["time.scheme=explicit", "time.order=1"])
    with pytest.raises(NoSettings, match="no settings") as refusal:
        tune(SWAY, ["tip=1e-9%"], tmp_path / "round_off", log=quiet)
    assert "a target above" in str(refusal.value)
    assert "grid" not in str(refusal.value)  # there is none
    assert "the run stopped" not in str(refusal.value)
    with pytest.raises(
        NoSettings, match=r"aside = 0 is not told from zero: a target in its own unit, as aside="
    ) as zero:
        tune(SWAY + seen("aside", "position", at=TIP, along="[0, 1, 0]"), ["aside=1%"], tmp_path / "zero", log=quiet)
    assert str(zero.value).startswith("no settings")
    every = seen("reach", "position", at=TIP, along=Z, summary='"max"')
    with pytest.raises(NoSettings, match="from its place in a cell and its outputs") as refusal:
        tune(SWAY + every, ["reach=0.1%"], tmp_path / "outputs", log=quiet)
    assert "a shorter output.every" in str(refusal.value)


def test_help_shows_the_form_of_a_target(capsys):
    with pytest.raises(SystemExit) as end:
        main(["tune", "--help"])
    assert end.value.code == 0
    assert "OBSERVABLE=1%" in capsys.readouterr().out
