"""A run file made by hand: two filaments that move in a known way, and a known flow in an uneven box."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ibfil.case.reading import parse_case
from ibfil.case.schema import Case
from ibfil.io.datasets import Meaning
from ibfil.io.snapshots import FilamentSnapshot, Snapshot
from ibfil.io.writer import GridPlace, Recorder
from ibfil.observables.factory import observers

CASE = """
title = "Two made filaments"
source = "by hand"
units = { length = "um", force = "pN", time = "s" }
[filament.long]
length = 2.0
nodes = 9
bending = 1.0
stretching = 100.0
radius = "0.1 + 0.01*s"
twisting = 1.0
[filament.short]
length = 1.0
nodes = 7
derivative = 2
bending = 1.0
stretching = 100.0
[fluid]
model = "stokes"
viscosity = 1.0
box = [3.0, 2.0, 1.0]
cells = [12, 8, 4]
[time]
end = 1.0
[output]
every = 0.25
grid_every = 0.5
[observe.tip]
kind = "position"
filament = "short"
at = "finish"
[observe.speed]
kind = "drift"
filament = "short"
along = [0, 1, 0]
[expect.right]
observe = "speed"
value = 3.0
tolerance = 1e-9
source = "the made motion"
[expect.wrong]
observe = "speed"
value = 4.0
tolerance = 0.1
"""

BENT = """
title = "A bent rod straightens"
[filament.rod]
length = 1.0
nodes = 9
derivative = 2
bending = 1.0
stretching = 100.0
shape = { kind = "circle", curvature = 1.0 }
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = 0.02
step = 1e-3
[output]
every = 0.005
[observe.span]
kind = "end_to_end"
[expect.span]
observe = "span"
range = [0.9, 1.0]
"""  # a case that is run in a moment, and ends with one expectation

ORIGIN, SPACING, CELLS = np.array([-1.5, -1.0, -0.5]), 0.25, (12, 8, 4)
SPEED = 3.0  # of every filament, along y


def made_case() -> Case:
    """The case above."""
    return parse_case(CASE, "made.toml")


def flow(x: np.ndarray, y: np.ndarray, z: np.ndarray, time: float) -> np.ndarray:
    """A field (..., 3) in which no two axes, points or times can be exchanged unseen."""
    return np.stack([x + 10 * y + 100 * z, x * y + time, z - 7 * time * x], axis=-1)


def filament(s: np.ndarray, time: float, number: int) -> FilamentSnapshot:
    """A straight filament along x that glides along y, its arrays all different."""
    n = len(s)
    r = np.column_stack([s, SPEED * time + 0 * s, np.full(n, float(number))])
    velocity = np.tile([0.0, SPEED, 0.0], (n, 1))
    e1 = np.tile([0.0, 0.0, 1.0], (n, 1))
    tension = np.arange(1.0, n) + time
    return FilamentSnapshot(r, velocity, 2 * r, e1, 3 * r, 4 * r, tension, None, None)


def snapshot(case: Case, time: float, fields: bool) -> Snapshot:
    """The made scene at one time."""
    filaments = {
        name: filament(np.linspace(0, rod.length, rod.nodes), time, number)
        for number, (name, rod) in enumerate(case.filaments.items())
    }
    axes = (ORIGIN[d] + SPACING * np.arange(CELLS[d]) for d in range(3))
    grid = {"velocity": flow(*np.meshgrid(*axes, indexing="ij"), time).astype(np.float32)} if fields else None
    diagnostics = {
        "net_force": np.array([0.0, 3.0, 4.0]),
        "power": 5.0,
        "stretch_max": 0.1,
        "stretch_min": -time,
    }
    return Snapshot(time, filaments, diagnostics, grid)


def make_run(path: Path, until: float = 1.0, status: str = "finished") -> Path:
    """Write the made scene from t = 0 to ``until``: filaments every 0.25, the flow every 0.5."""
    case = made_case()
    seen = observers(case)
    recorder = None
    for i in range(round(until / 0.25) + 1):
        now = snapshot(case, 0.25 * i, fields=i % 2 == 0)
        values = seen.record(now)
        if recorder is None:
            meanings = {seen.recorded(k): Meaning(o.dimension, o.description) for k, o in seen.observables.items()}
            location = GridPlace(ORIGIN, SPACING, 1)
            recorder = Recorder.create(
                path,
                case,
                now,
                values,
                meanings,
                grid=location,
                method="made",
                groups={"sperm number": 4.5},
                overwrite=True,
            )
        else:
            recorder.append(now, values)
        if now.grid:
            recorder.append_fields(now.time, now.grid)
    assert recorder is not None
    recorder.finish(status, steps=4, wall_time=75.0)
    return path
