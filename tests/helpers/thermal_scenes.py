"""Scenes of rods with thermal forces, as tests of them share them.

Statistical tests use fixed seeds; what they allow is three standard errors (or the chi-square bound of the same
probability), from the known spread and memory of each mode or, where those are not known, from independent rods.
Units: L = A = 1, drag across 1 per length, so that times are in units of zeta_perp L^4/A.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import tomli_w

from ibfil.case.reading import parse_case
from ibfil.case.schema import Case
from ibfil.simulation.simulation import Simulation

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
    **thermal: Any,
) -> Case:
    """Rods with thermal forces of that energy; ``thermal`` and ``time`` hold further keys of those tables."""
    text = {
        "filament": {name: dict(rod) for name, rod in rods.items()},
        "fluid": {"model": "rft", "viscosity": 1.0, "drag": drag, **(fluid or {})},
        "thermal": {"energy": energy, **thermal},
        "time": {"end": 1.0, "step": 1e-4, **(time or {})},
        "output": {"every": 1.0},
    }
    return parse_case(tomli_w.dumps(text), "test.toml")


def many(rod: Mapping[str, Any], count: int, energy: float, dt: float, **more: Any) -> Simulation:
    """A simulation of ``count`` independent rods."""
    return Simulation(scene({f"rod{k}": rod for k in range(count)}, energy, time={"step": dt}, **more))


def walk(simulation: Simulation, steps: int) -> None:
    """Takes steps of the case's length."""
    for _ in range(steps):
        simulation.accept(simulation.attempt(simulation.step_length), simulation.time + simulation.step_length)


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
