"""Drag matched to a grid: known numbers, the rule of directions, the cache, and what a case makes of it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import platformdirs
import pytest
from helpers.scenes import scene

from ibfil.assembly import drag as assembly_drag
from ibfil.assembly import rods as assembly_rods
from ibfil.case.idle import idle_keys
from ibfil.check.dimensionless import groups
from ibfil.check.report import report
from ibfil.check.warnings import warnings
from ibfil.errors import CaseError
from ibfil.fluids import calibrated_drag, mobility_table
from ibfil.fluids.calibrated_drag import Match, Rod, directions, measure, places
from ibfil.fluids.spaces.free import FreeSpace
from ibfil.fluids.spaces.periodic import PeriodicSpace
from ibfil.grid.kernels import KERNELS
from ibfil.grid.periodic_grid import Grid
from ibfil.simulation.simulation import Simulation

SMALL = Rod(0.5, 11, PeriodicSpace((1.6, 1.6, 1.6), (32, 32, 32)), "peskin4", 0.01)


@pytest.fixture(autouse=True)
def cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A cache folder of the test's own, and nothing remembered."""
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda name: tmp_path / name)
    calibrated_drag.match.cache_clear()
    return tmp_path


# --- the measurement ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("length", "cells", "perp", "par"),
    [(1.0, 64, 5.70, 3.87), (0.5, 64, 7.13, 5.37), (0.5, 128, 5.05, 3.56), (1.0, 128, 4.25, 2.74)],
)
def test_known_numbers(length, cells, perp, par):
    """Independent code: rods in random directions, nodes a cell apart, to three digits."""
    nodes = round(length * cells / 3.2) + 1
    found = measure(Rod(length, nodes, PeriodicSpace((3.2,) * 3, (cells,) * 3), "peskin4", 0.0))
    assert found.perp == pytest.approx(perp, rel=5e-3)
    assert found.par == pytest.approx(par, rel=5e-3)
    assert found.ratio == pytest.approx(perp / par, rel=5e-3)
    assert 0 < found.scatter < 0.02


@pytest.mark.parametrize(("length", "perp", "par"), [(1.0, 3.531, 2.407), (0.5, 4.473, 3.235)])
def test_known_numbers_of_free_space(length, perp, par):
    """Independent code, with slip: a fifth below those of a box of 3.2."""
    found = measure(Rod(length, round(length * 40) + 1, FreeSpace(0.025), "peskin4", 0.01))
    assert (found.perp, found.par) == pytest.approx((perp, par), rel=5e-4)
    assert 0 < found.scatter < 0.02


def test_one_rod_on_a_grid_line_of_the_known_drag():
    """Independent code, to seven digits."""
    grid, kernel = Grid([3.2] * 3, [64] * 3), KERNELS["peskin4"]
    table = mobility_table.octant(mobility_table.point_response(grid, 1.0), kernel.points)
    line = np.linspace(-0.5, 0.5, 21)[:, None] * np.array([1.0, 0, 0])
    drag = calibrated_drag._drag(
        mobility_table.mobility(table, *kernel.stencil(grid.coordinates(line)), np.zeros(21)).reshape(63, 63)
    )
    assert np.diag(drag) == pytest.approx([3.866703, 5.760179, 5.760179], rel=1e-6)
    assert drag == pytest.approx(np.diag(np.diag(drag)), abs=1e-8)


def test_only_ratios_of_lengths_count():
    large = Rod(5.0, SMALL.nodes, PeriodicSpace((16.0,) * 3, SMALL.space.cells), SMALL.kernel, SMALL.slip)
    one, other = measure(SMALL), measure(large)
    assert (one.perp, one.par, one.scatter) == pytest.approx((other.perp, other.par, other.scatter), rel=1e-9)


