"""One scene at several numbers of nodes, its rest and modes followed from one to the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...errors import RunFailed
from ...linalg.finite_differences import weights
from ...timestepping.base import FAILURES
from ...timestepping.steady import rods
from ..member import Member

if TYPE_CHECKING:
    from ...case.schema import Case
    from ...rods.geometry import Configuration
    from ...simulation.at_rest import SceneAtRest

FEWEST = 11  # nodes of a coarser level


def scene_of(case: str, overrides: Sequence[str]) -> SceneAtRest:
    """The scene of a case with changes. Raises CaseError, RunFailed."""
    from ...simulation.at_rest import SceneAtRest
    from ...simulation.simulation import Simulation

    return SceneAtRest(Simulation(Member("case", case, tuple(overrides)).resolved()))


def node_levels(case: Case) -> tuple[tuple[str, ...], ...]:
    """The overrides of a coarser, the case's own and a finer level; own and two finer ones where it has few nodes."""

    def level(count) -> tuple[str, ...]:
        return tuple(f"filament.{name}.nodes={count(f.nodes)}" for name, f in case.filaments.items())

    finer = level(lambda n: 2 * n - 1)
    if min((f.nodes - 1) // 2 + 1 for f in case.filaments.values()) < FEWEST:
        return (), finer, level(lambda n: 4 * n - 3)
    return level(lambda n: (n - 1) // 2 + 1), (), finer


def own_level(case: Case) -> int:
    """Which of the levels is the case's own."""
    return node_levels(case).index(())


def size(scene: SceneAtRest) -> float:
    """The size that falls as nodes are added: the mean share of a segment in its filament."""
    return float(np.mean([1.0 / (w.stop - w.start - 1) for w in scene.simulation.rods.nodes]))


def carried(from_scene: SceneAtRest, to_scene: SceneAtRest, values: np.ndarray) -> np.ndarray:
    """Values (n, ...) at the nodes of one level at those of another: cubics through four nodes, rod by rod."""
    out = np.zeros((len(to_scene.simulation.arclength), *values.shape[1:]), values.dtype)
    for a, b in zip(rods(from_scene.system), rods(to_scene.system), strict=True):
        s, there = from_scene.simulation.arclength[a], to_scene.simulation.arclength[b]
        first = np.clip(np.searchsorted(s, there) - 2, 0, len(s) - 4)
        for node, x, k in zip(range(b.start, b.stop), there, first, strict=True):
            out[node] = np.tensordot(weights(s[k : k + 4], x, 0), values[a][k : k + 4], axes=1)
    return out


def begun(from_scene: SceneAtRest, to_scene: SceneAtRest, rest: Configuration) -> Configuration:
    """The rest of one level as a configuration of another; the start of that where it cannot be carried over."""
    system, start = to_scene.system, to_scene.simulation.start
    y = np.zeros((len(start.r), system.unknowns))
    y[:, :3] = carried(from_scene, to_scene, rest.r) - start.r
    y.ravel()[system.ends.index] = 0.0
    try:
        there = system.move(start, y)
        if system.unknowns == 4:
            e1 = carried(from_scene, to_scene, rest.e1)
            y[:, 3] = np.arctan2(np.sum(e1 * there.e2, axis=1), np.sum(e1 * there.e1, axis=1))
            y[:, 3] = np.concatenate([np.unwrap(y[rod, 3]) for rod in rods(system)])
            y.ravel()[system.ends.index] = 0.0
            there = system.move(start, y)
    except FAILURES:
        return start
    return there


def rest_near(scene: SceneAtRest, configuration: Configuration):
    """The rest next to a configuration that was one nearby; else next to the scene's own start. Raises RunFailed."""
    try:
        return scene.next_rest(configuration)
    except RunFailed:
        return scene.next_rest()
