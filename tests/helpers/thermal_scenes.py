"""Scenes of rods with thermal forces, as tests of them share them.

Statistical tests use fixed seeds; what they allow is three standard errors (or the chi-square bound of the same
probability), from the known spread and memory of each mode or, where those are not known, from independent rods.
Units: L = A = 1, drag across 1 per length, so that times are in units of zeta_perp L^4/A.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import tomli_w

from ibfil.case.reading import parse_case
from ibfil.case.schema import Case
from ibfil.linalg.normal_numbers import Draw, NormalNumbers, Purpose
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping.brownian import Asked

USUAL = 0.9973  # how often three standard errors are kept
SPIN = 0.02
DRAG = {"perp": 1.0, "par": 0.5, "spin": SPIN}
ROD = {"length": 1.0, "nodes": 9, "bending": 1.0, "stretching": 200.0}
BENT = {**ROD, "twisting": 0.7, "curvature": [2.0, 1.0], "twist_rate": 3.0, "shape": {"kind": "relaxed"}}


def scene(
    rods: Mapping[str, Mapping[str, Any]],
    energy: float = 1e-2,
    *,
    drag: Mapping[str, float] | str = DRAG,
    fluid: Mapping[str, Any] | None = None,
    time: Mapping[str, Any] | None = None,
    contact: Mapping[str, Any] | None = None,
    **thermal: Any,
) -> Case:
    """Rods with thermal forces of that energy; ``thermal``, ``time``, ``contact`` are further keys of those tables."""
    text = {
        "filament": {name: dict(rod) for name, rod in rods.items()},
        "fluid": {"model": "rft", "viscosity": 1.0, "drag": drag, **(fluid or {})},
        "thermal": {"energy": energy, **thermal},
        "time": {"end": 1.0, "step": 1e-4, **(time or {})},
        "output": {"every": 1.0},
        **({} if contact is None else {"contact": dict(contact)}),
    }
    return parse_case(tomli_w.dumps(text), "test.toml")


def many(rod: Mapping[str, Any], count: int, energy: float, dt: float, **more: Any) -> Simulation:
    """A simulation of ``count`` independent rods."""
    return Simulation(scene({f"rod{k}": rod for k in range(count)}, energy, time={"step": dt}, **more))


def walk(simulation: Simulation, steps: int) -> None:
    """Takes steps of the case's length."""
    for _ in range(steps):
        simulation.accept(simulation.attempt(simulation.step_length), simulation.time + simulation.step_length)


def motion(simulation: Simulation, dt: float, step: int = 0) -> np.ndarray:
    """The random motion xi (n, m) of the ``step``th step, of length dt, from the present configuration."""
    state = simulation.state_now._replace(steps=step)
    q, middle = state.configuration, state.time + 0.5 * dt
    response = simulation.fluid.response(q.r, q.e3, middle, 0.5 * dt)
    return simulation.model.noise.motion(
        Asked(simulation.system, simulation.fluid, state, response, middle, 0.5 * dt), dt
    )


def drift(simulation: Simulation, step: int = 0) -> np.ndarray:
    """kT div M (n, m), as one step finds it."""
    noise, state = simulation.model.noise, simulation.state_now
    q, out = state.configuration, np.zeros((len(simulation.arclength), simulation.system.unknowns))
    response = simulation.fluid.response(q.r, q.e3, state.time, 1.0)
    asked = Asked(simulation.system, simulation.fluid, state, response, state.time, 1.0)
    noise._drift.add(asked, Draw(NormalNumbers(1), step), noise.energy, out)
    return out


def blocks(simulation: Simulation) -> np.ndarray:
    """Z (n, m, m) of every node, from the case alone: half a segment at an end."""
    rod = next(iter(simulation.case.filaments.values()))
    e3, m = simulation.configuration.e3, simulation.system.unknowns
    volume = np.full(len(e3), rod.length / (rod.nodes - 1))
    volume[:: rod.nodes] /= 2
    volume[rod.nodes - 1 :: rod.nodes] /= 2
    along = e3[:, :, None] * e3[:, None, :]
    out = np.zeros((len(e3), m, m))
    out[:, :3, :3] = DRAG["perp"] * (np.eye(3) - along) + DRAG["par"] * along
    if m == 4:
        out[:, 3, 3] = SPIN
    return volume[:, None, None] * out


class Unit:
    """Numbers of which one, the ``place``th of all that are asked for, is ``size`` and the others are zero."""

    def __init__(self, place: int, size: float = 1.0) -> None:
        self.place, self.size, self.asked = place, size, 0

    def __call__(self, purpose: Purpose, shape: tuple[int, ...]) -> np.ndarray:
        out = np.zeros(shape)
        here = self.place - self.asked
        if 0 <= here < out.size:
            out.ravel()[here] = self.size
        self.asked += out.size
        return out


def moved_by_units(move: Callable[[Unit], np.ndarray]) -> np.ndarray:
    """The matrix whose columns are the moves that each random number gives by itself."""
    counted = Unit(0)
    columns = [move(counted).ravel()]
    columns += [move(Unit(place)).ravel() for place in range(1, counted.asked)]
    return np.array(columns).T


def chains(count: int, nodes: int, energy: float, seed: int) -> np.ndarray:
    """Worm-like chains (count, nodes, 3) from Boltzmann's law: angles between segments by exp(cos/(kT ds))."""
    random, ds = np.random.default_rng(seed), 1.0 / (nodes - 1)
    stiff = 1 / (energy * ds)
    uniform = random.random((count, nodes - 1))
    cos = 1 + np.log(uniform + (1 - uniform) * np.exp(-2 * stiff)) / stiff
    sin, about = np.sqrt(np.maximum(0, 1 - cos**2)), 2 * np.pi * random.random((count, nodes - 1))
    t = np.zeros((count, nodes - 1, 3))
    t[:, 0, 0] = 1
    for i in range(1, nodes - 1):
        b = np.cross(t[:, i - 1], [0.0, 0.0, 1.0])
        b /= np.linalg.norm(b, axis=1)[:, None]
        c = np.cross(t[:, i - 1], b)
        across = np.cos(about[:, i, None]) * b + np.sin(about[:, i, None]) * c
        t[:, i] = cos[:, i, None] * t[:, i - 1] + sin[:, i, None] * across
    return np.concatenate([np.zeros((count, 1, 3)), np.cumsum(ds * t, axis=1)], axis=1)
