"""Twist is linear in its angle; where it turns far from node to node it is told."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from helpers.scenes import RFT, scene

from ibfil.check.warnings import warnings
from ibfil.simulation.failures import LARGEST_TWIST
from ibfil.simulation.simulation import Simulation

HELD = {"end": "clamped"}
ROD: dict[str, Any] = {
    "length": 1.0,
    "bending": 10.0,
    "stretching": 1e4,
    "twisting": 1.0,
    "radius": 0.05,
    "start": HELD,
    "finish": {**HELD, "angle": "5*min(t, 1)"},
}


def told(rod: dict[str, Any]) -> list[str]:
    return [line for line in warnings(Simulation(scene({"rod": rod}, RFT))) if "twist turns e1" in line]


@pytest.mark.parametrize(("nodes", "angle"), [(8, 14), (9, 5), (17, 5), (33, 5)])
def test_the_moment_of_a_wound_rod_is_C_times_the_angle_by_its_length(nodes: int, angle: int) -> None:
    """On a rod whose C/L is 1, with up to 2 rad from node to node. By Eq. 39 it was 4.681, 4.919, 4.980 for 5."""
    rod = {**ROD, "nodes": nodes, "finish": {**HELD, "angle": f"{angle}*min(t, 1)"}, "bending": 100.0}
    simulation = Simulation(scene({"rod": rod}, RFT, end=3.0, step=0.05))
    simulation.advance(3.0, lambda: None)
    moment = simulation.snapshot().filaments["rod"].moment[1:-1, 2]
    assert moment == pytest.approx(np.full(nodes - 2, float(angle)), rel=1e-6)


@pytest.mark.parametrize("angle", [0.7, 0.9, 1.6])
def test_few_nodes_a_turn_are_told(angle: float) -> None:
    rod = {**ROD, "nodes": 9, "finish": {**HELD, "angle": f"{8 * angle}*t"}}
    lines = told(rod)
    if angle == 0.7:
        assert not lines
        return
    found = re.search(r"by ([\d.]+) rad from node to node(.*); for 8 nodes a turn take (\d+)$", lines[0])
    assert found is not None
    assert float(found[1]) == pytest.approx(angle)
    assert bool(found[2]) == (angle > 1.4)  # half of where a run ends
    assert not told({**rod, "nodes": int(found[3])})


def test_a_spinning_clamp_is_told_by_what_it_winds_up() -> None:
    """spin zeta_r L ds/C once steady: the angle of the first segment of a run of it."""
    rod = {**ROD, "nodes": 9, "radius": 0.5, "start": {**HELD, "spin": 2.5}, "finish": {"end": "free"}}
    (line,) = told(rod)
    simulation = Simulation(scene({"rod": rod}, RFT, end=20.0, step=0.1))
    simulation.advance(20.0, lambda: None)
    found = float(np.max(np.abs(simulation.configuration.twist))) / 8
    expected = 2.5 * 4 * np.pi * 0.25 / 8
    assert f"by {expected:.2g} rad" in line
    assert 0.8 * expected < found < expected
    assert not told({**rod, "radius": 0.05})


def test_preferred_twist_and_that_of_the_start_count_too() -> None:
    free = {**ROD, "nodes": 9, "start": {"end": "free"}, "finish": {"end": "free"}}
    assert not told(free)
    assert "by 0.88 rad" in told({**free, "twist_rate": 7})[0]
    assert "by 1 rad" in told({**free, "shape": {"kind": "straight", "twist": 8}})[0]


def test_with_thermal_forces_half_a_turn_that_is_near_is_told() -> None:
    from helpers.thermal_scenes import ROD as SOFT
    from helpers.thermal_scenes import scene as thermal

    def soon(energy: float) -> bool:
        helix = {"curvature": [6.0, 0], "twist_rate": 18.0, "shape": {"kind": "relaxed"}}
        rod = {**SOFT, **helix, "nodes": 8, "twisting": 0.7}
        lines = warnings(Simulation(thermal({"rod": rod}, energy)))
        return any("soon half a turn apart" in line for line in lines)

    assert soon(0.02)
    assert not soon(1e-5)
    assert LARGEST_TWIST > 18.0 / 7
