"""Runs with rotation = "grid": orders, the ways to the grid, going on, turning with a flow, what spinning rods stir."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers.scenes import RIBBON, STOKES, rms, run, scene, slopes, twisting_rod

from ibfil.case.reading import parse_case
from ibfil.case.schema import Case
from ibfil.check.report import report
from ibfil.check.warnings import warnings
from ibfil.grid.kernels import PESKIN4
from ibfil.observables.factory import observers
from ibfil.rods.geometry import Configuration
from ibfil.simulation.simulation import Simulation

STIRRED: dict[str, Any] = {**STOKES, "rotation": "grid"}
SPUN = PESKIN4.twist_radius * 2.0 / 32 / np.sqrt(1.01)  # of a rod on that grid

# --- orders, and the ways to the grid --------------------------------------------------------------------------------


def twisting(**time: Any) -> Case:
    return twisting_rod(STIRRED, rod={"nodes": 11}, **time)


@cache
def reference() -> Configuration:
    return run(twisting(end=0.4, step=0.4 / 1280)).configuration


@pytest.mark.parametrize(
    ("scheme", "order"), [("semi-implicit", 1), ("implicit", 1), ("implicit", 2)], ids=["semi", "Euler", "BDF2"]
)
def test_positions_and_frame_converge_at_the_order_of_the_scheme(scheme, order):
    exact = reference()
    shapes = [run(twisting(end=0.4, step=0.4 / n, scheme=scheme, order=order)).configuration for n in (80, 160, 320)]
    for errors in ([rms(g.r - exact.r) for g in shapes], [rms(g.e1 - exact.e1) for g in shapes]):
        assert np.all(slopes(errors) > 0.9 * order)
        assert np.all(slopes(errors) < order + 0.5)


def test_the_explicit_scheme_finds_the_same_path():
    soft: dict[str, Any] = {"stretching": 50.0, "rod": {"nodes": 9, "radius": "L/10"}, "end": 0.15}
    exact = run(twisting_rod(STIRRED, step=0.15 / 400, **soft)).configuration
    shapes = [run(twisting_rod(STIRRED, step=0.15 / n, scheme="explicit", **soft)).configuration for n in (400, 800)]
    for errors in ([rms(g.r - exact.r) for g in shapes], [rms(g.e1 - exact.e1) for g in shapes]):
        assert 0.9 < slopes(errors)[0] < 1.5


GRID: dict[str, Any] = {"model": "stokes", "box": [1.6, 2.0, 2.4], "cells": [16, 20, 24], "rotation": "grid"}


@pytest.mark.parametrize(("method", "tolerance"), [("fft", 1e-10), ("krylov", 1e-6)])
def test_a_run_by_ffts_is_the_run_by_the_table(method, tolerance):
    table, other = (
        run(scene({"rod": RIBBON}, {**GRID, "method": m}, end=0.4, step=0.02)).configuration for m in ("table", method)
    )
    assert np.abs(table.r - other.r).max() < tolerance
    assert np.abs(table.e1 - other.e1).max() < tolerance


def test_turning_the_box_with_the_rod_in_it_turns_the_motion():
    shapes = []
    for turn in range(3):
        fluid = {**GRID, **{key: np.roll(GRID[key], turn).tolist() for key in ("box", "cells")}}
        place = {"position": [0.13, -0.21, 0.34], "direction": [0.6, 0.8, 0.0], "normal": [0.0, 0.0, 1.0]}
        rod = {**RIBBON, **{key: np.roll(value, turn).tolist() for key, value in place.items()}}
        shapes.append(run(scene({"rod": rod}, fluid, end=0.4, step=0.02)).configuration)
    for turn, shape in enumerate(shapes):
        assert np.abs(np.roll(shape.r, -turn, axis=1) - shapes[0].r).max() < 1e-12
        assert np.abs(np.roll(shape.e1, -turn, axis=1) - shapes[0].e1).max() < 1e-12


@pytest.mark.parametrize("method", ["table", "krylov"])
@pytest.mark.parametrize("time", [{"step": 0.02}, {"tolerance": 1e-3}])
def test_a_cut_run_goes_on_bit_for_bit(method, time):
    case = scene({"rod": RIBBON}, {**GRID, "method": method}, end=0.2, **time)
    whole = run(case)
    cut, again = run(case, 0.1), Simulation(case)
    whole_in_two = run(case, 0.1)
    whole_in_two.advance(0.2, lambda: None)
    again.restore(cut.state())
    again.advance(0.2, lambda: None)
    assert np.array_equal(again.configuration.r, whole_in_two.configuration.r)
    assert np.array_equal(again.configuration.e1, whole_in_two.configuration.e1)
    assert rms(again.configuration.r - whole.configuration.r) < 1e-3


def test_copies_of_a_spinning_rod_by_krylov_are_those_by_the_table():
    rod = {**RIBBON, "copies": {"count": 4, "seed": 3, "region": [[-0.6, -0.8, -1.0], [0.6, 0.8, 1.0]]}}
    snapshots = [
        run(scene({"rod": rod}, {**GRID, "method": m}, end=0.06, step=0.02)).snapshot().filaments
        for m in ("table", "krylov")
    ]
    for name, one in snapshots[0].items():
        assert np.abs(one.position - snapshots[1][name].position).max() < 1e-6


# --- what it means ---------------------------------------------------------------------------------------------------

STRAIGHT: dict[str, Any] = {
    "length": 0.9,
    "nodes": 16,
    "derivative": 2,
    "bending": 1.0,
    "twisting": 50.0,
    "stretching": 1e3,
    "direction": [0, 0, 1],
    "normal": [1, 0, 0],
}


def test_a_flow_that_turns_as_a_whole_turns_a_free_rod_and_its_frame_with_it():
    """u = W x r with W along the rod, and across: after time t everything is turned by W t, and nothing strains."""
    for axis, flow in (("along", ["-2*y", "2*x", 0]), ("across", [0, "-2*z", "2*y"])):
        rod = {**STRAIGHT, "radius": 0.02, "shape": {"kind": "relaxed"}, "curvature": [0, 0.8]}
        simulation = run(scene({"rod": rod}, {**STIRRED, "flow": flow}, end=0.2, step=0.002))
        c, s = np.cos(0.4), np.sin(0.4)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]] if axis == "along" else [[1, 0, 0], [0, c, -s], [0, s, c]])
        start = simulation.start
        settled = run(scene({"rod": rod}, STIRRED, end=0.2, step=0.002)).configuration  # the polygon settles by itself
        assert rms(settled.r - start.r) < 1e-3
        assert simulation.configuration.r == pytest.approx(settled.r @ turn.T, abs=1e-5), axis
        assert simulation.configuration.e1 == pytest.approx(settled.e1 @ turn.T, abs=1e-5), axis


def spun(radius: float, fluid: dict[str, Any] | None = None, **more: Any) -> Simulation:
    """A rod spun at its clamp at unit rate until its twist is steady."""
    rod = {**STRAIGHT, "radius": radius, "start": {"end": "clamped", "spin": 1.0}, **more}
    return run(scene({"rod": rod}, {**STIRRED, **(fluid or {})}, end=0.2, step=0.02))


def torque(simulation: Simulation) -> float:
    return float(simulation.snapshot().diagnostics["net_torque"][2])


def test_a_thin_rod_spins_against_its_own_drag():
    """4 pi eta a^2 w L, but for its ends: the fluid that it drags along beyond them is as wide as the kernel."""
    for radius in (0.05 * SPUN, 0.2 * SPUN):
        assert torque(spun(radius)) == pytest.approx(4 * np.pi * radius**2 * 0.9, rel=0.5 * radius**2 / SPUN**2)
        assert torque(spun(radius, {"rotation": "local"})) == pytest.approx(4 * np.pi * radius**2 * 0.9, rel=1e-9)


def test_a_rod_as_thick_as_the_grid_makes_it_spins_as_that_a_length():
    """Between two lengths, whole numbers of cells, so that the ends drop out (they are worth three radii)."""
    box = {"box": [2.0, 2.0, 4.0], "cells": [32, 32, 64]}
    long, short = (torque(spun(SPUN, box, length=n / 16, nodes=1 + n)) for n in (32, 20))
    radius = np.sqrt((long - short) / 0.75 / (4 * np.pi))
    assert radius == pytest.approx(SPUN, rel=0.005)  # the box, whose vorticity has no mean, takes 0.35 %
    assert radius == pytest.approx(1.5045 * 2.0 / 32, rel=0.01)


def test_torques_of_a_thick_rod_do_not_lock():
    """Uniform spin asks for uniform torque; without the spin's slip its nodes answer with +-20 times that."""
    for slip, smooth in ((0.01, True), (0.0, False)):
        simulation = spun(PESKIN4.twist_radius * 2.0 / 32, {"slip": slip}, length=1.0, nodes=17)
        torque = simulation.snapshot().filaments["rod"].torque[:, 2] * 16
        middle = torque[4:-4] / (4 * np.pi * SPUN**2)
        assert np.abs(middle - 1).max() < 0.2 if smooth else np.abs(middle - 1).max() > 2
        assert any("lock" in warning for warning in warnings(simulation)) != smooth


