"""How far thermal rods have moved after a time: the modes of M K, the beam of Euler and Bernoulli, and samples.

Of a mode of rate lam and stiffness k the mean square of the move in a time t is 2 kT/k (1 - exp(-lam t)), in s steps of
the trapezoid 2 kT/k (1 - g^s), g = (1 - lam dt/2)/(1 + lam dt/2); without stiffness 2 kT t M.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.thermal_scenes import chains, scene, walk
from scipy.optimize import brentq

from ibfil.linalg.constraints import Prescribed
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping.base import State

BOX: dict[str, Any] = {"model": "stokes", "box": [3.2] * 3, "method": "table", "slip": 0.01}
GENERIC: dict[str, Any] = {"position": [0.013, 0.027, 0.041], "direction": [1, 0.37, 0.21], "anchor": "centroid"}


def straight(nodes: int, fluid: dict[str, Any], energy: float = 1.0, dt: float = 1e-5, **rod: Any) -> Simulation:
    """A straight free rod, L = A = eta = 1."""
    rod = {"length": 1.0, "nodes": nodes, "bending": 1.0, "stretching": 1.6e4, **GENERIC, **rod}
    return Simulation(scene({"rod": rod}, energy, drag="paper", fluid=fluid, time={"step": dt}))


def mobility(simulation: Simulation) -> np.ndarray:
    """M (3 n, 3 n) at the start, column by column."""
    start = simulation.start
    response, none = simulation.fluid.response(start.r, start.e3, 0.0, 1.0), Prescribed(np.zeros(0, int), np.zeros(0))
    zero = np.zeros(start.r.shape)
    units = np.eye(zero.size).reshape(zero.size, *zero.shape)
    return np.array([response.forced(unit, none, zero).move.ravel() for unit in units]).T


class Modes:
    """The modes of a rod at rest whose nodes only move."""

    def __init__(self, simulation: Simulation) -> None:
        start, size = simulation.start, simulation.start.r.size
        _, inner = simulation.system.forces(start, 0.0)
        k = -simulation.system.stiffness(start, start, inner, 0.0).dense().reshape(size, size)
        root = np.linalg.cholesky(mobility(simulation))
        rates, turned = np.linalg.eigh(root.T @ (0.5 * (k + k.T)) @ root)
        self.rates, self.shapes = np.where(rates < 1e-9 * rates[-1], 0.0, rates), root @ turned

    def moved(self, rows: np.ndarray, steps: int, dt: float) -> np.ndarray:
        """Mean squares over kT of rows x (k,), x the moves in so many steps of the trapezoid."""
        a = 0.5 * dt * self.rates
        soft = np.where(a > 0, self.rates, 1.0)
        by_mode = np.where(a > 0, (1 - ((1 - a) / (1 + a)) ** steps) / soft, steps * dt)
        return 2 * (rows @ self.shapes) ** 2 @ by_mode


def beam(t: float, drag: float, count: int = 60) -> float:
    """The mean square over kT of one component across of the middle of a free beam, L = A = 1, in a time t.

    Even modes phi = cosh b/2 cos b s + cos b/2 cosh b s, s from the middle, tan b/2 + tanh b/2 = 0, of rate b^4/drag.
    """
    out = 2 * t / drag
    for n in range(1, count + 1):
        half = brentq(lambda x: np.tan(x) + np.tanh(x), (n - 0.5) * np.pi + 1e-9, n * np.pi)
        s = np.linspace(-1, 1, 20001) * half
        decay = np.exp(np.abs(s) - half) * (1 + np.exp(-2 * np.abs(s))) / (1 + np.exp(-2 * half))  # cosh s/cosh half
        shape = np.cos(s) / np.cos(half) + decay
        square = np.trapezoid(shape**2, s) / (2 * half)
        rate = (2 * half) ** 4 / drag
        out += 2 / (drag * rate) * shape[10000] ** 2 / square * -np.expm1(-rate * t)
    return out


def across_the_middle(nodes: int, simulation: Simulation) -> np.ndarray:
    """Two rows (2, 3 n): the components of the middle node across the rod."""
    rows = np.zeros((2, nodes, 3))
    rows[:, nodes // 2] = np.linalg.svd(simulation.start.e3[:1])[2][1:]
    return rows.reshape(2, -1)


@pytest.mark.parametrize("t", [1e-4, 1e-3])
def test_the_middle_of_a_rod_in_drag_moves_as_that_of_a_beam(t):
    """Independent of all code here; 81 nodes against the beam, drag 4 pi across."""
    simulation = straight(81, {"model": "rft"})
    found = Modes(simulation).moved(across_the_middle(81, simulation), 50, t / 50)
    np.testing.assert_allclose(found, beam(t, 4 * np.pi), rtol=0.01)


def test_in_the_fluid_of_a_grid_it_moves_twice_as_far():
    """Length by h = ds = 0.025: 2.165e-4 and 1.430e-3, found before by other code; drag: 1.161e-4, 6.501e-4."""
    simulation = straight(81, {**BOX, "cells": [128] * 3})
    modes, rows = Modes(simulation), across_the_middle(81, simulation)
    found = [np.mean(modes.moved(rows, 400, t / 400)) for t in (1e-4, 1e-3)]
    np.testing.assert_allclose(found, [2.165e-4, 1.430e-3], rtol=0.02)


def samples(simulation: Simulation, steps: int) -> np.ndarray:
    """The centroid (steps + 1, 3) after each step."""
    weights = np.ones(len(simulation.start.r))
    weights[[0, -1]] = 0.5
    out = [weights @ simulation.start.r / weights.sum()]
    for _ in range(steps):
        walk(simulation, 1)
        out.append(weights @ simulation.configuration.r / weights.sum())
    return np.array(out)


@pytest.mark.parametrize(
    ("steps", "lags"), [(500, (1,)), pytest.param(14000, (1, 10, 100), marks=pytest.mark.slow)], ids=["quick", "full"]
)
def test_the_centroid_of_a_stiff_rod_diffuses_as_its_modes_say(steps, lags):
    """In the fluid of a grid: mean squares within three standard errors, from blocks of whole lags."""
    energy, dt = 1e-6, 1e-3
    rod = {"nodes": 9, "length": 0.8, "stretching": 300.0}
    simulation = straight(fluid={**BOX, "cells": [32] * 3}, energy=energy, dt=dt, **rod)
    weights = np.ones(9)
    weights[[0, -1]] = 0.5
    rows = np.kron(weights / weights.sum(), np.eye(3))
    modes, path = Modes(simulation), samples(simulation, steps)
    for lag in lags:
        squares = np.sum((path[lag:] - path[:-lag]) ** 2, axis=1)
        parts = np.array([part.mean() for part in np.array_split(squares, len(squares) // (5 * lag))])
        expected = energy * np.sum(modes.moved(rows, lag, dt))
        error = parts.std(ddof=1) / np.sqrt(len(parts))
        assert error < 0.25 * expected
        assert abs(squares.mean() - expected) < 3 * error


@pytest.mark.slow
def test_chains_that_twist_in_the_fluid_of_a_grid_keep_boltzmanns_law():
    """Twelve chains of 8 nodes in one box, torques and all; kT = 0.2. Errors from independent chains.

    O3 ds is sin b (1 + cos beta)/2 of a twist b, beta between tangents, and M3 = C O3: <(O3 ds)^2> = 0.0396.
    """
    count, nodes, energy, steps = 12, 8, 0.2, 3000
    rod = {"length": 1.0, "nodes": nodes, "bending": 1.0, "twisting": 0.7, "stretching": 1400.0, "radius": 0.05}
    places = np.random.default_rng(3).uniform(-1.6, 1.6, (count, 3)).tolist()
    rods = {f"rod{k}": {**rod, "position": place} for k, place in enumerate(places)}
    fluid = {**BOX, "cells": [32] * 3, "rotation": "grid"}
    simulation = Simulation(scene(rods, energy, drag="paper", fluid=fluid, time={"step": 2e-5}))
    r = chains(count, nodes, energy, seed=1) + np.array(places)[:, None]
    start = simulation.system.start(r.reshape(-1, 3), np.tile([0.0, 0.0, 1.0], (count * nodes, 1)))
    simulation.state_now = State(0.0, start, np.zeros((count * nodes, 4)), 0.0)
    cosines, twists = np.zeros(count), np.zeros(count)
    for step in range(steps):
        walk(simulation, 1)
        if step < 500:  # e1 begins untwisted by half
            continue
        r = simulation.configuration.r.reshape(count, nodes, 3)
        t = np.diff(r, axis=1)
        t /= np.linalg.norm(t, axis=2)[:, :, None]
        cosines += np.sum(t[:, 1:] * t[:, :-1], axis=2).mean(axis=1) / (steps - 500)
        twist = simulation.configuration.twist.reshape(count, nodes)[:, :-1] / (nodes - 1)
        twists += np.mean(twist**2, axis=1) / (steps - 500)
    for found, expected in ((cosines, 0.97143), (twists, 0.0396)):
        error = found.std(ddof=1) / np.sqrt(count)
        assert error < 0.1 * expected
        assert abs(found.mean() - expected) < 3 * error
