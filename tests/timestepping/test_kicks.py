"""Lengths of thermal steps: trial steps against exact matrices, and runs that do not explode with the steps chosen."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from helpers.thermal_scenes import BENT, DRAG, ROD, blocks, many, scene, walk
from scipy import linalg
from scipy.stats import qmc

from ibfil.case.schema import Case
from ibfil.check.warnings import warnings
from ibfil.errors import CaseError, RunFailed
from ibfil.linalg.constraints import Prescribed
from ibfil.simulation import thermal_step, timescales
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping.kicks import Trials

CLAMPED = {"end": "clamped"}

# --- trial steps --------------------------------------------------------------------------------------------------


def kicks_of(simulation: Simulation) -> thermal_step.KickSizes:
    """The sizes of kicks in a step of the case."""
    return thermal_step.sizes_of_step(simulation.model, simulation.step_length)


def trials(simulation: Simulation, count: int) -> Trials:
    return Trials(simulation.system, simulation.fluid, simulation.model.noise, simulation.start, 0.0, count)


def matrices(simulation: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Z and -K of unknowns that are not held, in full."""
    system, start = simulation.system, simulation.start
    _, inner = system.forces(start, 0.0)
    size = len(start.r) * system.unknowns
    stiffness = -system.stiffness(start, start, inner, 0.0).dense().reshape(size, size)
    free = np.setdiff1d(np.arange(size), system.ends.index)
    return linalg.block_diag(*blocks(simulation))[np.ix_(free, free)], stiffness[np.ix_(free, free)]


@pytest.mark.parametrize(
    "rod", [ROD, {**BENT, "start": CLAMPED}, {**ROD, "twisting": 0.7}], ids=["free", "held", "twist"]
)
def test_trial_steps_turn_segments_as_steps_in_equilibrium_do(rod):
    """Of those the displacements have the covariance 2 kT dt (Z + dt/2 H)^-1, exactly."""
    energy, simulation = 1e-3, Simulation(scene({"rod": rod}, 1e-3))
    (z, h), limit = matrices(simulation), simulation.explicit_limit()
    n, m = len(simulation.start.r), simulation.system.unknowns
    free = np.setdiff1d(np.arange(n * m), simulation.system.ends.index)
    tangent = simulation.start.edge / simulation.start.length[:, None]
    tried = trials(simulation, 500)
    for ratio in (0.25, 0.5, 1, 2, 4, 8, 16, 32):
        dt = ratio * limit
        if ratio not in (0.25, 2, 32):
            tried.pass_by(dt)
            continue
        covariance = np.zeros((n * m, n * m))
        covariance[np.ix_(free, free)] = 2 * energy * dt * np.linalg.inv(z + 0.5 * dt * h)
        covariance = covariance.reshape(n, m, n, m)[:, :3, :, :3]
        found, expected = tried.of(dt).turn, []
        for i in range(n - 1):
            across = np.eye(3) - np.outer(tangent[i], tangent[i])
            change = covariance[i + 1, :, i + 1] + covariance[i, :, i] - 2 * covariance[i, :, i + 1]
            expected.append(np.trace(across @ change) / simulation.start.length[i] ** 2)
        assert np.mean(found[:-1]) == pytest.approx(np.mean(expected), rel=0.08)


def test_what_rings_is_the_work_of_the_force_that_a_linear_step_leaves_out():
    """dt phi.Z^-1 phi/(8 kT), from the same steps, in full."""
    energy, simulation = 1e-2, Simulation(scene({"rod": {**BENT, "start": CLAMPED}}, 1e-2))
    dt, system, start = 20 * simulation.explicit_limit(), simulation.system, simulation.start
    found = trials(simulation, 5).of(dt).ringing
    force, inner = system.forces(start, 0.0)
    stiffness, z = system.stiffness(start, start, inner, 0.0), linalg.block_diag(*blocks(simulation))
    expected, again = np.zeros(len(force)), trials(simulation, 5)
    for _, y in again._steps(again._response(dt), dt, 5):
        left_out = system.forces(system.move(start, y), 0.0)[0] - force - stiffness.times(y)
        left_out.ravel()[system.ends.index] = 0.0
        moved = np.linalg.solve(z, left_out.ravel()).reshape(left_out.shape)
        expected += dt * np.sum((left_out * moved)[:, :3], axis=1) / (8 * energy) / 5
    assert np.max(expected) > 1e-3
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_a_background_flow_and_a_start_out_of_equilibrium_are_no_kicks():
    rod = {**ROD, "curvature": [5.0, 0], "twisting": 0.7, "shape": {"kind": "straight"}}
    rest, flown = (
        Simulation(scene({"rod": {**ROD, "twisting": 0.7}}, 1e-6)),
        Simulation(scene({"rod": rod}, 1e-6, fluid={"flow": ["3*y", "2", "0"]})),
    )
    dt = 10 * rest.explicit_limit()
    assert np.mean(trials(flown, 50).of(dt).turn) == pytest.approx(np.mean(trials(rest, 50).of(dt).turn), rel=0.1)


