"""A stand-in for Simulation that steps in microseconds and in which one lost bit shows at once.

Each node obeys a chaotic map, with random numbers and with time; so a state that is not taken up exactly, a step more
or a step less, gives other outputs. Run as a program it runs a case, for tests that kill it.
"""

from __future__ import annotations

import sys
import time as clock
from collections.abc import Callable, Sequence
from types import SimpleNamespace

import numpy as np

from ibfil.case.reading import parse_case
from ibfil.case.schema import Case
from ibfil.check.overview import Overview, overview_of
from ibfil.errors import RunFailed
from ibfil.io.snapshots import FilamentSnapshot, Snapshot

CASE = """
title = "a fake"
[units]
length = "um"
force = "pN"
time = "s"
[filament.rod]
length = 1.0
nodes = 9
bending = 1.0
stretching = 100.0
anchor = "start"
start = { end = "clamped" }
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = 1.0
step = 0.003
[output]
every = 0.05
checkpoint_every = 60
[observe.tip]
kind = "position"
at = "finish"
[observe.speed]
kind = "speed"
[observe.moved]
kind = "displacement"
at = "centroid"
along = [0, 1, 0]
summary = "mean"
over = [0.2, 0.8]
"""

ALWAYS = "output.checkpoint_every=1e-9"  # a checkpoint after each step

GRID = """
grid_every = 0.1
grid_stride = 2
"""


def case(more: str = "", *overrides: str, grid: bool = False) -> Case:
    """The case above, with tables added at its end and overrides."""
    text = CASE.replace("checkpoint_every", GRID + "checkpoint_every") if grid else CASE
    if grid:
        fluid = 'model = "stokes"\nbox = [2.0, 2.0, 2.0]\ncells = [8, 8, 8]'
        text = text.replace('model = "rft"', fluid)
    return parse_case(text + more, "fake.toml", overrides)


class FakeSimulation:
    """What running/run.py needs of Simulation. ``fails_at`` a time, ``pause`` wall seconds a step."""

    method = "fake"
    wisdom = "(fake wisdom)"

    def __init__(self, case: Case, wisdom: str = "", *, fails_at: float = np.inf, pause: float = 0.0) -> None:
        self.case, self.fails_at, self.pause = case, fails_at, pause
        self.time, self.steps = 0.0, 0
        self.notices: list[str] = []
        ((name, filament),) = case.filaments.items()
        self.name = name
        self.y = np.linspace(0.1, 0.9, filament.nodes)
        self.random = np.random.default_rng(7)
        self.before = 0.0  # a memory that only the state carries from step to step
        self.grid = None
        if case.fluid.model != "rft":
            n = np.array(case.fluid.cells)
            h = case.fluid.box[0] / n[0]
            self.grid = SimpleNamespace(origin=-(n // 2) * h, spacing=h, cells=n)

    def advance(self, until: float, after_step: Callable[[], None]) -> None:
        """Steps of time.step, the last one shortened."""
        while self.time < until:
            last = self.time + self.case.time.step >= until * (1 - 1e-12)
            self.time = until if last else self.time + self.case.time.step
            drawn = self.random.random(len(self.y))
            self.y = 3.99 * self.y * (1 - self.y) * (0.9 + 0.05 * drawn + 0.05 * np.cos(self.time + self.before))
            self.before = float(self.y.sum())
            self.steps += 1
            if self.time >= self.fails_at:
                raise RunFailed("it diverged", time=self.time, filament=self.name, node=3, advice="a shorter step")
            if self.pause:
                clock.sleep(self.pause)
            after_step()

    def snapshot(self, fields: Sequence[str] = ()) -> Snapshot:
        """The map's values in y, and in everything else so that no two arrays are equal."""
        n = len(self.y)
        x = np.linspace(0, self.case.filaments[self.name].length, n)
        r = np.column_stack([x, self.y, self.y**2])
        rod = FilamentSnapshot(r, 2 * r, 3 * r, 4 * r, 5 * r, 6 * r, 7 * self.y[1:], 8 * r[0], None)
        grid = None
        if fields:
            nx, ny, nz = self.grid.cells
            base = np.arange(nx * ny * nz * 3, dtype=np.float32).reshape(nx, ny, nz, 3)
            grid = {field: base + np.float32(self.time) for field in fields}
        diagnostics = {"net_force": r.sum(axis=0), "power": self.before, "newton_iterations": 2.0}
        return Snapshot(self.time, {self.name: rod}, diagnostics, grid)

    def state(self) -> dict[str, np.ndarray | float | int | str]:
        """All of it, the random numbers with integers of 128 bits."""
        inner = self.random.bit_generator.state["state"]
        return {
            "time": self.time,
            "steps": self.steps,
            "y": self.y,
            "before": self.before,
            "random/state": inner["state"],
            "random/inc": inner["inc"],
            "kind": "PCG64",
        }

    def restore(self, state: dict[str, np.ndarray | float | int | str]) -> None:
        """Takes it up."""
        self.time, self.steps = state["time"], state["steps"]
        self.y, self.before = state["y"], state["before"]
        whole = self.random.bit_generator.state
        whole["state"] = {"state": state["random/state"], "inc": state["random/inc"]}
        self.random.bit_generator.state = whole


def look(simulation) -> Overview:
    """What is told of a fake, and of a real simulation, before it runs."""
    if isinstance(simulation, FakeSimulation):
        return Overview({"sperm number": 2.5}, ["nothing is solved"])
    return overview_of(simulation)


def main(path: str, what: str) -> None:
    """Run the case into ``path`` (what = start) or go on with it (resume), with a checkpoint at every step."""
    from ibfil.io import writer
    from ibfil.running import run as running_run

    writer._PAUSE = writer._SHARE = 0
    if what == "start":
        running_run.run(case("", ALWAYS), path, progress=False, build=FakeSimulation, look=look)
    else:
        running_run.resume_run(path, progress=False, build=FakeSimulation, look=look)


if __name__ == "__main__":
    main(*sys.argv[1:])
