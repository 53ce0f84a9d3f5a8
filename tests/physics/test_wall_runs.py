"""Runs above a wall: the swimmer, what a rod pumps, ways to the same run, resumed runs, recorded flows, faults."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.cut import assert_same_bits
from helpers.scenes import scene
from helpers.swimmer import IN_FREE_SPACE, swims

import ibfil
from ibfil.case.reading import parse_case
from ibfil.check.report import report
from ibfil.errors import CaseError, RunFailed
from ibfil.simulation.simulation import Simulation
from ibfil.studies.compare.fluids import fluid_overrides

WALL: Mapping[str, Any] = {"model": "stokes", "box": "free", "spacing": 0.05, "wall": "no-slip"}
WAVING = {
    "length": 1.0,
    "nodes": 21,
    "bending": 1.0,
    "stretching": 400.0,
    "curvature": ["8*sin(4*pi*s - 10*t)", 0],
    "shape": {"kind": "relaxed"},
    "position": [0.0, 0.0, 0.2],
}


def at_height(height: float) -> float:
    return swims(*IN_FREE_SPACE, "fluid.wall=no-slip", f"filament.swimmer.position=[0, 0, {height}]")


def test_the_swimmer_near_a_wall_is_faster():
    """Independent code with this slip, a hundredth of a period a step; -0.043777 without the wall."""
    assert at_height(0.1) == pytest.approx(-0.050794, abs=1e-5)


@pytest.mark.slow
def test_the_nearer_the_wall_the_faster():
    heights = (1, 0.5, 0.25, 0.15, 0.075, 0.05)
    known = [-0.043814, -0.043938, -0.044482, -0.046674, -0.054592, -0.058924]
    assert [at_height(height) for height in heights] == pytest.approx(known, abs=1e-5)


def shapes_after(method: str, wall: str) -> np.ndarray:
    rods = {"rod": WAVING, "other": {**WAVING, "position": [0.2, 0.4, 0.4]}}
    simulation = Simulation(scene(rods, {**WALL, "method": method, "wall": wall}, end=0.06, step=0.02))
    simulation.advance(0.06, lambda: None)
    return simulation.configuration.r


@pytest.mark.parametrize("wall", ["no-slip", "free-slip"])
def test_three_ways_make_one_run(wall):
    table = shapes_after("table", wall)
    assert np.abs(shapes_after("fft", wall) - table).max() < 1e-9
    assert np.abs(shapes_after("krylov", wall) - table).max() < 1e-5


@pytest.mark.parametrize("method", ["table", "fft", "krylov"])
def test_a_run_goes_on_with_the_same_bits(method):
    made = scene({"a": WAVING}, {**WALL, "method": method}, end=0.06, step=0.01)
    assert_same_bits(made, 0.03, 0.06)


def test_three_thousand_cells_above_the_wall_is_free_space():
    moved = []
    for fluid in (
        {**WALL, "wall": "no-slip"},
        {**WALL, "wall": "free-slip"},
        {k: v for k, v in WALL.items() if k != "wall"},
    ):
        simulation = Simulation(scene({"a": {**WAVING, "position": [0, 0, 150.0]}}, fluid, end=0.02, step=0.01))
        simulation.advance(0.02, lambda: None)
        moved.append(simulation.configuration.r)
    assert np.abs(moved[0] - moved[2]).max() < 1e-8
    assert np.abs(moved[1] - moved[2]).max() < 1e-8


PULLED = """
[filament.rod]
length = 1.0
nodes = 21
bending = 10.0
stretching = 1000
position = [0, 0, 0.5]
loads = { weight = [3.0, 2.0, -1.0] }
[fluid]
model = "stokes"
viscosity = 0.7
box = "free"
spacing = 0.05
wall = "no-slip"
[time]
end = 0.004
step = 0.002
[output]
every = 0.002
grid_every = 0.004
window = [2.0, 1.0, 1.0]
probes = [[0.1, 0.2, 0.3], [40.0, 0.0, 2.0], [0.3, 0.1, 0.0]]
[observe.along]
kind = "flux"
[observe.across]
kind = "flux"
along = [0, 2, 0]
[observe.heat]
kind = "dissipation"
"""


def test_a_pulled_rod_pumps_its_force_times_its_height(tmp_path: Path):
    """Q = F z/(pi eta); the flow at any point is that of the recorded forces, zero on the wall, and the window's."""
    (tmp_path / "case.toml").write_text(PULLED)
    result = ibfil.run(tmp_path / "case.toml", tmp_path / "run.h5", progress=False, log=lambda line: None)
    moved = result.snapshot.filaments["rod"].position[:, 2].mean()
    assert result.summaries["along"].value == pytest.approx(3 * moved / (np.pi * 0.7), rel=1e-3)
    assert result.summaries["across"].value == pytest.approx(2 * moved / (np.pi * 0.7), rel=1e-3)
    with ibfil.open(tmp_path / "run.h5") as run:
        probes = np.array(parse_case(PULLED, "t").output.probes)
        for time in run.time:
            recorded = run.diagnostics["probe_velocity"][run.output_at(time)]
            assert run.velocity_at(probes, time) == pytest.approx(recorded, abs=1e-12)
            assert not recorded[2].any()
        grid = run.grid
        assert grid.origin[2] == 0.0
        assert grid.fields["velocity"].shape == (2, 40, 20, 20, 3)
        assert not grid.fields["velocity"][-1][:, :, 0].any()
        points = np.random.default_rng(0).uniform([-0.5, -0.3, 0.01], [0.5, 0.3, 0.7], (9, 3))
        simulation = Simulation(run.case)
        base, weights = simulation.model.fluid_model.space.stencil(simulation.model.fluid_model.kernel, points)
        base = base - np.rint(grid.origin / grid.spacing).astype(int)
        field = np.asarray(grid.fields["velocity"][-1], float)
        got = [
            np.einsum("ijkc,i,j,k->c", field[tuple(slice(b, b + 4) for b in base[q])], *weights[q]) for q in range(9)
        ]
        assert run.velocity_at(points) == pytest.approx(np.array(got), abs=2e-6 * np.abs(got).max())
        assert np.array_equal(run.diagnostics["grid_power"], run.diagnostics["flow_dissipation"])


