"""Internal damping: its rates, its stiffness, and what it remembers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import tomli_w

from ibfil.case.reading import parse_case
from ibfil.simulation.simulation import Simulation

SLOWEST = 12.36236  # of a clamped rod, A/(zeta L^4)


def rod(**given: Any) -> Simulation:
    """A rod in a drag of one per length."""
    rod = {"length": 1.0, "nodes": 21, "bending": 1.0, "stretching": 1e6, **given}
    drag = {"model": "rft", "viscosity": 1.0, "drag": {"perp": 1.0, "par": 0.5, "spin": 1e-3}}
    case = {"filament": {"rod": rod}, "fluid": drag, "time": {"end": 10.0, "step": 0.01}, "output": {"every": 1.0}}
    return Simulation(parse_case(tomli_w.dumps(case), "rod.toml"))


@pytest.mark.parametrize("mu", [0.0, 0.02, 0.2])
def test_a_clamped_rod_comes_back_at_its_rate(mu):
    """k/(1 + mu k); also where mu is many steps, at which a rate lagged by a step would explode."""
    bent = {"kind": "straight", "perturb": [0, "1e-4*s**2*(6 - 4*s + s**2)", 0]}
    simulation, rate = rod(damping=mu, start={"end": "clamped"}, shape=bent), SLOWEST / (1 + mu * SLOWEST)
    dt, tips = 0.02 / rate, []
    for _ in range(60):
        simulation.accept(simulation.attempt(dt), simulation.time + dt)
        tips.append(simulation.configuration.r[-1, 1] - simulation.configuration.r[0, 1])
    assert -np.diff(np.log(tips))[30:].mean() / dt == pytest.approx(rate, rel=0.01)


def test_its_stiffness_is_the_derivative_and_its_memory_part_of_the_state():
    given = {"damping": 0.3, "twisting": 0.7, "radius": 0.02, "curvature": ["sin(3*s + t)", 1.0], "stretching": 100.0}
    one, other = rod(**given), rod(**given)
    one.advance(0.05, lambda: None)
    other.restore(one.state())
    for simulation in (one, other):
        simulation.advance(0.1, lambda: None)
    assert np.array_equal(one.configuration.table, other.configuration.table)
    system, start, h = one.system, one.configuration, 1e-6
    system.begin(0.01, 0.7)
    y = 0.003 * np.random.default_rng(2).standard_normal((21, 4))
    moved = system.move(start, y)
    exact = system.stiffness(moved, start, system.forces(moved, 0.1)[1], 0.1).dense().reshape(84, 84)
    numerical = np.zeros_like(exact)
    for k in range(84):
        step = np.zeros(84)
        step[k] = h
        ahead, behind = (system.forces(system.move(start, y + a * step.reshape(21, 4)), 0.1)[0] for a in (1, -1))
        numerical[:, k] = ((ahead - behind) / (2 * h)).ravel()
    assert np.abs(exact - numerical).max() < 1e-7 * np.abs(numerical).max()
