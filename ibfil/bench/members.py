"""The part of `ibfil bench` about the members of a study: what they cost beside their steps.

Two workers sweep the swimmer of README, ten periods each, an output each period and no fields of the grid, by the
command itself. Counted is processor time of all processes, so that a busy machine changes little; steps are timed in
each run (io/pace.py). The cost to begin (the command, two workers, what they load) is found by a sweep of runs
that end at once, and is shared by as many members as there are in a large study.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from .timing import Row, of_children

MEMBERS, FEW, LARGE = 100, 2, 500  # measured; to find what it takes to begin; told of
JOBS = 2
PERIODS = 10
PERIOD, EVERY = 0.2 * math.pi, 1.0  # of the beat; between two outputs, in periods


class Swept(NamedTuple):
    """Processor seconds of all processes of a sweep and of its runs' steps, its seconds, and how many steps."""

    processor: float
    stepping: float
    seconds: float
    steps: int


def swept(members: int, periods: float, folder: Path) -> Swept:
    """A sweep of so many members that run for so many periods. Raises CalledProcessError where it fails."""
    from ..io.pace import pace_of

    words = [sys.executable, "-m", "ibfil", "sweep", "swimmer_stokes", "--jobs", str(JOBS), "-o", str(folder)]
    words += ["--vary", f"fluid.viscosity=0.5:2:{members}", "output.fields=[]", f"time.end={periods * PERIOD!r}"]
    words += [f"observe.speed.over=[0, {periods * PERIOD!r}]", f"output.every={EVERY * PERIOD!r}"]
    before, began = of_children(), perf_counter()
    subprocess.run(words, capture_output=True, check=True, env={**os.environ, "NUMBA_NUM_THREADS": "1"})
    seconds, processor = perf_counter() - began, of_children() - before
    import h5py

    stepping, steps = 0.0, 0
    for path in folder.glob("*.h5"):
        with h5py.File(path) as file:
            count = int(file.attrs["steps"])
            _, one, _ = pace_of(file)
            stepping += one * count / max(1, count - 1)  # the first starts the clock
            steps += count
    return Swept(processor, stepping, seconds, steps)


def members(count: int = MEMBERS, periods: int = PERIODS) -> list[Row]:
    """Processor time of a member over that of its steps; and, on a machine of their own, its time by the clock."""
    with tempfile.TemporaryDirectory() as place:
        swept(FEW, 0.05, Path(place) / "warm")  # compiles, and keeps the table
        begin = swept(FEW, 0.05, Path(place) / "begin")
        whole = swept(count, periods, Path(place) / "whole")
    each, stepping = (whole.processor - begin.processor) / count, whole.stepping / count
    of_all = each + begin.processor / LARGE
    own, clock = f"a member of {LARGE}, {whole.steps // count} steps, {JOBS} workers", JOBS * whole.seconds / count
    busy = whole.processor / count
    return [
        Row(f"{own}: processor", of_all, "its steps", stepping, of_all / stepping, 1.05),
        Row(f"one of {count}: clock x workers", clock, "processor", busy, clock / busy, None),
        Row(
            "command and workers, to begin", begin.processor, "steps of one", stepping, begin.processor / stepping, None
        ),
    ]
