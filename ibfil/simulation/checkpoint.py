"""All that a run needs to go on bit for bit, by name: what a checkpoint file holds (io/checkpoint.py)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..assembly.bodies.clouds import path_key
from ..errors import CaseError
from ..rods.geometry import Configuration
from ..timestepping.base import State
from .solved_state import SolvedState
from .steps import OTHER_STEPS

if TYPE_CHECKING:
    from ..timestepping.step_control import StepControl
    from .model import Model
    from .steps import StepLimits

Stored = dict[str, np.ndarray | float | int | str]
Numbers = Mapping[str, np.ndarray | float]


def stored(model: Model, now: SolvedState, control: StepControl, limits: StepLimits, laws: str) -> Stored:
    """The present of a run, with what its control, watch, fluid and rods remember, and the names of its laws."""
    rods = model.rods
    return {
        "time": now.state.time,
        "steps": now.state.steps,
        "iterations": now.iterations,
        # Whole: measured again from r and e1 it may differ in the last bit (compilers fuse a b + c as they like).
        "shape": now.state.configuration.table,
        "start": rods.start.r,
        "y_old": now.state.y_old,
        "dt_old": now.state.dt_old,
        "velocity": now.velocity,
        "force": now.force,
        "reaction": now.reaction,
        **_under("control", control.state()),
        **_under("limits", limits.state()),
        **_under("fluid", model.fluid.memory()),
        **_under("rods", rods.system.memory()),
        **rods.contact.state(),
        **_under("cloud", _clouds(model)),
        **({"there": now.there.table} if rods.bodies else {}),
        **({"laws": laws} if laws else {}),
    }


def taken_up(
    model: Model, state: Stored, control: StepControl, limits: StepLimits, laws: str
) -> tuple[SolvedState, list[str]]:
    """The present that ``stored`` was given, its memories handed back to those whose they are; and what is to be told.

    Raises CaseError where other laws from Python, another start shape, or other markers of a body were stored.
    """
    if state.get("laws", "") != laws:
        found, wanted = laws or "none", state.get("laws") or "none"
        raise CaseError([f"{model.case.file}: laws: found {found}; the run began with {wanted}"])
    known: Numbers = {k: _number(v) for k, v in state.items() if not isinstance(v, str)}
    array = {k: v for k, v in known.items() if isinstance(v, np.ndarray)}
    number = {k: v for k, v in known.items() if not isinstance(v, np.ndarray)}
    _same_start(model, array["start"])
    _same_clouds(model, _of("cloud", array))
    told = [] if control.restore(_of("control", known)) else [OTHER_STEPS]
    limits.restore(_of("limits", number))
    if memory := _of("fluid", known):
        model.fluid.recall(memory)
    model.rods.system.recall(_of("rods", known))
    model.rods.contact.restore(known)
    shape = Configuration(array["shape"])
    there = Configuration(array["there"]) if model.rods.bodies else shape
    present = State(number["time"], shape, array["y_old"], number["dt_old"], int(number["steps"]))
    motion = array["velocity"], array["force"], array["reaction"]
    return SolvedState(present, *motion, int(number["iterations"]), control.shortened, there), told


def _number(value: np.ndarray | float) -> np.ndarray | float:
    return np.ascontiguousarray(value) if isinstance(value, np.ndarray) else float(value)


def _under(whose: str, memory: Mapping[str, Any]) -> dict[str, Any]:
    """A memory, each of its names after that of the one whose it is."""
    return {f"{whose}_{name}": value for name, value in memory.items()}


def _of(whose: str, known: Mapping[str, Any]) -> dict[str, Any]:
    """The memory that ``_under`` was given."""
    return {name.removeprefix(f"{whose}_"): value for name, value in known.items() if name.startswith(f"{whose}_")}


def _same_start(model: Model, began: np.ndarray) -> None:
    """Clamps and tethers hold the start shape, so it must be the one the run began with."""
    for name, where in zip(model.rods.names, model.rods.nodes, strict=True):
        moved = float(np.max(np.linalg.norm(model.rods.start.r[where] - began[where], axis=1)))
        if moved > 1e-9 * model.rods.system.length:  # another machine may differ in the last bits
            found = f"a start shape that differs by {moved:.3g} from the one the run began with"
            allowed = "the file or run it is read from, as it was"
            raise CaseError([f"{model.case.file}: filament.{name}.shape: found {found}; allowed: {allowed}"])


def _clouds(model: Model) -> dict[str, np.ndarray]:
    """The markers (k, 3) of bodies that have them from a file, by name."""
    rods = model.rods
    each = zip(rods.bodies, rods.with_bodies.rows.bodies, strict=True) if rods.bodies else ()
    return {name: body.cloud for name, body in each if body.cloud is not None}


def _same_clouds(model: Model, began: Mapping[str, np.ndarray]) -> None:
    """A body is what its file says, so the file must be as the run began with."""
    for name, cloud in _clouds(model).items():
        if not np.array_equal(cloud, began[name]):
            found = "found other markers in its file than the run began with"
            raise CaseError([f"{model.case.file}: {path_key(model.case, name)}: {found}; allowed: the file as it was"])
