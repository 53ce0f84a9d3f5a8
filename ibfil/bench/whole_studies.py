"""Studies of a scene against what they may cost: an error bar, the modes of a rod, a fit of three parameters."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from .first_step import processor_seconds
from .timing import Row

BASES, MODES, RUNS = 12.0, 2.0, 50.0  # runs of the scene, seconds, runs
_NOISE = 0.01  # of the length
_MODES = ("-m", "ibfil", "modes", "flailing", "filament.rod.nodes=65")
_TIMES = 5
_THREE = {"parameters.bending": (0.2, 5.0), "parameters.amplitude": (0.05, 1.0), "parameters.bend": (-2.0, 2.0)}
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
    """The three."""
    with TemporaryDirectory() as folder:
        return [_error_bar(Path(folder)), _modes(folder), _fit(Path(folder))]


def _error_bar(folder: Path) -> Row:
    """Of the shipped swimmer, choices and all, by processor time."""
    from ..studies.uncertainty.study import uncertainty

    cost = uncertainty("swimmer_stokes", folder / "bar", meant=True, log=_quiet).cost
    return Row("uncertainty swimmer_stokes --meant", cost, f"{BASES:g} of its runs", BASES, cost / BASES, 1.0, "runs")


def _modes(folder: str) -> Row:
    """From the prompt, the best of some, once all is compiled."""
    took = min(processor_seconds(_MODES, folder) for _ in range(_TIMES))
    return Row("modes flailing, 65 nodes, from the prompt", took, f"{MODES:g} s", MODES, took / MODES, 1.0)


def _fit(folder: Path) -> Row:
    """Of a twin, with noise, its runs two at a time."""
    from ..analysis.run import Run
    from ..case.reading import parse_case
    from ..running.run import run
    from ..studies.fit.study import fit

    run(parse_case(FIBRE, "fibre.toml"), folder / "truth.h5", progress=False, log=_quiet)
    noise = np.random.default_rng(1)
    with Run(folder / "truth.h5") as truth:
        lines = ["t,s,x,y"]
        for time, shape in zip(truth.time[1:], truth.position("fibre")[1:], strict=True):
            at = shape[::2, :2] + noise.normal(0, _NOISE, shape[::2, :2].shape)
            lines += [
                f"{float(time)!r},{s!r},{x!r},{y!r}"
                for s, (x, y) in zip(truth.arclength("fibre")[::2].tolist(), at.tolist(), strict=True)
            ]
    (folder / "tracked.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = fit(FIBRE, _THREE, folder / "fit", folder / "tracked.csv", _START, jobs=2, log=_quiet)
    runs = float(found.runs)
    return Row("fit of three parameters, --jobs 2", runs, f"{RUNS:g} runs", RUNS, runs / RUNS, 1.0, "runs")


def _quiet(line: str) -> None:
    """Say nothing."""
