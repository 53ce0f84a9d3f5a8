"""Steps in scenes with bodies: their order, and how long automatic ones are for what moves and turns bodies."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from helpers.example_cases import case

from ibfil.check.warnings import warnings
from ibfil.simulation.simulation import Simulation

SCENE = """
[filament.tail]
length = 1.0
nodes = 17
bending = 1.0
twisting = 1.0
stretching = 1e3
radius = 0.02
curvature = [6, 0]
twist_rate = 5
shape = { kind = "relaxed" }
anchor = "start"
position = [0.1, 0, 0]
start = { end = "body", body = "head" }
[body.head]
shape = { kind = "sphere", radius = 0.1 }
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = 1.0
[output]
every = 1.0
"""
MOTOR = "filament.tail.start.motor"


def simulation(*overrides: str) -> Simulation:
    return Simulation(case(SCENE, *overrides))


def test_places_and_turns_of_bodies_are_of_second_order_in_the_step():
    """Of a head that a motor and a torque turn by some radians, through its rods' bending."""
    ends = []
    for steps in (20, 40, 80):
        sim = simulation(f"{MOTOR}={{spin=4, axis=[1, 0, 0]}}", "body.head.torque=[0, 0.05, 0]", f"time.step=1/{steps}")
        sim.advance(1.0, lambda: None)
        head = sim.snapshot().bodies["head"]
        ends.append(np.concatenate([head.position, 0.1 * head.e1, 0.1 * head.e2]))
    coarse, fine = (np.linalg.norm(b - a) for a, b in pairwise(ends))
    assert coarse / fine == pytest.approx(4.0, rel=0.25)
    assert coarse > 1e-5


@pytest.mark.parametrize(
    "overrides",
    [
        [f"{MOTOR}.spin=10"],
        [f"{MOTOR}.angle=10*t"],
        ["body.head.motion={turns=[0, 0, 'sin(10*t)']}"],
        ["body.head.motion={moves=[0, '0.1*cos(10*t)', 0]}"],
        ["body.head.force=['sin(10*t)', 0, 0]"],
    ],
)
def test_an_automatic_step_is_a_25th_of_the_period_of_what_moves_a_body(overrides):
    sim, longest = simulation(*overrides), 2 * np.pi / 250
    sim.advance(1.0, lambda: None)
    assert sim.steps >= 1.0 / longest - 1
    assert sim.steps < 2.5 / longest  # an angle does not repeat: steps begin at a 25th of the bending time


@pytest.mark.parametrize(
    ("overrides", "rate"),
    [
        ([f"{MOTOR}.torque=0.3"], lambda now: now.motors["tail_start"].rate),
        ([f"{MOTOR}={{stall=1, free=50}}"], lambda now: now.motors["tail_start"].rate),
        (["body.head.torque=[0.5, 0, 0]"], lambda now: np.linalg.norm(now.bodies["head"].spin)),
    ],
)
def test_a_torque_is_resolved_as_fast_as_it_turns(overrides, rate):
    """At least 12 steps a turn, whatever the drag of what turns; not more than some hundreds."""
    sim = simulation(*overrides)
    turn = 2 * np.pi / rate(sim.snapshot())
    assert turn / 300 < sim.choice.longest < turn / 12


def test_a_motion_that_does_not_begin_at_zero_is_told():
    sim = simulation("body.head.motion={moves=['1 + t', 0, 0]}")
    assert any("body.head.motion.moves: [1.0, 0.0, 0.0] at t = 0" in line for line in warnings(sim))
    assert not any("body.head.motion" in line for line in warnings(simulation()))
