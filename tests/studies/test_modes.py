"""`ibfil modes` and `ibfil rest`: numbers with their bars, thresholds, what a run will show, files, refusals."""

from __future__ import annotations

import csv
import json
import re

import numpy as np
import pytest

import ibfil
from ibfil.commands.main import main
from ibfil.errors import CaseError, RunFailed
from ibfil.io.reader import RunFile
from ibfil.studies.modes import rest, study
from ibfil.studies.tables import with_bar


def silent(line: str) -> None:
    pass


def test_the_flutter_threshold_is_within_its_bar():
    """37.695 A/L^2 for a rod that cannot be compressed; this one, EA = 2e5 A/L^2, is shorter by F/EA there."""
    found = study.modes("flailing", None, ["filament.rod.nodes=33"], critical=("parameters.F0", 30.0, 45.0), log=silent)
    limit = found.threshold
    assert abs(limit.value - 37.695 * (1 - 37.695 / 2e5)) < 1.5 * limit.bar
    assert limit.bar < 0.02
    assert limit.nodes == (17, 33, 65)
    assert limit.grows_above
    assert limit.word.endswith("flutter")
    assert limit.frequency * 4 * np.pi == pytest.approx(191.26, rel=5e-3)
    # At F0 = 38 the case expects +2.241 A/(zeta L^4), by theory.
    leading = found.modes[0]
    assert leading.count == 2
    assert abs(leading.corrected.real - 2.241 / (4 * np.pi)) < 3 * leading.growth.doubt
    assert found.unstable


def test_euler_s_load_is_found_from_below_and_above():
    found = study.modes(
        "euler_buckling",
        None,
        ["filament.rod.nodes=33"],
        critical=("filament.rod.finish.force.0", -3.0, -2.0),
        log=silent,
    )
    limit = found.threshold
    assert limit.value == pytest.approx(-(np.pi**2) / 4, rel=2e-5)
    assert not limit.grows_above
    assert limit.word.endswith("divergence")


@pytest.mark.parametrize(
    ("scheme", "order", "step"), [("implicit", 1, 0.003), ("implicit", 2, 0.012), ("semi-implicit", 1, 0.003)]
)
def test_a_run_shows_the_growth_that_was_foretold(scheme, order, step):
    """Flutter that first order hides: it decays where the rod's own grows; linearly implicit steps make growth up."""
    own = [f"time.scheme={scheme}", f"time.order={order}"]
    changes = ["filament.rod.nodes=21", f"time.step={step}", *own, "time.end=4", "output.every=0.012"]
    start = "1e-4*(sin(k*s) - sinh(k*s) + c*(cos(k*s) - cosh(k*s)))"  # so small that nothing saturates
    shape = f'filament.rod.shape={{kind="straight", perturb=["0", "0", "{start}"]}}'
    windows = [f"observe.{name}.over=[1.5, 4]" for name in ("growth", "frequency")]
    found = study.modes("flailing", None, [*changes, shape, *windows], log=silent)
    seen = found.modes[0].seen[f"order {order}" if scheme == "implicit" else scheme]
    case = ibfil.read_case(_find("flailing"), [*changes, shape, *windows])
    result = ibfil.run(case, None, progress=False, log=silent)
    assert result.summaries["growth"].value == pytest.approx(seen.real, abs=2e-3)
    assert result.summaries["frequency"].value == pytest.approx(abs(seen.imag), rel=1e-3)
    assert abs(seen.real - found.modes[0].value.real) > 0.01 * (3 - order)


def _find(name: str):
    from ibfil.case.library import find

    return find(name)


