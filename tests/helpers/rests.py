"""Scenes at rest, for tests of equilibria and modes."""

from __future__ import annotations

from typing import Any

import numpy as np

from helpers.scenes import RFT, scene
from ibfil.simulation.at_rest import SceneAtRest
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping.linear_motion import LinearMotion

ZETA = 4 * np.pi  # drag across a rod of viscosity one
CLAMPED = {"end": "clamped"}


def straight(nodes: int, **keys: Any) -> dict[str, Any]:
    """A straight rod along x of length, A and C one, from the origin on, nearly inextensible."""
    return {
        "length": 1.0,
        "nodes": nodes,
        "bending": 1.0,
        "stretching": 1e5,
        "anchor": "start",
        "normal": [0, 1, 0],
        **keys,
    }


def spun(nodes: int, ratio: float, **keys: Any) -> dict[str, Any]:
    """The rod of Sec. 7.6, spun at its clamp at ``ratio`` A/(zeta_r L^2)."""
    spin = ratio * np.mean(keys.get("bending", 1.0)) / (4 * np.pi * 0.1**2)
    rod = {"twisting": 1.0, "radius": 0.1, "stretching": 1.6e4, "start": {**CLAMPED, "spin": float(spin)}}
    return straight(nodes, **{**rod, **keys})


def at_rest(rod: dict[str, Any], fluid: Any = RFT) -> SceneAtRest:
    """The scene of one rod."""
    return SceneAtRest(Simulation(scene({"rod": rod}, fluid)))


def motion_of(rod: dict[str, Any], fluid: Any = RFT) -> LinearMotion:
    """Its motion linearised about the rest next to its start."""
    scene = at_rest(rod, fluid)
    return scene.motion(scene.next_rest().configuration)


def rates(rod: dict[str, Any], fluid: Any = RFT, count: int = 8) -> np.ndarray:
    """Growth rates (k,) about the rest next to its start, in units of A/(zeta L^4)."""
    scene = at_rest(rod, fluid)
    motion = scene.motion(scene.next_rest().configuration)
    return scene.modes(motion, count).values * ZETA
