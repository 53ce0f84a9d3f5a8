"""Rods that tests load and bring to rest, in units of L, A and eta."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from helpers.scenes import RFT, run, scene
from ibfil.simulation.simulation import Simulation

# Lengths in L, forces in A/L^2; drag of the paper, 4 pi and 2 pi, at viscosity 1.
PERP, PAR = 4 * np.pi, 2 * np.pi
ROD: Mapping[str, Any] = {
    "length": 1.0,
    "nodes": 33,
    "bending": 1.0,
    "stretching": 1e5,
    "anchor": "start",
    "direction": [1, 0, 0],
    "normal": [0, 0, 1],
}
TWISTING: Mapping[str, Any] = {**ROD, "twisting": 0.6, "radius": 0.1}
CLAMPED = {"end": "clamped"}
STIFFENING = {"kind": "stiffening", "coefficient": 0.3, "exponent": 1.5}
TWO_WELL = {"kind": "two-well", "wells": [-2.0, 3.0], "barrier": 1.5, "gradient": 0.04}


def settled(
    rod: Mapping[str, Any], fluid: Mapping[str, Any] = RFT, *, end: float = 160.0, step: float = 4.0
) -> Simulation:
    """The rod at rest, to round-off: backward Euler with steps far longer than any relaxation."""
    simulation = run(scene({"rod": rod}, fluid, end=end, step=step, order=1))
    assert np.abs(simulation.snapshot().filaments["rod"].velocity).max() < 1e-10
    return simulation


def half(s: np.ndarray) -> np.ndarray:
    """Arclength of the half nodes."""
    return 0.5 * (s[1:] + s[:-1])


class Cubic:
    """M = A O (1 + |O|^2), M3 = C O3 (1 + O3^2), with A = 1, C = 0.6."""

    def bending(self, strain: np.ndarray, s: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        square = np.sum(strain**2, axis=1)[:, None]
        outer = 2 * strain[:, :, None] * strain[:, None, :]
        return strain * (1 + square), np.eye(2) * (1 + square[:, :, None]) + outer

    def twisting(self, strain: np.ndarray, s: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        return 0.6 * strain * (1 + strain**2), 0.6 * (1 + 3 * strain**2)