# --- the step that is chosen --------------------------------------------------------------------------------------


def test_automatic_steps_keep_kicks_small():
    cold, hot, stiff = (
        Simulation(scene({"rod": {**ROD, "stretching": ea}}, energy, time={"step": "auto"}))
        for energy, ea in ((1e-8, 2e2), (0.1, 2e3), (0.02, 2e4))
    )
    assert cold.step_length == pytest.approx(timescales.slowest_bending(cold.model) / 25)
    for simulation, decides in ((hot, "turn"), (stiff, "ringing")):
        limit = {"turn": thermal_step.TURN, "ringing": thermal_step.RINGING}[decides]
        assert getattr(kicks_of(simulation), decides) == pytest.approx(limit, rel=0.5)
        assert max(kicks_of(simulation).over()) < 1.5


def test_the_seed_of_a_run_does_not_change_its_step():
    lengths = {Simulation(scene({"rod": ROD}, 0.1, time={"step": "auto"}, seed=k)).step_length for k in (1, 2)}
    assert len(lengths) == 1


@pytest.mark.parametrize("step", ["auto", 3e-5])
def test_a_run_begins_with_short_steps_that_double(step):
    simulation = Simulation(scene({"rod": {**ROD, "stretching": 2e4}}, 1e-4, time={"step": step}))
    limit, lengths = simulation.explicit_limit(), []
    simulation.advance(5 * simulation.step_length, lambda: lengths.append(simulation.state_now.dt_old))
    assert lengths[0] <= limit
    assert simulation.step_length > 20 * limit
    assert all(new <= 2 * old * (1 + 1e-9) for old, new in pairwise(lengths))
    assert lengths[-1] == pytest.approx(simulation.step_length)


def test_so_that_every_mode_has_its_thermal_spread_at_once():
    """33 nodes from rest; after as many full steps, without the short ones, strains have a third of their variance."""
    nodes, rods, energy, stretching = 33, 40, 2e-6, 2e4
    simulation = many({**ROD, "nodes": nodes, "stretching": stretching}, rods, energy, 3e-6)
    dt, joined = simulation.step_length, simulation.system.mesh.joined

    def variance(simulation: Simulation) -> float:
        strain = simulation.configuration.length[joined] / simulation.system.mesh.ds[joined] - 1
        return float(np.mean(strain**2) * stretching / (nodes - 1) / energy)

    assert dt > 200 * simulation.explicit_limit()
    simulation.advance(3 * dt, lambda: None)
    without = Simulation(simulation.case)
    walk(without, simulation.steps)
    assert variance(simulation) == pytest.approx(1.0, abs=3 * np.sqrt(2 / (rods * (nodes - 1))))
    assert variance(without) < 0.5


def test_warnings_of_a_given_step_say_what_kicks_will_do():
    def told(step: float, energy: float = 0.02, **rod: Any) -> str:
        return "\n".join(warnings(Simulation(scene({"rod": {**ROD, **rod}}, energy, time={"step": step}))))

    stiff = {"nodes": 16, "stretching": 2e4}
    chosen = Simulation(scene({"rod": {**ROD, **stiff}}, 0.02, time={"step": "auto"})).step_length
    assert "time.step" not in told(chosen, **stiff)
    assert "less than their thermal variance" in told(2.5 * chosen, **stiff)
    assert "the run is likely to explode" in told(12 * chosen, **stiff)
    soft = {"nodes": 8, "stretching": 1400.0}
    assert "time.step" not in told(1.2e-5, 0.2, **soft)
    assert "% longer" in told(4e-5, 0.2, **soft)


