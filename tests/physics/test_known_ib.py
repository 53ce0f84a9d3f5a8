"""Rods in an immersed-boundary Stokes fluid: orders in time, published swimming speeds, locking, and symmetries.

Speeds are means over the second and third period in lengths L per time eta L^4/A. They were found by independent code
with the paper's Eq. 11; the package takes e3 x M exactly, which moves them by up to 0.5 % where a rod is not locked.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pytest
from helpers.scenes import RIBBON, STOKES, rms, run, scene, slopes, swimmer, twisting_rod

from ibfil.case.schema import Case
from ibfil.check.warnings import warnings
from ibfil.fluids import immersed_boundary
from ibfil.fluids.immersed_boundary import slip_mobility
from ibfil.rods.geometry import Configuration
from ibfil.simulation.simulation import Simulation

Build = Callable[..., Case]
PERIOD = 2 * np.pi / 10


# --- orders ----------------------------------------------------------------------------------------------------------


def swimming(**time: Any) -> Case:
    return swimmer(STOKES, smooth=True, stretching=400.0, rod={"nodes": 13}, **time)


def twisting(**time: Any) -> Case:
    return twisting_rod(STOKES, rod={"nodes": 11}, **time)


def soft_swimming(**time: Any) -> Case:
    return swimmer(STOKES, smooth=True, stretching=50.0, rod={"nodes": 9}, **time)


def soft_twisting(**time: Any) -> Case:
    return twisting_rod(STOKES, stretching=50.0, rod={"nodes": 9, "radius": "L/10"}, **time)


@cache
def reference(build: Build, end: float, count: int) -> Configuration:
    """The path by BDF2 in many steps."""
    return run(build(end=end, step=end / count)).configuration


def errors(build: Build, end: float, fine: int, counts: tuple[int, ...], **keys: Any) -> tuple[list, list]:
    """Errors at the end of positions and of e1, rms over nodes, in so many steps."""
    exact = reference(build, end, fine)
    shapes = [run(build(end=end, step=end / count, **keys)).configuration for count in counts]
    return [rms(g.r - exact.r) for g in shapes], [rms(g.e1 - exact.e1) for g in shapes]


def assert_order(found: list[float], order: int) -> None:
    """Slopes at least 0.9 of the order, and no more than half an order above it."""
    assert np.all(slopes(found) > 0.9 * order)
    assert np.all(slopes(found) < order + 0.5)


@pytest.mark.parametrize("build", [swimming, twisting], ids=["swimmer", "twisting rod"])
@pytest.mark.parametrize(
    ("scheme", "order"), [("semi-implicit", 1), ("implicit", 1), ("implicit", 2)], ids=["semi", "Euler", "BDF2"]
)
def test_positions_and_frame_converge_at_the_order_of_the_scheme(build: Build, scheme: str, order: int) -> None:
    """And to one path: the errors of all schemes are those from BDF2's."""
    positions, directors = errors(build, 0.4, 1280, (80, 160, 320), scheme=scheme, order=order)
    assert_order(positions, order)
    if build is twisting:
        assert_order(directors, order)


@pytest.mark.parametrize("build", [soft_swimming, soft_twisting], ids=["swimmer", "twisting rod"])
def test_the_explicit_scheme_is_first_order_and_finds_the_same_path(build: Build) -> None:
    positions, directors = errors(build, 0.15, 400, (400, 800), scheme="explicit")
    assert_order(positions, 1)
    if build is soft_twisting:
        assert_order(directors, 1)


@pytest.mark.parametrize("build", [swimming, twisting], ids=["swimmer", "twisting rod"])
def test_the_scene_moves_and_bends_and_twists_enough_to_tell(build: Build) -> None:
    start, end = Simulation(build(end=0.4, step=0.4)).configuration, reference(build, 0.4, 1280)
    assert rms(end.r - start.r) > 0.05
    assert np.abs(end.bend[:, 0]).max() > 1.0
    if build is twisting:
        assert np.abs(end.bend[:, 1]).max() > 0.5
        assert np.abs(end.twist).max() > 1.0
        assert rms(end.e1 - start.e1) > 0.5


# --- swimming speeds -------------------------------------------------------------------------------------------------


class Swim(NamedTuple):
    """Mean speed along x over the second and third period, the largest nodal force at their ends, and the run."""

    speed: float
    force: float
    run: Simulation


