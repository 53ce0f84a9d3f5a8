"""Run files written by hand from the fake simulation's outputs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from helpers.fake_simulation import FakeSimulation, case
from ibfil.io.datasets import Meaning
from ibfil.io.snapshots import Snapshot
from ibfil.io.writer import Recorder

MEANINGS = {"tip": Meaning("length", "position of the tip")}


def snapshots(count: int, given=None) -> Iterator[Snapshot]:
    """``count`` frames of a fake run, 0.05 apart."""
    simulation = FakeSimulation(given or case())
    for i in range(count):
        simulation.advance(0.05 * i, lambda: None)
        yield simulation.snapshot()


def series(snapshot: Snapshot) -> dict[str, np.ndarray]:
    """What the one observable sees."""
    return {"tip": snapshot.filaments["rod"].position[-1]}


def begin(path: Path, snapshot: Snapshot, **more) -> Recorder:
    """A run file with its first output."""
    return Recorder.create(path, case(), snapshot, series(snapshot), MEANINGS, **more)


def write(path: Path, count: int, **more) -> list[Snapshot]:
    """A finished run file of ``count`` outputs; the frames in it."""
    shown = list(snapshots(count))
    record = begin(path, shown[0], **more)
    for snapshot in shown[1:]:
        record.append(snapshot, series(snapshot))
    record.finish("finished", steps=7, wall_time=1.5)
    return shown
