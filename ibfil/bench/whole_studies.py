"""Studies of a scene against what they may cost: an error bar, the modes of a rod, a fit of three parameters."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ..analysis.run import Run
from .first_step import processor_seconds
from .timing import Row

BASES, MODES, RUNS = 12.0, 2.0, 50.0  # runs of the scene, seconds, runs
_NOISE = 0.01  # of the length
_IBFIL = ("-m", "ibfil")
_TIMES = 5
_THREE = {"parameters.bending": "0.2,5", "parameters.amplitude": "0.05,1", "parameters.bend": "-2,2"}
_START = ("parameters.bending=2", "parameters.amplitude=0.1", "parameters.bend=0")
FIBRE = """
[parameters]
bending = 1.0
amplitude = 0.2
bend = 0.4
[filament.fibre]
length = 1.0
nodes = 25
bending = "bending"
stretching = 2000
normal = [0, 0, 1]
curvature = ["bend", 0]
[filament.fibre.start]
end = "clamped"
moves = [0, "amplitude*sin(2*pi*t)", 0]
[fluid]
model = "rft"
viscosity = 1.0
drag = "paper"
[time]
end = 2
step = 0.01
[output]
every = 0.08
"""


def costs() -> list[Row]:
    """The three, as commands in a folder of their own."""
    with TemporaryDirectory() as folder:
        return [_error_bar(folder), _modes(folder), _fit(folder)]


def _error_bar(folder: str) -> Row:
    """Of the shipped swimmer, choices and all, by processor time."""
    name = "uncertainty swimmer_stokes --meant"
    processor_seconds((*_IBFIL, "run", "swimmer_stokes", "time.end=0.05", "-o", "first.h5"), folder)  # compiles
    processor_seconds((*_IBFIL, *name.split(), "-o", "bar"), folder)
    cost = _told(folder, "bar/uncertainty.json", "cost_in_base_runs")
    return Row(name, cost, "runs of its own", BASES, cost / BASES, 1.0, "runs")


def _modes(folder: str) -> Row:
    """From the prompt, the best of some, once all is compiled."""
    words = (*_IBFIL, "modes", "flailing", "filament.rod.nodes=65", "-o", "modes")
    took = min(processor_seconds(words, folder) for _ in range(_TIMES))
    return Row("modes flailing, 65 nodes, from the prompt", took, "allowed", MODES, took / MODES, 1.0)


def _fit(folder: str) -> Row:
    """Of a twin, with noise, its runs two at a time."""
    where = Path(folder)
    (where / "fibre.toml").write_text(FIBRE, encoding="utf-8")
    processor_seconds((*_IBFIL, "run", "fibre.toml", "-o", "truth.h5"), folder)
    (where / "tracked.csv").write_text("\n".join(_tracked(where / "truth.h5")) + "\n", encoding="utf-8")
    vary = [word for key, bounds in _THREE.items() for word in ("--vary", f"{key}={bounds}")]
    data = ("--data", "tracked.csv", "--jobs", "2", "-o", "fit")
    processor_seconds((*_IBFIL, "fit", "fibre.toml", *_START, *vary, *data), folder)
    runs = _told(folder, "fit/fit.json", "runs")
    return Row("fit of three parameters, --jobs 2", runs, "allowed", RUNS, runs / RUNS, 1.0, "runs")


def _tracked(path: Path) -> Iterator[str]:
    """Points of a run, with noise, as a table."""
    noise = np.random.default_rng(1)
    yield "t,s,x,y"
    with Run(path) as truth:
        some = truth.arclength("fibre")[::2].tolist()
        for time, shape in zip(truth.time[1:].tolist(), truth.position("fibre")[1:, ::2, :2], strict=True):
            seen = shape + noise.normal(0, _NOISE, shape.shape)
            yield from (f"{time!r},{s!r},{x!r},{y!r}" for s, (x, y) in zip(some, seen.tolist(), strict=True))


def _told(folder: str, name: str, key: str) -> float:
    return float(json.loads((Path(folder) / name).read_text(encoding="utf-8"))[key])
