"""The common part of the models of fluids on a periodic grid."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from .. import costs
from .. import grid as grids
from ..drag import drag
from . import grid_warnings
from .base import FluidModel, Term

if TYPE_CHECKING:
    from ...case.filament import Filament
    from ...fluids.base import Fluid
    from ...fluids.immersed_boundary import Immersed
    from ...fluids.output import FluidOutput
    from ...fluids.stokes import Solver
    from ...grid.kernels import Kernel
    from ...grid.periodic_grid import Grid
    from ..stacked import RodStack
    from .base import Scene

FIELDS = "fields and their transforms"
BAND = "band matrix"


class GridModel(FluidModel):
    """A fluid that nodes push on a periodic grid, through a discrete delta kernel."""

    @cached_property
    def grid(self) -> Grid:
        """The periodic grid. Raises CaseError where ``thickness`` has none."""
        return grids.grid(self.case)

    @cached_property
    def kernel(self) -> Kernel:
        """The discrete delta kernel."""
        return grids.kernel(self.case)

    @property
    def components(self) -> int:
        """How many numbers of a node go through the grid: 3, or 4 with its twist torque."""
        return 4 if self.case.couples_torque else 3

    # -- the fluid itself

    @abstractmethod
    def fluid(self, rods: RodStack, immersed: Immersed, method: str) -> Fluid:
        """The fluid by one of its methods."""

    def build(self, rods: RodStack) -> Fluid:
        """The fluid by the method of the case, or the one that counts say is cheapest."""
        return self.fluid(rods, self.immersed(rods), self.method(rods))

    def immersed(self, rods: RodStack) -> Immersed:
        """The ingredients of every fluid on this grid."""
        from ...fluids import immersed_boundary

        case, grid, eta = self.case, self.grid, self.case.fluid.viscosity
        volume = rods.system.mesh.volume
        slip = immersed_boundary.slip_mobility(case.fluid.slip, self.kernel, grid, eta, volume)
        local = rods.system.unknowns == 4 and not case.couples_torque
        spin = drag(case, rods).spin if local else None
        number = np.float32 if case.fluid.single else np.float64
        coupling = grids.coupling(case, rods)
        return immersed_boundary.Immersed(grid, self.kernel, eta, slip, spin, self.flow, rods.nodes, number, coupling)

    def output(self, rods: RodStack, fluid: Fluid) -> FluidOutput:
        """Heat and fields, by an evaluation on the whole grid."""
        from ...fluids.fields import GridFields
        from ...fluids.output import GridOutput

        fields = GridFields(self.grid, self.case.fluid.viscosity, self.flow, self.case.compute.threads)
        return GridOutput(self.immersed(rods), fields)

    def method(self, rods: RodStack) -> str:
        """The case's, or the cheapest by counts."""
        if self.case.fluid.method != "auto":
            return self.case.fluid.method
        seconds = self.seconds(rods)
        return min(seconds, key=lambda name: seconds[name])

    def transforms(self, rods: RodStack) -> bool:
        """All methods but the table do."""
        return self.method(rods) != "table"

    def solver(self, rods: RodStack, method: str) -> Solver:
        """The solver for velocities by FFT: of the whole grid, or where that is cheaper of the filaments' box."""
        eta, threads = self.case.fluid.viscosity, self.case.compute.threads
        if self.case.couples_torque:
            from ...fluids.torque_coupling import TorqueStokesSolve

            return TorqueStokesSolve(self.grid, eta, threads)
        if method == "fft" or (method == "krylov" and not self.fills_little(rods)):
            from ...fluids.stokes import StokesSolve

            return StokesSolve(self.grid, eta, threads)
        from ...grid.pruned_fft import PrunedSolve

        return PrunedSolve(self.grid, eta, threads)

    # -- what a step costs

    def _sizes(self, rods: RodStack) -> list[int]:
        """Extents, in cells, of the box that holds the filaments' stencils at the start."""
        from ...grid.pruned_fft import bounding_box

        base, _ = self.kernel.stencil(self.grid.coordinates(rods.start.r))
        return bounding_box(base, self.kernel.points, self.grid.cells)[1]

    def seconds(self, rods: RodStack) -> dict[str, float]:
        """Of a step by each method."""
        counts = [where.stop - where.start for where in rods.nodes]
        return costs.seconds_a_step(self.case, counts, self.grid.cells.tolist(), self._sizes(rods), self.components)

    def factor_cost(self, rods: RodStack) -> float:
        """The cost of factoring the rods' own systems, in velocity evaluations."""
        evaluation = costs.evaluation(self.grid.cells.tolist(), self._sizes(rods), len(rods.s))
        return sum(costs.factored(where.stop - where.start, self.components) for where in rods.nodes) / evaluation

    def fills_little(self, rods: RodStack) -> bool:
        """Whether transforms of the filaments' bounding box alone are the cheaper ones."""
        cells = self.grid.cells.tolist()
        return costs.pruned_evaluation(cells, self._sizes(rods)) < costs.full_evaluation(cells)

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
        case, out, look = self.case, [], costs.full_evaluation(self.grid.cells.tolist())
        if case.output.grid_every is not None:
            seconds = len(case.output.fields) * look * step / case.output.grid_every
            out.append(Term("fields written", seconds, fields))
        if case.dissipation_observed:
            every = case.output.every or case.time.end / max(len(case.output.times or ()), 1)
            workspace = 0.0 if fields else 6 * 8.0 * float(np.prod(self.grid.cells))
            out.append(Term("dissipation looked at", 1.5 * look * step / every, workspace))
        return out

    @property
    def _number(self) -> float:
        """Bytes of a number of tables and of fields with inertia."""
        return 4.0 if self.case.fluid.single else 8.0

    def memory(self, rods: RodStack) -> dict[str, float]:
        """The mobility table, what solves with it, and fields."""
        n, m, method = len(rods.s), rods.system.unknowns, self.method(rods)
        rim, entries = self.kernel.points - 1, 15 if self.components == 4 else 6
        out = {"mobility table": self._number * entries * float(np.prod(self.grid.cells // 2 + 1 + 2 * rim))}
        if method == "krylov":
            band = 8.0 * n * m * m * (2 * rods.system.profile.width + 1)
            out["preconditioner"] = (
                sum(8.0 * (self.components * (w.stop - w.start)) ** 2 for w in rods.nodes) + 2 * band
            )
            out["Krylov vectors"] = 60 * 8.0 * self.components * n
        else:
            out["dense matrices"] = costs.dense_bytes(n, self.components)
        return out

    # -- what is told

    def drag(self, filament: Filament) -> float:
        """4 pi eta, whatever the grid."""
        return 4 * np.pi * self.case.fluid.viscosity

    def modelled(self) -> list[str]:
        """Slip, and how rods spin."""
        out = []
        if self.case.fluid.slip:
            out.append(f"slip mobility of {self.case.fluid.slip:g} of a point's own, against locking")
        if self.case.couples_torque:
            out.append(
                "twist torques stir the grid as half a curl, rods spin with half its vorticity (rotation = grid)"
            )
        elif self.case.twists:
            out.append("spin against the rod's own drag (rotation = local)")
        return out

    def absent(self) -> list[str]:
        """Torque coupling, where it is not asked for."""
        return [] if self.case.couples_torque else ["torque coupling of the spin to the grid"]

    def size(self) -> list[str]:
        """The grid, and how thick rods and nodes are on it."""
        h, kernel = self.grid.spacing, self.kernel
        return [
            f"grid {' x '.join(str(n) for n in self.grid.cells)}, h = {h:.4g}",
            f"a rod on it is as thick as its kernel: radius {kernel.line_radius * h:.4g} when dragged, "
            f"{grids.twist_radius(self.case):.4g} when spun by the grid; no one radius of RFT has both",
            f"kernel {self.case.fluid.kernel}: one node moves as a sphere of radius {kernel.point_radius * h:.4g}; its "
            f"mobility differs by {kernel.translation_error:.2g} of itself between places in a cell",
        ]

    def groups(self, filament: Filament, rate: float) -> dict[str, float]:
        """Nodes, radii and waves in units of cells."""
        h, length = self.grid.spacing, filament.length
        out = {"ds/h": length / (filament.nodes - 1) / h, "a/L": self.kernel.line_radius * h / length}
        if filament.twisting is not None and self.case.couples_torque:
            out["a/L when spun"] = grid_warnings.spun_radius(filament, grids.twist_radius(self.case)) / length
        wave = grid_warnings.wave_number(filament)
        if wave:
            out["wavelength/h"] = 2 * np.pi / wave / h
        return out

    def warnings_of(self, scene: Scene, name: str, groups: Mapping[str, float]) -> list[str]:
        """Nodes and waves that the grid cannot tell apart, rods that it cannot spin, rods longer than the box."""
        return [
            *grid_warnings.of_nodes(self.case, name, groups),
            *grid_warnings.of_spin(self.case, name),
            *grid_warnings.of_images(self.grid, scene, name),
        ]

    def warnings(self, scene: Scene) -> list[str]:
        """A net force that a back pressure carries, a flow that is not periodic."""
        return [*grid_warnings.of_net_force(self.grid, scene), *grid_warnings.of_flow(self.grid, self.flow)]

    # -- pictures and recorded runs

    @property
    def box(self) -> np.ndarray:
        """The periodic box (3,)."""
        return np.array(self.case.fluid.box)

    @property
    def line_radius(self) -> float:
        """That of the kernel."""
        return self.kernel.line_radius * self.grid.spacing