def test_scatter_is_what_places_and_directions_differ_by():
    """The mean and the deviation again, rod by rod, through forces that give the nodes one velocity."""
    grid, kernel = SMALL.space.grid, KERNELS[SMALL.kernel]
    table = mobility_table.octant(mobility_table.point_response(grid, 1.0), kernel.points)
    volume = SMALL.length / (SMALL.nodes - 1) * np.array([0.5, *[1.0] * (SMALL.nodes - 2), 0.5])
    slip = SMALL.slip * (grid.spacing / (2 * volume)) / (6 * np.pi * kernel.point_radius * grid.spacing)
    along, across, weights = [], [], []
    for weight, (t, n, b) in directions():
        for place in places(8):
            r = np.linspace(-0.25, 0.25, 11)[:, None] * t + place * grid.spacing
            stencil = kernel.stencil(grid.coordinates(r))
            m = mobility_table.mobility(table, *stencil, slip)
            m = m.reshape(33, 33)
            along.append(np.tile(t, 11) @ np.linalg.solve(m, np.tile(t, 11)) / 0.5)
            across += [np.tile(u, 11) @ np.linalg.solve(m, np.tile(u, 11)) / 0.5 for u in (n, b)]
            weights.append(weight)
    found = measure(SMALL)
    for values, w, mean, scatter in (
        (np.array(along), np.array(weights), found.par, found.par_scatter),
        (np.array(across), np.repeat(weights, 2), found.perp, found.perp_scatter),
    ):
        expected = np.sum(w * values) / np.sum(w)
        assert mean == pytest.approx(expected, rel=1e-12)
        assert scatter == pytest.approx(np.sqrt(np.sum(w * (values - expected) ** 2) / np.sum(w)) / expected, rel=1e-9)
    assert found.scatter == max(found.par_scatter, found.perp_scatter)


def test_nodes_closer_than_the_grid_resolves_are_refused():
    with pytest.raises(ValueError, match="singular"):
        measure(Rod(0.5, 41, SMALL.space, SMALL.kernel, 0.0))
    assert measure(Rod(0.5, 41, SMALL.space, SMALL.kernel, 0.01)).perp == pytest.approx(measure(SMALL).perp, rel=0.02)


def test_directions_are_an_exact_mean_over_the_sphere():
    weights = np.array([weight for weight, _ in directions()])
    x, y, z = np.array([frame[0] for _, frame in directions()]).T
    assert len(weights) == 13
    for values, mean in [
        (np.ones(13), 1.0),
        (x**2, 1 / 3),
        (x * y, 0.0),
        (y**4, 1 / 5),
        (x**2 * z**2, 1 / 15),
        (z**6, 1 / 7),
        (x**4 * y**2, 1 / 35),
        (x**2 * y**2 * z**2, 1 / 105),
    ]:
        assert np.sum(weights * values) == pytest.approx(mean, abs=1e-14)
    for _, frame in directions():
        assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-15)


def test_places_fill_the_cell_and_none_mirrors_another():
    points = places(8)
    assert np.all((points >= 0) & (points < 1))
    for axis in points.T:
        assert np.max(np.diff(np.sort(np.append(axis, axis.min() + 1)))) < 3 / 8
        folded = np.minimum(axis, 1 - axis)
        assert np.min(np.diff(np.sort(folded))) > 1e-3


# --- the cache ------------------------------------------------------------------------------------------------------


def never(rod: Rod) -> Match:
    raise AssertionError("measured")


def again(rod: Rod) -> Match:
    """As a new process would ask."""
    calibrated_drag.match.cache_clear()
    return calibrated_drag.match(rod)


def test_what_was_measured_is_not_measured_again(monkeypatch, cache):
    found = calibrated_drag.match(SMALL)
    (kept,) = cache.rglob("*.json")
    assert kept == calibrated_drag.cache_file(SMALL)
    monkeypatch.setattr(calibrated_drag, "measure", never)
    assert again(SMALL) == found
    wider = PeriodicSpace((1.6, 1.6, 3.2), (32, 32, 64))
    free = FreeSpace(SMALL.space.spacing)
    for change in (
        {"length": 0.4},
        {"nodes": 12},
        {"space": wider},
        {"space": free},
        {"kernel": "es5"},
        {"slip": 0.02},
    ):
        with pytest.raises(AssertionError, match="measured"):
            again(Rod(**{**SMALL.__dict__, **change}))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        '{"inputs": {}}',
        '{"inputs": 1, "drag": {"perp": 1, "par": 1, "perp_scatter": 0, "par_scatter": 0}}',
        "WHOLE -> NaN",
        "WHOLE -> -1",
        'WHOLE -> "5"',
        "\udcff",
    ],
)
def test_a_damaged_file_is_measured_again_and_put_right(text, cache):
    found = calibrated_drag.match(SMALL)
    path = calibrated_drag.cache_file(SMALL)
    whole = path.read_text()
    if text.startswith("WHOLE -> "):
        text = whole.replace(str(json.loads(whole)["drag"]["par"]), text.removeprefix("WHOLE -> "))
    path.write_bytes(text.encode(errors="surrogateescape"))
    assert again(SMALL) == found
    assert path.read_text() == whole


