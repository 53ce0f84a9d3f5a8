"""Running cases, cutting runs, and what is in their files."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import h5py
import pytest
from fake_simulation import FakeSimulation, case

from ibfil import running
from ibfil.case import read_case
from ibfil.errors import Interrupted

HERE = Path(__file__).parent


def shipped(name: str, *overrides: str):
    """Makes a shipped case, shortened."""
    return lambda: read_case(HERE.parent / "cases" / name, overrides)


def real(case, wisdom: str):
    """The simulation that users get."""
    from ibfil.simulation import Simulation

    return Simulation(case, wisdom)


SHORT = ("time.end=0.1", "time.step='auto'", "fluid.cells=[32,32,32]", "output.every=0.02")

# What going on bit for bit is tested with: (case, how its simulation is made, steps at which it is cut).
SCENES = {
    "fake": (lambda: case(), FakeSimulation, (1, 17, 18, 200, 339)),
    "fake with fields": (lambda: case(grid=True), FakeSimulation, (1, 33, 34, 35, 299)),
    "swimmer": (shipped("swimmer/swimmer_rft.toml", "time.end=0.1"), real, (2, 11, 30)),
    "swimmer in a grid": (
        shipped("swimmer/swimmer_stokes.toml", "time.end=0.1", "fluid.cells=[32,32,32]", "output.grid_every=0.05"),
        real,
        (2, 7),
    ),
    "swimmer with inertia": (
        shipped("inertia/swimmer_re_10.toml", *SHORT, "output.grid_every=0.05", "output.fields=['pressure']"),
        real,
        (2, 7),
    ),
    "with inertia, by tolerance": (
        shipped("inertia/swimmer_re_10.toml", *SHORT, "time.tolerance=0.02", "fluid.method=krylov"),
        real,
        (3, 9),
    ),
    "whirling": (shipped("ends/whirling.toml", "time.end=0.1"), real, (2, 11)),
}


def quiet(line: str) -> None:
    """Say nothing."""


def run(given, path=None, build=FakeSimulation, **more):
    return running.run(given, path, build=build, progress=False, log=quiet, **more)


def go_on(path, *given, build=FakeSimulation, log=quiet, **more):
    return running.resume_run(path, *given, build=build, progress=False, log=log, **more)


def signalling(build, step: int, number: int = signal.SIGINT):
    """Makes simulations that send this process a signal after a step."""

    def make(*given):
        simulation = build(*given)
        inner = simulation.advance

        def advance(until, after_step):
            def counted():
                if simulation.steps == step:
                    os.kill(os.getpid(), number)
                after_step()

            inner(until, counted)

        simulation.advance = advance
        return simulation

    return make


def content(path: Path) -> dict[str, tuple]:
    """Every dataset of a run file: shape, type and bytes."""
    found = {}

    def take(name, item):
        if isinstance(item, h5py.Dataset):
            found[name] = (item.shape, item.dtype, item[()].tobytes())

    with h5py.File(path, locking=False) as file:
        file.visititems(take)
    return found


def interrupted(path: Path, step: int, given=None, build=FakeSimulation) -> None:
    with pytest.raises(Interrupted):
        run(given or case(), path, build=signalling(build, step))


def wait_for(condition, seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)
