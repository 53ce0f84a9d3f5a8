"""The content of an output (io/snapshots.py), taken from a simulation: filaments, diagnostics, fields where due."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..io.snapshots import BodySnapshot, FilamentSnapshot, LinkSnapshot, MotorSnapshot, Snapshot

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..fluids.output import FluidOutput
    from ..timestepping.base import State
    from .model import Model
    from .solved_state import SolvedState


class Diagnostics:
    """Takes frames of one scene. Fields cost an evaluation of the fluid; their plans are made at the first."""

    def __init__(self, model: Model) -> None:
        self._model, self._rods, self._mechanics = model, model.rods, model.rods.system

    @cached_property
    def _output(self) -> FluidOutput:
        """The fluid's own outputs, made when they are first asked for."""
        return self._model.fluid_model.output(self._rods, self._model.inner)

    @cached_property
    def _written(self) -> list[tuple[str, Filament, slice]]:
        """Names, filaments and nodes of those that are written."""
        rods = self._rods
        which = rods.written(self._model.case.output.copies_every)
        return [(rods.names[k], rods.filaments[k], rods.nodes[k]) for k in which]

    def snapshot(self, now: SolvedState, fields: Sequence[str] = ()) -> Snapshot:
        """The filaments that are written, with diagnostics of all, and the ``fields`` named."""
        configuration = now.state.configuration
        moment, strain = self._nodal_moment(now.state)
        filaments = {}
        for name, description, where in self._written:
            segment = slice(where.start, where.stop - 1)
            stretch = configuration.length[segment] / self._mechanics.mesh.ds[segment] - 1.0
            ends = (
                now.reaction[i, :3].copy() if end.held else None
                for i, end in ((where.start, description.start), (where.stop - 1, description.finish))
            )
            filaments[name] = FilamentSnapshot(
                configuration.r[where].copy(),
                now.velocity[where, :3].copy(),
                now.force[where, :3].copy(),
                configuration.e1[where].copy(),
                moment[where],
                strain[where],
                self._mechanics.stretching[segment] * stretch,
                *ends,
                **self._twisting(description, now, where),
            )
        grid = self._output.evaluate(configuration, self._pushed(now), now.state.time, fields) if fields else None
        links = {}
        for link in self._rods.links:
            seen = link.seen(configuration, now.state.time)
            links[link.name] = LinkSnapshot(seen.first, seen.second, seen.force, **seen.parts)
        return Snapshot(now.state.time, filaments, self._of_all(now), grid, links, *self._bodies(now))

    def _bodies(self, now: SolvedState) -> tuple[dict[str, BodySnapshot], dict[str, MotorSnapshot]]:
        """The bodies and motors by name."""
        if not self._rods.bodies:
            return {}, {}
        from . import of_bodies

        return of_bodies.bodies(self._rods, now), of_bodies.motors(self._rods, now)

    def _twisting(self, filament: Filament, now: SolvedState, where: slice) -> dict[str, np.ndarray]:
        """The twist torque and the spin (N, 3) of a filament that twists, by name."""
        if filament.twisting is None:
            return {}
        e3 = now.state.configuration.e3[where]
        return {"torque": now.force[where, 3:] * e3, "spin": now.velocity[where, 3:] * e3}

    def _pushed(self, now: SolvedState) -> np.ndarray:
        """All that pushes the fluid inside (n, m): the rods' force on the fluid, and what the fluid's couple adds."""
        thickness, state = self._model.thickness, now.state
        if thickness is None:
            return now.force
        return now.force + thickness.at(state.configuration.r, state.time).from_fluid(now.velocity)

    def _nodal_moment(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Moment and strain (n, 3) at nodes: the third component is the mean of the half nodes beside it."""
        configuration, mesh = state.configuration, self._mechanics.mesh
        moment = self._mechanics.moment(configuration, state.time)
        n = self._rods.count
        joined = mesh.joined[:n]
        beside = joined.astype(float) + np.append(False, joined[:-1])
        thirds = []
        for half in (moment.twist, configuration.twist[:n]):
            half = np.where(joined, half, 0.0)
            nodal = (half + np.append(0.0, half[:-1])) / np.maximum(beside, 1.0)
            for first, last in self._mechanics.closures:
                nodal[[first, last]] = 0.5 * (nodal[first] + nodal[last])
            thirds.append(nodal)
        nodal = np.column_stack([moment.bend, thirds[0]])
        for load in self._mechanics.loads:
            given = load.end_moment(configuration, state.time)
            if given is not None:  # the law's own is zero there
                i, vector = given
                nodal[i] = np.stack([configuration.e1[i], configuration.e2[i], configuration.e3[i]]) @ vector
        return nodal, np.column_stack([configuration.bend[:n], thirds[1]])

    def _of_all(self, now: SolvedState) -> dict[str, float | np.ndarray]:
        """The diagnostics of all filaments together, by name."""
        configuration, mesh, force = now.state.configuration, self._mechanics.mesh, now.force
        stretch = (configuration.length / mesh.ds)[mesh.joined] - 1.0
        net, torque = self._wrench(now)
        out: dict[str, float | np.ndarray] = {
            "net_force": net,
            "net_torque": torque,
            "stretch_max": float(stretch.max()),
            "stretch_min": float(stretch.min()),
            "power": float(np.sum(now.velocity * force)),
            "newton_iterations": float(now.iterations),
            "steps_shortened": float(now.shortened),
        }
        case, fluid = self._model.case, self._model.fluid
        if self._model.mass is not None:
            out["kinetic_energy"] = self._model.mass.energy(now.velocity)
        if case.output.probes and case.fluid.on_grid:
            points = np.array(case.output.probes)
            pushed = self._pushed(now)
            out["probe_velocity"] = fluid.velocity_at(points, configuration.r, configuration.e3, pushed, now.state.time)
        if case.dissipation_observed:
            out |= self._dissipation(now)
        return out | self._rods.contact.diagnostics(configuration.r)

    def _wrench(self, now: SolvedState) -> tuple[np.ndarray, np.ndarray]:
        """Total force and torque (3,) on the fluid."""
        configuration, force = now.state.configuration, now.force
        if self._rods.bodies:
            from .of_bodies import wrench

            return wrench(self._rods, now)
        torque = np.cross(configuration.r, force[:, :3]).sum(axis=0)
        if force.shape[1] == 4:
            torque = torque + (force[:, 3:] * configuration.e3).sum(axis=0)
        return force[:, :3].sum(axis=0), torque

    def _dissipation(self, now: SolvedState) -> dict[str, float | np.ndarray]:
        """The heat that the motion makes, its parts, that of the couple across the rods too, and other powers."""
        state, thickness = now.state, self._model.thickness
        out = self._output.dissipation(state.configuration, now.velocity, self._pushed(now), state.time)
        if thickness is None:
            return out
        heat = thickness.at(state.configuration.r, state.time).dissipation(now.velocity)
        return {**out, "dissipation": out["dissipation"] + heat, "couple_dissipation": heat}