def test_a_thicker_rod_spins_as_that_and_says_so():
    thick, widest = spun(2 * SPUN), spun(SPUN)
    assert torque(thick) == pytest.approx(torque(widest), rel=1e-12)
    assert not [w for w in warnings(widest) if "spins" in w]
    assert [w for w in warnings(thick) if "rod.radius" in w and "spins as one of that; take fewer" in w]


def test_check_prints_both_radii():
    text = report(scene({"rod": {**STRAIGHT, "radius": 0.01}}, STIRRED))
    h = 2.0 / 32
    assert f"radius {1.105 * h:.4g} when dragged, {SPUN:.4g} when spun" in text
    assert "stir the grid" in text
    assert "torque coupling" not in text


def test_a_spinning_rod_stirs_the_fluid_around_it_and_only_with_rotation_grid():
    """u = b^2 w/r about a long rod, less the turning of the box as a whole that its images make.

    Left are the gap of 0.2 between a rod and its image, beyond which its ends reach by b, and of the images across what
    varies by more than a turn, (r/2)^4: together five or six parts in a hundred.
    """
    points = [[0.25, 0, 0], [0, -0.35, 0], [0.2, 0.2, 0.05]]
    rod = {**STRAIGHT, "length": 1.8, "nodes": 31, "radius": SPUN, "start": {"end": "clamped", "spin": 1.0}}
    found = {}
    for rotation in ("local", "grid"):
        case = scene({"rod": rod}, {**STOKES, "rotation": rotation}, end=0.2, step=0.02)
        simulation = run(case)
        shape, force = simulation.configuration, simulation.state()["force"]
        found[rotation] = simulation.fluid.velocity_at(np.array(points), shape.r, shape.e3, force, 0.2)
    assert np.abs(found["local"]).max() < 1e-12
    for u, (x, y, _) in zip(found["grid"], points, strict=True):
        r = np.hypot(x, y)
        turned = SPUN**2 / r - SPUN**2 * np.pi * r / 4  # area of the box 4: the mean vorticity is zero
        assert u == pytest.approx(turned * np.array([-y, x, 0]) / r, abs=0.06 * turned)