def test_a_folder_that_cannot_be_written_is_no_fault(cache):
    (cache / "ibfil").write_text("a file where the folder should be")
    assert calibrated_drag.match(SMALL) == measure(SMALL)


# --- in a case ------------------------------------------------------------------------------------------------------

GRID = {"box": [1.6, 1.6, 1.6], "cells": [32, 32, 32]}
ROD = {"length": 1.0, "nodes": 21, "bending": 1.0, "stretching": 100.0}


def case(fluid=GRID, rods=None, matched=0.5, model="rft", **more):
    return scene(rods or {"rod": ROD}, {"model": model, "drag": {"matched": matched}, **fluid}, **more)


def test_the_drag_of_a_case_is_that_of_a_straight_rod_with_its_spacing_in_its_grid():
    """0.5 of a rod with 20 segments a unit length is SMALL; and drag is proportional to the viscosity."""
    stacked = assembly_rods.rods(case(viscosity=3.0))
    drag = assembly_drag.drag(case(viscosity=3.0), stacked)
    expected = measure(SMALL)
    assert drag.perp == pytest.approx(3.0 * expected.perp * stacked.system.mesh.volume, rel=1e-12)
    assert drag.par == pytest.approx(3.0 * expected.par * stacked.system.mesh.volume, rel=1e-12)


def test_each_filament_has_its_own():
    two = {"coarse": ROD, "fine": {**ROD, "nodes": 41, "position": [0, 0.5, 0]}}
    made = case(rods=two)
    coarse, fine = (assembly_drag.matching(made, made.filaments[name]) for name in two)
    assert coarse == measure(SMALL)
    assert fine == measure(Rod(0.5, 21, SMALL.space, SMALL.kernel, SMALL.slip))
    found = groups(Simulation(made))
    assert found["coarse: matched zeta_perp/eta"] == coarse.perp
    assert found["fine: matched zeta_perp/eta"] == fine.perp


def test_thickness_stands_for_cells():
    by_thickness = case(fluid={"box": [1.6, 1.6, 1.6], "thickness": 0.0553})
    assert assembly_drag.matching(by_thickness, by_thickness.filaments["rod"]) == measure(SMALL)


def test_spin_is_against_the_rods_own_drag():
    twisting = {**ROD, "twisting": 1.0, "radius": 0.02}
    made = case(rods={"rod": twisting}, viscosity=2.0)
    stacked = assembly_rods.rods(made)
    expected = 4 * np.pi * 2.0 * 0.02**2 * stacked.system.mesh.volume
    assert assembly_drag.drag(made, stacked).spin == pytest.approx(expected, rel=1e-12)


def test_check_and_banner_tell_the_match():
    expected = measure(SMALL)
    found = groups(Simulation(case()))
    assert found["matched zeta_perp/eta"] == expected.perp
    assert found["matched zeta_par/eta"] == expected.par
    assert found["zeta_perp/zeta_par"] == expected.perp / expected.par
    assert found["matched scatter"] == expected.scatter
    assert f"matched zeta_perp/eta = {expected.perp:.4g}" in report(case())


def test_a_drag_that_is_no_number_is_warned_of(monkeypatch):
    monkeypatch.setattr(calibrated_drag, "measure", lambda rod: Match(6.0, 4.0, 0.001, 0.03))
    assert any("differs by 0.03" in line for line in warnings(Simulation(case())))
    calibrated_drag.match.cache_clear()
    for path in calibrated_drag.cache_file(SMALL).parent.glob("*.json"):
        path.unlink()
    monkeypatch.setattr(calibrated_drag, "measure", lambda rod: Match(6.0, 4.0, 0.001, 0.003))
    assert not any("differs by" in line for line in warnings(Simulation(case())))


