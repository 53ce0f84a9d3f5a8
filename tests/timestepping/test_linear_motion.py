"""The linearised motion against the motion itself, and one way to its modes against the other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.rests import CLAMPED, at_rest, spun, straight

from ibfil.errors import CaseError
from ibfil.linalg.constraints import Prescribed
from ibfil.simulation.at_rest import SceneAtRest
from ibfil.timestepping.base import State
from ibfil.timestepping.equilibrium import newton
from ibfil.timestepping.explicit import Explicit
from ibfil.timestepping.implicit import Implicit
from ibfil.timestepping.linear_motion import LinearMotion
from ibfil.timestepping.spectrum import all_modes, leading_modes
from ibfil.timestepping.steady import NoRest, SteadyRods, frame_of

GRID: dict[str, Any] = {"model": "stokes", "box": [2.4, 2.4, 2.4], "cells": [24, 24, 24], "slip": 0.01}
FLOW = {"flow": ["-3*x", "0", "3*z"]}
FLUIDS: dict[str, dict[str, Any]] = {
    "rft": {"model": "rft"},
    "rft in a flow": {"model": "rft", **FLOW},
    "thick in a flow": {"model": "rft", **FLOW, "thick": {"aspect": 6.0}},
    "table": {**GRID, "method": "table"},
    "table in a flow": {**GRID, "method": "table", **FLOW},
    "fft": {**GRID, "method": "fft"},
    "krylov": {**GRID, "method": "krylov"},
    "stirred": {**GRID, "method": "table", "rotation": "grid"},
}
BENT = {"curvature": ["2*s", 0], "shape": {"kind": "relaxed"}, "stretching": 400.0}
RODS: dict[str, dict[str, Any]] = {
    "clamped": straight(9, start=CLAMPED, position=[-0.5, 0.1, 0.05], **BENT),
    "free": straight(9, anchor="middle", **BENT),
    "pulled": straight(9, start={"end": "hinged"}, finish={"follower": 5.0}, position=[-0.5, 0, 0], stretching=400.0),
    "straight": straight(9, start=CLAMPED, position=[-0.5, 0.1, 0.05]),
    "spun": spun(9, 7.0, position=[-0.5, 0.1, 0.05], stretching=400.0),
}


def linearised(rod: str, fluid: str, amount: float = 1e-2) -> tuple[SceneAtRest, LinearMotion]:
    """The motion about a configuration that is no rest: it need not be one."""
    fluid_keys = dict(FLUIDS[fluid])
    if rod != "spun":
        fluid_keys.pop("rotation", None)
    scene = at_rest(RODS[rod], fluid_keys)
    y = amount * np.random.default_rng(1).standard_normal((9, scene.system.unknowns)).cumsum(axis=0)
    y.ravel()[scene.system.ends.index] = 0.0
    return scene, scene.motion(scene.system.move(scene.simulation.start, y))


@pytest.mark.parametrize("fluid", FLUIDS)
@pytest.mark.parametrize("rod", RODS)
def test_it_is_the_derivative_of_the_motion(rod, fluid):
    """By central differences of v itself, along some displacement."""
    scene, motion = linearised(rod, fluid)
    x = np.random.default_rng(2).standard_normal(motion.free.size)
    y, h = motion.whole(x), 1e-6
    sides = [
        LinearMotion(scene.system, scene.fluid, scene.system.move(motion.configuration, sign * h * y)).residual
        for sign in (1, -1)
    ]
    change = (sides[0] - sides[1]) / (2 * h)
    assert np.abs(motion.times(x) - change).max() < 2e-6 * np.abs(change).max()
    if rod == "free" and fluid == "table":  # what moves with the nodes at frozen forces is no trifle
        assert np.abs(motion.elastic(x) - change).max() > 1e-4 * np.abs(change).max()


@pytest.mark.parametrize(
    ("rod", "fluid"),
    [
        *(("clamped", "rft in a flow"), ("clamped", "table"), ("spun", "rft"), ("spun", "stirred")),
        *(("straight", "table"), ("straight", "fft"), ("straight", "krylov")),
    ],
)
def test_both_ways_find_the_same_modes(rod, fluid):
    scene, motion = linearised(rod, fluid, 1e-3 if rod == "clamped" else 0.0)
    whole, leading = all_modes(motion), leading_modes(motion, 6, 25 / scene.time)
    for value in leading.values[:4]:
        assert np.abs(whole.values - value).min() < 1e-7 * max(abs(value), 25 / scene.time)
    assert leading.values[0].real == pytest.approx(whole.values[0].real, abs=1e-6 * 25 / scene.time)


def test_double_modes_are_found_twice_by_either_way():
    """A round rod bends alike in two planes."""
    scene, motion = (lambda s: (s, s.motion(s.simulation.start)))(at_rest(straight(33, start=CLAMPED)))
    for found in (all_modes(motion), leading_modes(motion, 6, 25 / scene.time)):
        assert found.values[1] == pytest.approx(found.values[0], rel=1e-6)
        pair = found.vectors[:, :3, :2].reshape(-1, 2)
        assert np.linalg.svd(pair, compute_uv=False)[1] > 0.1


def test_what_grows_much_faster_than_the_scene_relaxes_is_found():
    """A column under 200 times the Euler load: eleven growing modes, and one of its free end alone, at F^2.

    There k^4 + F k^2 + rate = 0; no moment and no shear at the end want decaying k a third of a turn apart, k1 k2 = F.
    """
    rod = straight(65, start=CLAMPED, finish={"force": [-500.0, 0, 0]}, stretching=1e7)
    scene = at_rest(rod)
    motion = scene.motion(newton(scene.system, scene.fluid, scene.simulation.start, scene.time).configuration)
    whole, leading = all_modes(motion), leading_modes(motion, 8, 25 / scene.time)
    assert whole.values[0].real * 4 * np.pi == pytest.approx(500.0**2, rel=0.05)
    assert leading.values[0] == pytest.approx(whole.values[0], rel=1e-6)


SCHEMES = {"explicit": (Explicit(), 2e-7), "Euler": (Implicit(order=1), 2e-2), "BDF2": (Implicit(order=2), 2e-2)}


@pytest.mark.parametrize(("scheme", "share"), SCHEMES.values(), ids=SCHEMES)
@pytest.mark.parametrize("fluid", ["rft", "table"])
def test_a_scheme_takes_a_mode_by_its_factor(scheme, share, fluid):
    """A small part of the slowest mode, stepped by the scheme itself; ``share`` of its time is the step."""
    rod = straight(9, start=CLAMPED, position=[-0.5, 0, 0], stretching=400.0)
    scene = at_rest(rod, FLUIDS[fluid])
    motion = scene.motion(scene.simulation.start)
    found = all_modes(motion)
    steady, rate = SteadyRods(scene.system, 0.0), found.values[0].real
    dt = share / abs(rate)
    factor = scheme.amplification(np.array([rate * dt]))[0].real
    y = 1e-6 * found.vectors[:, :, 0].real
    start = scene.simulation.start
    # A step back along the discrete mode, so that BDF2 has its own past.
    past = scene.system.move(start, y)
    now = scene.system.move(past, (factor - 1) * y)
    state = State(0.0, now, (factor - 1) * y, dt)
    step = scheme.step(steady, scene.fluid, state, dt)
    moved = step.state.y_old
    assert np.vdot(y, moved) / np.vdot(y, y) == pytest.approx(factor * (factor - 1), rel=1e-4)


def test_nothing_is_carried_where_the_fluid_is_at_rest():
    scene = at_rest(straight(17, start=CLAMPED))
    assert not scene.motion(scene.simulation.start).carried
    # A flow that vanishes on the rod itself moves it as soon as it bends.
    shear = at_rest(straight(17, start=CLAMPED), {"model": "rft", "flow": ["z", "0", "0"]})
    motion = shear.motion(shear.simulation.start)
    assert motion.carried
    assert not np.any(motion.velocity)


# --- frames ----------------------------------------------------------------------------------------------------------


def frame(rod: dict[str, Any], fluid: dict[str, Any] | None = None):
    scene = at_rest(rod, fluid or {"model": "rft"})
    return frame_of(scene.system, scene.simulation.fluid, scene.simulation.start, 0.0)


def test_frames():
    still = frame(straight(9, start=CLAMPED))
    assert not still.turns
    assert not still.spin.any()
    twirled = frame(spun(9, 5.0))
    assert not twirled.turns
    assert np.all(twirled.spin == 5.0 / (4 * np.pi * 0.1**2))
    for other in ({"bending": [1.0, 0.5]}, {"curvature": [1.0, 0]}):
        turned = frame(spun(9, 5.0, **other))
        assert turned.turns
        assert np.cross(turned.rate, [1, 0, 0]) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("rod", "fluid", "words"),
    [
        (spun(9, 5.0, finish={**CLAMPED, "spin": 1.0}), {}, "its twist grows"),
        (straight(9, start={**CLAMPED, "moves": ["0", "0", "0"]}, twisting=1.0, radius=0.1), {}, ""),
        (spun(9, 5.0, bending=[1.0, 0.5]), FLOW, "not the same all around"),
    ],
    ids=["two spins", "at rest", "flow across"],
)
def test_scenes_without_a_frame_say_why(rod, fluid, words):
    if not words:
        assert not frame(rod).turns
        return
    scene = at_rest(rod, {"model": "rft", **fluid})
    with pytest.raises(NoRest, match=words):
        frame_of(scene.system, scene.simulation.fluid, scene.simulation.start, 0.0)


def test_a_steady_fluid_keeps_held_ends_at_rest():
    """The clamp of a spun ribbon, in the frame that turns with it."""
    scene = at_rest(spun(9, 5.0, bending=[1.0, 0.5]))
    motion = scene.motion(scene.next_rest().configuration)
    response = scene.fluid.response(motion.configuration.r, motion.configuration.e3, 0.0, 1.0)
    free = Prescribed(np.zeros(0, np.int64), np.zeros(0))
    held = response.forced(motion.force, motion.held, np.zeros(motion.shape))
    alone = response.forced(motion.force + held.reaction, free, np.zeros(motion.shape))
    assert np.abs(held.move).max() < 1e-6
    assert np.abs(alone.move).max() < 1e-6


def test_rods_with_mass_are_refused():
    with pytest.raises(CaseError, match=r"filament.rod.mass: found a mass; allowed: none; rests are the same"):
        at_rest(straight(9, mass=1.0))
