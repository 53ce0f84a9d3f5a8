"""Warnings about a scene above a wall: heights, flows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ...case.schema import Case
    from ...fluids.base import Flow
    from .base import Scene

FLOW_ON_WALL = 1e-6  # of a background flow's size some way above the wall: what it may be on the wall


def of_height(case: Case, scene: Scene, name: str, near: float) -> list[str]:
    """A filament that begins nearer to the wall than ``near``, a node's radius, though it is not held there."""
    z = scene.configuration.r[scene.nodes(name), 2]
    filament = case.filaments[name]
    inner = z[int(filament.start.held) : len(z) - int(filament.finish.held)]
    share = float(np.mean(inner < near))
    if share < 0.5:  # the part of a cilium by its base is near, and hardly moves
        return []
    return [
        f"filament.{name}: begins {float(np.min(inner)):.3g} above the wall with most of its nodes nearer than "
        f"{near:.3g}, their radius: mobilities there are those of no rod; take a smaller fluid.spacing, or raise it"
    ]


def of_flow(flow: Flow | None, sticks: bool) -> list[str]:
    """A background flow that is not zero on a wall that it sticks to, or goes through one along which it slides."""
    if flow is None:
        return []
    places = np.random.default_rng(0).uniform(-1.0, 1.0, (64, 3))
    size = float(np.max(np.abs(flow(places + np.array([0.0, 0.0, 1.0]), 0.0))))
    on_wall = np.abs(flow(places * [1.0, 1.0, 0.0], 0.0))
    most = float(np.max(on_wall if sticks else on_wall[:, 2]))
    if most <= FLOW_ON_WALL * max(size, 1e-300):
        return []
    does = "is not zero on the wall" if sticks else "goes through the wall"
    return [f"fluid.flow: {does}: found {most:.3g} at z = 0; take one that vanishes there, as ['z', 0, 0] does"]
