"""`ibfil stability`: the classes by their numbers, the predicted limit, and a map of both fluids."""

from __future__ import annotations

import csv
import json
import re

import pytest
from helpers.extremes import PLACE, STRETCH
from helpers.made_run import BENT

from ibfil.commands import main
from ibfil.errors import CaseError
from ibfil.studies.settings import axis
from ibfil.studies.stability import study as stability_study
from ibfil.studies.stability.study import classed

FINE = {"place": 0.01, "shape": 0.01, "turn": 0.01, "stretch": 0.001, "force": 1.0}
WAVE = """
[filament.rod]
length = 1.0
nodes = 21
bending = 1.0
stretching = 1.6e4
curvature = ["4*sin(2*pi*s - 10*t)", 0]
shape = { kind = "relaxed" }
[fluid]
model = "stokes"
viscosity = 1.0
box = [1.6, 1.6, 1.6]
cells = [32, 32, 32]
[time]
end = 0.2
step = 0.02
[output]
every = 0.1
"""


@pytest.mark.parametrize(
    ("numbers", "kind"),
    [
        ({}, "stable"),
        ({"place": 0.051}, "wrong"),
        ({"place": 0.06, "turn": 0.101}, "turned"),
        ({"place": 0.06, "turn": 0.2, "force": 10.1}, "locked"),
        ({"place": 0.06, "turn": 0.2, "force": 20.0, "stretch": 0.0201}, "stretched"),
        ({"place": 0.049, "turn": 0.099, "force": 9.9, "stretch": 0.0199}, "stable"),
    ],
)
def test_a_class_is_the_first_number_beyond_its_limit(numbers, kind):
    assert classed({**FINE, **numbers}) == kind


def test_the_limits_are_those_of_the_extremes():
    """One meaning of `accurate` in the package: tests/helpers/extremes.py judges by the same numbers."""
    assert (stability_study.PLACE, stability_study.STRETCH) == (PLACE, STRETCH)


def quiet(line: str) -> None:
    """Say nothing."""


def test_without_slip_nodes_half_a_cell_apart_lock_and_with_it_they_do_not(tmp_path):
    axes = [axis("fluid.slip=0,0.01"), axis("fluid.cells=[16,16,16],[32,32,32]")]
    result = stability_study.stability(WAVE, axes, tmp_path, log=quiet)
    kinds = {(one.setting.values["fluid.slip"], one.setting.values["fluid.cells"]): one for one in result.cells}
    locked = kinds["0", "[16,16,16]"]
    assert (locked.kind, locked.predicted) == ("locked", "locked")
    for key in (("0", "[32,32,32]"), ("0.01", "[16,16,16]"), ("0.01", "[32,32,32]")):
        assert (kinds[key].kind, kinds[key].predicted) == ("stable", ""), key
    assert result.foretold == 4


def test_too_long_a_step_is_wrong_and_that_is_predicted(tmp_path):
    """Steps of 2 and of 0.2 radians of the wave, taken whole, as outputs are further apart."""
    two = ["fluid.model=rft", "time.end=1.2", "output.every=0.6"]
    result = stability_study.stability(WAVE, [axis("time.step=0.2,0.02")], tmp_path, two, log=quiet)
    assert [(one.kind, one.predicted) for one in result.cells] == [("wrong", "wrong"), ("stable", "")]
    assert result.foretold == 2


FLUTTERS = """
[filament.rod]
length = 1.0
nodes = 9
bending = 1.0
stretching = 2e4
anchor = "start"
direction = [1, 0, 0]
shape = { kind = "straight", perturb = ["0", "0", "0.01*s**2"] }
start = { end = "clamped" }
finish = { follower = -45.0 }
[fluid]
model = "rft"
viscosity = 1.0
drag = "paper"
[time]
end = 1.2
step = 0.01
[output]
every = 0.1
"""


