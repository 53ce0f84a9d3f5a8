"""Closed rods with thermal forces: the spread of a ring's modes, the drift, and copies that stay what they are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.thermal_scenes import Unit, moved_by_units, scene, walk

from ibfil.linalg.constraints import Prescribed
from ibfil.linalg.normal_numbers import NormalNumbers, Purpose
from ibfil.rods.linking import linking
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping.base import State
from ibfil.timestepping.brownian import Asked

ENERGY, SMALL = 1e-14, 1e-7
FREE: dict[str, Any] = {"model": "stokes", "box": "free", "spacing": 0.2, "method": "table"}
RFT: dict[str, Any] = {"model": "rft"}


def ring(segments: int, fluid: dict[str, Any], energy: float = ENERGY, **rod: Any) -> Simulation:
    """A ring of radius 1, A = 1, which at rest is one."""
    shape = {"kind": "circle", "curvature": 1.0}
    place = {"anchor": "centroid", "position": [0.013, 0.027, 0.041], "direction": [1, 0.37, 0.21]}
    rod = {"length": 2 * np.pi, "nodes": segments + 1, "closed": True, "shape": shape, **place, **rod}
    rod = {"bending": 1.0, "twisting": 0.7, "stretching": 1e3, "radius": 0.05, "curvature": [1.0, 0.0], **rod}
    return Simulation(scene({"ring": rod}, energy, drag="paper", fluid=fluid, time={"step": 1e-3}))


class OneNumber(NormalNumbers):
    """Numbers of a run of which all are zero but those of ``unit``."""

    def __init__(self, unit: Unit) -> None:
        self.unit = unit

    def draw(self, purpose: Purpose, step: int, shape: tuple[int, ...]) -> np.ndarray:
        return np.zeros(shape) if purpose == Purpose.DRIFT else self.unit(purpose, shape)


def relaxed(segments: int) -> State:
    """The polygon at rest."""
    simulation = ring(segments, RFT, 0.0)
    for _ in range(100):
        simulation.accept(simulation.attempt(1.0), simulation.time + 1.0)
    return simulation.state_now._replace(time=0.0, steps=0)


def own(simulation: Simulation) -> np.ndarray:
    """The nodes of the ring, each once."""
    return np.setdiff1d(np.arange(len(simulation.start.r)), simulation.system.copies)


def spread(simulation: Simulation, state: State, dt: float) -> np.ndarray:
    """S = A S A^T + B B^T over kT, of own nodes (k m, k m), without the motions that nothing holds."""
    system, noise = simulation.system, simulation.model.noise
    shape, nodes = state.y_old.shape, own(simulation)

    def step(x: np.ndarray, unit: Unit) -> np.ndarray:
        noise._numbers = OneNumber(unit)
        displaced = np.zeros(shape)
        displaced[nodes] = SMALL * x.reshape(-1, shape[1])
        begin = state._replace(configuration=system.move(state.configuration, displaced))
        y = simulation.model.stepper.step(system, simulation.fluid, begin, dt).state.y_old
        assert np.array_equal(y, system.complete(y))
        return x + y[nodes].ravel() / SMALL

    zero = np.zeros(len(nodes) * shape[1])
    still = step(zero, Unit(-1))
    a = np.array([step(x, Unit(-1)) - still for x in np.eye(len(zero))]).T
    b = moved_by_units(lambda unit: step(zero, unit) - still) * SMALL / np.sqrt(ENERGY)
    rate, modes = np.linalg.eig(a)
    back = np.linalg.inv(modes)
    driven = back @ b @ b.T @ back.conj().T
    falls = 1 - rate[:, None] * rate.conj()[None]
    live = np.abs(1 - rate) > 5e-3  # the softest has 0.045 at dt = 0.1; motions of the whole, 0.002 by rounding at most
    inside = live[:, None] & live[None]
    return (modes @ np.where(inside, driven / np.where(inside, falls, 1), 0) @ modes.conj().T).real


def of_modes(simulation: Simulation, state: State, dt: float) -> np.ndarray:
    """Variances of the radial modes cos 2 and 3 theta over kT R^3/(pi A (n^2 - 1)^2)."""
    covariance, nodes = spread(simulation, state, dt), own(simulation)
    away = state.configuration.r[nodes] - state.configuration.r[nodes].mean(axis=0)
    plane = np.linalg.svd(away)[2][:2]
    theta = np.arctan2(away @ plane[1], away @ plane[0])
    out = []
    for n in (2, 3):
        mode = np.zeros((len(nodes), state.y_old.shape[1]))
        mode[:, :3] = 2 / len(nodes) * np.cos(n * theta)[:, None] * away / np.linalg.norm(away, axis=1)[:, None]
        out.append(mode.ravel() @ covariance @ mode.ravel() * np.pi * (n**2 - 1) ** 2)
    return np.array(out)


def test_modes_of_a_ring_have_half_kt_each_at_any_step():
    """Of a cos n theta the bending energy is pi A (n^2 - 1)^2 a^2/(2 R^3) (Love 1927, art. 293).

    Polygons have it to second order.
    """
    coarse, fine = (of_modes(ring(n, RFT), relaxed(n), 1.0) for n in (24, 48))
    assert np.all(coarse - 1 > 0.05)
    np.testing.assert_allclose((4 * fine - coarse) / 3, 1, atol=0.005)
    np.testing.assert_allclose(of_modes(ring(24, RFT), relaxed(24), 0.1), coarse, rtol=1e-5)


def test_and_in_any_fluid():
    """But for what Eq. 44 of a bent polygon lacks to be the slope of an energy, which is of second order too."""
    state = relaxed(12)
    np.testing.assert_allclose(*(of_modes(ring(12, fluid), state, 1.0) for fluid in (RFT, FREE)), rtol=0.002)


def mobility(simulation: Simulation, configuration: Any) -> np.ndarray:
    """M of own nodes at a configuration, column by column."""
    shape, nodes = (len(configuration.r), simulation.system.unknowns), own(simulation)
    response = simulation.fluid.response(configuration.r, configuration.e3, 0.0, 1.0)
    none, columns = Prescribed(np.zeros(0, np.int64), np.zeros(0)), []
    for node in nodes:
        for component in range(shape[1]):
            unit = np.zeros(shape)
            unit[node, component] = 1.0
            columns.append(response.forced(unit, none, np.zeros(shape)).move[nodes].ravel())
    return np.array(columns).T


@pytest.mark.parametrize("fluid", [RFT, FREE], ids=["rft", "free space"])
def test_the_drift_of_a_ring_is_the_divergence_of_its_mobility(fluid):
    """Over the nodes that are its own; evenly spaced in resistive-force theory it has none."""
    simulation, delta = ring(8, fluid), 1e-5
    system, start, nodes = simulation.system, simulation.start, own(simulation)
    shape = (len(start.r), system.unknowns)
    expected = np.zeros((len(nodes), shape[1]))
    for k, node in enumerate(nodes):
        for component in range(3):
            unit = np.zeros(shape)
            unit[node, component] = delta
            ahead, behind = (mobility(simulation, system.move(start, sign * unit)) for sign in (1, -1))
            expected.ravel()[:] += (ahead - behind)[:, k * shape[1] + component] / (2 * delta)
    noise, found = simulation.model.noise, np.zeros(shape)
    response = simulation.fluid.response(start.r, start.e3, 0.0, 0.5)
    asked = Asked(system, simulation.fluid, simulation.state_now, response, 0.0, 0.5)
    places = range(shape[0] * shape[1]) if fluid is FREE else [0]
    for place in places:
        for sign in (0.5, -0.5):
            noise._drift.add(asked, Unit(place, 2 * sign), 0.5, found)
    assert fluid is RFT or not noise._drift._free[system.copies].any()  # two together would move it at random
    assert (np.max(np.abs(expected)) > 1e-3) == (fluid is FREE)
    np.testing.assert_allclose(found[nodes], expected, atol=1e-5 * max(np.max(np.abs(expected)), 1e-3))


def test_a_ring_stays_closed_and_linked_however_it_is_kicked():
    """The last node and its e1 are the first ones, to the last bit."""
    simulation = ring(24, RFT, 0.05, linking=1)
    walk(simulation, 200)
    q, where = simulation.configuration, simulation.rods.nodes[0]
    r, e1 = q.r[where], q.e1[where]
    assert np.max(np.abs(r - simulation.start.r[where])) > 0.05
    assert np.array_equal(q.r, q.r[simulation.system.source])
    assert np.array_equal(e1[0], e1[-1])
    assert linking(r, e1).linking == 1