@cache
def swim(
    nodes: int,
    cells: int,
    stretching: float,
    slip: float,
    *,
    steps: int = 100,
    viscosity: float = 1.0,
    box: float = 3.2,
    kernel: str = "peskin4",
    scheme: str = "implicit",
) -> Swim:
    """The paper's swimmer; ``slip`` is a part of a node's own mobility: the case's is that at a spacing of h/2."""
    scaled = slip * 2 * cells / (box * (nodes - 1))
    fluid = {"model": "stokes", "box": [box] * 3, "cells": [cells] * 3, "slip": scaled, "kernel": kernel}
    rod = {"length": 1.0, "nodes": nodes, "bending": 1.0, "stretching": stretching}
    rod |= {"curvature": ["8*sin(4*pi*s - 10*t)", 0], "shape": {"kind": "relaxed"}}
    rod |= {"align": "chord", "anchor": "centroid"}  # with grid points, as the numbers were measured
    case = scene({"rod": rod}, fluid, viscosity=viscosity, end=3 * PERIOD, step=PERIOD / steps, scheme=scheme)
    simulation = Simulation(case)
    middle, force = [], 0.0
    for k in (1, 2, 3):
        simulation.advance(k * PERIOD, lambda: None)
        middle.append(simulation.configuration.r.mean(axis=0))
        force = max(force, float(np.abs(simulation.snapshot().filaments["rod"].force).max()))
    return Swim((middle[2] - middle[0])[0] / (2 * PERIOD), force, simulation)


@pytest.fixture
def slip_alike(monkeypatch):
    """All nodes slip alike, as in the code the numbers are of; here the ends', of half a volume, slip twice as much."""

    def alike(fraction, kernel, h, viscosity, volume):
        return slip_mobility(fraction, kernel, h, viscosity, np.full_like(volume, volume.max()))

    monkeypatch.setattr(immersed_boundary, "slip_mobility", alike)


@pytest.mark.parametrize(
    ("nodes", "cells", "stretching", "slip", "speed", "tolerance"),
    [
        (41, 64, 400.0, 0.01, -0.01783, 0.005),
        (21, 64, 800.0, 0.0, -0.01701, 0.005),
        (41, 64, 1.6e4, 0.01, -0.01774, 0.005),
        (41, 128, 1.6e4, 0.01, -0.0436, 0.005),
        (41, 128, 1.6e4, 0.0, -0.0428, 0.005),
        (41, 128, 400.0, 0.01, -0.0437, 0.01),  # -0.0437 .. -0.0440 with more nodes
        (41, 128, 400.0, 0.0, -0.0437, 0.01),  # Eq. 11, with its force along the rod: -0.04295
    ],
)
def test_speed(nodes, cells, stretching, slip, speed, tolerance, slip_alike):
    found = swim(nodes, cells, stretching, slip)
    assert found.speed == pytest.approx(speed, rel=tolerance)
    assert found.run.shortened == 0
    assert np.abs(found.run.snapshot().diagnostics["net_force"]).max() < 1e-12 * found.force


def test_speed_in_a_thicker_fluid(slip_alike):
    assert swim(41, 64, 400.0, 0.01, viscosity=10.0).speed == pytest.approx(-0.015908, rel=0.005)


@pytest.mark.parametrize("slip", [0.1, 1.0])
def test_positions_on_a_grid_are_of_second_order_in_the_nodes(slip):
    """At fixed cells, nodes h/2 to h/8 apart. With the slip of inner nodes at the ends the order is 0.8."""
    fluid = {**STOKES, "method": "table", "slip": slip}
    r = [run(swimmer(fluid, rod={"nodes": n}, end=0.15, step=0.025)).configuration.r for n in (41, 81, 161)]
    d = [rms(fine[::2] - coarse) for coarse, fine in pairwise(r)]
    assert np.log2(d[0] / d[1]) > 1.6


@pytest.mark.parametrize(("box", "cells", "speed"), [(2.0, 40, -0.01807), (6.4, 128, -0.01766), (2.0, 80, -0.0439)])
def test_speed_in_other_boxes(box, cells, speed):
    """A free swimmer is without force, and feels its images by a few parts in a hundred at most."""
    assert swim(41, cells, 400.0, 0.01, box=box).speed == pytest.approx(speed, rel=0.005)


# Cells that give each kernel the same radius, a = 0.0328, and the speed of each.
SAME_RADIUS = {"roma3": (96, -0.0434), "peskin4": (128, -0.0437), "es5": (132, -0.0438), "bkp6": (148, -0.0436)}


@pytest.mark.parametrize(
    "name", ["roma3", "peskin4", *(pytest.param(k, marks=pytest.mark.slow) for k in ("es5", "bkp6"))]
)
def test_kernels_of_the_same_radius_swim_alike(name, slip_alike):
    cells, speed = SAME_RADIUS[name]
    assert swim(41, cells, 400.0, 0.01, kernel=name).speed == pytest.approx(speed, rel=0.005)


@pytest.mark.slow
def test_the_explicit_scheme_swims_as_fast():
    assert swim(41, 64, 400.0, 0.01, steps=4400, scheme="explicit").speed == pytest.approx(-0.01784, rel=0.01)


