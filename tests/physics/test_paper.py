"""postprocess/paper: the theory its table is held against, its two counter-examples, and the table itself."""

from __future__ import annotations

import importlib
import math

import numpy as np
import pytest
from scipy.integrate import trapezoid

from ibfil.case.library import named
from ibfil.case.reading import read_case
from ibfil.studies.member import Member, Outcome
from ibfil.studies.members import run_members
from postprocess.paper import __main__ as paper
from postprocess.paper import finite_difference, lagged_tension, stagnation
from postprocess.paper.buckled import first_below, free_modes
from postprocess.paper.elastic_diffusion import diffusion_ratio
from postprocess.paper.fig6_diffusion import ELASTIC, drag_ratio, rigid_ratio
from postprocess.paper.helix_statics import Helix
from postprocess.paper.old_schemes import Swimmer
from postprocess.paper.results import Row, Runs, columns, markdown, plain

PAR = 0.2 * np.pi


def test_the_follower_case_starts_from_a_mode_that_is_free_at_its_end():
    """Eq. 61 corrected: W'' and W''' vanish at s = 1; with the printed denominator they do not."""
    given = read_case(named("flailing_with_twist")).parameters
    k, c = given["k"], given["c"]
    second = -math.sin(k) - math.sinh(k) - c * (math.cos(k) + math.cosh(k))
    third = -math.cos(k) - math.cosh(k) + c * (math.sin(k) - math.sinh(k))
    assert abs(second) < 1e-9
    assert abs(third) < 1e-9
    printed = (math.cos(k) + math.cosh(k)) / (math.sin(k) + math.sinh(k))
    assert abs(-math.sin(k) - math.sinh(k) - printed * (math.cos(k) + math.cosh(k))) > 6


def test_eq_57_is_the_ratio_of_drags_of_a_helix_held_from_turning():
    """Summed over a whole turn of tangents, zeta_par = zeta_perp/2."""
    for theta in np.radians([0.0, 20.0, 45.0, 75.0, 90.0]):
        phase = np.linspace(0, 2 * np.pi, 64, endpoint=False)
        e3 = np.stack([-np.cos(theta) * np.sin(phase), np.cos(theta) * np.cos(phase), np.full(64, np.sin(theta))], 1)
        drag = np.mean([np.eye(3) - 0.5 * np.outer(t, t) for t in e3], axis=0)
        assert drag_ratio(theta) == pytest.approx(drag[2, 2] / drag[0, 0], rel=1e-12)
    assert [rigid_ratio(np.radians(angle)) for angle in (0, 90)] == pytest.approx([4 / 3, 0.5])


@pytest.mark.parametrize("angle", [30, 60])
def test_the_linearised_elastic_helix_diffuses_as_an_independent_code_says(angle):
    own = (f"parameters.theta={angle}*pi/180", "filament.helix.nodes=120")
    ratio = diffusion_ratio(Member("helix", "brownian_helix", own).resolved(), 1e-3)
    assert ratio == pytest.approx(ELASTIC[angle], rel=4e-3)
    assert ratio != pytest.approx(drag_ratio(np.radians(angle)), rel=0.05)


def test_the_straight_elastic_rod_diffuses_twice_as_fast_along_itself():
    case = Member("rod", "brownian_rod", ("filament.rod.nodes=40",)).resolved()
    assert diffusion_ratio(case, 1e-3) == pytest.approx(0.5, rel=1e-6)


def test_the_helix_at_rest_in_a_slow_flow_is_longer_by_the_linear_response():
    """1.029, 1.452 and 1.874 zeta_par u R^2 L^2/A for C = A, 2A/3 and A/2."""
    for twisting, slope in ((1.0, 1.029), (2 / 3, 1.452), (0.5, 1.874)):
        helix = Helix(5.0, 3.0, 1.0, 1.0, twisting, 2 * PAR, PAR)
        assert helix.extensions([1e-3])[0] == pytest.approx(slope * PAR * 1e-3 * 0.09 * 25, rel=2e-3)


def test_the_straight_rod_at_a_stagnation_point_turns_drifts_and_buckles():
    rates = stagnation.growth(300.0)[0]
    assert rates[:3] == pytest.approx([2.0, 1.59094, 1.0], rel=1e-5)
    assert stagnation.threshold(0, 100, 250) == pytest.approx(153.2, rel=1e-4)
    # Far above: the waves of the middle, T = -mu/16 there: growth 1 + (T/2)^2/mu, more than turning away.
    assert stagnation.bending_rates(3000.0)[0] > 2.5


def test_free_modes_are_orthogonal_and_first_below_finds_the_first():
    s = np.linspace(0, 1, 2001)
    products = [[trapezoid(a * b, s) for b in free_modes(s, 4)] for a in free_modes(s, 4)]
    assert np.allclose(products, np.eye(4), atol=1e-5)
    assert first_below(np.array([3.0, 2.0, 1.0, 2.0]), 2.5) == 1
    assert first_below(np.array([3.0, 2.0, 1.0, 2.0]), 0.5) == 2


