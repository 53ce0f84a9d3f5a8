"""What an output holds (frames.py), taken from a running simulation: all filaments, diagnostics, fields where due."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from . import assemble_fluid, assemble_grid
from .frames import FilamentFrame, Frame
from .loads import EndMoment

if TYPE_CHECKING:
    from .assemble import Stacked
    from .case import Case
    from .case_filament import Filament
    from .fields import GridFields
    from .fluid import Fluid
    from .grid import Grid
    from .stepping import State


class Instant(NamedTuple):
    """A simulation at one instant: the state, and velocity, force on the fluid, reaction (n, m) of the step to it."""

    state: State
    velocity: np.ndarray
    force: np.ndarray
    reaction: np.ndarray
    iterations: int
    shortened: int


class Diagnostics:
    """Takes frames of one scene. Fields cost an evaluation of the fluid; their plans are made at the first."""

    def __init__(self, case: Case, rods: Stacked, fluid: Fluid, grid: Grid | None) -> None:
        self.case, self.fluid, self.grid = case, fluid, grid
        self._rods, self._mechanics = rods, rods.mechanics
        self._fields: GridFields | None = None
        self._wants_dissipation = any(one.kind == "dissipation" for one in case.observe.values())

    def frame(self, now: Instant, fields: Sequence[str] = ()) -> Frame:
        """All filaments with diagnostics, and the ``fields`` named."""
        shape = now.state.shape
        moment, strain = self._nodal_moment(now.state)
        filaments = {}
        for name, description, where in zip(self._rods.names, self._rods.filaments, self._rods.nodes, strict=True):
            segment = slice(where.start, where.stop - 1)
            stretch = shape.length[segment] / self._mechanics.mesh.ds[segment] - 1.0
            ends = (
                now.reaction[i, :3].copy() if end.end != "free" else None
                for i, end in ((where.start, description.start), (where.stop - 1, description.finish))
            )
            filaments[name] = FilamentFrame(
                shape.r[where].copy(),
                now.velocity[where, :3].copy(),
                now.force[where, :3].copy(),
                shape.e1[where].copy(),
                moment[where],
                strain[where],
                self._mechanics.stretching[segment] * stretch,
                *ends,
                **self._twisting(description, now, where),
            )
        grid = self._evaluate(fields, now) if fields else None
        return Frame(now.state.time, filaments, self._of_all(now), grid)

    def _twisting(self, filament: Filament, now: Instant, where: slice) -> dict[str, np.ndarray]:
        """The twist torque and the spin (N, 3) of a filament that twists, by name."""
        if filament.twisting is None:
            return {}
        e3 = now.state.shape.e3[where]
        return {"torque": now.force[where, 3:] * e3, "spin": now.velocity[where, 3:] * e3}

    def _nodal_moment(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Moment and strain (n, 3) at nodes: the third component is the mean of the half nodes beside it."""
        shape, mesh = state.shape, self._mechanics.mesh
        moment = self._mechanics.moment(shape, state.time)
        beside = mesh.joined.astype(float) + np.append(False, mesh.joined[:-1])
        thirds = []
        for half in (moment.twist, shape.twist):
            half = np.where(mesh.joined, half, 0.0)
            thirds.append((half + np.append(0.0, half[:-1])) / beside)
        nodal = np.column_stack([moment.bend, thirds[0]])
        for load in self._mechanics.loads:
            if isinstance(load, EndMoment):  # the law's own is zero there
                i = int(load.node[0])
                nodal[i] = np.stack([shape.e1[i], shape.e2[i], shape.e3[i]]) @ load.moment(shape, state.time)
        return nodal, np.column_stack([shape.bend, thirds[1]])

    def _of_all(self, now: Instant) -> dict[str, float | np.ndarray]:
        """The diagnostics of all filaments together, by name."""
        shape, mesh, force = now.state.shape, self._mechanics.mesh, now.force
        stretch = (shape.length / mesh.ds)[mesh.joined] - 1.0
        torque = np.cross(shape.r, force[:, :3]).sum(axis=0)
        if force.shape[1] == 4:
            torque = torque + (force[:, 3:] * shape.e3).sum(axis=0)
        out: dict[str, float | np.ndarray] = {
            "net_force": force[:, :3].sum(axis=0),
            "net_torque": torque,
            "stretch_max": float(stretch.max()),
            "stretch_min": float(stretch.min()),
            "power": float(np.sum(now.velocity * force)),
            "newton_iterations": float(now.iterations),
            "steps_shortened": float(now.shortened),
        }
        if self.grid is not None and self.case.output.probes:
            points = np.array(self.case.output.probes)
            out["probe_velocity"] = self.fluid.velocity_at(points, shape.r, shape.e3, force, now.state.time)
        if self._wants_dissipation:
            out |= self._dissipation(now)
        contact = self._rods.contact
        if contact is not None:
            out |= {"contacts": float(contact.near(shape.r).i.size), "first_contact": contact.since}
        return out

    def _dissipation(self, now: Instant) -> dict[str, float | np.ndarray]:
        """What the fluid turns into heat: F.(u - u0) of drag; eta int |grad u|^2 of a grid, and the nodes' side."""
        force, shape, time = now.force, now.state.shape, now.state.time
        if self.grid is None:
            flow = assemble_fluid.flow(self.case)
            carried = 0.0 if flow is None else float(np.sum(force[:, :3] * flow(shape.r, time)))
            return {"dissipation": float(np.sum(now.velocity * force)) - carried}
        heat, power = self._grid().dissipation(*self._pushes(now))
        own = assemble_grid.own_mobility(self.case, self._rods, self.grid)
        slip = float(np.sum(own * force[:, : own.shape[1]] ** 2))
        return {"dissipation": heat, "grid_power": power, "slip_power": slip}

    def _grid(self) -> GridFields:
        """What makes fields, made when it is first asked for."""
        assert self.grid is not None
        if self._fields is None:
            self._fields = assemble_fluid.fields(self.case, self.fluid, self.grid)
        return self._fields

    def _pushes(self, now: Instant) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The stencils of the nodes, and the vectors that they put onto the grid."""
        assert self.grid is not None
        base, weights = assemble_grid.kernel(self.case).stencil(self.grid.coordinates(now.state.shape.r))
        coupling = assemble_grid.coupling(self.case, self._rods)
        return base, weights, coupling.lift(coupling.axes(now.state.shape.e3), now.force)

    def _evaluate(self, fields: Sequence[str], now: Instant) -> dict[str, np.ndarray]:
        """Fields on the grid: one evaluation of the fluid."""
        return self._grid().evaluate(*self._pushes(now), now.state.time, fields)