def test_on_the_grid_itself_nothing_is_matched(monkeypatch):
    """Grid fluids take of the drag its spin alone."""
    monkeypatch.setattr(calibrated_drag, "measure", never)
    made = case(model="stokes", rods={"rod": {**ROD, "twisting": 1.0, "radius": 0.02}})
    assert assembly_drag.matching(made, made.filaments["rod"]) is None
    Simulation(made)


@pytest.mark.parametrize(
    ("arguments", "key", "allowed"),
    [
        ({"fluid": {"cells": [32, 32, 32]}}, "fluid.box", "matched to a grid"),
        ({"fluid": {"box": [1.6, 1.6, 1.6]}}, "fluid.cells", "cells or thickness"),
        ({"matched": 1.6}, "fluid.drag.matched", "below the smallest side of fluid.box, 1.6"),
        ({"matched": 0.04}, "fluid.drag.matched", "0.05 to 25: 1 to 500 segments of rod"),
        (
            {"rods": {"rod": {**ROD, "length": 0.001}}},
            "fluid.drag.matched",
            "5e-05 to 0.025: 1 to 500 segments of rod",
        ),
    ],
)
def test_what_is_missing_or_too_long_is_told(arguments, key, allowed):
    with pytest.raises(CaseError) as error:
        case(**arguments)
    (fault,) = error.value.faults
    assert f": {key}: " in fault
    assert allowed in fault


def test_a_grid_that_cannot_tell_is_a_fault_of_the_case():
    made = case(fluid={**GRID, "slip": 0}, rods={"rod": {**ROD, "nodes": 81}})
    with pytest.raises(CaseError, match=r"fluid\.drag: .* singular; allowed: slip = 0\.01"):
        Simulation(made)


# --- spin ------------------------------------------------------------------------------------------------------------


def test_spin_is_that_of_a_rod_spun_through_the_grid():
    """4 pi a^2, and 3 b more of length for the ends of a rod as thick as the grid's b; none for a thin one."""
    b = 1.504506 * 0.1 / np.sqrt(1.01)
    found = {}
    for length, nodes in ((1.0, 11), (2.0, 21)):
        rod = Rod(length, nodes, PeriodicSpace((3.2,) * 3, (32,) * 3), "peskin4", 0.01, b)
        found[length] = measure(rod)
        assert found[length].perp == measure(replace(rod, radius=0.0)).perp
    assert measure(replace(rod, radius=0.0)).spin == 0
    per_length = found[2.0].spin * 2.0 - found[1.0].spin
    assert np.sqrt(per_length / (4 * np.pi)) == pytest.approx(b, rel=0.01)
    ends = (found[1.0].spin - per_length) / per_length
    assert 2 * b < ends < 4 * b
    thin = measure(replace(rod, radius=0.2 * b))
    assert thin.spin == pytest.approx(4 * np.pi * (0.2 * b) ** 2, rel=0.02)
    assert thin.spin_scatter < 1e-3


def test_a_case_in_rft_takes_its_spin_from_the_grid_where_rotation_is_grid():
    rod = {"length": 1.0, "nodes": 11, "bending": 1.0, "twisting": 1.0, "stretching": 400.0, "radius": 0.1}
    fluid = {"model": "rft", "drag": {"matched": 0.5}, "box": [1.6] * 3, "cells": [16] * 3}
    spins = {}
    for rotation in ("local", "grid"):
        case = scene({"rod": rod}, {**fluid, "rotation": rotation}, viscosity=2.0)
        filament = case.filaments["rod"]
        spins[rotation] = float(assembly_drag.drag_coefficients(case, filament, np.full(11, 0.1))[2][0])
        assert ("fluid.rotation" in idle_keys(case)) == (rotation == "local")
    matched_rod = Rod(0.5, 6, PeriodicSpace((1.6,) * 3, (16,) * 3), "peskin4", 0.01, 0.1)
    assert spins["local"] == pytest.approx(8 * np.pi * 0.01)
    assert spins["grid"] == pytest.approx(2 * measure(matched_rod).spin)
    assert spins["grid"] > 1.05 * spins["local"]  # its ends
