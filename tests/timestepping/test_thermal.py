"""Thermal forces: the kicks, the scheme's step, and the runs they are part of."""

from __future__ import annotations

import numpy as np
import pytest
import tomli_w
from helpers.runs import content, go_on, interrupted, real, run
from helpers.thermal_scenes import BENT, ROD, USUAL, blocks, drift, motion, scene, walk
from scipy import linalg, stats

from ibfil.case.reading import parse_case
from ibfil.check.dimensionless import groups
from ibfil.fluids import resistive_force
from ibfil.rods.geometry import measure
from ibfil.simulation.simulation import Simulation

# --- the kicks ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("directions", ["xyz", "xy"])
def test_kicks_have_the_covariance_of_the_mobility_and_nodes_know_nothing_of_each_other(directions):
    energy, dt, count = 0.3, 1e-3, 20000
    simulation = Simulation(scene({"rod": BENT}, energy, directions=directions))
    draws = np.array([motion(simulation, dt, step) for step in range(count)])
    mean = dt * drift(simulation)
    n = len(mean)
    z = blocks(simulation)
    kicked = [0, 1, 2, 3] if directions == "xyz" else [0, 1, 3]
    if directions == "xy":
        assert np.all(draws[:, :, 2] == 0)
    root = np.linalg.cholesky(2 * energy * dt * np.linalg.inv(z)[:, kicked][:, :, kicked])
    white = np.linalg.solve(root, (draws - mean)[:, :, kicked].transpose(1, 2, 0)).reshape(n * len(kicked), count)
    covariance = white @ white.T / count
    low, high = stats.chi2.ppf([(1 - USUAL) / 2, (1 + USUAL) / 2], count * len(white)) / (count * len(white))
    assert low < np.trace(covariance) / len(white) < high
    for values in (count * (np.diag(covariance) - 1) ** 2 / 2, count * covariance[np.triu_indices(len(white), 1)] ** 2):
        assert values.sum() < stats.chi2.ppf(USUAL, len(values))
    assert count * np.sum(white.mean(axis=1) ** 2) < stats.chi2.ppf(USUAL, len(white))


CLAMPED = {"end": "clamped"}


@pytest.mark.parametrize("directions", ["xyz", "xy"])
@pytest.mark.parametrize(
    "rod",
    [
        BENT,
        {**BENT, "derivative": 6},
        {**BENT, "spacing": "q*(1 + q)/2"},
        {**BENT, "start": CLAMPED},
        {**BENT, "start": {"end": "hinged"}},
    ],
    ids=["free", "order 6", "uneven", "clamped", "hinged"],
)
def test_the_drift_is_kt_times_the_divergence_of_the_mobility(rod, directions):
    """Each node's mobility is differenced along each direction it is kicked in; others do not enter it."""
    energy, h = 0.2, 1e-5
    simulation = Simulation(scene({"rod": rod}, energy, directions=directions))
    shape = simulation.configuration
    if directions == "xy":  # in the plane, as it is meant
        flat = shape.r * [1, 1, 0]
        shape = simulation.system.start(flat, np.tile([0.0, 0.0, 1.0], (len(flat), 1)))
        simulation.state_now = simulation.state_now._replace(configuration=shape)
    drag, dimensions = simulation.fluid.drag, len(directions)

    def mobility(r: np.ndarray, i: int, a: int) -> np.ndarray:
        """Column a of node i's mobility, at positions r."""
        unit = np.zeros((len(r), 4))
        unit[i, a] = 1.0
        return resistive_force.mobilize(drag, measure(simulation.system.mesh, r, shape.e1).e3, unit)[i, :3]

    expected = np.zeros_like(shape.r)
    for i in range(len(shape.r)):  # held nodes too: their reactions take theirs away
        for a in range(dimensions):
            there, back = shape.r.copy(), shape.r.copy()
            there[i, a] += h
            back[i, a] -= h
            expected[i] += energy * (mobility(there, i, a) - mobility(back, i, a)) / (2 * h)
    found = drift(simulation)
    assert np.max(np.abs(expected)) > 1
    np.testing.assert_allclose(found[:, :3], expected, atol=1e-6 * np.max(np.abs(expected)))
    assert np.all(found[:, 3] == 0)


def test_without_the_drift_the_ends_of_a_free_rod_would_be_pushed_inwards_by_one_and_a_half_kt_over_ds():
    energy = 0.3
    simulation = Simulation(scene({"rod": ROD}, energy))
    force = resistive_force.resist(simulation.fluid.drag, simulation.configuration.e3, drift(simulation))
    expected = np.zeros((9, 3))
    expected[[0, -1], 0] = np.array([-1, 1]) * 1.5 * energy * 8
    np.testing.assert_allclose(force, expected, atol=1e-12)