def test_modes_of_a_bent_rod_without_torsion_are_told(tmp_path):
    found = study.modes("end_moment", tmp_path, ["filament.rod.nodes=33"], count=3, log=silent)
    assert found.left_out > 0
    assert all(mode.kind.word == "bending, in plane" for mode in found.modes)
    assert any("has no torsion" in note for note in found.notes)
    assert not found.unstable
    with (tmp_path / "modes.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["growth"]) == pytest.approx(found.modes[0].corrected.real)
    message = json.loads((tmp_path / "modes.json").read_text())
    assert message["modes"][0]["levels"]["growth"]["word"] == "seen"
    assert (tmp_path / "modes.png").stat().st_size > 10_000


def test_modes_are_filaments_that_swing_about_the_rest(tmp_path):
    found = study.modes("whirling", tmp_path, ["filament.rod.nodes=17"], count=2, log=silent)
    with RunFile(tmp_path / "modes.h5") as run:
        assert run.status == "finished"
        assert run.time[-1] == pytest.approx(2 - 1 / 16)
        r = run.position("rod")
    rest_shape = found.rest.configuration.r
    assert np.abs(r[:16] - rest_shape).max() == pytest.approx(0.1, rel=1e-6)
    assert np.abs(r[:16].mean(axis=0) - rest_shape).max() < 1e-3
    # Whirling turns one way, and the tip keeps its distance from the axis.
    distance = np.linalg.norm(r[:16, -1, 1:], axis=1)
    assert np.ptp(distance) < 1e-6


def test_twist_and_rigid_motions_are_named():
    """A free rod that twists: six rigid motions, none of them growth; the slowest that decays is a twist."""
    found = study.modes("end_moment", None, ["filament.rod.nodes=17", "filament.rod.finish={}", *TWISTING], log=silent)
    assert found.zeros == 0
    assert {mode.kind.word for mode in found.modes} >= {"bending", "twist"}
    free = [*TWISTING, "filament.rod.start={}", "filament.rod.finish={}"]
    found = study.modes("end_moment", None, ["filament.rod.nodes=17", *free], log=silent)
    assert found.zeros == 6


TWISTING = ["filament.rod.twisting=1", "filament.rod.radius=0.1", "filament.rod.stretching=1e3"]


LEANING = 'filament.rod.shape={kind="straight", perturb=[0, 0, "1e-3*s**2"]}'


def test_a_column_settles_in_the_plane_it_leant_to(tmp_path):
    found = rest.rest("euler_buckling", tmp_path, ["filament.rod.nodes=33", LEANING])
    with RunFile(tmp_path / "rest.h5") as run:
        tip = run.position("rod")[-1, -1]
    assert abs(tip[1]) < 1e-6
    assert tip[2] == pytest.approx(0.66363, rel=1e-3)
    assert found.observables[-1]["rod finish"] == pytest.approx(tip)


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["modes", "swimmer_rft"], 2, "filament.swimmer.curvature: found a function of t; allowed: constants"),
        (["modes", "swimmer_re_1"], 2, "fluid.model: found navier-stokes; allowed: rft, stokes"),
        (["modes", "flailing", "--critical", "parameters.F0=30,30"], 2, "allowed: KEY=LO,HI"),
        (["modes", "flailing", "--critical", "parameters.F1=30,40"], 2, "no such parameter"),
        (["modes", "flailing", "filament.rod.nodes=17", "--critical", "parameters.F0=30,35"], 1, "does not change"),
        (["rest", "flailing", "filament.rod.nodes=17"], 1, "grows and oscillates"),
        (["rest", "euler_buckling", "fluid.flow=[1,0,0]", "filament.rod.start={}"], 1, "no state of rest"),
    ],
)
def test_refusals(arguments, status, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    try:
        found = main(arguments)
    except SystemExit as stop:
        found = stop.code
    assert found == status
    assert words in capsys.readouterr().err


def test_the_command_prints_what_it_found(tmp_path, capsys):
    assert main(["modes", "whirling_ribbon", "filament.rod.nodes=17", "--count", "2", "-o", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    assert "turns with the clamp at 39.79" in told
    assert "growth seen, dt = 0.004: order 2" in told
    assert "+- from 17, 33, 65 nodes" in told


@pytest.mark.parametrize(
    ("value", "bar", "words"),
    [
        (37.68853, 0.0012, "37.6885 +- 0.0012"),
        (-0.04377, 0.00042, "-0.04377 +- 0.00042"),
        (-164.14, 0.088, "-164.140 +- 0.088"),
        (12345.6, 350.0, "12346 +- 350"),
        (1.0, 0.0, "1"),
        (1.0, float("inf"), "1 +- not known"),
        (1.23456e-12, 2.5e-14, "1.235e-12 +- 2.5e-14"),
    ],
)
def test_a_number_has_the_digits_that_its_bar_leaves_it(value, bar, words):
    assert with_bar(value, bar) == words


def test_errors_are_those_of_python_too():
    with pytest.raises(CaseError):
        study.modes("swimmer_rft", None, [], log=silent)
    with pytest.raises(RunFailed):
        rest.rest("flailing", "nowhere", ["filament.rod.nodes=17"])


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (["flailing"], r"UNSTABLE: bending at the angular frequency 15\.3\d* grows by a factor e in 5\.4"),
        (
            ["flailing", "parameters.F0=30"],
            r"stable: the slowest mode, bending at the angular frequency [\d.]+, decays",
        ),
        (["swimmer_rft"], r"not known: .*curvature: found a function of t"),
    ],
)
def test_check_says_on_request_whether_a_scene_is_stable_at_rest(words, found, capsys):
    """Flutter sets in at F0 = 37.7; at 38 the growth is 2.241/(4 pi), e-fold 5.6 at 191.26/(4 pi), on 65 nodes 5.4."""
    from ibfil.commands.main import main

    assert main(["check", *words, "--rest"]) == 0
    assert re.match(rf"at rest:\n  {found}", capsys.readouterr().out.split("\n\n")[-1])
    assert main(["check", *words]) == 0
    assert "at rest:" not in capsys.readouterr().out