def test_the_printed_scheme_tears_the_rod_beyond_its_limit_and_not_below():
    """Whatever the viscosity, between 0.7 and 2.5 times zeta_par ds^2/(2 EA): far below the paper's own steps."""
    for eta in (1.0, 1e-3):
        swimmer = Swimmer(33, viscosity=eta)
        limit = lagged_tension.limit(swimmer)
        assert lagged_tension.swim(swimmer, 0.7 * limit, 500)[1]
        assert not lagged_tension.swim(swimmer, 2.5 * limit, 500)[1]
    assert lagged_tension.limit(Swimmer(128)) < 2e-8


def test_the_swimmer_by_finite_differences_turns_and_in_water_goes_the_wrong_way():
    """By finite volumes it rocks by 1.5 degrees in this time and comes back, and moves to -x."""
    times, shapes = finite_difference.swim(Swimmer(128), 1e-4, 0.1, 0.05)
    chord = shapes[-1, -1] - shapes[-1, 0]
    assert times[-1] == pytest.approx(0.1)
    assert abs(np.degrees(np.arctan2(chord[1], chord[0]))) > 10
    times, shapes = finite_difference.swim(Swimmer(128, viscosity=1e-3), 1e-5, 0.16, 0.16)
    chord = shapes[-1, -1] - shapes[-1, 0]
    assert shapes[-1, :, 0].mean() > 0.5
    assert np.abs(np.linalg.norm(np.diff(shapes[-1], axis=0), axis=1) * 127 - 1).max() < 0.05


def test_a_row_knows_what_it_is_held_against():
    assert Row("", "", 0.1, 0.2, 0.201, 1.0, 0.01).verdict == "yes"
    assert Row("", "", 0.1, 0.2, 0.21, 1.0, 0.01).verdict == "no"
    assert Row("", "", 0.1, None, 0.11, 1.0).difference == pytest.approx(0.1)
    assert Row("", "", "none", None, "rotates", 1.0).verdict == ""
    assert Row("", "", 0.1, 0.2, 0.26, 1.0, error=0.021).verdict == "yes"
    assert Row("", "", 0.1, 0.2, 0.26, 1.0, error=0.019).verdict == "no"
    row = Row("7.1", "speed | way", 0.106, 0.1035, 0.1036, 12.3, 0.005, note="why")
    assert columns(row)[2:9] == ["0.106", "0.1035", "0.1036", "+0.10 %", "0.5 %", "yes", "12 s"]
    assert "| speed / way |" in markdown([row])
    assert "why" not in plain([row])


@pytest.mark.parametrize("part", paper.PARTS)
@pytest.mark.parametrize("quick", [True, False])
def test_every_member_of_a_figure_is_a_case_that_can_be_run(part, quick):
    members = importlib.import_module(f"postprocess.paper.{paper.PARTS[part]}").members(quick)
    assert len({member.name for member in members}) == len(members)
    for member in members[::7]:
        assert member.resolved().time.end > 0


def test_the_script_runs_draws_and_goes_on(tmp_path, capsys, monkeypatch):
    """The smallest part in a smaller form: figure, table, and nothing run again."""
    part = importlib.import_module("postprocess.paper.fig5_helix")
    monkeypatch.setattr(part, "MODULI", {"1": 1.0, "5/6": 5 / 6})
    monkeypatch.setattr(part, "_speeds", lambda quick: np.array([0.3, 0.6, 0.9]))
    assert paper.main(["--only", "fig5", "--quick", "-o", str(tmp_path)]) == 0
    assert "yes" in capsys.readouterr().out
    folder = tmp_path / "quick"
    assert (folder / "fig5_helix.png").stat().st_size > 10_000
    assert "| 7.3 | slope of the extension" in (folder / "table.md").read_text()
    assert (folder / "table.csv").read_text().count("\n") == 6
    written = {path: path.stat().st_mtime_ns for path in folder.glob("*.h5")}
    assert paper.main(["--only", "fig5", "--quick", "-o", str(tmp_path)]) == 0
    assert written == {path: path.stat().st_mtime_ns for path in folder.glob("*.h5")}


def test_a_part_without_its_runs_is_told_and_the_others_go_on(tmp_path, capsys, monkeypatch):
    def none(members, folder, **more):
        return [Outcome(member, "failed", folder / "none.h5") for member in members]

    monkeypatch.setattr(paper, "run_members", none)
    (tmp_path / "full").mkdir()
    assert paper.main(["--only", "fig5", "-o", str(tmp_path)]) == 1
    assert "fig5: cannot be drawn" in capsys.readouterr().err


def test_runs_are_opened_when_asked_for(tmp_path):
    member = Member("tiny", "hanging_rod", ("time.end=5",))
    runs = Runs(run_members([member, Member("other", "no_such_case")], tmp_path, log=lambda line: None), tmp_path)
    assert list(runs) == ["tiny"]
    assert runs["tiny"].time[-1] == 5
    assert runs.seconds("tiny") > 0
    with pytest.raises(Exception, match="no such file"):
        runs["other"]
    runs.close()
