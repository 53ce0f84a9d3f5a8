"""The rest that a scene settles at: `ibfil rest`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...observables.factory import observers
from ...timestepping.equilibrium import residual_of
from ..settings import source
from ..tables import measured, write_json
from .levels import scene_of
from .run_file import Pose, write

if TYPE_CHECKING:
    from ...timestepping.equilibrium import Settled

RUN, DETAILS = "rest.h5", "rest.json"


@dataclass(frozen=True)
class AtRest:
    """The rests a scene passes through, the stable one last, with the observables there."""

    title: str
    settled: Settled
    round_off: float
    observables: tuple[Mapping[str, float | list[float]], ...]
    about: Mapping[str, Any]


def rest(case: str, folder: str | Path, overrides: Sequence[str] = ()) -> AtRest:
    """Find the stable rest; write rest.h5, whose outputs are the rests, and rest.json into ``folder``.

    Raises CaseError for what has no rest by its nature, RunFailed where none is found.
    """
    scene = scene_of(source(case), overrides)
    own, settled = scene.simulation.case, scene.settled()
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    still = np.zeros((len(scene.simulation.arclength), scene.system.unknowns))
    poses = [Pose(float(i), one.configuration, still) for i, one in enumerate(settled.rests)]
    write(folder / RUN, scene, iter(poses), "rest", "states of rest, the stable one last; times count them")
    last = scene.motion(settled.rests[-1].configuration)
    round_off = residual_of(last.noise, scene.system.length, scene.time)
    out = AtRest(own.title or own.file, settled, round_off, tuple(_observables(folder / RUN)), measured())
    write_json(folder / DETAILS, details(out))
    return out


def _observables(path: Path) -> list[dict[str, float | list[float]]]:
    """The ends of each filament at each output, and the case's observables that are of one output alone."""
    from ...io.reader import RunFile

    with RunFile(path) as run:
        known = observers(run.case).observables
        names = [name for name, one in known.items() if not getattr(one, "fitted", False)]
        series = {name: np.asarray(run.observables[name]) for name in names}
        for name in run.filaments:
            for end, node in (("start", 0), ("finish", -1)):
                series[f"{name} {end}"] = run.position(name)[:, node]
        return [{name: values[i].tolist() for name, values in series.items()} for i in range(len(run))]


def details(found: AtRest) -> dict[str, Any]:
    """Everything, ready for JSON."""
    return {
        "title": found.title,
        **found.about,
        "round_off": found.round_off,
        "rests": [
            {
                "residual": one.residual,
                "steps": one.steps,
                "solves": one.solves,
                "leading": {"growth": value.real, "frequency": abs(value.imag)},
                "observables": dict(seen),
            }
            for one, value, seen in zip(found.settled.rests, found.settled.leading, found.observables, strict=True)
        ],
    }
