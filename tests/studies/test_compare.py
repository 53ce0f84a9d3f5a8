"""`ibfil compare`: one scene under several fluids; quantities over whole periods and their scatter."""

from __future__ import annotations

import csv
import json
import re

import numpy as np
import pytest

from ibfil.case.reading import parse_case
from ibfil.commands import main
from ibfil.errors import CaseError, RunFailed
from ibfil.io.reader import RunFile
from ibfil.studies.compare.fluids import fluid_overrides, known_fluids
from ibfil.studies.compare.quantities import Window, quantities, quantity
from ibfil.studies.compare.study import choose_window, compare
from ibfil.studies.member import Member
from ibfil.studies.members import run_members
from ibfil.studies.uncertainty.study import uncertainty

SWIMMER = """
title = "A small swimmer"
[filament.rod]
length = 1.0
nodes = 13
bending = 1.0
stretching = 100.0
curvature = ["4*sin(2*pi*s - 10*t)", 0]
shape = { kind = "relaxed" }
[fluid]
model = "stokes"
viscosity = 1.0
density = 1.0
box = [2.0, 2.0, 2.0]
cells = [24, 24, 24]
[time]
end = "4*pi/10"
step = "pi/100"
[output]
every = "pi/100"
"""


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compare")
    fluids = ("rft", "matched", "stokes", "navier-stokes", "free")
    return compare(SWIMMER, fluids, folder, log=lambda line: None), folder


def test_every_fluid_of_the_schema_can_be_asked_for():
    assert known_fluids() == ("rft", "matched", "slender", "free", "wall", "stokes", "navier-stokes")
    case = parse_case(SWIMMER, "s")
    assert fluid_overrides("matched", case) == ("fluid.model=rft", "fluid.drag={matched=1.0}")
    own = parse_case(SWIMMER, "s", ["fluid.drag={matched=2.0}"])
    assert fluid_overrides("matched", own) == ("fluid.model=rft",)
    assert fluid_overrides("rft", own) == ("fluid.model=rft", "fluid.drag=auto")
    assert fluid_overrides("rft", case) == ("fluid.model=rft",)


def test_between_a_box_and_free_space_the_spacing_is_kept():
    boxed = parse_case(SWIMMER, "s", ["output.grid_every=1"])
    free = parse_case(SWIMMER, "s", ["output.grid_every=1", *fluid_overrides("free", boxed)])
    assert (free.fluid.box, free.fluid.cells, free.fluid.spacing) == ("free", None, 2.0 / 24)
    assert free.output.window == (2.0, 2.0, 2.0)
    assert fluid_overrides("free", free) == ("fluid.model=stokes",)
    back = parse_case(SWIMMER, "s", [*fluid_overrides("free", boxed), *fluid_overrides("navier-stokes", free)])
    assert back.fluid.cells == (36, 36, 36)  # three times its length, and the spacing again
    assert back.fluid.box == pytest.approx((3.0, 3.0, 3.0))
    assert back.fluid.spacing is None
    assert back.output.window is None


def test_the_table_has_a_column_a_fluid_and_both_sides_of_the_power(result):
    comparison, folder = result
    by = {column.fluid: column.numbers for column in comparison.columns}
    assert comparison.window.count == 1
    assert comparison.window.period == pytest.approx(2 * np.pi / 10, rel=1e-4)
    assert by["stokes"]["both sides differ by, at most"].value < 1e-10
    lost = by["stokes"]["lost between nodes and grid, a share"].value
    assert 0 < lost < 0.2  # far from all; the number: test_dissipation.py
    inertial = {key: one.value for key, one in by["navier-stokes"].items()}
    assert "both sides differ by, at most" not in inertial  # one side is not the other while the fluid speeds up
    moving = inertial["power upon the grid"] - inertial["dissipated by the fluid"]
    assert inertial["of that into the fluid's motion"] == pytest.approx(moving)
    assert by["rft"]["dissipated by the fluid"].value == pytest.approx(by["rft"]["power of the nodes"].value)
    turning = [numbers["frequency (angular)"].value for numbers in by.values() if "frequency (angular)" in numbers]
    assert turning
    assert turning == pytest.approx([10.0] * len(turning), rel=1e-2)  # the wave's; the fit's window is one period
    for fluid in by:
        assert by[fluid]["speed"].value > 0
        assert by[fluid]["wall time a unit of time"].value > 0
    # Images a box of two lengths away change the speed of a swimmer by no more than some per cent.
    assert 0 < abs(by["free"]["speed"].value / by["stokes"]["speed"].value - 1) < 0.1
    assert "distance from the first, rms/L" not in by["rft"]
    assert (
        by["stokes"]["distance from the first, rms/L"].value > by["stokes"]["the same without rigid motion"].value > 0
    )
    # Little inertia: nearer to Stokes than resistive-force theory is.
    near = abs(by["navier-stokes"]["speed"].value - by["stokes"]["speed"].value)
    assert near < abs(by["rft"]["speed"].value - by["stokes"]["speed"].value)
    with open(folder / "compare.csv", newline="") as file:
        rows = {row["quantity"]: row for row in csv.DictReader(file)}
    assert float(rows["speed"]["matched"]) == by["matched"]["speed"].value
    message = json.loads((folder / "compare.json").read_text())
    assert [one["fluid"] for one in message["fluids"]] == list(by)
    assert message["machine"]
    assert (folder / "compare.png").read_bytes().startswith(b"\x89PNG")


