"""Rods between two bodies, or between a body and the lab: each body has its own balance, and all together the total."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from ibfil.case.reading import parse_case
from ibfil.simulation.simulation import Simulation

ROD = """
[filament.{name}]
length = {length}
nodes = {nodes}
bending = {stiff}
twisting = {stiff}
stretching = {stretching}
radius = 0.02
anchor = "start"
position = [{at}, 0, 0]
start = {start}
finish = {finish}
{more}
"""
REST = """
{bodies}
[fluid]
model = "rft"
drag = "paper"
viscosity = 1.0
[time]
end = 100.0
step = {step}
[output]
every = 1.0
"""


def rod(name: str, at: float, start: str, finish: str, length=1.0, nodes=21, stiff=1.0, stretching=1e4, more="") -> str:
    return ROD.format(**locals())


def clamped(body: str, more: str = "") -> str:
    return f'{{ end = "body", body = "{body}"{more} }}'


def body(name: str, shape: str, more: str = "") -> str:
    return f"[body.{name}]\nshape = {shape}\n{more}\n"


def sphere(radius: float) -> str:
    return f'{{ kind = "sphere", radius = {radius} }}'


def scene(rods: str, bodies: str, step: float) -> Simulation:
    return Simulation(parse_case(rods + REST.format(bodies=bodies, step=step), "x.toml"))


def imbalance(sim: Simulation, force=(0.0, 0.0, 0.0), row: int = 0) -> float:
    """The largest total force and torque beyond a force on the ``row``th body, at the geometry of the last step."""
    now = sim.snapshot().diagnostics
    at = sim._there.r[sim.system.rows.n + 2 * row]
    off = np.concatenate([now["net_force"] - force, now["net_torque"] - np.cross(at, force)])
    return float(np.abs(off).max())


def test_a_dumbbell_moves_as_a_rigid_one():
    """Spheres of .2 and .1 with a rod of 1 between their surfaces, pushed at the first: by the rigid mobility."""
    push = (0.3, 1.0, 0.2)
    stiff = rod("rod", 0.2, clamped("a"), clamped("b"), nodes=41, stiff=1e6, stretching=1e8)
    pair = body("a", sphere(0.2), f"position = [0, 0, 0]\nforce = {list(push)}") + body(
        "b", sphere(0.1), "position = [1.3, 0, 0]"
    )
    sim = scene(stiff, pair, 1e-3)
    now = sim.snapshot().bodies["a"]
    np.testing.assert_allclose(now.velocity, [0.025130, 0.158567, 0.031713], rtol=1e-3)
    np.testing.assert_allclose(now.spin[1:], [0.033597, -0.167983], rtol=1e-3)
    soft = scene(stiff.replace("1000000.0", "0.5").replace("100000000.0", "500"), pair, 0.05)
    for until in (0.5, 1.0, 2.0):
        soft.advance(until, lambda: None)
        assert imbalance(soft, push) < 1e-12


def test_the_share_of_a_body_does_not_matter_as_nodes_become_many():
    """A bent dumbbell that straightens: the smaller sphere's place, with 21, 41 and 81 nodes, is of second order."""
    places = []
    for nodes in (21, 41, 81):
        bent = rod(
            "rod", 0.0, clamped("a"), clamped("b"), nodes=nodes, more='shape = { kind = "circle", curvature = 2 }'
        )
        sim = scene(bent, body("a", sphere(0.2)) + body("b", sphere(0.1)), 0.01)
        sim.advance(0.2, lambda: None)
        places.append(sim.snapshot().bodies["b"].position)
        assert imbalance(sim) < 1e-12
    first, second = (np.linalg.norm(b - a) for a, b in pairwise(places))
    assert second < 0.4 * first
    assert second < 1e-3


