"""Thermal steps in the fluids of a grid, number by number: no samples, every random number and every unknown is probed.

Straight rods at rest, in a generic place and direction, kicked so little that all is linear.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from helpers.thermal_scenes import Unit, drift, moved_by_units, scene

from ibfil.linalg.constraints import Prescribed
from ibfil.linalg.normal_numbers import Draw, NormalNumbers, Purpose
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping.base import State
from ibfil.timestepping.brownian import Asked

ENERGY, SMALL = 1e-14, 1e-7
STRAIGHT: dict[str, Any] = {
    "length": 0.8,
    "nodes": 9,
    "bending": 1.0,
    "stretching": 300.0,
    "position": [0.013, 0.027, 0.041],
    "direction": [1, 0.37, 0.21],
}
TWISTING = {**STRAIGHT, "twisting": 0.7, "radius": 0.05}
CLAMPED, HINGED = {"end": "clamped"}, {"end": "hinged"}
TWO = {
    "one": {**TWISTING, "start": CLAMPED},
    "other": {**STRAIGHT, "position": [0.1, 0.4, -0.2], "loads": {"tether": {"stiffness": 3.0}}},
}
GRID = {"model": "stokes", "box": [2.4, 2.4, 2.4], "cells": [24, 24, 24], "method": "table"}
NO_BOX = {"box": "free", "cells": None, "spacing": 0.1}
SCENES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "free": ({"rod": STRAIGHT}, {}),
    "free, fft": ({"rod": STRAIGHT}, {"method": "fft"}),
    "clamped, twisting": ({"rod": {**TWISTING, "start": CLAMPED}}, {"rotation": "local"}),
    "hinged and clamped, torques": ({"rod": {**TWISTING, "start": HINGED, "finish": CLAMPED}}, {"rotation": "grid"}),
    "two, torques": (TWO, {"rotation": "grid"}),
    "free space": ({"rod": STRAIGHT}, {**NO_BOX}),
    "above a wall": ({"rod": {**STRAIGHT, "position": [0.013, 0.027, 0.341]}}, {**NO_BOX, "wall": "no-slip"}),
    "rft": ({"rod": {**TWISTING, "start": CLAMPED}}, {"model": "rft", "box": None, "cells": None, "method": "auto"}),
}
EACH_SCENE = pytest.mark.parametrize("name", SCENES)


class OneNumber(NormalNumbers):
    """Numbers of a run of which all are zero but those of ``unit``."""

    def __init__(self, unit: Unit) -> None:
        self.unit = unit

    def draw(self, purpose: Purpose, step: int, shape: tuple[int, ...]) -> np.ndarray:
        return np.zeros(shape) if purpose == Purpose.DRIFT else self.unit(purpose, shape)


class Linear(NamedTuple):
    """A step x -> A x + B w at rest, of unknowns that are not held; their stiffness -K and mobility, the free part."""

    move: np.ndarray
    kick: np.ndarray
    stiffness: np.ndarray
    mobility: np.ndarray
    places: np.ndarray  # flat indices of these unknowns


def simulation_of(name: str) -> Simulation:
    rods, fluid = SCENES[name]
    fluid = {key: value for key, value in (GRID | fluid).items() if value is not None}
    return Simulation(scene(rods, ENERGY, drag="paper", fluid=fluid, time={"step": 1e-3}))


def free_of(simulation: Simulation) -> np.ndarray:
    """Flat indices of unknowns that are not held."""
    size = len(simulation.start.r) * simulation.system.unknowns
    return np.setdiff1d(np.arange(size), simulation.system.ends.index)


def mobility(simulation: Simulation, configuration) -> np.ndarray:
    """((M^-1)_ff)^-1 at a configuration, from the whole M column by column."""
    shape = (len(configuration.r), simulation.system.unknowns)
    response = simulation.fluid.response(configuration.r, configuration.e3, 0.0, 1.0)
    none, zero, columns = Prescribed(np.zeros(0, np.int64), np.zeros(0)), np.zeros(shape), []
    for k in range(zero.size):
        unit = np.zeros(shape)
        unit.ravel()[k] = 1.0
        columns.append(response.forced(unit, none, zero).move.ravel())
    free = free_of(simulation)
    return np.linalg.inv(np.linalg.inv(np.array(columns).T)[np.ix_(free, free)])


def linear(simulation: Simulation, dt: float) -> Linear:
    """A step of length dt, probed through the scheme itself."""
    system, start, noise = simulation.system, simulation.start, simulation.model.noise
    shape, free = (len(start.r), system.unknowns), free_of(simulation)

    def step(x: np.ndarray, unit: Unit) -> np.ndarray:
        noise._numbers = OneNumber(unit)
        displaced = np.zeros(shape)
        displaced.ravel()[free] = SMALL * x
        state = State(0.0, system.move(start, displaced), np.zeros(shape), 0.0)
        y = simulation.model.stepper.step(system, simulation.fluid, state, dt).state.y_old
        return x + y.ravel()[free] / SMALL

    still = step(np.zeros(len(free)), Unit(-1))  # what rounding leaves of a rod at rest, and the drift
    move = np.array([step(x, Unit(-1)) - still for x in np.eye(len(free))]).T
    kick = moved_by_units(lambda unit: step(np.zeros(len(free)), unit) - still) * SMALL / np.sqrt(ENERGY)
    _, inner = system.forces(start, 0.0)
    stiffness = system.stiffness(start, start, inner, 0.0).dense().reshape(2 * (shape[0] * shape[1],))
    return Linear(move, kick, -stiffness[np.ix_(free, free)], mobility(simulation, start), free)


@EACH_SCENE
@pytest.mark.parametrize("dt", [1e-4, 0.1])
def test_the_stationary_covariance_is_kt_over_the_stiffness_at_any_step(name, dt):
    """K (A S A^T + B B^T - S) K^T = 0 for S = kT H^-1: also where the kicks of held nodes are taken by reactions."""
    one = linear(simulation_of(name), dt)
    h = one.stiffness
    spread = np.linalg.pinv(h, rcond=1e-10, hermitian=True)
    found = h @ (one.move @ spread @ one.move.T + one.kick @ one.kick.T) @ h
    np.testing.assert_allclose(found, h, atol=1e-5 * np.max(np.abs(h)))


@EACH_SCENE
def test_a_mode_forgets_by_one_minus_a_over_one_plus_a_a_step(name):
    """a = lam dt/2, lam the rates of M_c H: dynamics is that of the fluid, modes too stiff for it ring."""
    dt = 0.03
    one = linear(simulation_of(name), dt)
    a = 0.5 * dt * np.linalg.eigvals(one.mobility @ one.stiffness).real
    expected = np.sort((1 - a) / (1 + a))
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(one.move).real), expected, atol=3e-5)
    assert expected[0] < -0.6


def test_over_a_long_step_an_elastic_rod_diffuses_as_a_rigid_one():
    """2 kT dt X (X^T M^-1 X)^-1 X^T, X the five motions of a straight rigid rod: constraints that no code knows of."""
    simulation, dt = simulation_of("free"), 1e4
    one = linear(simulation, dt)
    r, n = simulation.start.r, len(simulation.start.r)
    along = simulation.start.e3[0]
    across = np.linalg.svd(along[None])[2][1:]
    motions = [np.tile(axis, n) for axis in np.eye(3)]
    motions += [np.cross(axis, r - r.mean(axis=0)).ravel() for axis in across]
    x = np.array(motions).T
    rigid = 2 * dt * x @ np.linalg.inv(x.T @ np.linalg.inv(one.mobility) @ x) @ x.T
    change = one.move - np.eye(3 * n)
    spread = np.linalg.pinv(one.stiffness, rcond=1e-10, hermitian=True)
    found = change @ spread @ change.T + one.kick @ one.kick.T
    np.testing.assert_allclose(found, rigid, atol=1e-3 * np.max(np.abs(rigid)))


@pytest.mark.parametrize("name", ["free", "clamped, twisting", "hinged and clamped, torques", "two, torques"])
def test_the_random_finite_difference_is_the_divergence_of_the_constrained_mobility(name):
    """Summed over w = +-1 in each unknown it is kT div M_c, as central differences of the whole matrix have it."""
    simulation, delta = simulation_of(name), 1e-5
    system, start, free = simulation.system, simulation.start, free_of(simulation)
    shape = (len(start.r), system.unknowns)
    expected = np.zeros(shape)
    for column, place in enumerate(free):
        if place % shape[1] == 3:
            continue
        unit = np.zeros(shape)
        unit.ravel()[place] = delta
        ahead, behind = (mobility(simulation, system.move(start, sign * unit)) for sign in (1, -1))
        expected.ravel()[free] += (ahead - behind)[:, column] / (2 * delta)
    noise, found = simulation.model.noise, np.zeros(shape)
    response = simulation.fluid.response(start.r, start.e3, 0.0, 0.5)
    asked = Asked(system, simulation.fluid, simulation.state_now, response, 0.0, 0.5)
    for place in range(len(start.r) * shape[1]):
        for sign in (0.5, -0.5):
            noise._drift.add(asked, Unit(place, 2 * sign), 0.5, found)
    assert np.max(np.abs(expected)) > 0.01
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.max(np.abs(expected)))


def test_the_drift_of_a_step_is_one_sample_of_it():
    simulation = simulation_of("free")
    samples = np.array([drift(simulation, step) for step in range(2)]) / ENERGY
    assert np.all(np.isfinite(samples))
    assert np.max(np.abs(samples[0] - samples[1])) > 0.1
    assert np.array_equal(samples[0], drift(simulation, 0) / ENERGY)


def test_by_transforms_and_by_the_table_a_run_goes_the_same_way():
    """The same numbers and equal matrices: to round-off, that a stiff rod of a hundred limits lets grow."""
    ends = []
    for method in ("table", "fft", "pruned"):
        fluid = {**GRID, "method": method}
        simulation = Simulation(scene({"rod": STRAIGHT}, 1e-2, drag="paper", fluid=fluid, time={"step": 1e-4}))
        simulation.advance(2e-3, lambda: None)
        ends.append(simulation.configuration.r)
    for other in ends[1:]:
        np.testing.assert_allclose(other, ends[0], atol=1e-9)


def test_numbers_of_a_draw_are_those_of_its_step():
    one, other = Draw(NormalNumbers(1), 3), Draw(NormalNumbers(1), 4)
    assert not np.array_equal(one(Purpose.DRIFT, (4,)), other(Purpose.DRIFT, (4,)))