@pytest.mark.parametrize(("slip", "rate"), [(0.0, 7.45e3), (0.01, 1.24e4)])
def test_the_explicit_limit_on_the_papers_grid(slip, rate):
    """2 over the largest eigenvalue of M K; without slip forward Euler was stable at 2.6e-4 and not above 2.7e-4."""
    fluid = {"model": "stokes", "box": [3.2] * 3, "cells": [64] * 3, "slip": slip}
    limit = Simulation(swimmer(fluid, stretching=400.0, step=1e-3)).explicit_limit()
    assert limit == pytest.approx(2 / rate, rel=0.05)


@pytest.mark.parametrize("slip", [0.0, 0.01])
@pytest.mark.parametrize("viscosity", [1e-2, 0.1, 1.0, 10.0, 1e2])
def test_explicit_steps_within_five_per_cent_of_the_limit_are_stable_below_and_not_above(viscosity, slip):
    """About a straight rod: the stiffest motion is multiplied by 1 - 2 dt/limit each step, in 200 by 0.9^200 or 2e8."""
    fluid = {"model": "stokes", "box": [3.2] * 3, "cells": [64] * 3, "slip": slip, "method": "table"}
    ripple = "1e-12*cos(40*pi*s) + 1e-12*sin(13*s)"
    rod = {"length": 1.0, "nodes": 41, "bending": 1.0, "stretching": 400.0, "position": [0.017, 0.021, 0.033]}
    rod["shape"] = {"kind": "straight", "perturb": [ripple, ripple, 0]}
    limit = Simulation(scene({"rod": rod}, fluid, viscosity=viscosity, step=1e-3)).explicit_limit()
    moved = []
    for factor in (0.95, 1.05):
        step = factor * limit
        case = scene({"rod": rod}, fluid, viscosity=viscosity, scheme="explicit", step=step, end=200 * step)
        simulation = Simulation(case)
        before = simulation.configuration.r
        simulation.advance(case.time.end, lambda: None)
        moved.append(np.abs(simulation.configuration.r - before).max())
    assert moved[0] < 1e-10  # without slip a decaying motion may first grow fortyfold
    assert moved[1] > 1e-7


# --- locking ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [50, pytest.param(100, marks=pytest.mark.slow)])
def test_without_slip_a_stiff_swimmer_with_nodes_half_a_cell_apart_locks_and_goes_the_wrong_way(steps):
    locked, cured = (swim(41, 64, 1.6e4, slip, steps=steps) for slip in (0.0, 0.01))
    assert cured.speed == pytest.approx(-0.01774, rel=0.01)
    assert locked.speed > 0.01
    assert locked.force > 50 * cured.force
    assert locked.run.shortened == 0  # nothing in the run says so; the program does, before
    assert any("locks" in line for line in warnings(locked.run))
    assert not any("locks" in line for line in warnings(cured.run))


def test_nodes_a_cell_apart_need_no_slip():
    """The other cure: the speed is that of the finer rod with slip to 6 %, at any stretching, and forces are small."""
    for stretching in (800.0, 1.6e4):
        found = swim(21, 64, stretching, 0.0)
        assert found.speed == pytest.approx(-0.0177, rel=0.06)
        assert found.force < 2 * (40 / 20) * swim(41, 64, 1.6e4, 0.01).force  # a node carries twice the length


# --- symmetries ------------------------------------------------------------------------------------------------------

SWIMMER: dict[str, Any] = {
    "length": 1.0,
    "nodes": 15,
    "bending": 1.0,
    "stretching": 400.0,
    "curvature": ["8*sin(4*pi*s - 10*t)", 0],
    "shape": {"kind": "relaxed"},
}
RODS = pytest.mark.parametrize("rod", [SWIMMER, RIBBON], ids=["swimmer", "spun ribbon"])
METHODS = pytest.mark.parametrize("method", ["table", "fft"])
GRID: dict[str, Any] = {"model": "stokes", "box": [1.6, 2.0, 2.4], "cells": [16, 20, 24], "slip": 0.01}
SAME = 1e-12  # round-off over 20 steps; a shift by a part of a cell makes 1e-3


def path(rods: dict[str, dict[str, Any]], fluid: dict[str, Any], **more: Any) -> Configuration:
    """Where 20 steps lead."""
    return run(scene(rods, fluid, **{"end": 0.4, "step": 0.02, **more})).configuration