# --- the step -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("force", ["eq44", "torque-free"])
def test_a_step_is_the_linearised_trapezoid_and_one_correction(force):
    """(Z - dt/2 K) y = dt (f + Z u0) + Z xi in full, K by differencing the forces, in a flow, with a spun clamp.

    Then the same with (f(q) + f(q + y))/2 - K y/2 in place of f.
    """
    rod = {**BENT, "force": force, "start": {**CLAMPED, "spin": 3.0}, "shape": {"kind": "straight"}}
    flow = {"flow": ["0.3*y", "0.2", "10*t"]}
    dt = 1e-3
    simulation = Simulation(scene({"rod": rod}, 1e-3, fluid=flow, time={"step": dt}))
    start, system = simulation.configuration, simulation.system
    n, m = len(start.r), 4
    middle = 0.5 * dt

    def forces(y: np.ndarray) -> np.ndarray:
        return system.forces(system.move(start, y.reshape(n, m)), middle)[0].ravel()

    h = 1e-6
    k = np.array([(forces(h * e) - forces(-h * e)) / (2 * h) for e in np.eye(n * m)]).T
    z = linalg.block_diag(*blocks(simulation))
    kicks = z @ motion(simulation, dt).ravel()
    u0 = np.zeros((n, m))
    u0[:, :3] = np.stack([0.3 * start.r[:, 1], np.full(n, 0.2), np.full(n, 10 * middle)], axis=1)
    held, prescribed = system.ends.index, np.array([0, 0, 0, 3.0 * dt])
    free, left = np.setdiff1d(np.arange(n * m), held), z - 0.5 * dt * k

    def step(mean: np.ndarray) -> np.ndarray:
        right, out = dt * (mean + z @ u0.ravel()) + kicks, np.zeros(n * m)
        out[held] = prescribed
        out[free] = np.linalg.solve(left[np.ix_(free, free)], (right - left @ out)[free])
        return out

    linear = step(forces(np.zeros(n * m)))
    expected = step(0.5 * (forces(np.zeros(n * m)) + forces(linear) - k @ linear))
    assert np.max(np.abs(expected - linear)) > 1e-3 * np.max(np.abs(expected))
    found = simulation.attempt(dt)
    np.testing.assert_allclose(found.state.y_old.ravel(), expected, atol=1e-6 * np.max(np.abs(expected)))
    # What the rods do to the fluid is what moves them against it, less its kicks.
    felt = (z @ (expected / dt - u0.ravel()) - kicks / dt).reshape(n, m)
    np.testing.assert_allclose(found.force, felt, atol=1e-5 * np.max(np.abs(felt)))


def test_a_free_rod_gives_the_fluid_no_net_force_however_it_is_kicked():
    simulation = Simulation(scene({"rod": BENT}, 1e-2))
    walk(simulation, 20)
    snapshot = simulation.snapshot()
    size = np.sum(np.abs(snapshot.filaments["rod"].force))
    assert size > 1
    assert np.max(np.abs(snapshot.diagnostics["net_force"])) < 1e-9 * size


@pytest.mark.parametrize("force", ["eq44", "torque-free"])
@pytest.mark.parametrize("spacing", ["even", "q*(2 + q)/3"])
@pytest.mark.parametrize("ends", [("free", "free"), ("clamped", "free"), ("hinged", "clamped"), ("clamped", "clamped")])
def test_the_stiffness_of_a_straight_rod_at_rest_is_symmetric(ends, spacing, force):
    """Else no drag gives it Boltzmann's law: with stencils of order 6, or the cubic at a clamp, it is not."""
    rod = {**BENT, "curvature": [0, 0], "twist_rate": 0, "spacing": spacing, "force": force, "nodes": 11}
    rod |= {"start": {"end": ends[0]}, "finish": {"end": ends[1]}}
    for derivative in (2, 6):
        simulation = Simulation(scene({"rod": {**rod, "derivative": derivative}}))
        system, shape = simulation.system, simulation.configuration
        _, inner = system.forces(shape, 0.0)
        k = system.stiffness(shape, shape, inner, 0.0).dense().reshape(44, 44)
        free = np.setdiff1d(np.arange(44), system.ends.index)
        k = k[np.ix_(free, free)]
        uneven = np.max(np.abs(k - k.T)) / np.max(np.abs(k))
        assert uneven < 1e-12 if derivative == 2 else uneven > 1e-3


