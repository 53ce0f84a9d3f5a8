"""Run files written by hand from the fake simulation's outputs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from helpers.fake_simulation import FakeSimulation, case
from ibfil.io.frames import Frame
from ibfil.io.writer import Meaning, Recorder

MEANINGS = {"tip": Meaning("length", "position of the tip")}


def frames(count: int, given=None) -> Iterator[Frame]:
    """``count`` frames of a fake run, 0.05 apart."""
    simulation = FakeSimulation(given or case())
    for i in range(count):
        simulation.advance(0.05 * i, lambda: None)
        yield simulation.frame()


def series(frame: Frame) -> dict[str, np.ndarray]:
    """What the one observable sees."""
    return {"tip": frame.filaments["rod"].position[-1]}


def begin(path: Path, frame: Frame, **more) -> Recorder:
    """A run file with its first output."""
    return Recorder.create(path, case(), frame, series(frame), MEANINGS, **more)


def write(path: Path, count: int, **more) -> list[Frame]:
    """A finished run file of ``count`` outputs; the frames in it."""
    shown = list(frames(count))
    record = begin(path, shown[0], **more)
    for frame in shown[1:]:
        record.append(frame, series(frame))
    record.finish("finished", steps=7, wall_time=1.5)
    return shown