@RODS
@pytest.mark.parametrize("cells", [(3, -7, 5), (8, 10, 12), (16 * 5, -20 * 3, 24)])
def test_a_shift_by_whole_cells_changes_nothing(rod, cells):
    """Also by half a box, which puts the rod across its seams, and by whole boxes, which puts it outside."""
    by = 0.1 * np.array(cells)
    here, there = (path({"rod": {**rod, "position": list(p)}}, GRID) for p in (np.zeros(3), by))
    assert np.abs(there.r - by - here.r).max() < SAME
    assert np.abs(there.e1 - here.e1).max() < SAME
    assert rms(here.r - path({"rod": rod}, GRID, end=0.02).r) > 0.02
    partly = path({"rod": {**rod, "position": [0.03, 0.02, 0.05]}}, GRID)
    assert np.abs(partly.r - [0.03, 0.02, 0.05] - here.r).max() > 1e-6


@RODS
@METHODS
def test_turning_the_box_with_the_rod_in_it_turns_the_motion(rod, method):
    """x -> y -> z -> x in a box of three unequal sides: no axis is special."""
    shapes = []
    for turn in range(3):
        fluid = {**GRID, "method": method}
        for key in ("box", "cells"):
            fluid[key] = np.roll(fluid[key], turn).tolist()
        table = {**rod, "position": np.roll([0.13, -0.21, 0.34], turn).tolist()}
        table["direction"] = np.roll([0.6, 0.8, 0.0], turn).tolist()
        table["normal"] = np.roll([0.0, 0.0, 1.0], turn).tolist()
        shapes.append(path({"rod": table}, fluid))
    for turn, shape in enumerate(shapes):
        assert np.abs(np.roll(shape.r, -turn, axis=1) - shapes[0].r).max() < SAME
        assert np.abs(np.roll(shape.e1, -turn, axis=1) - shapes[0].e1).max() < SAME


@RODS
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_box_is_one_of_two_in_a_box_of_twice_the_length(rod, axis):
    """What periodic means: two rods in two boxes do what one does in one."""
    one = path({"rod": rod}, GRID)
    apart, long = np.zeros(3), {**GRID, "box": list(GRID["box"]), "cells": list(GRID["cells"])}
    apart[axis] = 0.5 * long["box"][axis]
    long["box"][axis] *= 2
    long["cells"][axis] *= 2
    two = path({"a": {**rod, "position": list(-apart)}, "b": {**rod, "position": list(apart)}}, long)
    n = rod["nodes"]
    for shape, by in ((two.r[:n], -apart), (two.r[n:], apart)):
        assert np.abs(shape - by - one.r).max() < SAME
    assert np.abs(two.e1 - np.tile(one.e1, (2, 1))).max() < SAME


@RODS
@pytest.mark.parametrize(("length", "viscosity", "bending"), [(2.5, 0.3, 1.7), (0.01, 1e-3, 4e-9)])
def test_size_and_viscosity_and_stiffness_drop_out(rod, length, viscosity, bending):
    """In units of L and eta L^4/A the motion is the same number for number, slip and spin drag included."""
    builds = {"swimmer": swimmer, "ribbon": twisting_rod}
    build = builds["swimmer" if rod is SWIMMER else "ribbon"]
    keys: dict[str, Any] = {"end": 0.2, "step": 0.01, "rod": {"nodes": 13}}
    one = run(build(GRID, **keys))
    two = run(build(GRID, length=length, viscosity=viscosity, bending=bending, **keys))
    assert np.abs(two.configuration.r / length - one.configuration.r).max() < SAME
    assert np.abs(two.configuration.e1 - one.configuration.e1).max() < SAME
    unit = bending / length**2
    force = one.snapshot().filaments["rod"].force
    assert np.abs(two.snapshot().filaments["rod"].force / unit - force).max() < 1e-6 * np.abs(force).max()


@RODS
@pytest.mark.parametrize(("method", "tolerance"), [("fft", 1e-10), ("krylov", 1e-6)])
def test_a_run_by_ffts_is_the_run_by_the_table(rod, method, tolerance):
    """krylov's residual is loose, but Newton goes on until its correction is below 1e-8 L."""
    table, other = (path({"rod": rod}, {**GRID, "method": m}) for m in ("table", method))
    assert np.abs(table.r - other.r).max() < tolerance
    assert np.abs(table.e1 - other.e1).max() < tolerance


@pytest.mark.parametrize("rod", [SWIMMER, RIBBON], ids=["free", "held and spun"])
def test_the_fluid_as_a_whole_does_not_move(rod):
    """A free rod gives no net force; on a held one a uniform back pressure carries what the support gives."""
    simulation = run(scene({"rod": rod}, GRID, end=0.1, step=0.02))
    snapshot = simulation.snapshot(["velocity"])
    net = np.abs(snapshot.diagnostics["net_force"]).max()
    if rod is RIBBON:
        assert net > 0.01
    else:
        assert net < 1e-12
    velocity = snapshot.grid["velocity"]
    assert np.abs(velocity).max() > 0.01
    assert np.abs(velocity.mean(axis=(0, 1, 2), dtype=float)).max() < 1e-7 * np.abs(velocity).max()  # single precision
