"""The contract between rods and fluids (fluids/base.py), held against every fluid in every situation of the ends.

A new fluid is one line of FLUIDS, a new kind of end one line of SCENES; everything below is asked of each pair.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from helpers.scenes import scene

from ibfil.assembly import rods as assembly_rods
from ibfil.assembly.fluids.models import fluid_model
from ibfil.assembly.wrapped import surrounding
from ibfil.fluids.base import Fluid, Response
from ibfil.linalg.constraints import Prescribed
from ibfil.linalg.stiffness import Pairs, Stiffness
from ibfil.rods.system import RodSystem

GRID = {"model": "stokes", "box": [1.6, 2.0, 1.8], "cells": [16, 20, 18], "slip": 0.01}
FLOW = ["0.3 + y", "sin(x + t)", "0"]
FREE = {"model": "stokes", "box": "free", "spacing": 0.1, "slip": 0.01}
INERTIA = {**GRID, "model": "navier-stokes", "density": 3.0}
PERIODIC = ["0.3", "sin(2*pi*x/1.6 + t)", "0"]
# The case's [fluid], with the mass of its rods, and how closely one implicit() satisfies the
# statement, relative to the move.
FLUIDS: dict[str, tuple[dict[str, Any], float]] = {
    "rft": ({"model": "rft"}, 1e-11),
    "rft in a flow": ({"model": "rft", "drag": {"perp": 9.0, "par": 6.0, "spin": 0.1}, "flow": FLOW}, 1e-11),
    "table": ({**GRID, "method": "table"}, 1e-11),
    "table in a flow": ({**GRID, "method": "table", "kernel": "es5", "flow": FLOW}, 1e-11),
    "fft": ({**GRID, "method": "fft", "kernel": "bspline6"}, 1e-10),
    "fft in a flow": ({**GRID, "method": "fft", "flow": FLOW}, 1e-10),
    "krylov": ({**GRID, "method": "krylov"}, 1e-4),
    "stirred table": ({**GRID, "method": "table", "rotation": "grid"}, 1e-11),
    "stirred table in a flow": ({**GRID, "method": "table", "rotation": "grid", "flow": FLOW}, 1e-11),
    "stirred fft": ({**GRID, "method": "fft", "rotation": "grid", "kernel": "es4"}, 1e-10),
    "stirred krylov": ({**GRID, "method": "krylov", "rotation": "grid"}, 1e-4),
    "free table": ({**FREE, "method": "table"}, 1e-11),
    "free table in a flow": ({**FREE, "method": "table", "kernel": "bkp6", "flow": FLOW}, 1e-11),
    "free fft": ({**FREE, "method": "fft", "flow": FLOW}, 1e-10),
    "free krylov": ({**FREE, "method": "krylov"}, 1e-4),
    "free stirred table": ({**FREE, "method": "table", "rotation": "grid", "flow": FLOW}, 1e-11),
    "free stirred fft": ({**FREE, "method": "fft", "rotation": "grid"}, 1e-10),
    "wall table": ({**FREE, "wall": "no-slip", "method": "table"}, 1e-11),
    "wall fft in a flow": ({**FREE, "wall": "no-slip", "method": "fft", "flow": FLOW}, 1e-10),
    "wall krylov": ({**FREE, "wall": "no-slip", "method": "krylov"}, 1e-4),
    "free-slip wall table": ({**FREE, "wall": "free-slip", "method": "table", "kernel": "bkp6"}, 1e-11),
    "free-slip wall fft, thick": ({**FREE, "wall": "free-slip", "method": "fft", "thick": True}, 1e-10),
    "navier-stokes table": ({**INERTIA, "method": "table"}, 1e-11),
    "navier-stokes in a flow": ({**INERTIA, "method": "table", "kernel": "es5", "flow": PERIODIC}, 1e-11),
    "navier-stokes fft": ({**INERTIA, "method": "fft", "flow": PERIODIC}, 1e-10),
    "navier-stokes krylov": ({**INERTIA, "method": "krylov"}, 1e-4),
    "navier-stokes stirred table": ({**INERTIA, "method": "table", "rotation": "grid"}, 1e-11),
    "navier-stokes stirred fft": ({**INERTIA, "method": "fft", "rotation": "grid", "flow": PERIODIC}, 1e-10),
    "rft, thick, in a flow": ({"model": "rft", "flow": FLOW, "thick": {"aspect": 6.0}}, 1e-11),
    "table, thick, in a flow": ({**GRID, "method": "table", "flow": FLOW, "thick": True}, 1e-11),
    "fft, thick": ({**GRID, "method": "fft", "thick": True}, 1e-10),
    "krylov, thick, in a flow": ({**GRID, "method": "krylov", "flow": FLOW, "thick": True}, 1e-4),
    "stirred table, thick": ({**GRID, "method": "table", "rotation": "grid", "flow": FLOW, "thick": True}, 1e-11),
    "navier-stokes, thick": ({**INERTIA, "method": "table", "flow": PERIODIC, "thick": True}, 1e-11),
    "navier-stokes krylov, thick": ({**INERTIA, "method": "krylov", "flow": PERIODIC, "thick": True}, 1e-4),
    "rft, heavy, in a flow": ({"model": "rft", "flow": FLOW, "mass": 0.7}, 1e-11),
    "table, heavy and thick": ({**GRID, "method": "table", "flow": FLOW, "thick": True, "mass": "0.3 + s"}, 1e-11),
    "fft, heavy": ({**GRID, "method": "fft", "mass": 0.7}, 1e-10),
    "krylov, heavy": ({**GRID, "method": "krylov", "mass": 0.7}, 1e-4),
    "stirred table, heavy": ({**GRID, "method": "table", "rotation": "grid", "mass": 0.7}, 1e-11),
    "navier-stokes, heavy": ({**INERTIA, "method": "table", "flow": PERIODIC, "mass": 0.7}, 1e-11),
}

PLANAR: dict[str, Any] = {
    "length": 1.0,
    "nodes": 11,
    "bending": 1.0,
    "stretching": 300.0,
    "curvature": ["4*sin(4*pi*s - 2*t)", 0],
    "shape": {"kind": "relaxed"},
}
TWISTING: dict[str, Any] = {
    **PLANAR,
    "bending": [1.0, 0.4],
    "twisting": 0.7,
    "radius": 0.05,
    "curvature": ["3*sin(4*pi*s)", "2*s"],
    "twist_rate": "1 + t",
}
SCENES: dict[str, dict[str, dict[str, Any]]] = {
    "free": {"rod": PLANAR},
    "free and twisting": {"rod": TWISTING},
    "clamped": {"rod": {**PLANAR, "start": {"end": "clamped"}}},
    "clamped at the end": {"rod": {**PLANAR, "derivative": 2, "finish": {"end": "clamped"}}},
    "hinged": {"rod": {**PLANAR, "start": {"end": "hinged"}, "finish": {"end": "hinged"}}},
    "pulled": {"rod": {**PLANAR, "start": {"end": "hinged"}, "finish": {"follower": -3.0}}},
    "spun": {"rod": {**TWISTING, "start": {"end": "clamped", "spin": "20*cos(t)"}}},
    "spun and held": {
        "rod": {
            **TWISTING,
            "start": {"end": "clamped", "spin": 20.0},
            "finish": {"end": "clamped", "angle": "t**2"},
        }
    },
    "clamped, twist free": {"rod": {**TWISTING, "start": {"end": "clamped", "twist": "free"}}},
    "two": {
        "left": {**TWISTING, "start": {"end": "clamped", "spin": 5.0}},
        "right": {**PLANAR, "nodes": 9, "position": [0.1, 0.5, 0.2], "finish": {"end": "hinged"}},
    },
}
UNHELD = ["free", "free and twisting"]
ABOVE = [0.0, 0.0, 0.6]
BETWEEN = (0.3, 0.34)  # the step's two times
TAU = 0.03


class Asked(NamedTuple):
    """A fluid at a configuration that nobody made smooth, and what may be asked of it."""

    fluid: Fluid
    response: Response
    inertia: np.ndarray  # (n, m) of the nodes, and their velocity v* by which it acts, for steps of 0.5 the one before
    coasting: np.ndarray
    system: RodSystem
    r: np.ndarray
    e3: np.ndarray
    force: np.ndarray  # (n, m)
    stiffness: Stiffness
    held: Prescribed
    y: np.ndarray
    target: np.ndarray


def asked(fluid: dict[str, Any], rods: dict[str, dict[str, Any]], steps: int = 2) -> Asked:
    """With a past of so many steps, where the fluid keeps one."""
    twists = any("twisting" in rod for rod in rods.values())
    fluid = {key: value for key, value in fluid.items() if twists or key != "rotation"}
    mass = fluid.pop("mass", None)
    rods = {name: rod if mass is None else {**rod, "mass": mass} for name, rod in rods.items()}
    if "wall" in fluid:
        rods = {
            name: {**rod, "position": np.add(rod.get("position", [0, 0, 0]), ABOVE).tolist()}
            for name, rod in rods.items()
        }
    stacked = assembly_rods.rods(scene(rods, fluid))
    made = surrounding(fluid_model(scene(rods, fluid)), stacked).fluid
    system, rng = stacked.system, np.random.default_rng(0)
    n, m = len(stacked.s), system.unknowns
    held = system.held(*BETWEEN)
    start = system.move(stacked.start, 1e-3 * rng.standard_normal((n, m)))
    y = 1e-3 * rng.standard_normal((n, m))
    shape = system.move(start, y)
    force, inner = system.forces(shape, BETWEEN[1])
    stiffness = system.stiffness(shape, start, inner, BETWEEN[1])
    target = 1e-3 * rng.standard_normal((n, m))
    for k in range(steps):
        made.advance(made.response(shape.r, shape.e3, BETWEEN[0], 0.8 * TAU), (k + 1) * y / TAU, force)
    response = made.response(shape.r, shape.e3, BETWEEN[1], TAU, 0.5)
    coasting = (1.5**2 * 2 - 0.5**2) / 2 * y / TAU
    return Asked(
        made,
        response,
        weighed(mass, rods, stacked.s, system),
        coasting,
        system,
        shape.r,
        shape.e3,
        force,
        stiffness,
        held,
        y,
        target,
    )


def weighed(mass: Any, rods: dict[str, dict[str, Any]], s: np.ndarray, system: RodSystem) -> np.ndarray:
    """Mass and rotary inertia (n, m) of the nodes: that of a round rod of radius 0.05 where it twists."""
    out = np.zeros((len(s), system.unknowns))
    per_length = 0.0 * s if mass is None else 0.3 + s if isinstance(mass, str) else np.full(len(s), mass)
    out[:, :3] = (per_length * system.mesh.volume)[:, None]
    if system.unknowns == 4:
        twists = np.repeat(["twisting" in rod for rod in rods.values()], [rod["nodes"] for rod in rods.values()])
        out[:, 3] = twists * out[:, 0] * 0.05**2 / 2
    return out


def resisted(a: Asked, y: np.ndarray) -> np.ndarray:
    """The force (n, m) that it takes to give the nodes the velocity of displacements y: m (v - v*)/tau."""
    return a.inertia * ((y - a.target) / TAU - a.coasting) / TAU


def times(stiffness: Stiffness, d: np.ndarray) -> np.ndarray:
    """K d (n, m), written out from what a band matrix by node with further blocks is said to be."""
    n, m = d.shape
    w = (stiffness.band.shape[2] // m - 1) // 2
    out = np.zeros((n, m))
    for i in range(n):
        for j in range(max(0, i - w), min(n, i + w + 1)):
            out[i] += stiffness.band[i, :, (j - i + w) * m : (j - i + w + 1) * m] @ d[j]
    for i, j, block in zip(*stiffness.pairs, strict=True):
        out[i] += block @ d[j]
    return out


def coupled(a: Asked) -> Asked:
    """The same where a dozen pairs of nodes are coupled at random, held ones too, some of them twice."""
    rng, (n, m) = np.random.default_rng(5), a.force.shape
    rows, columns = rng.integers(0, n, (2, 12))
    columns = np.where(columns == rows, (rows + n // 2) % n, columns)
    blocks = 0.1 * np.abs(a.stiffness.band).mean() * rng.standard_normal((12, m, m))
    for node in range(n):  # what is not there stays so: nodes that do not twist
        if not a.stiffness.band[node, m - 1].any():
            blocks[rows == node, 3], blocks[columns == node, :, 3] = 0.0, 0.0
    pairs = Pairs(np.append(rows, rows[:3]), np.append(columns, columns[:3]), np.append(blocks, blocks[:3], axis=0))
    return a._replace(stiffness=Stiffness(a.stiffness.band, pairs))


def elsewhere(values: np.ndarray, held: Prescribed) -> np.ndarray:
    """The values at unknowns that are not held."""
    return np.delete(values.ravel(), held.at)


def moved(response: Response, force: np.ndarray, target: np.ndarray) -> np.ndarray:
    """target + tau (u0 + M force): what the fluid says when nothing is held."""
    return response.forced(force, Prescribed(np.zeros(0, np.int64), np.zeros(0)), target).move


EACH_SCENE = pytest.mark.parametrize("name", SCENES)
THIN = {name: fluid for name, (fluid, _) in FLUIDS.items() if not {"thick", "mass"} & set(fluid)}
EACH_FLUID = pytest.mark.parametrize(("fluid", "tolerance"), FLUIDS.values(), ids=FLUIDS)


@EACH_SCENE
@EACH_FLUID
def test_forced(fluid, tolerance, name):
    a = asked(fluid, SCENES[name])
    before = a.force.copy(), a.target.copy()
    answer = a.response.forced(a.force, a.held, a.target)
    assert np.array_equal(answer.move.ravel()[a.held.at], a.held.value)
    assert not elsewhere(answer.reaction, a.held).any()
    assert a.held.at.size == 0 or np.all(answer.reaction.ravel()[a.held.at] != 0)
    scale, inertia = np.abs(answer.force).max(), resisted(a, answer.move)
    assert np.abs(answer.force - (a.force + answer.reaction - inertia)).max() < 1e-12 * max(
        scale, np.abs(inertia).max()
    )
    statement = moved(a.response, answer.force + inertia, a.target)
    exact = 1e-12 if fluid in THIN.values() else tolerance  # what nodes feel of their own velocity is solved for
    assert np.abs(answer.move - statement).max() < exact * np.abs(answer.move - a.target).max()
    assert np.array_equal(a.force, before[0])
    assert np.array_equal(a.target, before[1])


@EACH_SCENE
@EACH_FLUID
def test_implicit(fluid, tolerance, name):
    assert_implicit(asked(fluid, SCENES[name]), tolerance)


@pytest.mark.parametrize("name", ["spun and held", "two"])
@EACH_FLUID
def test_implicit_where_nodes_far_apart_are_coupled(fluid, tolerance, name):
    assert_implicit(coupled(asked(fluid, SCENES[name])), tolerance)


def assert_implicit(a: Asked, tolerance: float) -> None:
    """The correction satisfies the statement, with held unknowns and reactions."""
    before = a.force.copy(), a.target.copy(), a.y.copy()
    answer = a.response.implicit(a.force, a.stiffness.copy(), a.held, a.y, a.target)
    new = a.y + answer.move
    missed = answer.move.ravel()[a.held.at] - (a.held.value - a.y.ravel()[a.held.at])
    assert np.abs(missed).max(initial=0.0) < 1e-14 * np.abs(answer.move).max()  # out of a linear solve: to round-off
    assert not elsewhere(answer.reaction, a.held).any()
    assert a.held.at.size == 0 or np.all(answer.reaction.ravel()[a.held.at] != 0)
    bent, inertia = times(a.stiffness, answer.move), resisted(a, new)
    scale = np.abs(bent).max()
    assert np.abs(answer.force - (a.force + bent + answer.reaction - inertia)).max() < 1e-12 * scale
    statement = moved(a.response, answer.force + inertia, a.target)
    assert np.abs(new - statement).max() < tolerance * np.abs(answer.move).max()
    for now, then in zip((a.force, a.target, a.y), before, strict=True):
        assert np.array_equal(now, then)


@pytest.mark.parametrize("name", UNHELD)
@EACH_FLUID
def test_nothing_pushes_a_fluid_with_a_free_rod_in_it(fluid, tolerance, name):
    a = asked(fluid, SCENES[name])
    implicit = a.response.implicit(a.force, a.stiffness.copy(), a.held, a.y, a.target)
    for answer, y in ((a.response.forced(a.force, a.held, a.target), 0.0), (implicit, a.y)):
        net = (answer.force + resisted(a, y + answer.move))[:, :3].sum(axis=0)
        assert np.abs(net).max() < 1e-12 * np.abs(answer.force).max()
        assert not answer.reaction.any()


@pytest.mark.parametrize("fluid", THIN.values(), ids=THIN)
def test_without_force_nodes_go_where_the_flow_goes(fluid):
    a = asked(fluid, SCENES["free and twisting"], steps=0)
    answer = a.response.forced(np.zeros_like(a.force), a.held, a.target)
    (x, y), t, flow, curl = a.r.T[:2], BETWEEN[1], np.zeros_like(a.r), np.zeros(len(a.r))
    if fluid.get("flow") == FLOW:
        flow, curl = np.stack([0.3 + y, np.sin(x + t), 0 * x], axis=1), np.cos(x + t) - 1
    elif "flow" in fluid:
        k = 2 * np.pi / 1.6
        flow, curl = np.stack([0.3 + 0 * x, np.sin(k * x + t), 0 * x], axis=1), k * np.cos(k * x + t)
    assert answer.move[:, :3] == pytest.approx(a.target[:, :3] + TAU * flow, abs=1e-15)
    spin = np.zeros(len(x))
    if "flow" in fluid:
        spin = 0.5 * curl * a.e3[:, 2]
    assert answer.move[:, 3] == pytest.approx(a.target[:, 3] + TAU * spin, abs=1e-9 if spin.any() else 0)


@EACH_SCENE
@pytest.mark.parametrize("rotation", ["local", "grid"])
@pytest.mark.parametrize(
    "grid",
    [{**GRID, "flow": FLOW}, {**INERTIA, "flow": PERIODIC}, {**GRID, "flow": FLOW, "thick": True}],
    ids=["stokes", "inertia", "thick"],
)
@pytest.mark.parametrize(("method", "tolerance"), [("fft", 1e-10), ("krylov", 1e-4)])
def test_the_ways_to_the_grid_agree(method, tolerance, grid, rotation, name):
    fluid = {**grid, "rotation": rotation}
    exact, other = (asked({**fluid, "method": m}, SCENES[name]) for m in ("table", method))
    one, two = (a.response.forced(a.force, a.held, a.target) for a in (exact, other))
    close = tolerance if fluid.get("thick") else 1e-12
    assert np.abs(one.move - two.move).max() < close * np.abs(one.move).max()
    assert np.abs(one.force - two.force).max() < close * np.abs(one.force).max()
    one, two = (a.response.implicit(a.force, a.stiffness.copy(), a.held, a.y, a.target) for a in (exact, other))
    assert np.abs(one.move - two.move).max() < tolerance * np.abs(one.move).max()
    assert np.abs(one.force - two.force).max() < tolerance * np.abs(one.force).max()
