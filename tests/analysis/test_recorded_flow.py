"""Background flow: Z (dr/dt - u) = F in resistive-force theory (Eq. 48), and superposed on the grid's Stokes flow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from helpers.scenes import RFT, STOKES, run, scene, slopes
from scipy.optimize import brentq

from ibfil.linalg.constraints import Prescribed
from ibfil.simulation.simulation import Simulation

PERP, PAR = 4 * np.pi, 2 * np.pi
ROD: Mapping[str, Any] = {"length": 1.0, "nodes": 13, "derivative": 2, "bending": 1.0, "stretching": 1e4}
FLUIDS = pytest.mark.parametrize("fluid", [RFT, STOKES], ids=["rft", "stokes"])


@FLUIDS
def test_a_free_rod_is_carried_by_a_uniform_flow_and_feels_no_force(fluid: Mapping[str, Any]) -> None:
    """Exactly: BDF2 after one Euler step is exact for a velocity that is constant in time."""
    simulation = run(scene({"rod": ROD}, {**fluid, "flow": [0.3, -0.2, 0.1]}, end=0.5, step=0.1))
    moved = simulation.configuration.r - simulation.start.r
    assert moved == pytest.approx(np.tile([0.15, -0.1, 0.05], (13, 1)), abs=1e-9)
    assert np.abs(simulation.snapshot().filaments["rod"].force).max() < 1e-6


def test_a_uniform_flow_carries_a_rod_that_straightens_and_changes_nothing_else() -> None:
    rod = {**ROD, "shape": {"kind": "circle", "curvature": 2.0}}
    still, carried = (run(scene({"rod": rod}, {**RFT, "flow": u}, end=0.5, step=0.1)) for u in ([0, 0, 0], [0.3, 1, 0]))
    assert np.abs(still.configuration.bend).max() < 1.9
    assert carried.configuration.r - still.configuration.r == pytest.approx(np.tile([0.15, 0.5, 0], (13, 1)), abs=1e-9)


@FLUIDS
def test_a_flow_that_changes_in_time_carries_a_rod_by_its_integral(fluid: Mapping[str, Any]) -> None:
    """Taken at the end of each step, it is of second order; exactly so as BDF2 is for t^2 cos 3t.

    The velocity that is told is that at the end of the step, and so the flow's.
    """
    errors = []
    for step in (0.04, 0.02, 0.01):
        flow = ["5*t**2*cos(3*t)", 0, "t**2"]
        simulation = run(scene({"rod": ROD}, {**fluid, "flow": flow}, end=0.4, step=step))
        r, velocity = simulation.configuration.r.mean(axis=0), simulation.snapshot().filaments["rod"].velocity
        assert velocity == pytest.approx(np.tile([5 * 0.16 * np.cos(1.2), 0, 0.16], (13, 1)), abs=1e-9)
        exact = 5 * ((9 * 0.16 - 2) * np.sin(1.2) + 6 * 0.4 * np.cos(1.2)) / 27
        errors.append(float(np.abs(r - [exact, 0, 0.064 / 3]).max()))
    assert errors[-1] < 1e-4
    assert min(slopes(errors)) > 1.9


def turned(fluid: Mapping[str, Any], start: float, end: float, step: float) -> float:
    """How far a stiff straight rod at an angle to the flow u = (y, 0, 0) is from cot(angle) = cot(start) + t."""
    direction = [np.cos(start), np.sin(start), 0.0]
    rod = {**ROD, "bending": 1e3, "stretching": 1e6, "direction": direction}
    r = run(scene({"rod": rod}, {**fluid, "flow": ["y", 0, 0]}, end=end, step=step)).configuration.r
    assert np.abs(r.mean(axis=0)).max() < 1e-12
    chord = r[-1] - r[0]
    assert abs(chord[2]) < 1e-12
    return float(np.arctan2(chord[1], chord[0]) - np.arctan2(1.0, 1 / np.tan(start) + end))


@pytest.mark.parametrize(("start", "end"), [(1.2, 1.0), (2.4, 0.8)])
def test_in_shear_a_slender_rod_turns_as_jeffery_says(start: float, end: float) -> None:
    """Of infinite aspect ratio: theta' = -sin(theta)^2, whatever the drag; second order in the step."""
    errors = [abs(turned(RFT, start, end, step)) for step in (0.1, 0.05, 0.025)]
    assert errors[-1] < 1e-3
    assert min(slopes(errors)) > 1.9


@pytest.mark.parametrize(("start", "end"), [(1.2, 1.0), (2.4, 0.8)])
def test_on_a_grid_too_but_for_the_images_of_the_box(start: float, end: float) -> None:
    """A line of forces along itself pushes no node across, but its images do; those of a box twice as wide less."""
    boxes = [{**STOKES, "box": [size] * 3, "cells": [16 * size] * 3} for size in (2, 4)]
    near, far = (abs(turned(box, start, end, 0.025)) for box in boxes)
    assert far < 1e-3
    assert far < near / 5