def test_a_head_on_a_cantilever_bends_it_as_a_force_on_its_end_does():
    """Small forces and torques on the head, at rest: F l^3/(3 A) + T l^2/(2 A), with the centre a radius beyond."""
    radius, force, torque, stiff = 0.1, 1e-3, 2e-4, 1.0
    sim = scene(
        rod("rod", 0.0, '{ end = "clamped" }', clamped("head"), stiff=stiff, stretching=1e6, nodes=41),
        body("head", sphere(radius), f"force = [0, {force}, 0]\ntorque = [0, 0, {torque}]"),
        2.0,
    )
    sim.advance(60.0, lambda: None)
    now = sim.snapshot()
    at_end = torque + force * radius
    bent = force / (3 * stiff) + at_end / (2 * stiff)
    turned = force / (2 * stiff) + at_end / stiff
    assert now.bodies["head"].position[1] == pytest.approx(bent + radius * turned, rel=2e-3)
    assert now.bodies["head"].e1[1] == pytest.approx(turned, rel=2e-3)
    np.testing.assert_allclose(now.filaments["rod"].reaction_start, [0, -force, 0], atol=1e-6 * force)


def test_a_motor_turns_a_head_against_the_lab():
    """A straight stiff rod clamped in the lab, a motor at its other end: the head turns alone, by 8 pi eta a^3."""
    sim = scene(
        rod("rod", 0.0, '{ end = "clamped" }', clamped("head", ", motor = { spin = 2.0 }"), stiff=1e4),
        body("head", sphere(0.3)),
        0.01,
    )
    sim.advance(0.3, lambda: None)
    now = sim.snapshot()
    np.testing.assert_allclose(now.bodies["head"].spin, [-2, 0, 0], atol=1e-3)
    assert now.motors["rod_finish"].torque == pytest.approx(2 * 8 * np.pi * 0.3**3, rel=1e-3)


def test_a_chain_of_rods_with_hinges_is_a_chain():
    """Three rods, two joints, one of them pushed: rods meet at the joints, the pull goes down the chain."""
    push = (0.0, 2.0, 1.0)
    ends = [('{ end = "free" }', "a"), ("a", "b"), ("b", '{ end = "free" }')]
    rods = ""
    for k, pair in enumerate(ends):
        start, finish = (end if end.startswith("{") else clamped(end, ", hinged = true") for end in pair)
        rods += rod(f"r{k}", 0.5 * k, start, finish, length=0.5, nodes=11)
    joint = '{ kind = "joint" }'
    sim = scene(rods, body("a", joint, f"force = {list(push)}") + body("b", joint), 0.01)
    for until in (0.1, 0.5):
        sim.advance(until, lambda: None)
        np.testing.assert_allclose(sim.snapshot().diagnostics["net_force"], push, atol=1e-12)
    assert imbalance(sim, push) < 1e-3  # hinges have no balance of torque: that of Eq. 44 is of second order
    now = sim.snapshot()
    r = [now.filaments[f"r{k}"].position for k in range(3)]
    np.testing.assert_allclose(r[0][-1], r[1][0], atol=1e-11)
    np.testing.assert_allclose(r[1][-1], r[2][0], atol=1e-11)
    assert r[1][0, 1] - r[2][-1, 1] > 0.05
    np.testing.assert_allclose(now.filaments["r2"].reaction_start, -now.filaments["r1"].reaction_finish, atol=1e-11)


def test_newton_converges_fast_on_a_soft_pair_in_large_steps():
    """The rows of clamps have their exact slope: as many iterations as a swimmer with one body."""
    bent = rod("rod", 0.0, clamped("a"), clamped("b"), more='curvature = ["4*sin(6*s - 9*t)", "3*s"]')
    sim = scene(bent, body("a", sphere(0.2)) + body("b", sphere(0.1), "torque = [0.02, 0.1, 0]"), 0.05)
    for k in range(1, 15):
        sim.advance(0.05 * k, lambda: None)
        assert sim.snapshot().diagnostics["newton_iterations"] <= (7 if k == 1 else 5)
    assert sim.snapshot().diagnostics["steps_shortened"] == 0
