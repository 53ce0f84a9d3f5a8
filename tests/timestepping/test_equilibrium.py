"""Rests that are known, and scenes that have none."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.rests import CLAMPED, at_rest, straight
from scipy.optimize import brentq
from scipy.special import ellipk

from ibfil.errors import CaseError, RunFailed
from ibfil.timestepping.equilibrium import continued, newton, settled


def found(search, rod, fluid=None):
    scene = at_rest(rod, fluid or {"model": "rft"})
    return scene, search(scene.system, scene.fluid, scene.simulation.start, scene.time)


@pytest.mark.parametrize("search", [newton, continued])
def test_a_rod_bent_by_a_moment_is_an_arc(search):
    rod = straight(33, start=CLAMPED, finish={"moment": [0, 0, 1.0]}, normal=[0, 0, 1])
    _, rest = found(search, rod)
    assert rest.configuration.r[-1] == pytest.approx([np.sin(1), 1 - np.cos(1), 0], abs=3e-4)
    assert rest.residual < 1e-5


def test_a_rod_under_its_weight_is_longer_by_half_of_it():
    """w L/(2 EA), exact for a rod hung by its top, drawn by its own weight in the direction it hangs."""
    rod = straight(21, direction=[0, 0, -1], start=CLAMPED, loads={"weight": [0, 0, -3.0]}, stretching=10.0)
    _, rest = found(continued, rod)
    assert rest.configuration.r[-1, 2] == pytest.approx(-1.15, abs=1e-12)


def test_a_grid_fluid_rests_where_resistive_force_theory_does():
    """A rest has no velocities, so no fluid counts."""
    rod = straight(17, start=CLAMPED, finish={"force": [0, 0, 2.0]}, position=[-0.5, 0, 0])
    grid = {"model": "stokes", "box": [3.2, 3.2, 3.2], "cells": [32, 32, 32]}
    a, b = (found(continued, rod, fluid)[1].configuration.r for fluid in (None, grid))
    assert np.abs(a - b).max() < 1e-9


def elastica(load: float) -> float:
    """How far the tip of a clamped column stands aside under a dead load beyond Euler's: 2 k/sqrt(F)."""
    k = brentq(lambda k: ellipk(k * k) - np.sqrt(load), 1e-6, 1 - 1e-9)
    return 2 * k / np.sqrt(load)


def test_a_column_is_pushed_off_straight_and_ends_on_the_elastica():
    """The straight column is a rest that is not stable; both are told."""
    rod = straight(
        33,
        start=CLAMPED,
        finish={"force": [-3.0, 0, 0]},
        stretching=1e5,
        shape={"kind": "straight", "perturb": [0, 0, "1e-6*s**2"]},
    )
    _, ends = found(settled, rod)
    assert len(ends.rests) == 2
    assert ends.leading[0].real * 4 * np.pi == pytest.approx(2.9587, rel=0.01)
    assert ends.leading[1].real < 1e-6
    tip = ends.rests[1].configuration.r[-1]
    assert np.hypot(tip[1], tip[2]) == pytest.approx(elastica(3.0), rel=1e-3)


NOT_AT_REST = {
    "it sinks": (straight(9, anchor="middle", loads={"weight": [0, 0, -1.0]}), {}, "still move"),
    "it sinks slowly": (straight(9, anchor="middle", loads={"weight": [0, 0, -1e-4]}), {}, "still move"),
    "it is carried away": (straight(9, anchor="middle"), {"flow": ["1", "0", "0"]}, "still move"),
    "it flutters": (straight(17, start=CLAMPED, finish={"follower": -45.0}), {}, "grows and oscillates"),
}


@pytest.mark.parametrize(("rod", "fluid", "words"), NOT_AT_REST.values(), ids=NOT_AT_REST)
def test_a_scene_without_a_rest_says_so(rod, fluid, words):
    scene = at_rest(rod, {"model": "rft", **fluid})
    with pytest.raises(RunFailed, match=words) as refusal:
        scene.settled()
    assert refusal.value.filament == "rod"


def test_what_changes_in_time_is_refused_by_name():
    rod = straight(9, start={**CLAMPED, "moves": ["sin(t)", "0", "0"]}, curvature=["s*t", 0])
    inertia = {"model": "navier-stokes", "density": 1.0, "box": [2, 2, 2], "cells": [16, 16, 16]}
    with pytest.raises(CaseError) as refusal:
        at_rest(rod, inertia)
    keys = [line.split(": ")[1] for line in refusal.value.faults]
    assert keys == ["filament.rod.curvature", "filament.rod.start.moves", "fluid.model"]
