"""Configurations about a rest as an ordinary run file: `show`, `vtk`, `render` and `shape.kind = "run"` take it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...io.datasets import Meaning
from ...io.writer import Recorder
from ...observables.factory import observers
from ...simulation.diagnostics import Diagnostics
from ...simulation.solved_state import SolvedState
from ...timestepping.base import State

if TYPE_CHECKING:
    from ...rods.geometry import Configuration
    from ...simulation.at_rest import SceneAtRest
    from ..modes.results import Mode

PHASES = 16  # outputs of a mode, over its period
SWING = 0.1  # of the length: the largest displacement of a mode as it is drawn
TURN = 0.5  # radians: the same of a turn


class Pose(NamedTuple):
    """One output: its time in the file, and a configuration with the velocity (n, m) it has there."""

    time: float
    configuration: Configuration
    velocity: np.ndarray


def write(path: Path, scene: SceneAtRest, poses: Iterator[Pose], method: str, reason: str) -> None:
    """Write the poses as a finished run of the scene's case. Raises RunFailed, RunFileError as any run file."""
    simulation = scene.simulation
    seen, diagnostics = observers(simulation.case), Diagnostics(simulation.model)
    first = next(poses)
    meanings = {seen.recorded(name): Meaning(one.dimension, one.description) for name, one in seen.observables.items()}
    recorder: Recorder | None = None
    for pose in chain([first], poses):
        force, _ = scene.system.forces(pose.configuration, 0.0)
        state = State(pose.time, pose.configuration, np.zeros_like(force), 0.0)
        snapshot = diagnostics.snapshot(
            SolvedState(state, pose.velocity, force, np.zeros_like(force), 0, 0, pose.configuration)
        )
        values = seen.record(snapshot)
        if recorder is None:
            case = simulation.case
            recorder = Recorder.create(path, case, snapshot, values, meanings, method=method, overwrite=True)
        else:
            recorder.append(snapshot, values)
    assert recorder is not None
    recorder.finish("finished", reason)


def swings(scene: SceneAtRest, rest: Configuration, modes: tuple[Mode, ...]) -> Iterator[Pose]:
    """Each mode over one period about the rest; mode k from time k - 1 to k."""
    for number, mode in enumerate(modes):
        vector = swing(scene, mode)
        for phase in range(PHASES):
            turn = np.exp(2j * np.pi * phase / PHASES)
            there = scene.system.move(rest, np.ascontiguousarray((vector * turn).real))
            yield Pose(number + phase / PHASES, there, (mode.value * vector * turn).real)


def swing(scene: SceneAtRest, mode: Mode) -> np.ndarray:
    """A mode (n, m) as large as it is drawn, at the phase of its largest displacement."""
    moved, turned = mode.vector[:, :3], mode.vector[:, 3:]
    size = max(np.abs(moved).max() / (SWING * scene.system.length), np.abs(turned).max(initial=0.0) / TURN)
    flat = mode.vector.ravel()
    return mode.vector / (size * np.exp(1j * np.angle(flat[np.argmax(np.abs(flat))])))
