"""The dimensionless groups by their formulas, in units in which nothing is one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.scenes import scene

from ibfil.check.dimensionless import groups, shortest_wave
from ibfil.simulation.simulation import Simulation

# A wave of length 1.25 and angular frequency 4 on a rod of length 2, A = 3, EA = 500.
WAVE: dict[str, Any] = {
    "length": 2.0,
    "nodes": 41,
    "bending": 3.0,
    "stretching": 500.0,
    "radius": 0.03,
    "curvature": ["0.5*sin(2*pi*s/1.25 - 4*t)", 0],
}
GRID = {"box": [6.0, 6.0, 6.0], "cells": [48, 48, 48]}
VISCOSITY = 0.7


def found(rod: dict[str, Any], fluid: dict[str, Any], **more: Any) -> dict[str, float]:
    return groups(Simulation(scene({"rod": rod}, fluid, viscosity=VISCOSITY, end=2.0, step=0.02, **more)))


def test_in_resistive_force_theory():
    """The sperm number L (zeta_perp omega/A)^(1/4), with the paper's 4 pi eta."""
    rft = found(WAVE, {"model": "rft", "drag": "paper"})
    assert rft["sperm number"] == pytest.approx(2 * (4 * np.pi * VISCOSITY * 4 / 3) ** 0.25, rel=1e-3)
    assert rft["omega dt"] == pytest.approx(4 * 0.02, rel=1e-3)
    assert rft["EA L^2/A"] == pytest.approx(500 * 4 / 3)
    assert rft["a/L"] == pytest.approx(0.03 / 2)
    assert "Re = rho omega L^2/eta" not in rft


def test_a_stream_has_a_reynolds_number_of_its_own():
    stream = {"model": "navier-stokes", "density": 1.3, "flow": [0, 3, 4], **GRID}
    name = "Re = rho U L/eta, U the fastest of fluid.flow"
    assert found(WAVE, stream)[name] == pytest.approx(1.3 * 5 * 2 / VISCOSITY)
    assert name not in found(WAVE, {"model": "navier-stokes", "density": 1.3, **GRID})


def test_on_a_grid():
    inertia = found(WAVE, {"model": "navier-stokes", "density": 1.3, **GRID})
    h = 6.0 / 48
    assert inertia["Re = rho omega L^2/eta"] == pytest.approx(1.3 * 4 * 2**2 / VISCOSITY, rel=1e-3)
    assert inertia["ds/h"] == pytest.approx(0.05 / h)
    assert inertia["a/L"] == pytest.approx(1.105 * h / 2)
    assert inertia["wavelength/h"] == pytest.approx(1.25 / h, rel=1e-3)


def test_of_a_rod_that_spins_with_the_grid():
    """No thicker than its own radius, nor than b/sqrt(1 + slip) with the kernel's b = 1.5045 h."""
    for radius, spins in ((0.03, 0.03), (1.0, 1.504506 * 6.0 / 48 / np.sqrt(1.01))):
        rod = {**WAVE, "twisting": 1.0, "radius": radius}
        spun = found(rod, {"model": "stokes", "rotation": "grid", **GRID})
        assert spun["a/L when spun"] == pytest.approx(spins / 2, rel=1e-6)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"curvature": ["20*sin(30*pi*s - 5*t)", 0]}, 1 / 15),
        ({"curvature": ["1 + 0.5*t*cos(8*pi*s)", 0]}, 0.25),
        ({"curvature": ["tanh(20*(s - 1))", 0]}, np.inf),  # a front is no wave
        ({"curvature": [0, 0], "loads": {"force": [0, "where(s > 0.9, step(1.1 - s), 0)", 0]}}, 0.4),
        ({"curvature": [0, 0], "loads": {"force": [0, "1e4*(sin(30*pi*s) - y)", 0]}}, np.inf),  # of the place too
    ],
)
def test_the_shortest_wave_along_a_rod(keys: dict[str, Any], expected: float):
    """Of sinusoids their wavelength, of a load on a part of the rod twice its width."""
    case = scene({"rod": {**WAVE, **keys}}, {"model": "rft"})
    assert shortest_wave(case.filaments["rod"], 1.0) == pytest.approx(expected, rel=2e-2)


def test_waves_in_segments_are_among_the_groups():
    assert found(WAVE, {"model": "rft"})["wavelength/ds"] == pytest.approx(1.25 / 0.05, rel=1e-2)
