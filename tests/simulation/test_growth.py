"""Disturbances that grow: their rates against dense eigenvalues, and steps that follow them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.scenes import RFT, scene

from ibfil.check.report import report
from ibfil.check.warnings import warnings
from ibfil.fluids.resistive_force import mobilize
from ibfil.simulation import timescales
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping.growth import growing

COLUMN: dict[str, Any] = {
    "length": 1.0,
    "nodes": 21,
    "bending": 1.0,
    "stretching": 1e4,
    "anchor": "start",
    "start": {"end": "clamped"},
    "shape": {"kind": "straight", "perturb": [0, "1e-3*s**2", 0]},
}


def column(end: float, *, force: Any = 0.0, follower: Any = 0.0, **time: Any) -> Simulation:
    rod = {**COLUMN, "finish": {"force": [force, 0, 0], "follower": follower}}
    return Simulation(scene({"rod": rod}, RFT, end=end, **time))


@pytest.mark.parametrize(
    "load", [{"force": -3.0}, {"force": -60.0}, {"follower": -60.0}, {"follower": -25.0}, {"force": 5.0}]
)
def test_the_leading_mode_is_that_of_the_dense_matrix(load: dict[str, float]) -> None:
    """Of a column under tension or compression, after two steps that built it up; flutter is a complex pair."""
    simulation = column(1.0, **load, step=1e-4)
    simulation.advance(2e-4, lambda: None)
    system, here, time = simulation.system, simulation.configuration, simulation.time
    fluid = simulation.model.fluid_model.local_fluid(simulation.rods)
    force, inner = system.forces(here, time)
    stiffness = system.stiffness(here, here, inner, time)
    size, held = force.size, system.ends.index
    mobility = np.stack([mobilize(fluid.drag, here.e3, x.reshape(force.shape)).ravel() for x in np.eye(size)], axis=1)
    moving = np.setdiff1d(np.arange(size), held)
    jacobian = (mobility @ stiffness.dense().reshape(size, size))[np.ix_(moving, moving)]
    values = np.linalg.eigvals(jacobian)
    leading = values[np.argmax(values.real)]
    begin = np.random.default_rng(3).standard_normal(force.shape)
    begin.ravel()[held] = 0.0
    for tau in (1.0, 0.01, 0.3 / abs(leading)):
        mode = growing(fluid.linear_step(here.e3, stiffness, held, tau), begin, tau)
        if leading.real < 0:
            assert mode is None
        else:
            assert mode is not None
            assert mode.eigenvalue.real == pytest.approx(leading.real, rel=1e-3)
            assert abs(mode.eigenvalue.imag) == pytest.approx(abs(leading.imag), rel=1e-3, abs=1e-3 * leading.real)
            x = mode.shape.ravel()[moving]
            if leading.imag == 0:
                assert np.linalg.norm(jacobian @ x - leading.real * x) < 0.02 * leading.real * np.linalg.norm(x)


@pytest.mark.parametrize("force", [-60.0, -200.0])
def test_a_column_buckles_to_the_side_it_leans_to(force: float) -> None:
    """Automatic steps that did not know of growth took the tip to the other side, at +0.26 for -0.26."""
    found, fine = column(0.05, force=force), column(0.05, force=force, step=1e-4)
    assert not [line for line in warnings(fine) if "growth" in line and force > -100]
    for simulation in (found, fine):
        simulation.advance(0.05, lambda: None)
    assert fine.configuration.r[-1, 1] > 0.1
    assert found.configuration.r[-1] == pytest.approx(fine.configuration.r[-1], abs=1e-2)
    assert found.steps < 200


def test_a_given_step_that_does_not_follow_growth_is_told_at_the_start() -> None:
    """Flutter under a follower of 60 A/L^2: at such steps a rod decays where it should swing."""
    short, long = column(1.0, follower=-60.0, step=1e-3), column(1.0, follower=-60.0, step=0.05)
    assert not warnings(short)
    (told,) = warnings(long)
    assert told.startswith("time.step: 0.05 is ")
    assert "the rods' own growth or swing" in told


def test_growth_that_begins_later_is_told_when_it_does() -> None:
    """A force that sets in at t = 0.5, far from the start."""
    simulation = column(1.0, force="-200*where(t > 0.5, min((t - 0.5)/0.1, 1), 0)", step=0.01)
    assert not [line for line in warnings(simulation) if "own growth" in line]
    simulation.advance(1.0, lambda: None)
    told = [line for line in simulation.notices if "own growth" in line]
    assert len(told) == 1
    assert told[0].startswith("at t = 0.")


def test_a_watch_goes_on_from_its_state() -> None:
    """A cut run takes the same steps, with growth found before the cut."""
    whole, cut = column(0.05, force=-60.0), column(0.05, force=-60.0)
    cut.advance(0.02, lambda: None)
    again = column(0.05, force=-60.0)
    again.restore(cut.state())
    assert cut.limits.state() == again.limits.state() != {}
    for goal in (0.02, 0.05):
        whole.advance(goal, lambda: None)
    again.advance(0.05, lambda: None)
    assert np.array_equal(whole.configuration.table, again.configuration.table)
    assert whole.steps == again.steps


def test_rods_that_nothing_loads_or_holds_are_not_looked_at() -> None:
    rod = {"length": 1.0, "nodes": 11, "bending": 1.0, "stretching": 1e4, "curvature": ["3*sin(t)", 0]}
    assert Simulation(scene({"rod": rod}, RFT)).limits.growth is None
    assert column(1.0, force=1.0).limits.growth is not None


def test_steps_of_a_stiff_rod_under_a_feeble_load_grow_as_it_goes_to_rest() -> None:
    """Its bending time is a hundredth of the time in which the load moves it: 400 steps where there were 9,958."""
    rod = {"length": 1.0, "nodes": 11, "bending": 1.0, "stretching": 1e3, "loads": {"weight": [0, 0, -1]}}
    simulation = Simulation(scene({"rod": rod, "other": {**rod, "position": [0.5, 0, 0.3]}}, RFT, end=10.0))
    assert simulation.step_length == pytest.approx(timescales.slowest_bending(simulation.model) / 25)
    told = report(simulation.case)
    assert "a 25th of the slowest bending time" in told
    assert "it grows, up to 0.5027 (the time in which loads or flow move a rod by its length)" in told
    assert "time.tolerance would have the error of each step decide" in told
    simulation.advance(10.0, lambda: None)
    assert simulation.steps < 60
    fall = simulation.configuration.r[:11, 2].mean()
    assert fall == pytest.approx(-10.0 / (4 * np.pi), rel=1e-3)  # a straight rod falls as its drag says


def test_and_their_error_is_bounded_while_they_bend() -> None:
    """A bent rod that straightens, against steps of a fortieth: 5e-3 at 25 a bending time, then less."""
    rod = {**COLUMN, "shape": {"kind": "circle", "curvature": 2.0}}
    found = Simulation(scene({"rod": rod}, RFT, end=3.0))
    fine = Simulation(scene({"rod": rod}, RFT, end=3.0, step=1e-3))
    for time, most in ((0.1, 5e-3), (0.5, 3e-3), (1.5, 1e-3), (3.0, 1e-3)):
        for simulation in (found, fine):
            simulation.advance(time, lambda: None)
        apart = found.configuration.r - fine.configuration.r
        assert np.sqrt(np.mean(np.sum(apart**2, axis=1))) < most
    assert found.steps < 75  # 25 a bending time of 1.02


@pytest.mark.parametrize("left", [-1e-17, -1e-9, -1e-2])
def test_rounding_is_no_growth(left: float) -> None:
    """A step that leaves -1e-17 of a mode has damped it; such a one was growth of 1e17/tau. -1/100 is of 101/tau."""
    factors = np.array([[0.5, 0.3, left]])
    found = growing(lambda y: y * factors, np.ones((1, 3)), 1.0)
    assert found is None if abs(left) < 1e-6 else found.eigenvalue == pytest.approx(101.0)
