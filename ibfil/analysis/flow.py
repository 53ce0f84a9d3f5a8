"""The fluid's velocity at any point of a recorded run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from ..assembly.fluids.models import fluid_model
from ..assembly.wrapped import recorded_thickness
from ..errors import CaseError

if TYPE_CHECKING:
    from ..assembly.fluids.base import FluidModel
    from ..case.schema import Case
    from ..io.reader import GridRecord, RunFile


class Flow(Protocol):
    """The flow of a run."""

    def velocity_at(self, points: np.ndarray, time: float) -> np.ndarray:
        """The velocity (k, 3) at ``points`` (k, 3); CaseError for times it does not know."""


def flow_of(run: RunFile) -> Flow:
    """The flow of a run: computed from the recorded forces where they alone make it, else its recorded field.

    Raises CaseError for a run in resistive-force theory, and for one without the field that is needed.
    """
    fluid = fluid_model(run.case)
    if not run.case.fluid.on_grid:
        what = "resistive-force theory knows no flow between the rods"
        raise CaseError([f'{run.path}: fluid.model: found "rft"; {what}; allowed: a fluid on a grid'])
    if fluid.flow_from_forces and not _leaves_out(run.case):
        return FlowOfForces(run, fluid)
    grid = run.grid
    if grid is None or "velocity" not in grid.fields:
        allowed = 'output.grid_every with "velocity" among output.fields'
        why = "the flow is read from where output.copies_every leaves forces out"
        why = why if _leaves_out(run.case) else "this fluid's flow is read from"
        raise CaseError([f"{run.path}: found no velocity field, which {why}; allowed: {allowed}"])
    return FlowOfField(run, grid)


def _leaves_out(case: Case) -> bool:
    """Whether there are copies whose forces are not in the run file."""
    return case.output.copies_every > 1 and any(filament.copies for filament in case.filaments.values())


class FlowOfForces:
    """u0 + J L^-1 S F of the recorded forces, and of torques where the fluid tells their flow."""

    def __init__(self, run: RunFile, fluid: FluidModel) -> None:
        self._run, self._background, self._solve = run, fluid.flow, fluid.solve_for_flow()
        rods = [(run.filament(name), run.arclength(name)) for name in run.filaments]
        self._thickness = recorded_thickness(fluid, rods)

    def velocity_at(self, points: np.ndarray, time: float) -> np.ndarray:
        """By the space that the fluid fills."""
        u = self._solve.velocity_at(points, *self._pushes(time))
        return u if self._background is None else u + self._background(points, time)

    def _pushes(self, time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions of all nodes, what they push with, and twist torques (n, 3), linear between outputs at ``time``."""
        i, part = between(self._run.time, time, str(self._run.path))

        def taken(key: str) -> np.ndarray:
            parts = [
                columns[key][i : i + 2] if key in columns else np.zeros_like(columns["force"][i : i + 2])
                for columns in self._run.filaments.values()
            ]
            two = np.concatenate(parts, axis=1)
            return np.ascontiguousarray((1.0 - part) * two[0] + part * two[-1])

        r, force = taken("position"), taken("force")
        if self._thickness is not None:
            force = force + self._thickness.at(r, time).from_fluid(taken("velocity"))
        return r, force, taken("torque")


class FlowOfField:
    """The recorded velocity, trilinear between its points and linear between its times."""

    def __init__(self, run: RunFile, grid: GridRecord) -> None:
        self._path, self._grid = str(run.path), grid
        self._time, self._field = np.asarray(grid.time), grid.fields["velocity"]

    def velocity_at(self, points: np.ndarray, time: float) -> np.ndarray:
        """Eight points of each of two fields."""
        i, part = between(self._time, time, self._path)
        x = (points - self._grid.origin) / self._grid.spacing
        low = np.floor(x).astype(int)
        u = np.zeros_like(points)
        for field, share in zip(self._field[i : i + 2], (1.0 - part, part), strict=False):
            for corner in np.ndindex(2, 2, 2):
                weight = share * np.prod(np.where(corner, x - low, 1.0 - (x - low)), axis=1)
                index = tuple(((low + corner) % field.shape[:3]).T)
                u += weight[:, None] * field[index]
        return u


def between(times: np.ndarray, time: float, path: str) -> tuple[int, float]:
    """The number of the last of ``times`` (T,) not after ``time``, and how far it is on the way to the next."""
    slack = 1e-9 * (times[-1] - times[0])
    if not times[0] - slack <= time <= times[-1] + slack:
        raise CaseError([f"{path}: time: found {time:g}; allowed: {times[0]:g} to {times[-1]:g}"])
    if len(times) == 1:
        return 0, 0.0
    i = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 2))
    return i, float(np.clip((time - times[i]) / (times[i + 1] - times[i]), 0.0, 1.0))