def test_a_filament_that_does_not_twist_is_carried_and_gives_no_torque():
    """Its forces go on the grid as ever, whether or not another filament stirs."""
    still = {"length": 0.6, "nodes": 11, "bending": 1.0, "stretching": 1e3, "direction": [0, 0, 1]}
    still |= {"position": [0.2, 0, 0], "normal": [1, 0, 0]}
    spinner = {**STRAIGHT, "radius": SPUN, "start": {"end": "clamped", "spin": 1.0}}
    simulation = run(scene({"spinner": spinner, "still": still}, STIRRED, end=0.1, step=0.02))
    force = simulation.state()["force"]
    assert np.abs(force[16:, 3]).max() < 1e-14 * np.abs(force[:16, 3]).max()
    move = simulation.configuration.r[16:] - simulation.start.r[16:]
    assert move[:, 1].mean() > 0.05 * 0.1 * SPUN**2 / 0.2  # around the spinner, which turns about z


def test_methods_that_know_no_torques_are_refused_and_never_chosen():
    simulation = Simulation(scene({"rod": {**STRAIGHT, "radius": 0.02}}, STIRRED))
    assert set(simulation.model.seconds) == {"table", "fft", "krylov"}


def test_frames_hold_the_torque_and_the_spin_and_their_power():
    """All of a spun straight rod's power is its torque's; so is the diagnostic, and the observables count it."""
    simulation = spun(0.3 * SPUN)
    snapshot = simulation.snapshot()
    rod = snapshot.filaments["rod"]
    assert rod.torque.sum(axis=0) == pytest.approx(snapshot.diagnostics["net_torque"], abs=1e-12)
    assert rod.spin == pytest.approx(np.tile([0, 0, 1.0], (16, 1)), abs=1e-9)
    assert rod.power.sum() == pytest.approx(rod.torque[:, 2].sum(), rel=1e-9)
    assert rod.power.sum() == pytest.approx(snapshot.diagnostics["power"], rel=1e-12)
    text = simulation.case.text + "".join(f'\n[observe.{k}]\nkind = "{k}"\n' for k in ("torque", "power"))
    looking = observers(parse_case(text, "spun.toml"))
    looking.record(snapshot)
    observed = {k: looking.summaries()[k].value for k in ("torque", "power")}
    assert observed["torque"] == pytest.approx(snapshot.diagnostics["net_torque"], abs=1e-12)
    assert observed["power"] == pytest.approx(snapshot.diagnostics["power"], rel=1e-12)


def test_a_free_rod_gives_the_fluid_neither_force_nor_torque():
    """Forces and twist torques together, as the grid feels them, with forces that are free of torque."""
    rod = {**RIBBON, "force": "torque-free", "derivative": 2, "start": {"end": "free"}}
    snapshot = run(scene({"rod": rod}, GRID, end=0.1, step=0.02)).snapshot()
    felt = snapshot.filaments["rod"]
    assert np.abs(snapshot.diagnostics["net_force"]).max() < 1e-11 * np.abs(felt.force).sum()
    own = np.abs(np.cross(felt.position, felt.force)).sum()
    assert np.abs(felt.torque).sum() > 0.01 * own
    assert np.abs(snapshot.diagnostics["net_torque"]).max() < 1e-7 * own  # Newton's tolerance


def test_a_table_in_single_precision_is_one_to_its_digits():
    paths = [
        run(scene({"rod": RIBBON}, {**GRID, "method": "table", "precision": p}, end=0.2, step=0.02)).configuration
        for p in ("double", "single")
    ]
    assert 0 < np.abs(paths[0].r - paths[1].r).max() < 1e-4
    assert np.abs(paths[0].e1 - paths[1].e1).max() < 1e-4
