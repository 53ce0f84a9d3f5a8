"""From a case to resistive-force theory, and what is told of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from .. import costs
from ..drag import drag, drag_coefficients, matching
from ..profiles import alone
from .base import FluidModel, Term

if TYPE_CHECKING:
    from ...case.filament import Filament
    from ...fluids.base import Fluid
    from ...fluids.output import FluidOutput
    from ...fluids.resistive_force import Drag
    from ...timestepping.brownian import Drift
    from ..stacked import RodStack
    from .base import Scene

_DRAG = 0.05  # seconds of drag, of those of the rods
DRAG_SCATTER = 0.02  # scatter of a straight rod's drag over places and directions, above which it is no number


class ResistiveForceModel(FluidModel):
    """Drag of each node, and no flow between nodes (Eq. 16, 17, 48)."""

    def build(self, rods: RodStack) -> Fluid:
        """Drag per node, in the background flow."""
        return self.local_fluid(rods)

    def drift(self, rods: RodStack) -> Drift:
        """That of the ends, from the drag."""
        from ...timestepping.brownian import EndDrift

        assert self.case.thermal is not None
        found = drag(self.case, rods)
        return EndDrift(found.perp, found.par, rods.system.mesh, self.case.thermal.planar)

    def output(self, rods: RodStack, fluid: Fluid) -> FluidOutput:
        """The heat of drag."""
        from ...fluids.output import DragOutput
        from ...fluids.resistive_force import ResistiveForce

        assert isinstance(fluid, ResistiveForce)
        return DragOutput(fluid)

    def terms(self, rods: RodStack, memory: Mapping[str, float], step: float) -> list[Term]:
        """Drag, and the factors of what links couple."""
        n, m = len(rods.s), rods.system.unknowns
        out = [Term("drag of each node", _DRAG * costs.of_rods(self.case, n), 8.0 * 3 * n)]
        if not rods.links:
            return out
        from ...linalg.block_sparse import pattern

        found = pattern(rods.system.profile, *rods.linked)
        seconds = costs.of_factors(self.case, found.operations, m)
        return [*out, Term("factors of linked nodes", seconds, 8.0 * m * m * len(found.column))]

    def drag(self, filament: Filament) -> float:
        """The case's own, across."""
        return self._coefficients(filament)[0]

    def _coefficients(self, filament: Filament) -> tuple[float, float]:
        """Drag per length across and along a filament."""
        radius, s = filament.radius, np.linspace(0.0, filament.length, filament.nodes)
        return drag_coefficients(self.case, filament, None if radius is None else alone(radius, s))[:2]

    def turning_drag(self, rods: RodStack, where: slice) -> float:
        """The sum of zeta_perp Lc s^2, s from the middle of the drag."""
        perp, s = drag(self.case, rods).perp[where], rods.s[where]
        return float(np.sum(perp * (s - np.average(s, weights=perp)) ** 2))

    def local_drag(self, rods: RodStack) -> Drag:
        """The case's own."""
        return drag(self.case, rods)

    def modelled(self) -> list[str]:
        """Drag, and where its coefficients come from."""
        fluid, eta = self.case.fluid, self.case.fluid.viscosity
        out = ["resistive-force drag on each node; no flow between nodes"]
        if fluid.calibrated is not None:
            where = "in free space" if fluid.free else "in the case's periodic box"
            out.append(f"its coefficients those of a straight rod of length {fluid.calibrated.matched:g} {where}")
            return out
        out += self._bodies()
        for name, filament in self.case.filaments.items():
            (perp, par), drag = self._coefficients(filament), fluid.drag_of(filament.radius)
            which = f'drag = "{drag}"' if isinstance(drag, str) else "given"
            idle = drag == "paper" and filament.radius is not None
            unused = ", which does not use the radius" if idle else ""
            spins = " but for its spin" if idle and filament.twisting is not None else ""
            out.append(
                f"drag of {name}: {perp / eta:.4g} eta across, {par / eta:.4g} eta along ({which}{unused}{spins})"
            )
        return out

    def _bodies(self) -> list[str]:
        """The drags of bodies."""
        from ...bodies.resistance import ellipsoid

        out = []
        for name, body in self.case.bodies.items():
            if body.resistance is not None:
                out.append(f"drag of {name}: as given (resistance)")
            elif any(body.shape.semi_axes):
                found = ellipsoid(np.array(body.shape.semi_axes), 1.0)[:2]
                moved, turned = (", ".join(f"{x:.4g}" for x in dict.fromkeys(np.round(part, 12))) for part in found)
                out.append(f"drag of {name}: {moved} eta along its axes, {turned} eta about them (in unbounded fluid)")
        return out

    def absent(self) -> list[str]:
        """Hydrodynamic interaction, and all that a grid takes; what a wall does to drag."""
        wall = [] if self.case.fluid.wall is None else ["the wall: drag is the same at any height"]
        return ["hydrodynamic interaction; grid and FFT plans", *wall]

    def groups(self, filament: Filament, rate: float) -> dict[str, float]:
        """The radius that the case gives; with drag calibrated on a grid what was found there."""
        out = {}
        if filament.radius is not None:
            middle = filament.radius.bind("s", "t")(0.5 * filament.length, 0.0)
            out["a/L"] = float(np.max(middle)) / filament.length
        matched = matching(self.case, filament)
        if matched is None:
            perp, par = self._coefficients(filament)
            out["zeta_perp/eta"], out["zeta_par/eta"] = (
                perp / self.case.fluid.viscosity,
                par / self.case.fluid.viscosity,
            )
        else:
            out["matched zeta_perp/eta"], out["matched zeta_par/eta"] = matched.perp, matched.par
            out["zeta_perp/zeta_par"], out["matched scatter"] = matched.ratio, matched.scatter
            if matched.spin:
                out["matched zeta_r/eta"] = matched.spin
        return out

    def warnings(self, scene: Scene) -> list[str]:
        """Drag of rods in a case whose grid makes them sheets."""
        axis = self.case.fluid.thin_axis
        if axis is None:
            return []
        return [
            f"fluid.cells: one cell along {'xyz'[axis]} makes filaments sheets on a grid; the drag here is that of "
            "rods: the two are not one scene"
        ]

    def warnings_of(self, scene: Scene, name: str, groups: Mapping[str, float]) -> list[str]:
        """Drag calibrated on a grid that cannot tell it to two digits."""
        scatter = groups.get("matched scatter", 0.0)
        if scatter <= DRAG_SCATTER:
            return []
        larger = "" if self.case.fluid.free else " or a larger fluid.box"
        return [
            f"filament.{name}: the drag of a straight rod differs by {scatter:.2g} of itself between places in a cell "
            f"and directions: set fluid.slip = 0.01, or take a wider fluid.kernel{larger}"
        ]
