"""The class of a setting as it is foretold, without a run, from the spectrum of the linearised motion.

An explicit step beyond 2/max |lam| diverges; lam are the eigenvalues that `ibfil modes` finds, here at the start shape.
Of a scene that has a rest next to its start, the start is a disturbance x of it, and the whole run follows as long as
that is small: by the motion it goes as exp(lam t), by a scheme as g(lam dt)^n (timestepping/linear_steps.py). Where the
two come to be further apart than what is called wrong, the setting is wrong. So growth that a scheme hides or makes up
is foretold, not only that a step is long.

Of scenes that change in time: omega dt beyond 2 pi/20 is not accurate. On grids: nodes nearer than 0.8 h without slip
lock.
"""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...errors import CaseError, RunFailed
from .results import PLACE

if TYPE_CHECKING:
    from ...case.schema import Case
    from ...simulation.simulation import Simulation
    from ...timestepping.linear_steps import Spectrum

_NO_SCENE = ("title", "source", "time", "output", "observe", "expect", "stop", "compute")  # tables that move nothing
SMALL = 0.3  # of the length, rms: a disturbance that is larger is not followed


class Prediction(NamedTuple):
    """A class of results.CLASSES, "" for nothing to fear, and what it is taken from."""

    kind: str = ""
    why: str = ""


class Rest(NamedTuple):
    """The spectrum about the rest next to a start, and how far that start is from it (k,)."""

    spectrum: Spectrum
    start: np.ndarray


class Rests:
    """The rests of the scenes of a map: scenes that differ in their time alone have one."""

    def __init__(self) -> None:
        self._found: dict[str, Rest | None] = {}

    def of(self, simulation: Simulation) -> Rest | None:
        """The rest next to the start; None where there is none by its nature, none near, or too many unknowns."""
        tables = tomllib.loads(simulation.case.text)
        scene = repr([tables[key] for key in sorted(tables) if key not in _NO_SCENE])
        if scene not in self._found:
            self._found[scene] = _rest(simulation)
        return self._found[scene]


def _rest(simulation: Simulation) -> Rest | None:
    from ...simulation.at_rest import SceneAtRest
    from ...timestepping.linear_steps import MOST, Spectrum, apart

    if simulation.start.r.shape[0] * simulation.system.unknowns > MOST:
        return None
    try:
        scene = SceneAtRest(simulation)
        motion = scene.motion(scene.next_rest().configuration)
    except (CaseError, RunFailed):
        return None
    start = apart(motion, simulation.start)
    if _size(simulation, motion.whole(start)[None]).max() > SMALL:
        return None
    return Rest(Spectrum(motion), start)


def predicted(simulation: Simulation, rests: Rests) -> Prediction:
    """The prediction for a simulation that has not begun."""
    from ...assembly.fluids.grid_warnings import LOCKING_SPACING
    from ...check.dimensionless import groups
    from ...simulation.steps import LONG_PHASE

    case, dt = simulation.case, simulation.step_length
    limit = simulation.explicit_limit() if case.time.explicit else np.inf
    if dt > limit:
        return Prediction("diverged", f"step {dt / limit:.3g} times 2/max|lambda| = {limit:.3g}")
    found = groups(simulation)
    near = min((value for key, value in found.items() if key.endswith("ds/h")), default=np.inf)
    if case.fluid.on_grid and case.fluid.slip == 0 and near < LOCKING_SPACING:
        return Prediction("locked", f"nodes {near:.3g} cells apart without slip")
    fast = max((value for key, value in found.items() if key.endswith("omega dt")), default=0.0)
    if fast > LONG_PHASE * (1 + 1e-9):
        return Prediction("wrong", f"omega dt = {fast:.3g}")
    given = case.time.tolerance is None and not case.time.automatic
    rest = rests.of(simulation) if given else None
    return Prediction() if rest is None else _about_rest(simulation, rest)


def _about_rest(simulation: Simulation, rest: Rest) -> Prediction:
    """The prediction from the course of the start, small as it is, by the scheme and by the motion itself."""
    dt, times = _steps(simulation.case, simulation.step_length)
    spectrum, scheme = rest.spectrum, simulation.model.stepper
    steps = spectrum.steps(scheme, dt)
    true = spectrum.itself().after(rest.start, times)
    run = steps.after(rest.start, np.rint(times / dt))
    both = np.stack([_size(simulation, _whole(spectrum, x)) for x in (true, run, run - true)])
    large = np.nonzero(~(both[:2].max(axis=0) <= SMALL))[0]
    seen = both[2, : large[0] + 1] if large.size else both[2]
    growth = float(steps.rates.real.max() / dt)
    why = f"growth {spectrum.leading.real:.4g} at rest, {growth:.4g} by the step"
    return Prediction("" if seen.max(initial=0.0) <= PLACE else "wrong", why)


def _steps(case: Case, dt: float) -> tuple[float, np.ndarray]:
    """The step as it is taken, outputs being hit, and the times of the outputs."""
    every = case.output.every
    if every is None:
        return dt, np.asarray(case.output.times)
    times = np.arange(1, int(case.time.end / every + 1e-6) + 1) * every
    return every / np.ceil(every / dt - 1e-9), times


def _whole(spectrum: Spectrum, x: np.ndarray) -> np.ndarray:
    """Displacements (t, k) of the unconstrained unknowns as (t, n, m)."""
    return np.stack([spectrum.motion.whole(one) for one in x])


def _size(simulation: Simulation, y: np.ndarray) -> np.ndarray:
    """Root mean square (t,) of displacements y (t, n, m) over the nodes of a filament, of its length; the largest."""
    rods, out = simulation.rods, []
    for filament, where in zip(rods.filaments, rods.ranges, strict=True):
        out.append(np.sqrt((y[:, where, :3] ** 2).sum(axis=2).mean(axis=1)) / filament.length)
    largest: np.ndarray = np.max(out, axis=0)
    return largest
