"""Running cases, cutting runs, and what is in their files."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

import h5py
import pytest

from helpers.fake_simulation import FakeSimulation, case, look
from ibfil.case.reading import parse_case
from ibfil.errors import Interrupted
from ibfil.running import run as running_run

HERE = Path(__file__).parents[1]


def real(case, wisdom: str):
    """The simulation that users get."""
    from ibfil.simulation.simulation import Simulation

    return Simulation(case, wisdom)


ROD = """
[filament.rod]
length = 1.0
nodes = 9
bending = 1.0
twisting = 1.0
radius = 0.05
stretching = 100.0
curvature = ["3*sin(6*s - 40*t)", "2*s"]
shape = { kind = "relaxed" }
start = { end = "clamped", spin = 20.0 }
[fluid]
model = "rft"
viscosity = 1.0
box = [2.0, 2.0, 2.0]
cells = [16, 16, 16]
density = 1.0
[time]
end = 0.012
step = 1e-3
[output]
every = 4e-3
grid_every = 8e-3
"""
SECOND = """
[filament.other]
length = 0.5
nodes = 9
bending = 1.0
stretching = 100.0
position = [0.2, 0.1, 0.05]
[contact]
action = "warn"
distance = 0.08
"""
LINKED = """
[filament.other]
length = 1.0
nodes = 9
bending = 1.0
stretching = 100.0
radius = 0.05
position = [0.0, 0.1, 0.05]
[link.spring]
between = [{ filament = "rod", at = 0.3 }, { filament = "other" }]
stiffness = 20.0
damping = 0.1
[link.bound]
kind = "bind"
filaments = ["other", "rod"]
normal = 100.0
motor = { friction = 5.0, lag = 0.01 }
"""

BODIES = """
[body.head]
shape = { kind = "ellipsoid", axes = [0.2, 0.15, 0.1] }
force = [0.1, "sin(100*t)", 0]
frame = "body"
[body.held]
shape = { kind = "sphere", radius = 0.1 }
position = [0, 0, 1]
motion = { moves = ["t", 0, 0] }
[observe.spin]
kind = "body_spin"
body = "head"
[observe.torque]
kind = "motor_torque"
motor = "rod_start"
"""


def rod(*overrides: str, more: str = ""):
    """Makes a case with a rod that is spun and bends itself in space."""
    return lambda: parse_case(ROD + more, "rod.toml", overrides)


FLUIDS = {
    "rft": ["fluid.drag=slender"],
    **{method: ["fluid.model=stokes", f"fluid.method={method}"] for method in ("table", "fft", "pruned")},
    "krylov": ["fluid.model=stokes", "fluid.method=krylov"],
    "single": ["fluid.model=stokes", "fluid.precision=single"],
    "stirred": ["fluid.model=stokes", "fluid.rotation=grid"],
    "navier-stokes": ["fluid.model=navier-stokes", "output.fields=['pressure']"],
    "navier-stokes fft": ["fluid.model=navier-stokes", "fluid.method=fft"],
    "navier-stokes single": ["fluid.model=navier-stokes", "fluid.precision=single"],
    "navier-stokes krylov": ["fluid.model=navier-stokes", "fluid.method=krylov", "fluid.rotation=grid"],
}
SCHEMES = {
    "explicit": ["time.scheme=explicit", "time.step=1e-5", "time.end=1.2e-4", "output.every=4e-5"],
    "semi-implicit": ["time.scheme=semi-implicit"],
    "first order": ["time.order=1"],
    "tolerance": ["time.tolerance=1e-2"],
}
# What going on bit for bit is tested with: (case, how its simulation is made, steps at which it is cut).
SCENES = {
    "fake": (lambda: case(), FakeSimulation, (1, 17, 18, 200, 339)),
    "fake with fields": (lambda: case(grid=True), FakeSimulation, (1, 33, 34, 35, 299)),
    **{fluid: (rod(*keys), real, (2, 7)) for fluid, keys in FLUIDS.items()},
    **{
        f"{scheme}, {fluid}": (rod(*FLUIDS[fluid], *keys), real, (2, 7))
        for scheme, keys in SCHEMES.items()
        for fluid in ("rft", "table", "navier-stokes", "navier-stokes krylov")
        if (scheme, fluid) != ("explicit", "navier-stokes krylov")
    },
    "thermal": (rod("thermal={energy=1e-3}", "time.step=1e-3"), real, (2, 7)),
    "thermal in the plane": (rod("thermal={energy=1e-3, directions='xy', twist=false}"), real, (1, 5)),
    **{
        f"bodies, {how}": (
            rod(*FLUIDS["rft"], f"filament.rod.start={{end='body', body='head', motor={motor}}}", *keys, more=BODIES),
            real,
            (2, 7),
        )
        for how, motor, keys in (
            ("given step", "{spin=20}", []),
            ("tolerance", "{stall=0.1, free=50}", SCHEMES["tolerance"]),
        )
    },
    "contact": (rod(*FLUIDS["table"], more=SECOND), real, (2, 7)),
    **{f"linked, {fluid}": (rod(*FLUIDS[fluid], more=LINKED), real, (2, 7)) for fluid in ("rft", "krylov")},
}


def quiet(line: str) -> None:
    """Say nothing."""


def run(given, path=None, build=FakeSimulation, **more):
    return running_run.run(given, path, build=build, look=look, progress=False, log=quiet, **more)


def go_on(path, *given, build=FakeSimulation, log=quiet, **more):
    return running_run.resume_run(path, *given, build=build, look=look, progress=False, log=log, **more)


def meddling(build, step: int, meddle):
    """Makes simulations during which ``meddle`` is called, after a step."""

    def make(*given):
        simulation = build(*given)
        inner = simulation.advance

        def advance(until, after_step):
            def counted():
                if simulation.steps == step:
                    meddle()
                after_step()

            inner(until, counted)

        simulation.advance = advance
        return simulation

    return make


def signalling(build, step: int, number: int = signal.SIGINT):
    """Makes simulations that send this process a signal after a step."""
    return meddling(build, step, lambda: os.kill(os.getpid(), number))


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


def wait_for(condition, process: subprocess.Popen | None = None, seconds: float = 300.0) -> None:
    """Until ``condition`` holds, at once in vain where ``process``, which is to bring it about, has ended."""
    end = time.monotonic() + seconds
    while not condition():
        assert process is None or process.poll() is None or condition(), "the process has ended"
        assert time.monotonic() < end, f"not within {seconds:g} s"
        time.sleep(0.005)
