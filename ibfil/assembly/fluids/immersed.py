"""The common part of the models of fluids that nodes push through a discrete delta kernel, whatever space they fill."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...linalg.gmres import bytes_of
from .. import costs
from .. import grid as grids
from ..drag import drag
from . import grid_warnings, shells
from .base import Term
from .immersed_bodies import ImmersedBodiesModel

if TYPE_CHECKING:
    from ...case.filament import Filament
    from ...fluids.base import Fluid
    from ...fluids.immersed_boundary import Immersed
    from ...fluids.resistive_force import Drag
    from ...grid.kernels import Kernel
    from ...timestepping.brownian import Drift
    from ..stacked import RodStack
    from .base import Scene

FIELDS = "fields and their transforms"
BAND = "band matrix"
MOST_NODES = 400  # of a rod whose drag on turning is solved for: a dense system of three times as many


class ImmersedModel(ImmersedBodiesModel):
    """A fluid that nodes push through a discrete delta kernel."""

    @cached_property
    def kernel(self) -> Kernel:
        """The discrete delta kernel."""
        return grids.kernel(self.case)

    # -- the fluid itself

    @abstractmethod
    def fluid(self, rods: RodStack, immersed: Immersed, method: str) -> Fluid:
        """The fluid by one of its methods."""

    def build(self, rods: RodStack) -> Fluid:
        """The fluid by the method of the case, or the one that counts say is cheapest."""
        return self.fluid(rods, self.immersed(rods), self.method(rods))

    def drift(self, rods: RodStack) -> Drift:
        """By a random finite difference over a ten-thousandth of the spacing."""
        from ...timestepping.brownian import Divergence

        assert self.case.thermal is not None
        free = np.ones((len(rods.s), rods.system.unknowns))
        free.ravel()[rods.system.ends.index] = 0.0
        free[rods.system.copies] = 0.0
        free[:, 2 if self.case.thermal.planar else 3 :] = 0.0
        return Divergence(1e-4 * self.spacing, free)

    @property
    def spacing(self) -> float:
        """That of the space."""
        return self.space.spacing

    def immersed(self, rods: RodStack) -> Immersed:
        """The ingredients of every fluid in this space."""
        from ...fluids import immersed_boundary

        case, space, eta, n = self.case, self.space, self.case.fluid.viscosity, rods.count
        volume = rods.system.volume[:n]
        slip = immersed_boundary.slip_mobility(case.fluid.slip, self.kernel, space.spacing, eta, volume)
        local = rods.system.unknowns == 4 and not case.couples_torque
        spin = drag(case, rods).spin[:n] if local else None
        number = np.float32 if case.fluid.single else np.float64
        coupling = grids.coupling(case, rods)
        twists = rods.twists[:n].astype(float) if local else None
        parts = (space, self.kernel, eta, slip, spin, self.flow, twists, rods.groups, number, coupling)
        if not rods.bodies:
            return immersed_boundary.Immersed(*parts)
        from ...fluids.shells.stokes import ImmersedBodies

        return ImmersedBodies(*parts, shells=shells.shells(case, rods, case.fluid.kernel, space.spacing))

    def method(self, rods: RodStack) -> str:
        """The case's, or the cheapest by counts."""
        if self.case.fluid.method != "auto":
            return self.case.fluid.method
        seconds = self.seconds(rods)
        return min(seconds, key=lambda name: seconds[name])

    def transforms(self, rods: RodStack) -> bool:
        """All methods but the table do."""
        return self.method(rods) != "table"

    # -- what a step costs

    @abstractmethod
    def evaluation(self, rods: RodStack) -> float:
        """Seconds of one evaluation of the velocity at nodes by the cheaper transforms, from counts."""

    @abstractmethod
    def field_evaluation(self) -> float:
        """Seconds of one evaluation of a field for output, from counts."""

    @abstractmethod
    def table_entries(self) -> float:
        """Numbers of the mobility table."""

    def factor_cost(self, rods: RodStack) -> float:
        """The cost of factoring the rods' own systems, in velocity evaluations."""
        factors = sum(costs.factored(count, self.components) for count in rods.group_sizes)
        return factors / self.evaluation(rods)

    def terms(self, rods: RodStack, memory: Mapping[str, float], step: float) -> list[Term]:
        """The flow between nodes, and what is written of it."""
        used = {name: size for name, size in memory.items() if name not in (BAND, FIELDS)}
        seconds = self.seconds(rods)[self.method(rods)] - costs.of_rods(self.case, len(rods.s))
        flow = self._flow_terms(rods, seconds, used)
        fields = memory.get(FIELDS, 0.0)
        if self.case.output.grid_every is None:
            flow[0] = flow[0]._replace(bytes=flow[0].bytes + fields)
        return [*flow, *self._put_out(fields, step)]

    def _flow_terms(self, rods: RodStack, seconds: float, used: Mapping[str, float]) -> list[Term]:
        torques = ", torques too" if self.case.couples_torque else ""
        return [Term(f"flow between nodes{torques} ({self.method(rods)})", seconds, sum(used.values()))]

    def _put_out(self, fields: float, step: float) -> list[Term]:
        """Fields and dissipation that outputs ask for, spread over the steps between them."""
        case, out = self.case, []
        if case.output.grid_every is not None:
            seconds = len(case.output.fields) * self.field_evaluation() * step / case.output.grid_every
            out.append(Term("fields written", seconds, fields))
        if case.dissipation_observed:
            every = case.output.every or case.time.end / max(len(case.output.times or ()), 1)
            seconds, workspace = self._dissipation()
            out.append(Term("dissipation looked at", seconds * step / every, 0.0 if fields else workspace))
        return out

    @abstractmethod
    def _dissipation(self) -> tuple[float, float]:
        """Seconds, from counts, and bytes of one look at the dissipation."""

    @property
    def _number(self) -> float:
        """Bytes of a number of tables and of fields with inertia."""
        return 4.0 if self.case.fluid.single else 8.0

    def memory(self, rods: RodStack) -> dict[str, float]:
        """The mobility table, and what solves with it."""
        n, m, method = rods.count + sum(self.markers), rods.system.unknowns, self.method(rods)
        out = {"mobility table": self._number * self.table_entries()}
        if rods.bodies:
            out["bodies by nodes"] = 5 * 8.0 * rods.count * m * (6 * len(rods.bodies) + len(rods.motors))
        if method == "krylov":
            kept = 2 * 8.0 * n * m * m * (2 * rods.system.profile.width + 1)  # the stiffness of factors, and a copy
            alone = [sum(both) for both in self.counts(rods)] if rods.bodies else None
            blocks = bytes_of(self.components * k for k in alone or rods.group_sizes)
            out["preconditioner"] = (4 if alone else 1) * blocks + kept
            out["Krylov vectors"] = 60 * 8.0 * self.components * n
        else:
            out["dense matrices"] = costs.dense_bytes(n, self.components)
        return out

    # -- what is told

    def drag(self, filament: Filament) -> float:
        """4 pi eta, whatever the grid."""
        return 4 * np.pi * self.case.fluid.viscosity

    def local_drag(self, rods: RodStack) -> Drag:
        """4 pi eta across and 2 pi eta along, whatever the space; against spin the rods' own."""
        from ...fluids.resistive_force import Drag

        eta, volume = self.case.fluid.viscosity, rods.system.volume
        spin = drag(self.case, rods).spin if rods.system.unknowns == 4 else volume
        return Drag(4 * np.pi * eta * volume, 2 * np.pi * eta * volume, spin)

    def turning_drag(self, rods: RodStack, where: slice) -> float | None:
        """By the exact Stokes mobility of its nodes, alone, where it stands: the mean of the two ways to turn."""
        if where.stop - where.start > MOST_NODES:
            return None
        immersed, start = self.immersed(rods), rods.start
        nodes = immersed.nodes(start.r, start.e3)[where]
        mobility = immersed.mobility().matrix(nodes, immersed.own[where])
        r = start.r[where] - np.average(start.r[where], axis=0, weights=rods.system.mesh.volume[where])
        n, c = len(r), self.components
        pushed = mobility.reshape(n, c, n, c)[:, :3, :, :3].reshape(3 * n, 3 * n)
        turns = np.stack([np.cross(e, r).ravel() for e in (start.e1[where][0], start.e2[where][0])], axis=1)
        return 0.5 * float(np.sum(turns * np.linalg.solve(pushed, turns)))

    def modelled(self) -> list[str]:
        """Slip, how rods spin, and what bodies are made of."""
        out = shells.told(self.case, self.case.fluid.kernel, self.space.spacing)
        if self.case.fluid.slip:
            out += [self._slip(name, filament) for name, filament in self.case.filaments.items()]
        if self.case.couples_torque:
            out.append(
                "twist torques stir the grid as half a curl, rods spin with half its vorticity (rotation = grid)"
            )
        elif self.case.twists:
            out.append("spin against the rod's own drag (rotation = local)")
        return out

    def _slip(self, name: str, filament: Filament) -> str:
        """The slip of a filament's nodes, eps h/(2 ds), in terms of what a point moves by itself."""
        apart = filament.length / (filament.nodes - 1) / self.space.spacing
        share = 100 * self.case.fluid.slip / (2 * apart)
        return (
            f"slip of {name} against locking: nodes {apart:.3g} h apart slip by {share:.2g} % of a point's own "
            f"mobility, ends by {2 * share:.2g} % (fluid.slip = {self.case.fluid.slip:g})"
        )

    def absent(self) -> list[str]:
        """Torque coupling, where it is not asked for."""
        return [] if self.case.couples_torque else ["torque coupling of the spin to the grid"]

    def size(self) -> list[str]:
        """How thick rods and nodes are on the grid."""
        h, kernel = self.space.spacing, self.kernel
        return [
            f"a rod on it is as thick as its kernel: radius {kernel.line_radius * h:.4g} when dragged, "
            f"{grids.twist_radius(self.case):.4g} when spun by the grid; no one radius of RFT has both",
            f"kernel {self.case.fluid.kernel}: one node moves as a sphere of radius {kernel.point_radius * h:.4g}; its "
            f"mobility differs by {kernel.translation_error:.2g} of itself between places in a cell",
        ]

    def groups(self, filament: Filament, rate: float) -> dict[str, float]:
        """Nodes, radii and waves in units of cells."""
        h, length = self.space.spacing, filament.length
        out = {"ds/h": length / (filament.nodes - 1) / h, "a/L": self.kernel.line_radius * h / length}
        if filament.twisting is not None and self.case.couples_torque:
            out["a/L when spun"] = grid_warnings.spun_radius(filament, grids.twist_radius(self.case)) / length
        wave = grid_warnings.wave_number(filament)
        if wave:
            out["wavelength/h"] = 2 * np.pi / wave / h
        return out

    def warnings_of(self, scene: Scene, name: str, groups: Mapping[str, float]) -> list[str]:
        """Nodes and waves that the grid cannot tell apart, rods that it cannot spin, or as thick as they are said."""
        return [
            *grid_warnings.of_nodes(self.case, name, groups),
            *grid_warnings.of_spin(self.case, name),
            *grid_warnings.of_thickness(self.case, name, self.line_radius),
        ]

    def warnings(self, scene: Scene) -> list[str]:
        """Bodies that the grid tells badly."""
        dense = self.method(scene.rods) != "krylov"
        return shells.warnings(self.case, self.case.fluid.kernel, self.space.spacing, self.box, dense)

    # -- pictures and recorded runs

    @property
    def line_radius(self) -> float:
        """That of the kernel."""
        return self.kernel.line_radius * self.space.spacing
