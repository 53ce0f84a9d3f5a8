"""The schemes that take one linear solve a step or none: their steps against the matrices themselves."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.scenes import scene

from ibfil.simulation.simulation import Simulation

# Pressed together by 2 % and bent: its tension is negative all along.
PRESSED = {
    "length": 1.0,
    "nodes": 9,
    "derivative": 2,
    "bending": 1.0,
    "stretching": 1e3,
    "shape": {"kind": "straight", "perturb": ["-0.02*s", "0.01*sin(6*s)", "0.01*s**2"]},
}


def matrices(simulation: Simulation, kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Z, the stiffness of that name (27, 27) and f (27,) of the rod as it starts."""
    system, shape, drag = simulation.system, simulation.configuration, simulation.fluid.drag
    force, moment = system.forces(shape, 0.0)
    k = getattr(system, kind)(shape, shape, moment, 0.0).dense().reshape(27, 27)
    z = np.zeros((9, 3, 9, 3))
    for i, t in enumerate(shape.e3):
        z[i, :, i] = drag.perp[i] * (np.eye(3) - np.outer(t, t)) + drag.par[i] * np.outer(t, t)
    return z.reshape(27, 27), k, force.ravel()


def test_a_semi_implicit_step_is_backward_euler_on_the_matrix_without_compression() -> None:
    """(Z - dt K) y = dt f, long enough that with the compression in K the rod would buckle backwards."""
    dt = 1.0
    simulation = Simulation(scene({"rod": PRESSED}, scheme="semi-implicit", step=dt))
    found = simulation.attempt(dt)
    solved = []
    for kind in ("definite_stiffness", "stiffness"):
        z, k, force = matrices(simulation, kind)
        solved.append(np.linalg.solve(z - dt * k, dt * force).reshape(9, 3))
    assert found.state.y_old == pytest.approx(solved[0], rel=1e-9, abs=1e-12)
    assert np.abs(solved[1] - solved[0]).max() > 1e-3
    assert found.velocity == pytest.approx(solved[0] / dt, rel=1e-9, abs=1e-12)


def test_an_explicit_step_is_the_force_over_the_drag() -> None:
    dt = 1e-6
    simulation = Simulation(scene({"rod": PRESSED}, scheme="explicit", step=dt))
    z, _, force = matrices(simulation, "stiffness")
    y = simulation.attempt(dt).state.y_old
    assert y == pytest.approx(dt * np.linalg.solve(z, force).reshape(9, 3), rel=1e-10, abs=1e-18)