# --- runs ---------------------------------------------------------------------------------------------------------


def example(place: np.ndarray, seed: int) -> Case:
    """A scene of the map: nodes, kT and EA by ``place`` (5,) within (0, 1), its kind, and whether it twists."""
    nodes = round(8 * (129 / 8) ** place[0])
    energy, stretching = 1e-4 * 2000 ** place[1], 50 * 2e4 ** place[2]
    kind = ("straight", "helical", "clamped", "several")[int(4 * place[3])]
    rod: dict[str, Any] = {**ROD, "nodes": nodes, "stretching": stretching}
    if place[4] < 0.5 or kind == "helical":
        rod["twisting"] = 0.7
    if kind == "helical":
        rod |= {"curvature": [6.0, 0], "shape": {"kind": "relaxed"}, "twist_rate": 6.0}
    if kind == "clamped":
        rod["start"] = CLAMPED
    rods = {f"rod{k}": {**rod, "position": [0, 0.3 * k, 0]} for k in range(3 if kind == "several" else 1)}
    return scene(rods, energy, drag=DRAG, time={"step": "auto", "end": 1e5}, seed=seed)


def survivors(count: int, steps: int) -> Iterator[str]:
    """The fate of the first ``count`` scenes of the map after so many steps each: "runs", or a refusal or failure."""
    for k, place in enumerate(qmc.Sobol(5, seed=1).random(512)[:count]):
        try:
            simulation = Simulation(example(place, seed=k + 1))
        except CaseError as refused:
            yield str(refused)
            continue
        try:
            while simulation.steps < steps:
                simulation.advance(simulation.time + 100 * simulation.step_length, lambda: None)
        except RunFailed as failed:
            yield str(failed)
            continue
        yield "runs"


def test_the_first_scenes_of_the_map_do_not_explode():
    assert list(survivors(12, 200)) == 12 * ["runs"]


@pytest.mark.slow
def test_none_of_512_scenes_explodes_or_it_is_refused_with_a_sentence():
    """8 to 129 nodes, kT L/A from 1e-4 to 0.2, EA L^2/A from 50 to 1e6; straight, helical, clamped, three of them."""
    fates = list(survivors(512, 2000))
    assert fates.count("runs") == 499
    assert all(fate == "runs" or "for a thermal stretch of" in fate for fate in fates)


@pytest.mark.slow
@pytest.mark.parametrize(("longer", "least"), [(1, 0.0), (2, 0.1)])
def test_what_rings_is_what_the_variance_of_the_stiffest_motion_is_off_by(longer, least):
    """Strains have 1 - W of their variance, to first order; without the correction 1 + W.

    16 nodes, EA L^2/A = 2e4, kT L/A = 0.02.
    """
    rod, rods, energy = {**ROD, "nodes": 16, "stretching": 2e4}, 30, 0.02
    dt = longer * many(rod, 1, energy, "auto").step_length
    simulation = many(rod, rods, energy, dt)
    joined, found = simulation.system.mesh.joined, []
    simulation.advance(50 * dt, lambda: None)
    for _ in range(400):
        simulation.advance(simulation.time + 5 * dt, lambda: None)
        strain = (simulation.configuration.length[joined] / simulation.system.mesh.ds[joined] - 1).reshape(rods, 15)
        found.append(np.var(strain, axis=1) * 2e4 / 15 / energy * 15 / 14)
    of_rods = np.mean(found, axis=0)
    error, ringing = (
        of_rods.std(ddof=1) / np.sqrt(rods),
        kicks_of(simulation).ringing,
    )
    assert ringing > least
    assert np.mean(of_rods) == pytest.approx(1 - ringing, abs=3 * error + ringing**2)


def test_held_unknowns_do_not_move_in_trials():
    simulation = Simulation(scene({"rod": {**ROD, "start": CLAMPED}}, 1e-3))
    tried = trials(simulation, 3)
    tried.of(1e-5)
    assert isinstance(tried._held, Prescribed)
    assert np.all(tried._x.ravel()[tried._held.at] == 0)
