"""Twist that turns far from node to node is told: its moment is C sin(angle)/ds."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from helpers.scenes import RFT, scene

from ibfil.check.warnings import warnings
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


@pytest.mark.parametrize(("nodes", "moment"), [(9, 4.681), (17, 4.919), (33, 4.980)])
def test_the_moment_of_a_wound_rod_is_as_far_below_as_is_told(nodes: int, moment: float) -> None:
    """5 rad on a rod whose C/L is 1: numbers by trial."""
    simulation = Simulation(scene({"rod": {**ROD, "nodes": nodes}}, RFT, end=3.0, step=0.05))
    simulation.advance(3.0, lambda: None)
    found = simulation.snapshot().filaments["rod"].moment[nodes // 2, 2]
    assert found == pytest.approx(moment, abs=1e-3)
    lines = told({**ROD, "nodes": nodes})
    if nodes == 33:  # 0.16 rad from node to node
        assert not lines
        return
    below = re.search(r"([\d.]+) % below C angle/ds; take (\d+) nodes$", lines[0])
    assert below is not None
    assert float(below[1]) == pytest.approx(100 * (1 - moment / 5), abs=0.1)
    assert not told({**ROD, "nodes": int(below[2])})


def test_preferred_twist_and_that_of_the_start_count_too() -> None:
    free = {**ROD, "nodes": 9, "start": {"end": "free"}, "finish": {"end": "free"}}
    assert not told(free)
    assert "by 0.38 rad" in told({**free, "twist_rate": 3})[0]
    assert "by 0.5 rad" in told({**free, "shape": {"kind": "straight", "twist": 4}})[0]


def test_with_thermal_forces_a_quarter_turn_that_is_near_is_told() -> None:
    from helpers.thermal_scenes import ROD as SOFT
    from helpers.thermal_scenes import scene as thermal

    def soon(energy: float) -> bool:
        helix = {"curvature": [6.0, 0], "twist_rate": 6.0, "shape": {"kind": "relaxed"}}
        rod = {**SOFT, **helix, "nodes": 8, "twisting": 0.7}
        lines = warnings(Simulation(thermal({"rod": rod}, energy)))
        return any("soon a quarter turn apart" in line for line in lines)

    assert soon(0.02)
    assert not soon(1e-5)
    assert np.arcsin(0.95) > 6.0 / 7