def test_what_is_told_of_a_wall():
    told = report(parse_case(PULLED.replace("[fluid]", "[fluid]\nflow = ['1', 0, 0]"), "t"))
    assert "Stokes flow above a no-slip wall at z = 0" in told
    assert "fluid.flow: is not zero on the wall" in told
    assert "is not zero" not in report(parse_case(PULLED.replace("[fluid]", "[fluid]\nflow = ['z', 0, 0]"), "t"))
    low = report(parse_case(PULLED.replace("position = [0, 0, 0.5]", "position = [0, 0, 0.03]"), "t"))
    assert "filament.rod: begins 0.03 above the wall" in low
    rft = report(parse_case(PULLED, "t", ["fluid.model=rft"]))
    assert "the wall: drag is the same at any height" in rft


def test_a_start_below_the_wall_and_an_end_held_on_it_without_slip_are_faults():
    below = scene({"rod": {**WAVING, "position": [0, 0, -0.01]}}, WALL)
    with pytest.raises(
        CaseError, match=r"filament.rod.position: found node \d+ at z = -0.01, below the wall; allowed: z >= 0"
    ):
        Simulation(below)
    standing = {"length": 1.0, "nodes": 21, "bending": 1.0, "stretching": 400.0, "anchor": "start"}
    standing |= {"direction": [0, 0, 1], "normal": [1, 0, 0], "start": {"end": "clamped"}}
    Simulation(scene({"rod": standing}, WALL))
    with pytest.raises(
        CaseError, match=r"fluid.slip: found 0 and filament.rod.start held on the wall.*allowed: slip > 0"
    ):
        Simulation(scene({"rod": standing}, {**WALL, "slip": 0.0}))
    Simulation(scene({"rod": standing}, {**WALL, "wall": "free-slip", "slip": 0.0}))


def test_a_rod_that_is_pressed_on_the_wall_stops_the_run_and_says_where():
    rod = {**WAVING, "curvature": [0, 0], "shape": {"kind": "straight"}, "position": [0, 0, 0.02]}
    rod |= {"start": {"end": "hinged", "moves": [0, 0, "-t"]}}
    simulation = Simulation(scene({"rod": rod}, WALL, end=1.0, step=0.01))
    with pytest.raises(RunFailed, match="a node went through the wall") as failed:
        simulation.advance(1.0, lambda: None)
    assert (failed.value.filament, failed.value.node) == ("rod", 0)
    assert failed.value.time == pytest.approx(0.02, abs=1e-3)
    assert simulation.configuration.r[:, 2].min() > -1e-6


def test_compared_fluids_keep_the_wall_or_do_without():
    walled = parse_case(PULLED + "[expect.q]\nobserve = 'along'\nvalue = 1\n", "t")
    text = walled.text
    for name, wall in (("wall", "no-slip"), ("free", None), ("stokes", None), ("rft", "no-slip")):
        case = parse_case(text, "t", fluid_overrides(name, walled))
        assert (case.fluid.wall, case.fluid.kind) == (wall, name)
        assert ("along" in case.observe) == (wall is not None)
    with pytest.raises(CaseError, match=r"--fluids: found wall, and no fluid.wall in the case"):
        fluid_overrides("wall", parse_case(text, "t", fluid_overrides("free", walled)))


def test_drag_that_is_matched_is_that_far_from_the_wall():
    """Resistive-force theory knows no height: the pair is that of free space, bit for bit, and told."""
    from ibfil.assembly.drag import matching

    fluid = {**WALL, "model": "rft", "drag": {"matched": 0.5}}
    cases = [scene({"rod": WAVING}, one) for one in (fluid, {k: v for k, v in fluid.items() if k != "wall"})]
    near, far = (matching(case, case.filaments["rod"]) for case in cases)
    assert near == far
    assert near is not None
    assert near.perp > near.par > 0
    assert "the wall: drag is the same at any height" in report(cases[0])


def test_a_trade_above_a_wall_has_the_order_of_its_steps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import csv

    from ibfil.commands import main

    monkeypatch.chdir(tmp_path)
    Path("wall.toml").write_text(
        scene({"rod": {**WAVING, "nodes": 11}}, {**WALL, "spacing": 0.1}, end=0.2, step=0.01).text
    )
    steps = ["0.02", "0.005"]
    assert main.main(["trade", "wall.toml", "time.order=1", "--vary", f"time.step={','.join(steps)}", "-o", "out"]) == 0
    with open("out/trade.csv", newline="") as file:
        errors = {row["time.step"]: float(row["position"]) for row in csv.DictReader(file)}
    assert np.log(errors["0.02"] / errors["0.005"]) / np.log(4) == pytest.approx(1.0, abs=0.25)
