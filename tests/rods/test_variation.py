"""How loads change with the rod: their part of the stiffness against differences of their forces, load by load."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.scenes import scene

from ibfil.rods.constitutive import Linear
from ibfil.simulation.simulation import Simulation

N = 9
LENGTH = 1.3
TIME = 0.4
# Keys of a rod that is free at both ends.
LOADS: dict[str, dict[str, Any]] = {
    "end force": {"finish": {"force": ["1 + t", -2, 0.5]}},
    "follower": {"start": {"follower": "3 - t"}, "finish": {"follower": -4}},
    "moment, lab": {"start": {"moment": [0.3, "t", -0.5]}, "finish": {"moment": ["0.2*t", 0.7, 0.4]}},
    "moment, body": {
        "start": {"moment": [0.3, "t", -0.5], "frame": "body"},
        "finish": {"moment": ["0.2*t", 0.7, 0.4], "frame": "body"},
    },
    "spring": {"start": {"spring": {"stiffness": 5, "to": [0.1, 0.2, 0.3]}}, "finish": {"spring": {"stiffness": 2}}},
    "force": {"loads": {"force": ["s", "t", 1]}},
    "force of place": {"loads": {"force": ["sin(3*y)*t", "x*z - y**2", "s*cos(2*x)"]}},
    "body force": {"loads": {"body_force": ["1 + s", "t", "-2*s"]}},
    "active moment": {"loads": {"moment": ["1 - s", "t + s", 0]}},
    "active moment, twist": {"loads": {"moment": ["1 - s", "t + s", "2*s"]}},
    "weight": {"loads": {"weight": [0, 1, -2]}},
    "tether": {"loads": {"tether": {"stiffness": 3}}},
    "tether to a curve": {"loads": {"tether": {"stiffness": 3, "to": ["s", "t*s", 0]}}},
}
# The same across the rods, which lie along x at the start: all that a rod takes that cannot twist.
ACROSS = {
    "moment, lab": {"start": {"moment": [0, "t", -0.5]}, "finish": {"moment": [0, 0.7, 0.4]}},
    "moment, body": {
        "start": {"moment": [0.3, "t", 0], "frame": "body"},
        "finish": {"moment": ["0.2*t", 0.7, 0], "frame": "body"},
    },
}
FOLLOWING = set(LOADS) - {"end force", "force", "weight"}
KINDS = pytest.mark.parametrize("force", ["eq44", "torque-free"])


def loaded(force: str, m: int, keys: dict[str, Any], derivative: int = 6) -> Simulation:
    """Two unevenly spaced rods of which both have the loads; nothing else pushes their nodes."""
    rod = {"length": LENGTH, "nodes": N, "derivative": derivative, "spacing": "q**1.2", "bending": 1, "stretching": 1}
    if m == 4:
        rod |= {"twisting": 1, "radius": 0.1}
    both = {"a": {**rod, "force": force, **keys}, "b": {**rod, "force": force, "position": [0, 1, 0.5], **keys}}
    simulation = Simulation(scene(both))
    system = simulation.system
    zero = np.zeros(2 * N)
    system.law = Linear(np.zeros((2 * N, 2)), zero, (lambda t: zero, lambda t: zero), lambda t: zero)
    system.stretching = zero
    return simulation


def bent(simulation: Simulation) -> tuple[Any, np.ndarray]:
    """A start of curved, twisted, unevenly stretched rods, and displacements y (n, m) from it."""
    system, rng = simulation.system, np.random.default_rng(7)
    r = simulation.configuration.r.copy()
    s = simulation.arclength[:, None]
    r += 0.2 * np.concatenate([np.sin(2 * s) ** 2, np.sin(3 * s), np.cos(4 * s)], axis=1)
    start = system.start(r, np.array([0.1, 1.0, 0.3]) + 0.3 * rng.standard_normal(r.shape))
    y = 0.3 * rng.standard_normal((len(r), system.unknowns))
    y[:, :3] *= 0.03
    return start, y


@KINDS
@pytest.mark.parametrize(
    ("m", "name"), [(m, name) for m in (3, 4) for name in LOADS if m == 4 or name != "active moment, twist"]
)
def test_the_stiffness_of_a_load_is_the_derivative_of_its_force(force: str, m: int, name: str) -> None:
    """Central differences with h = 1e-6 err by h^2 f'''/6 and eps f/h: some 1e-9 of the largest entry here."""
    keys = ACROSS.get(name, LOADS[name]) if m == 3 else LOADS[name]
    simulation = loaded(force, m, keys, derivative=2 if name in ("moment, lab", "tether") else 6)
    system, (start, y), h = simulation.system, bent(simulation), 1e-6
    shape = system.move(start, y)
    applied, moment = system.forces(shape, TIME)
    assert np.abs(applied[:N]).max() > 0.01
    assert np.abs(applied[N:]).max() > 0.01
    exact = system.stiffness(shape, start, moment, TIME).dense()
    numerical = np.zeros_like(exact)
    for j, c in np.ndindex(y.shape):
        ahead, behind = y.copy(), y.copy()
        ahead[j, c] += h
        behind[j, c] -= h
        forces = [system.forces(system.move(start, z), TIME)[0] for z in (ahead, behind)]
        numerical[:, :, j, c] = (forces[0] - forces[1]) / (2 * h)
    assert np.abs(exact - numerical).max() <= 1e-7 * np.abs(numerical).max()
    assert (np.abs(numerical).max() > 0.1) == (name in FOLLOWING)


@KINDS
@pytest.mark.parametrize("name", [name for name in LOADS if "moment" in name])
def test_moments_push_with_no_net_force(force: str, name: str) -> None:
    simulation = loaded(force, 4, LOADS[name])
    start, y = bent(simulation)
    shape = simulation.system.move(start, y)
    applied, _ = simulation.system.forces(shape, TIME)
    for rod in (applied[:N], applied[N:]):
        assert np.abs(rod[:, :3].sum(axis=0)).max() < 1e-14 * np.abs(rod).sum()
