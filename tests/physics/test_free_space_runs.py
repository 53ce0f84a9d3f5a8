"""Runs in free space: known speeds, the periodic box as it grows, neighbours far away, resumed runs, recorded flows."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.cut import assert_same_bits
from helpers.ring_cylinder import drag
from helpers.scenes import RIBBON, scene
from helpers.swimmer import IN_FREE_SPACE, swims

import ibfil
from ibfil import parse_case
from ibfil.simulation.simulation import Simulation

FREE: Mapping[str, Any] = {"model": "stokes", "box": "free", "spacing": 0.025}
WAVING = {
    "length": 1.0,
    "nodes": 21,
    "bending": 1.0,
    "stretching": 400.0,
    "curvature": ["8*sin(4*pi*s - 10*t)", 0],
    "shape": {"kind": "relaxed"},
}


def in_box(side: float) -> tuple[str, ...]:
    return f"fluid.box={[side] * 3}", f"fluid.cells={[round(side / 0.025)] * 3}"


def test_the_swimmer_of_the_paper_without_its_images():
    """Independent code with this slip, a hundredth of a period a step."""
    assert swims(*IN_FREE_SPACE) == pytest.approx(-0.043777, abs=2e-6)
    assert swims(*in_box(1.6)) == pytest.approx(-0.044338, abs=1e-5)


@pytest.mark.slow
def test_boxes_go_to_free_space_as_the_cube_of_their_side():
    assert swims(*IN_FREE_SPACE, "time.step=2*pi/10/200") == pytest.approx(-0.043690, abs=1e-5)
    free, speeds = swims(*IN_FREE_SPACE), {side: swims(*in_box(side)) for side in (2.4, 3.2, 4.8, 6.4)}
    assert list(speeds.values()) == pytest.approx([-0.043930, -0.043841, -0.043796, -0.043785], abs=1e-5)
    assert (8 * speeds[6.4] - speeds[3.2]) / 7 == pytest.approx(free, abs=1e-6)


def shapes_after(method: str, fluid: Mapping[str, Any] = FREE, rod: Mapping[str, Any] = WAVING) -> np.ndarray:
    case = scene(
        {"rod": rod, "other": {**rod, "position": [0.2, 0.4, 0.1]}}, {**fluid, "method": method}, end=0.06, step=0.02
    )
    simulation = Simulation(case)
    simulation.advance(0.06, lambda: None)
    return simulation.configuration.r


@pytest.mark.parametrize("twisting", [False, True], ids=["forces", "torques"])
def test_three_ways_make_one_run(twisting):
    fluid = {**FREE, "spacing": 0.05, **({"rotation": "grid"} if twisting else {})}
    rod = {key: value for key, value in RIBBON.items() if key != "start"} if twisting else WAVING
    table = shapes_after("table", fluid, rod)
    assert np.abs(shapes_after("fft", fluid, rod) - table).max() < 1e-9
    assert np.abs(shapes_after("krylov", fluid, rod) - table).max() < 1e-5


def test_where_a_rod_is_does_not_matter():
    """A thousand cells away, by whole cells: the same but for rounding; a box would have it among its images."""
    fluid = {**FREE, "spacing": 0.05}
    here = Simulation(scene({"rod": WAVING}, fluid, end=0.04, step=0.02))
    there = Simulation(scene({"rod": {**WAVING, "position": [50.0, -50.0, 100.0]}}, fluid, end=0.04, step=0.02))
    for one in (here, there):
        one.advance(0.04, lambda: None)
    assert np.abs(there.configuration.r - here.configuration.r - [50.0, -50.0, 100.0]).max() < 1e-11


def test_a_rod_far_away_is_carried_by_oseens_flow():
    """A force 40 lengths away: F (1 + n n)/(8 pi eta r) carries a rod that nothing else moves."""
    pulled = {"length": 1.0, "nodes": 9, "bending": 1.0, "stretching": 400.0, "loads": {"weight": [0.0, 0.0, -2.0]}}
    idle = {"length": 1.0, "nodes": 9, "bending": 1.0, "stretching": 400.0, "position": [24.0, 0.0, 32.0]}
    case = scene({"pulled": pulled, "idle": idle}, {**FREE, "spacing": 0.125}, viscosity=0.7, end=0.02, step=0.01)
    simulation = Simulation(case)
    simulation.advance(0.02, lambda: None)
    moved = simulation.snapshot().filaments["idle"].velocity.mean(axis=0)
    n = np.array([0.6, 0.0, 0.8])
    expected = -2.0 * (np.array([0.0, 0.0, 1.0]) + n * n[2]) / (8 * np.pi * 0.7 * 40.0)
    assert moved == pytest.approx(expected, abs=2e-3 * np.linalg.norm(expected))


@pytest.mark.parametrize("along", [False, True], ids=["across", "along"])
def test_a_rod_sinks_as_a_cylinder_and_much_faster_than_in_a_box(along):
    rod = {"length": 1.0, "nodes": 65, "bending": 10.0, "stretching": 4000.0, "loads": {"weight": [0, 0, -1.0]}}
    rod |= {"direction": [0, 0, 1], "normal": [1, 0, 0]} if along else {}
    h, speeds = 1 / 64, []
    for fluid in (
        {**FREE, "spacing": h, "slip": 0.0},
        {"model": "stokes", "box": [3, 3, 3], "cells": [192] * 3, "slip": 0.0},
    ):
        simulation = Simulation(scene({"rod": rod}, fluid, end=0.002, step=0.001))
        simulation.advance(0.002, lambda: None)
        speeds.append(-np.trapezoid(simulation.snapshot().filaments["rod"].velocity[:, 2], simulation.arclength))
        told = [one for one in simulation.model.fluid_model.warnings(simulation) if "net force" in one]
        assert bool(told) == (fluid["box"] != "free")
    length = 1 + (3.1 if along else 2.5) * h
    assert speeds[0] == pytest.approx(1 / drag(length, 1.1057 * h, along), rel=1e-2)
    assert speeds[1] == pytest.approx(speeds[0] - 2.837297 / (6 * np.pi * 3), rel=0.02)
    assert f"slows the rods by about {2.837297 / (18 * np.pi):.3g}" in told[0]


@pytest.mark.parametrize("method", ["table", "fft", "krylov"])
def test_a_run_goes_on_with_the_same_bits(method):
    fluid = {**FREE, "spacing": 0.05, "method": method}
    made = scene({"a": WAVING, "b": {**WAVING, "position": [0.1, 0.3, 0.0]}}, fluid, end=0.1, step=0.01)
    assert_same_bits(made, 0.05, 0.1)


RECORDED = """
[filament.rod]
length = 1.0
nodes = 9
bending = 1.0
stretching = 100
curvature = ["8*sin(4*pi*s - 10*t)", 0]
{rod}
[fluid]
model = "stokes"
viscosity = 0.7
box = "free"
spacing = 0.125
flow = ["0.3", "x", 0]
{fluid}
[time]
end = 0.04
step = 0.02
[output]
every = 0.02
grid_every = 0.04
window = [1.0, 0.75, 0.5]
window_at = [0.1, 0.3, 0.2]
probes = [[0.1, 0.2, 0.3], [40.0, 0.0, 0.0]]
[observe.heat]
kind = "dissipation"
"""


@pytest.mark.parametrize("stirs", [False, True], ids=["forces", "torques"])
def test_a_recorded_run_knows_its_flow(tmp_path: Path, stirs):
    """The flow of recorded forces is that of the probes; the window's field is the flow at its points."""
    rod = "twisting = 1.0\nradius = 0.05\ntwist_rate = 3" if stirs else ""
    text = RECORDED.format(rod=rod, fluid='rotation = "grid"' if stirs else "")
    (tmp_path / "case.toml").write_text(text)
    ibfil.run(tmp_path / "case.toml", tmp_path / "run.h5", progress=False, log=lambda line: None)
    with ibfil.open(tmp_path / "run.h5") as run:
        probes = np.array(parse_case(text, "t").output.probes)
        for time in run.time:
            recorded = run.diagnostics["probe_velocity"][run.output_at(time)]
            assert run.velocity_at(probes, time) == pytest.approx(recorded, abs=1e-12)
        grid = run.grid
        assert grid.fields["velocity"].shape == (2, 8, 6, 4, 3)
        middle = grid.origin + grid.spacing * (np.array([8, 6, 4]) // 2)
        assert middle == pytest.approx([0.125, 0.25, 0.25])  # the point nearest to window_at
        power = np.asarray(run.diagnostics["grid_power"])
        assert np.array_equal(power, run.diagnostics["flow_dissipation"])
        assert np.all(power > 0)


def test_a_field_smoothed_by_the_kernel_is_the_flow_there(tmp_path: Path):
    """J of the window's field, at points well inside it, is what ``velocity_at`` says."""
    from ibfil.grid.kernels import KERNELS

    (tmp_path / "case.toml").write_text(
        RECORDED.format(rod="", fluid="").replace("[1.0, 0.75, 0.5]", "[1.5, 1.5, 1.5]")
    )
    ibfil.run(tmp_path / "case.toml", tmp_path / "run.h5", progress=False, log=lambda line: None)
    with ibfil.open(tmp_path / "run.h5") as run:
        grid, points = run.grid, np.random.default_rng(0).uniform(-0.2, 0.5, (9, 3))
        base, weights = KERNELS["peskin4"].stencil((points - grid.origin) / grid.spacing)
        field = np.asarray(grid.fields["velocity"][-1], float)
        got = np.zeros((9, 3))
        for q in range(9):
            cut = field[tuple(slice(b, b + 4) for b in base[q])]
            got[q] = np.einsum("ijkc,i,j,k->c", cut, *weights[q])
        assert run.velocity_at(points) == pytest.approx(got, abs=2e-6 * np.abs(got).max())