def test_twist_is_left_out_where_it_is_asked():
    simulation = Simulation(scene({"rod": {**ROD, "twisting": 1.0}}, 1e-6, twist=False))
    assert np.all(motion(simulation, 1e-3)[:, 3] == 0)


# --- runs ---------------------------------------------------------------------------------------------------------


def test_the_same_seed_gives_the_same_bits_and_another_seed_does_not():
    ends = []
    for seed in (1, 1, 2):
        simulation = Simulation(scene({"rod": BENT}, seed=seed))
        walk(simulation, 10)
        ends.append((simulation.configuration.r.tobytes(), simulation.configuration.e1.tobytes()))
    assert ends[0] == ends[1]
    assert ends[0][0] != ends[2][0]


def test_a_run_cut_twice_is_as_never_cut(tmp_path):
    case = scene({"rod": BENT}, time={"end": 0.003, "step": 1e-4})
    whole, path = tmp_path / "whole.h5", tmp_path / "run.h5"
    run(case, whole, build=real)
    interrupted(path, 2, case, real)
    interrupted_again = tmp_path / "again.h5"
    interrupted(interrupted_again, 11, case, real)
    for cut in (path, interrupted_again):
        go_on(cut, build=real)
        assert content(cut) == content(whole)


def test_no_random_numbers_are_made_without_a_thermal_table():
    text = tomli_w.dumps(
        {
            "filament": {"rod": ROD},
            "fluid": {"model": "rft", "viscosity": 1.0},
            "time": {"end": 1.0, "step": 1e-3},
            "output": {"every": 1.0},
        }
    )
    simulation = Simulation(parse_case(text, "test.toml"))
    assert simulation.model.noise is None


def test_no_energy_no_kicks():
    simulation = Simulation(scene({"rod": ROD}, 0.0))
    before = simulation.configuration.r.copy()
    walk(simulation, 10)
    assert np.array_equal(simulation.configuration.r, before)
    assert "A/(kT L)" not in groups(simulation)


def test_kicks_in_the_plane_leave_a_rod_in_it():
    rod = {**ROD, "curvature": [0, 3.0], "normal": [0, 1, 0], "shape": {"kind": "relaxed"}}
    simulation = Simulation(scene({"rod": rod}, 1e-2, directions="xy"))
    start = simulation.configuration.r.copy()
    walk(simulation, 100)
    moved = simulation.configuration.r - start
    assert np.max(np.abs(moved[:, :2])) > 1e-2
    assert np.max(np.abs(moved[:, 2])) < 1e-12


def test_held_ends_stay_and_a_clamp_that_leaves_twist_free_turns():
    rod = {**ROD, "twisting": 1.0, "start": {"end": "clamped"}, "finish": {"end": "hinged"}}
    free = {**ROD, "twisting": 1.0, "start": {"end": "clamped", "twist": "free"}}
    simulation = Simulation(scene({"held": rod, "free": free}, 1e-3))
    before = simulation.configuration
    walk(simulation, 50)
    after = simulation.configuration
    for node in (0, 8, 9):
        np.testing.assert_allclose(after.r[node], before.r[node], atol=1e-15)
    for node in (0, 9):
        np.testing.assert_allclose(after.e3[node], before.e3[node], atol=1e-15)
    np.testing.assert_allclose(after.e1[0], before.e1[0], atol=1e-14)
    assert np.max(np.abs(after.e1[9] - before.e1[9])) > 1e-3
    assert np.min(np.linalg.norm(after.r - before.r, axis=1)[1:8]) > 1e-4


def test_a_rod_that_does_not_twist_beside_one_that_does_is_not_turned():
    simulation = Simulation(scene({"plain": ROD, "twisting": {**ROD, "twisting": 1.0}}))
    kicks = motion(simulation, 1e-3)
    assert np.all(kicks[:9, 3] == 0)
    assert np.all(kicks[9:, 3] != 0)


def test_a_soft_round_rod_without_twist_may_turn_its_frame_at_will():
    """Its e1 is carried along as kicks turn the tangents, differently from node to node; that is no twist."""
    simulation = Simulation(scene({"rod": ROD}, 0.1))
    twisted = measure(
        simulation.system.mesh, simulation.configuration.r, np.tile([[0, 0, 1.0], [0, 1.0, 0]], (5, 1))[:9]
    )
    simulation.state_now = simulation.state_now._replace(configuration=twisted)
    walk(simulation, 1)
    assert np.max(np.abs(simulation.configuration.twist)) > 0


def test_a_step_that_fails_is_not_tried_again_with_other_kicks():
    simulation = Simulation(scene({"rod": ROD}, time={"min_step": 1e-12}))
    assert not simulation.may_halve(1.0)