def rates(mu: float, nodes: int) -> np.ndarray:
    """Growth rates of bends of a straight rod in u = gamma (-x, y, 0), in gamma, largest first.

    mu = zeta_perp gamma L^4/A. The rod is first let come to rest along x; then the velocity of each node across is
    differenced with the place of each, drag turning with the tangents.
    """
    gamma = mu / PERP
    rod = {**ROD, "nodes": nodes, "stretching": 1e6}
    flow = {**RFT, "flow": [f"-{gamma!r}*x", f"{gamma!r}*y", 0]}
    simulation = run(scene({"rod": rod}, flow, end=100 / gamma, step=2 / gamma, order=1))
    system, shape = simulation.system, simulation.configuration
    assert np.abs(simulation.snapshot().filaments["rod"].velocity).max() < 1e-10

    def across(y: np.ndarray) -> np.ndarray:
        moved = system.start(shape.r + np.outer(y, [0, 1, 0]), shape.e1)
        force, _ = system.forces(moved, 0.0)
        response = simulation.fluid.response(moved.r, moved.e3, 0.0, 1.0)
        return response.forced(force, Prescribed(np.zeros(0, np.int64), np.zeros(0)), np.zeros_like(force)).move[:, 1]

    h = 1e-9  # the stretch it makes is of second order, but EA is large
    jacobian = np.array([across(h * unit) - across(-h * unit) for unit in np.eye(nodes)]).T / (2 * h)
    return np.sort(np.linalg.eigvals(jacobian).real)[::-1] / gamma


def neutral(mu: float) -> float:
    """Zero where a bend, even in x, neither grows nor decays: by the power series of its equation.

    With the tension zeta_par gamma (x^2 - L^2/4)/2 of the straight rod, zeta_perp = 2 zeta_par and L = 1,

        h_t/gamma = h + x h' + (x^2 - 1/4) h''/4 - h''''/mu,   h'' = h''' = 0 at both ends
    """
    ends = []
    for a in ([1.0, 0.0], [0.0, 1.0]):
        for k in range(40):
            p = 2 * k
            right = a[k] * (1 + p + p * (p - 1) / 4) - a[k + 1] * (p + 2) * (p + 1) / 16
            a.append(mu * right / ((p + 4) * (p + 3) * (p + 2) * (p + 1)))
        h = np.polynomial.Polynomial(np.ravel(np.column_stack([a, np.zeros(len(a))])))
        ends.append([h.deriv(2)(0.5), h.deriv(3)(0.5)])
    return float(np.linalg.det(ends))


def test_a_straight_rod_at_a_stagnation_point_buckles_at_the_known_strength() -> None:
    """zeta_perp gamma L^4/A = 153.2 (linear stability). Below it only tilt grows, at 2 gamma, and drift, at gamma."""
    critical = brentq(neutral, 120.0, 180.0, xtol=1e-10)
    assert critical == pytest.approx(153.2, abs=0.01)
    errors = []
    for nodes in (17, 33, 65):
        assert rates(critical, nodes)[:2] == pytest.approx([2.0, 1.0], abs=1e-6)
        errors.append(abs(brentq(lambda mu, n=nodes: rates(mu, n)[2], 140.0, 170.0, xtol=1e-3) / critical - 1))
    assert errors[-1] < 2e-3
    assert slopes(errors)[-1] > 1.9


def test_a_held_rod_feels_the_drag_of_the_flow_along_it() -> None:
    """zeta_par U (L - s) beyond s; the support holds it all."""
    rod = {**ROD, "start": {"end": "clamped"}, "anchor": "start"}
    simulation = run(scene({"rod": rod}, {**RFT, "flow": [0.7, 0, 0]}, end=40.0, step=1.0, order=1))
    found, s = simulation.snapshot().filaments["rod"], simulation.arclength
    assert found.tension == pytest.approx(PAR * 0.7 * (1 - 0.5 * (s[1:] + s[:-1])), rel=1e-8)
    assert found.reaction_start == pytest.approx([-PAR * 0.7, 0, 0], abs=1e-8)


def test_the_flow_is_in_the_velocity_field_that_is_written() -> None:
    """A free straight rod in a uniform flow disturbs nothing: the field is the flow, but for round-off in single."""
    fluid = {**STOKES, "flow": ["0.5", "0.1*sin(pi*x)", "0"]}
    simulation = run(scene({"rod": {**ROD, "bending": 1e-8, "stretching": 1e-8}}, fluid, end=0.1, step=0.05))
    field = simulation.snapshot(("velocity",)).grid["velocity"]
    x = simulation.grid.origin[0] + simulation.grid.spacing * np.arange(32)
    assert field[..., 0] == pytest.approx(np.full((32, 32, 32), 0.5), abs=1e-6)
    assert field[..., 1] == pytest.approx(np.broadcast_to(0.1 * np.sin(np.pi * x)[:, None, None], (32,) * 3), abs=1e-6)


def test_a_fluid_with_inertia_knows_the_time_of_its_flow_in_steps_of_any_length() -> None:
    """Euler, BDF2, and BDF2 with half the step."""
    fluid = {**STOKES, "model": "navier-stokes", "density": 1.0, "flow": ["0", "0.1*sin(pi*x)*cos(9*t)", "0"]}
    simulation = Simulation(scene({"rod": ROD}, fluid, end=0.025, step=0.01))
    for until in (0.02, 0.025):
        simulation.advance(until, lambda: None)
    assert simulation.steps == 3
    assert simulation.fluid.time == pytest.approx(0.025, rel=1e-13)
    assert simulation.fluid.history.dt_old == pytest.approx(0.005, rel=1e-12)


def test_a_maintained_flow_has_no_pressure_of_its_own() -> None:
    """What drives it carries it: the pressure is that of the rods' disturbance, and these hardly push."""
    vortices = ["sin(pi*x)*cos(pi*y)", "-cos(pi*x)*sin(pi*y)", "0"]  # alone they have rho/4 (cos 2 pi x + cos 2 pi y)
    fluid = {**STOKES, "model": "navier-stokes", "density": 1.0, "flow": vortices}
    simulation = run(scene({"rod": {**ROD, "bending": 1e-8, "stretching": 1e-8}}, fluid, end=0.04, step=0.01))
    assert np.abs(simulation.snapshot(("pressure",)).grid["pressure"]).max() < 1e-6
