"""Rods in a Navier-Stokes fluid: momentum, orders in time, Stokes flow as a limit, steps that fail, steps it bounds."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from helpers.scenes import STOKES, rms, run, slopes, swimmer

from ibfil.assembly.fluids.navier_stokes import crossing
from ibfil.errors import RunFailed
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping.base import NotConverged

# --- rods in it ------------------------------------------------------------------------------------------------------


def inertial(density: float, **more) -> dict:
    return {**STOKES, "model": "navier-stokes", "density": density, **more}


def test_the_fluid_keeps_its_momentum_and_that_of_a_free_rod():
    simulation = run(swimmer(inertial(20.0), rod={"nodes": 21}, end=0.1, step=0.01))
    past = simulation.fluid.history  # type: ignore[attr-defined]
    assert np.abs(past.now).max() > 1e-4
    assert not past.now[:, 0, 0, 0].any()
    snapshot = simulation.snapshot()
    force = snapshot.filaments["rod"].force
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()


@pytest.mark.parametrize(("scheme", "order"), [("semi-implicit", 1), ("implicit", 1), ("implicit", 2)])
def test_order_in_time(scheme, order):
    ends = []
    for steps in (20, 40, 80, 160):
        case = swimmer(
            inertial(30.0),
            rod={"nodes": 15},
            smooth=True,
            stretching=300.0,
            end=0.3,
            step=0.3 / steps,
            scheme=scheme,
            order=order,
        )
        ends.append(run(case).configuration.r)
    errors = [rms(a - b) for a, b in pairwise(ends)]
    assert slopes(errors)[-1] == pytest.approx(order, abs=0.3)


def test_explicit_steps_converge_to_what_implicit_ones_do():
    more = {"rod": {"nodes": 11}, "stretching": 100.0, "end": 0.02}
    implicit = run(swimmer(inertial(5.0), step=1e-4, **more)).configuration.r
    simulation = run(swimmer(inertial(5.0), step="auto", scheme="explicit", **more))
    dt = simulation.step_length
    assert 5e-4 < dt < 2e-3
    finer = (run(swimmer(inertial(5.0), step=dt / n, scheme="explicit", **more)) for n in (2, 4))
    errors = [rms(one.configuration.r - implicit) for one in (simulation, *finer)]
    assert slopes(errors) == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("density", [1.0, 100.0])
def test_explicit_limit_knows_inertia(density):
    """It is where explicit steps stop being stable, or a little below."""
    more = {"rod": {"nodes": 11}, "stretching": 100.0}
    limit = Simulation(swimmer(inertial(density), step=1e-3, **more)).explicit_limit()
    assert limit > 1.5 * Simulation(swimmer(STOKES, step=1e-3, **more)).explicit_limit()
    run(swimmer(inertial(density), step=0.9 * limit, scheme="explicit", end=40 * limit, **more))
    with pytest.raises(RunFailed):
        run(swimmer(inertial(density), step=1.6 * limit, scheme="explicit", end=100 * limit, **more))


def test_hardly_any_inertia_is_stokes_flow():
    period = 2 * np.pi / 10
    settings = {"rod": {"nodes": 21}, "end": period, "step": period / 100}
    stokes, almost, far = (
        run(swimmer(fluid, **settings)).configuration.r for fluid in (STOKES, inertial(1e-4), inertial(10.0))
    )
    assert rms(almost - stokes) < 3e-5
    assert rms(far - stokes) > 1e-3


@pytest.mark.slow
def test_hardly_any_inertia_is_stokes_flow_on_the_papers_grid():
    period = 2 * np.pi / 10
    grid = {"box": [3.2] * 3, "cells": [64] * 3}
    ends = [
        run(swimmer({**fluid, **grid}, stretching=400.0, end=period, step=period / 100))
        for fluid in (STOKES, inertial(1e-4))
    ]
    assert rms(ends[1].configuration.r - ends[0].configuration.r) < 3e-5


# --- steps that are tried again --------------------------------------------------------------------------------------


def test_a_step_that_fails_and_is_halved_leaves_no_trace_in_the_past(monkeypatch):
    """The same steps, taken without a failure, come to the same."""
    case = swimmer(inertial(10.0), rod={"nodes": 15}, end=0.1, step=0.01)
    one, two = Simulation(case), Simulation(case)
    scheme, tried, fail = one.model.stepper, [], (1, 5, 6)

    class Failing:
        order = 2

        def step(self, rods, fluid, state, dt):
            tried.append(dt)
            step = scheme.step(rods, fluid, state, dt)
            if len(tried) in fail:
                raise NotConverged("so the test has it", 0)
            return step

    monkeypatch.setattr(one, "model", replace(one.model, stepper=Failing()))
    one.advance(0.1, lambda: None)
    assert one.shortened == len(fail)
    good = [dt for k, dt in enumerate(tried, 1) if k not in fail]
    assert len(set(np.round(good, 9))) > 2
    for dt in good:
        two.accept(two.attempt(dt), two.time + dt)
    assert two.configuration.r == pytest.approx(one.configuration.r, abs=1e-14)
    assert two.fluid.history.now == pytest.approx(one.fluid.history.now, abs=1e-14)  # type: ignore[attr-defined]


@pytest.mark.parametrize("density", [1.0, 50.0])
def test_the_error_keeps_within_the_tolerance(density):
    """A unit time; the swimmer forgets some of it on the way."""
    settings = {"rod": {"nodes": 15}, "stretching": 300.0, "end": 0.6}
    reference = run(swimmer(inertial(density), step=0.6 / 600, **settings)).configuration.r
    for tolerance in (0.1, 0.01):
        simulation = run(swimmer(inertial(density), tolerance=tolerance, **settings))
        assert tolerance / 50 < rms(simulation.configuration.r - reference) / 0.6 < tolerance
        assert simulation.steps < 60


# --- steps and the speed of the fluid --------------------------------------------------------------------------------


def test_automatic_steps_let_no_fluid_cross_more_than_a_cell():
    """A stream of 10 past a swimmer, whose own motion asks for 25 steps a period: cells of 1/16, so steps of 1/160.

    Automatic ones are shorter by what rho u h/eta = 10/16 asks for.
    """
    settings = {"rod": {"nodes": 11}, "stretching": 300.0, "end": 2 * np.pi / 10}
    stream = inertial(1.0, flow=["10", "0", "0"])
    assert run(swimmer(inertial(1.0), **settings)).steps in (25, 26)
    for more, part in (({}, crossing(10 / 16)), ({"tolerance": 0.5}, 1.0)):
        simulation, ends = Simulation(swimmer(stream, **settings, **more)), [0.0]
        simulation.advance(settings["end"], lambda s=simulation, ends=ends: ends.append(s.time))
        assert part / 250 < max(np.diff(ends)) < 1.0001 * part / 160


def test_given_steps_in_which_the_fluid_goes_too_far_are_told_once():
    stream = inertial(1.0, flow=["10", "0", "0"])
    simulation = run(swimmer(stream, rod={"nodes": 11}, stretching=300.0, end=0.05, step=0.0125))
    assert simulation.steps == 4
    (told,) = simulation.notices
    assert re.search(r"at t = 0\.0125 the fluid crosses 2(\.[0-4])? cells in a step.*take a step below 0\.00", told)


def test_single_precision_keeps_single_fields_and_is_off_by_a_millionth():
    """Of the swimmer's length, at Re about 10: rounding of 6e-8 a step, against a motion of 1e-2 a step."""
    runs = []
    for precision in ("double", "single"):
        simulation = run(swimmer({**inertial(10.0), "precision": precision}, rod={"nodes": 21}, end=0.2, step=0.02))
        past = simulation.fluid.history  # type: ignore[attr-defined]
        assert {f.itemsize for f in (past.now, past.old, past.n_now, past.n_old)} == {8 if runs else 16}
        runs.append(simulation.configuration.r)
    assert 1e-14 < rms(runs[0] - runs[1]) < 1e-6