def test_it_says_what_each_fluid_models_alone_and_what_that_takes(result):
    comparison, _ = result
    own = {column.fluid: column.own for column in comparison.columns}
    assert any("inertia" in line for line in own["navier-stokes"])
    assert not any("inertia" in line for line in own["stokes"])
    assert any("hydrodynamic interaction" in line for line in own["stokes"])
    assert any("straight rod of length 1" in line for line in own["matched"])
    assert not any("filament rod" in line for lines in own.values() for line in lines)
    shares = {column.fluid: " ".join(column.shares) for column in comparison.columns}
    assert "inertia and advection" in shares["navier-stokes"]
    assert "flow between nodes" not in shares["rft"]


class Moved:
    """A run as far as `quantities` looks at it: a circle of radius 0.3 that turns at rate 5 and drifts."""

    def __init__(self, drift: np.ndarray) -> None:
        self.case = parse_case(SWIMMER, "s")
        self.time = np.linspace(0.0, 4 * np.pi / 5, 401)
        s = np.linspace(0.0, 1.0, 13)
        turn = 5 * self.time[:, None]
        around = np.stack([0 * turn, np.cos(turn), np.sin(turn)], axis=-1) * (0.3 * (s**2 - 1 / 3))[None, :, None]
        position = around + (self.time[:, None] * drift)[:, None, :] + s[None, :, None] * [1, 0, 0]
        n = len(self.time)
        columns = {
            "position": position,
            "force": np.ones((n, 13, 3)),
            "velocity": np.full((n, 13, 3), 0.5),
            "reaction_start": np.column_stack([np.cos(5 * self.time) ** 2, 0 * self.time, 0 * self.time]),
        }
        self.filaments = {"rod": columns}
        self.diagnostics = {"power": np.sin(5 * self.time) ** 2, "dissipation": np.full(n, 0.25)}
        self.arclength = {"rod": s}.__getitem__


def test_means_are_over_whole_periods_and_exact():
    run = Moved(np.array([0.0, 0.3, 0.4]))
    window = Window(run.time[-1], 2 * np.pi / 5, 2)
    found = quantities(run, window)
    assert found["speed"].value == pytest.approx(0.5, rel=1e-12)
    assert found["speed"].error == pytest.approx(0.0, abs=1e-12)
    assert found["velocity z"].value == pytest.approx(0.4, rel=1e-12)
    assert found["reaction at start x"].value == pytest.approx(0.5, rel=1e-6)
    assert found["power of the nodes"].value == pytest.approx(0.5, rel=1e-6)
    assert found["dissipated by the fluid"].value == pytest.approx(0.25)
    assert found["frequency (angular)"].value == pytest.approx(5.0, rel=1e-3)
    assert "Lighthill efficiency" not in found  # it is held


def test_the_error_is_the_standard_error_of_the_periods():
    found = quantity(np.array([1.0, 2.0, 3.0, 6.0]), "1")
    assert found.value == 3.0
    assert found.error == pytest.approx(np.std([1, 2, 3, 6], ddof=1) / 2)
    assert quantity(np.array([1.0]), "1").error is None


def test_the_window_leaves_the_transient_out_and_counts_whole_periods():
    case = parse_case(SWIMMER, "s")
    period = 2 * np.pi / 10
    window = choose_window(case, 10.3 * period, None, None)
    assert window.count == 6  # of 10.3 a third is left out
    assert window.end == 10.3 * period
    assert choose_window(case, 10.3 * period, None, 2.0 * period).count == 8
    assert choose_window(case, 9.0, 2.0, 1.0) == Window(9.0, 2.0, 4)
    with pytest.raises(CaseError, match=r"time\.end"):
        choose_window(case, 1.5 * period, None, None)
    still = parse_case(SWIMMER.replace(" - 10*t", ""), "s")
    assert choose_window(still, 8.0, None, None) == Window(8.0, 1.0, 4, "nothing drives in time")


