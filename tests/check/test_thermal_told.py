"""What is told of thermal forces: refusals, warnings, what `check` says, and the step that is chosen."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from helpers.thermal_scenes import ROD, scene

from ibfil.check import report
from ibfil.check.dimensionless import groups
from ibfil.check.warnings import warnings
from ibfil.errors import CaseError, RunFailed
from ibfil.simulation import steps, timescales
from ibfil.simulation.simulation import Simulation


@pytest.mark.parametrize("scheme", ["implicit", "explicit"])
def test_other_schemes_are_refused(scheme):
    with pytest.raises(CaseError, match=r"time\.scheme: .*semi-implicit"):
        scene({"rod": ROD}, time={"scheme": scheme})


def test_a_grid_is_refused_with_a_sentence():
    grid = {"model": "stokes", "box": [2.0, 2.0, 2.0], "cells": [16, 16, 16]}
    with pytest.raises(CaseError) as refused:
        scene({"rod": ROD}, fluid=grid)
    (line,) = refused.value.faults
    assert 'thermal: found thermal forces and fluid.model = "stokes"' in line
    assert 'only fluid.model = "rft"' in line


def test_a_tolerance_is_refused():
    with pytest.raises(CaseError, match=r"time\.tolerance: found a tolerance with \[thermal\]"):
        scene({"rod": ROD}, time={"tolerance": 1e-3})


def test_check_says_what_is_kicked_and_how_stiff_the_rod_is_against_it():
    case = scene({"rod": {**ROD, "twisting": 1.0}}, 0.02)
    assert any("thermal forces and twist moments, kT = 0.02, seed 1" in line for line in report.modelled(case))
    assert not any("thermal" in line for line in report.absent(case))
    without = scene({"rod": {**ROD, "twisting": 1.0}}, 0.02, twist=False)
    assert any("thermal forces, kT" in line for line in report.modelled(without))
    assert "thermal twist moments" in report.absent(without)
    assert groups(Simulation(case))["A/(kT L)"] == pytest.approx(50)
    assert "linearised trapezoid" in report.report(case)


@pytest.mark.parametrize(
    ("rod", "energy", "more", "told"),
    [
        ({"derivative": 6}, 1e-4, {}, r"filament\.rod\.derivative: .* order 6"),
        ({"stretching": 10.0}, 0.1, {}, r"filament\.rod\.stretching: .* of their length"),
        ({"bending": [1.0, 0.1]}, 0.1, {}, r"filament\.rod\.bending: .* nodes"),
        ({"twisting": 0.1}, 0.1, {}, r"filament\.rod\.twisting: .* nodes"),
        ({}, 0.1, {"time": {"step": 1e-3}}, r"time\.step: .* % longer"),
        ({"stretching": 1e6}, 1e-6, {"time": {"step": 5e-2}}, r"time\.step: .* thermal spread only in"),
        ({"direction": [0, 0, 1], "normal": [1, 0, 0]}, 1e-4, {"directions": "xy"}, r"thermal\.directions: .* plane"),
    ],
)
def test_warnings(rod, energy, more, told):
    twisting = {"twisting": 1.0} if "bending" in rod else {}
    found = warnings(Simulation(scene({"rod": {**ROD, **twisting, **rod}}, energy, **more)))
    assert len(matching(found, told)) == 1
    assert not matching(warnings(Simulation(scene({"rod": ROD}, 1e-4))), told)


def matching(lines: list[str], pattern: str) -> list[str]:
    """The lines that match."""
    return [line for line in lines if re.search(pattern, line)]


def test_the_automatic_step_keeps_kicks_from_stretching_the_rod():
    cold, hot = (Simulation(scene({"rod": ROD}, energy, time={"step": "auto"})) for energy in (1e-6, 0.1))
    assert cold.step_length == pytest.approx(cold.bending_time() / steps.POINTS_A_PERIOD)
    assert 0.8 * steps.STRETCH < hot.thermal_stretch(hot.step_length) <= steps.STRETCH
    # The stiffest motion of a rod, of rate 2/limit, is forgotten no later than its slowest bending.
    stiff = Simulation(scene({"rod": {**ROD, "stretching": 1e6}}, 1e-6, time={"step": "auto"}))
    assert stiff.step_length**2 / (2 * stiff.explicit_limit()) == pytest.approx(stiff.bending_time())


def test_the_stretch_that_kicks_leave_is_that_of_free_segments_while_steps_are_short():
    """A quarter of the angle squared; neighbours move apart by 2 kT dt (1/Z_i + 1/Z_j) in each of two directions."""
    energy, drag, nodes, dt = 0.1, 2.0, 11, 1e-12
    mobility = 1 / (drag * 0.1 * np.array([0.5, *np.ones(9), 0.5]))
    expected = 0.25 * 2 * np.mean(2 * energy * dt * (mobility[1:] + mobility[:-1])) / 0.1**2
    assert timescales.thermal_stretch(energy, drag, 1.0, 1.0, nodes, dt) == pytest.approx(expected, rel=1e-3)


def test_a_run_that_kicks_tear_says_so_and_not_that_something_pulls():
    """A spread of twist beyond a quarter turn: told beforehand with what would be enough, and where it stops."""
    case = scene({"rod": {**ROD, "twisting": 0.05}}, 0.1, time={"step": 1e-3, "end": 1.0})
    simulation = Simulation(case)
    (line,) = matching(warnings(simulation), r"filament\.rod\.twisting: ")
    nodes, square = ROD["nodes"], 0.1 * (ROD["length"] / (ROD["nodes"] - 1)) / 0.05
    assert f"{square / 0.05:.2g} times that modulus" in line
    assert f" or {1 + math.ceil((nodes - 1) * square / 0.05)} nodes" in line
    assert ("stops the run" in line) == (square > 0.2)
    with pytest.raises(RunFailed) as stopped:
        simulation.advance(1.0, lambda: None)
    assert "thermal kicks" in stopped.value.cause
    assert "a tenth of time.step" in stopped.value.advice
