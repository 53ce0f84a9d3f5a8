"""How a run fails, and how steps are halved before: when, where, what to change. RFT throughout."""

from __future__ import annotations

import pytest
from helpers.scenes import run, scene

from ibfil.errors import RunFailed
from ibfil.simulation.simulation import Simulation


def test_a_run_that_diverges_says_when_where_and_what_to_change() -> None:
    """Two filaments, the second too stiff for the step: it is named, its node counted from its own start."""
    soft = {"length": 1.0, "nodes": 9, "bending": 1e-3, "stretching": 1.0}
    wave = {"kind": "expression", "r": ["s", "0.02*sin(6*pi*s)", 0]}
    stiff = {**soft, "bending": 1.0, "stretching": 1e4, "position": [0, 5, 0], "shape": wave}
    limit = Simulation(scene({"a": soft, "b": stiff})).explicit_limit()
    simulation = Simulation(scene({"a": soft, "b": stiff}, end=1.0, step=3 * limit, scheme="explicit"))
    with pytest.raises(RunFailed) as caught:
        simulation.advance(1.0, lambda: None)
    failed = caught.value
    assert failed.filament == "b"
    assert 0 <= failed.node < 9
    assert 0 < failed.time < 300 * limit
    assert failed.time == simulation.time
    assert "time.scheme=implicit" in failed.advice
    # The limit it advises is that of the start, and stable.
    assert f"{limit:.3g}" in failed.advice
    for part in ("filament b", f"node {failed.node}", f"t = {failed.time:.6g}", failed.advice):
        assert part in str(failed)


def test_a_step_that_cannot_be_solved_is_halved_down_to_min_step_and_then_refused_with_its_node() -> None:
    """A force of 1e7 along a straight rod folds its end over at once, however short the step."""
    keys = {"length": 1.0, "nodes": 9, "bending": 1.0, "stretching": 100.0}
    keys |= {"start": {"end": "clamped"}, "finish": {"follower": -1e7}}
    simulation = Simulation(scene({"rod": keys}, end=1.0, step=0.1, min_step=1e-3))
    with pytest.raises(RunFailed) as caught:
        simulation.advance(1.0, lambda: None)
    assert simulation.shortened == 6  # 0.1/2^6 > 1e-3 > 0.1/2^7
    assert caught.value.time == 0.0
    assert caught.value.filament == "rod"
    assert 0 < caught.value.node < 9
    assert "time.step" in caught.value.advice


def test_halved_steps_are_counted_and_grow_again_and_the_output_is_still_hit() -> None:
    """A straight rod is told all at once to be an arc of 10 radians: too far for Newton in one step.

    Four halvings make a 16th of a step; without growing again, the step in question would be a dozen.
    """
    rod = {"length": 1.0, "nodes": 21, "bending": 1.0, "stretching": 1e3}
    simulation = run(scene({"rod": {**rod, "curvature": ["10*step(t - 0.15)", 0]}}, end=0.4, step=0.1))
    assert simulation.shortened >= 4
    assert simulation.time == 0.4
    assert 4 < simulation.steps < 14


def test_a_twist_that_nears_half_a_turn_between_nodes_is_refused_with_its_node() -> None:
    """Beyond that the twist comes back from the other side, and a rod would wind up without end."""
    keys = {"length": 1.0, "nodes": 9, "bending": 1.0, "stretching": 1e3, "twisting": 1.0, "radius": 0.5}
    keys |= {"start": {"end": "clamped", "spin": 10.0}}
    with pytest.raises(RunFailed, match="half a turn") as caught:
        run(scene({"rod": keys}, end=10.0, step=0.01))
    assert caught.value.filament == "rod"
    assert caught.value.node == 0
    assert "more nodes" in caught.value.advice
