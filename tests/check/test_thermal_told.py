"""What is told of thermal forces: refusals, warnings, what `check` says, and the step that is chosen."""

from __future__ import annotations

import math
import re

import pytest
from helpers.thermal_scenes import ROD, scene

from ibfil.check import report
from ibfil.check.dimensionless import groups
from ibfil.check.warnings import warnings
from ibfil.errors import CaseError, RunFailed
from ibfil.simulation.simulation import Simulation


@pytest.mark.parametrize("scheme", ["implicit", "explicit"])
def test_other_schemes_are_refused(scheme):
    with pytest.raises(CaseError, match=r"time\.scheme: .*semi-implicit"):
        scene({"rod": ROD}, time={"scheme": scheme})


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
        ({"bending": [1.0, 0.1]}, 0.1, {}, r"filament\.rod\.bending: .* nodes"),
        ({"twisting": 0.1}, 0.1, {}, r"filament\.rod\.twisting: .* nodes"),
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


def test_segments_so_soft_that_their_thermal_stretch_ends_the_run_are_refused():
    """kT/(EA ds) above 0.02: within some thousand steps one is at a fifth of its rest length."""
    soft = {**ROD, "stretching": 35.0}
    with pytest.raises(CaseError) as refused:
        Simulation(scene({"rod": soft, "stiff": {**ROD, "stretching": 41.0}}, 0.1))
    (line,) = refused.value.faults
    assert "filament.rod.stretching: found 35, for a thermal stretch of 0.15 (rms) of a segment" in line
    assert "allowed: at least 40 = kT/(0.02 ds), or fewer nodes" in line


def test_repulsion_that_kicks_jump_over_or_that_throws_rods_back_is_told():
    def told(step: float, strength: float, distance: float = 0.02) -> str:
        rods = {"one": ROD, "other": {**ROD, "position": [0, 0.2, 0]}}
        contact = {"action": "repel", "distance": distance, "strength": strength}
        return "\n".join(warnings(Simulation(scene(rods, 1e-3, time={"step": step}, contact=contact))))

    assert "contact" not in told(1e-6, 1.0)
    assert "repel" not in told(1e-6, 1.0)
    assert "above a quarter of the distance over which they repel each other, 0.02" in told(1e-2, 1.0)
    assert "contact.strength: in a step 1e+03 over 0.02 throws a node back" in told(1e-4, 1e3)


def test_a_run_that_kicks_tear_says_so_and_not_that_something_pulls():
    """A spread of twist of half a turn: told beforehand with what would be enough, and where it stops."""
    case = scene({"rod": {**ROD, "twisting": 0.01}}, 0.1, time={"step": 1e-3, "end": 1.0})
    simulation = Simulation(case)
    (line,) = matching(warnings(simulation), r"filament\.rod\.twisting: ")
    nodes, square = ROD["nodes"], 0.1 * (ROD["length"] / (ROD["nodes"] - 1)) / 0.01
    assert f"{square / 0.05:.2g} times that modulus" in line
    assert f" or {1 + math.ceil((nodes - 1) * square / 0.05)} nodes" in line
    assert ("stops the run" in line) == (square > 1.0)
    with pytest.raises(RunFailed) as stopped:
        simulation.advance(1.0, lambda: None)
    assert "thermal kicks" in stopped.value.cause
    assert "a tenth of time.step" in stopped.value.advice