def test_a_fluid_that_fails_is_told_and_the_others_are_compared(tmp_path, monkeypatch, environment, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(SWIMMER.replace("density = 1.0", ""))
    assert main.main(["compare", "s.toml", "--fluids", "rft,slender,navier-stokes", "-o", "out"]) == 1
    out = capsys.readouterr().out
    assert "density" in out
    assert "rft" in out
    assert "Traceback" not in out


@pytest.mark.parametrize("fluids", [("rft",), ("rft", "rft"), ("rft", "honey")])
def test_what_cannot_be_compared_is_refused(tmp_path, fluids):
    with pytest.raises(CaseError, match="--fluids"):
        compare(SWIMMER, fluids, tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_where_no_run_ends_there_is_nothing_to_compare(tmp_path):
    wild = ["time.scheme=explicit", "time.step=0.01", "filament.rod.stretching=1e7"]
    with pytest.raises(RunFailed, match="no fluid's run came to an end"):
        compare(SWIMMER, ("rft", "stokes"), tmp_path, wild, log=lambda line: None)


SWIM = '[observe.swim]\nkind = "drift"\nat = "centroid"\nalong = [1, 0, 0]\n'
LONGER = (
    SWIMMER.replace('end = "4*pi/10"', 'end = "6*pi/10"').replace("bending = 1.0", "bending = 1.0\nradius = 0.02")
    + SWIM
)


def sources_are_those_of_uncertainty(column, case, folder, *overrides):
    """Step, nodes and place have the estimates of `ibfil uncertainty` of the same number."""
    (other,) = uncertainty(case, folder, overrides, log=quiet).bars
    found = column.numbers["observed: swim"]
    assert found.value == other.value
    for mine in found.sources:
        assert mine.estimate == next(one.estimate for one in other.sources if one.name == mine.name)
    return {one.name for one in found.sources}


def test_bars_of_rows_are_those_of_uncertainty_and_cover_a_run_much_finer(tmp_path, capsys):
    path = tmp_path / "s.toml"
    path.write_text(LONGER)
    whole = compare(str(path), ("rft", "slender"), tmp_path / "both", bars=True, log=quiet)
    rft = whole.columns[0].numbers
    names = sources_are_those_of_uncertainty(whole.columns[0], LONGER, tmp_path / "rft", "fluid.model=rft")
    assert names == {"step", "nodes"} == {one.name for one in rft["speed"].sources}
    finer = ("fluid.model=rft", "time.step=pi/800", "filament.rod.nodes=97")
    outcome = run_members([Member("fine", LONGER, finer)], tmp_path, log=quiet)[0]
    with RunFile(outcome.path) as run:
        fine = quantities(run, whole.window)
    for key in ("speed", "velocity x", "power of the nodes"):
        assert abs(rft[key].value - fine[key].value) < rft[key].bar
        assert rft[key].bar < 5 * abs(rft[key].value - fine[key].value)
    with (tmp_path / "both" / "compare.csv").open(newline="") as file:
        rows = {row["quantity"]: row for row in csv.DictReader(file)}
    assert float(rows["speed"]["rft bar"]) == rft["speed"].bar
    assert rows["steps"]["rft bar"] == ""
    command = ["compare", str(path), "--fluids", "rft,slender", "-o", str(tmp_path / "both"), "--bars"]
    assert main.main(command) == 0  # nothing is run again
    out = capsys.readouterr().out
    assert "+- the bar of step, nodes and place in a cell" in out
    assert "distance from the first, rms/L" in out
    assert re.search(r"the same without rigid motion +- +[\d.e-]+ \(scatter ", out)  # no bar, of what is of two runs
    assert (tmp_path / "both" / "compare.png").stat().st_size > 10_000
    hot = ["thermal.energy=1e-6", "thermal.seed=1", "filament.rod.curvature=[0, 0]"]
    assert main.main([*command, *hot]) == 2
    assert "[thermal]: found thermal noise; allowed: none with --bars" in capsys.readouterr().err


@pytest.mark.slow
def test_bars_of_rows_on_a_grid_have_the_place_in_a_cell(tmp_path):
    whole = compare(LONGER, ("stokes", "rft"), tmp_path / "both", bars=True, log=quiet)
    names = sources_are_those_of_uncertainty(whole.columns[0], LONGER, tmp_path / "stokes")
    assert (
        names == {"step", "nodes", "place in a cell"} == {one.name for one in whole.columns[0].numbers["speed"].sources}
    )


def quiet(line):
    """Say nothing."""