def test_growth_that_a_scheme_hides_or_makes_up_is_foretold_from_the_spectrum(tmp_path):
    """A rod that flutters: no step here is long by the time scales of the case, which has nothing that drives."""
    axes = [
        axis("time.scheme=implicit,implicit,semi-implicit&time.order=2,1,1"),
        axis("time.step=0.005,0.05"),
    ]
    result = stability_study.stability(FLUTTERS, axes, tmp_path, log=quiet)
    assert [(one.kind == "stable", one.predicted) for one in result.cells] == [
        (True, ""),
        *[(False, "wrong")] * 5,
    ]
    assert result.foretold == 6
    grows, hidden = result.cells[0].why, result.cells[3].why
    assert re.fullmatch(r"growth \d\.\d+ at rest, \d\.\d+ by the step", grows)
    assert re.fullmatch(r"growth \d\.\d+ at rest, -\d\.\d+ by the step", hidden)
    less = ["filament.rod.finish.follower=-5", "time.step=0.05"]
    decays = stability_study.stability(FLUTTERS, axes[:1], tmp_path / "b", less, log=quiet)
    assert [(one.kind, one.predicted) for one in decays.cells] == [("stable", "")] * 3


def test_the_prediction_is_that_of_ibfil_modes(tmp_path):
    """The growth at rest and the one that a step shows are the numbers of `ibfil modes`."""
    from ibfil.studies.modes.study import modes

    result = stability_study.stability(FLUTTERS, [axis("time.step=0.05")], tmp_path, log=quiet)
    leads = modes(FLUTTERS, None, ["time.step=0.05"], count=1, log=quiet).modes[0]
    told = [float(word) for word in re.findall(r"-?\d+\.\d+", result.cells[0].why)]
    assert told == pytest.approx([leads.value.real, leads.seen["order 2"].real], abs=2e-3)


def test_the_explicit_scheme_ends_where_it_is_predicted_to(here, capsys):
    """2/rho(M K), which another number of nodes has elsewhere: 0.8 of it is stable, 1.3 of it diverges.

    At f of the limit the stiffest motion grows by 2 f - 1 a step: at 1.3, in the 37 steps (0.02/1.3 limits of 9 nodes;
    196 of 13) by 4e7 at least, from what a bent rod with free ends has of it to begin with; below 1 it decays.
    """
    explicit = ["time.scheme=explicit", "time.order=1", "time.end=0.02"]
    vary = ["--vary", "filament.rod.nodes=9,13", "--vary", "time.step=LIMIT", "-o", "out"]
    from ibfil.case.reading import read_case
    from ibfil.simulation.simulation import Simulation

    limits = [
        Simulation(read_case("bent.toml", [*explicit, f"filament.rod.nodes={n}"])).explicit_limit() for n in (9, 13)
    ]
    steps = f"{1.3 * limits[0]:.6g},{0.8 * limits[0]:.6g},{1.3 * limits[1]:.6g},{0.8 * limits[1]:.6g}"
    vary[3] = f"time.step={steps}"
    assert main.main(["stability", "bent.toml", *explicit, *vary]) == 0
    assert "8 of 8 as predicted" in capsys.readouterr().out
    with open("out/stability.csv", newline="") as file:
        kinds = [row["class"] for row in csv.DictReader(file)]
    assert kinds == ["diverged", "stable", "stable", "stable", "diverged", "diverged", "diverged", "stable"]
    message = json.loads((here / "out/stability.json").read_text())
    assert message["limits"]["stretch"] == 0.02
    assert message["machine"]
    assert (here / "out/stability.png").read_bytes().startswith(b"\x89PNG")
    runs, finer = ({path.name for path in (here / "out" / of).glob("*.h5")} for of in ("runs", "finer"))
    assert len(finer) == 2  # explicit steps share the finer run of their nodes
    assert finer < runs  # and its name is that of the first


def test_what_cannot_be_judged_is_refused_or_told(tmp_path):
    with pytest.raises(CaseError, match="thermal noise"):
        stability_study.stability(BENT + "\n[thermal]\nenergy = 1e-3\n", [axis("time.step=1e-3")], tmp_path, log=quiet)
    result = stability_study.stability(BENT, [axis("filament.rod.nodes=9,2")], tmp_path, log=quiet)
    assert [one.kind for one in result.cells] == ["stable", "diverged"]
    assert "nodes" in result.cells[1].message
