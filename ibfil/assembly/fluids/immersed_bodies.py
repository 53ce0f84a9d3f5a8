"""Bodies in the models of fluids that nodes push through a delta kernel: their markers, swimmers, and methods."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from .. import costs
from ..bodies import swimmers
from ..bodies.clouds import size
from . import shells
from .base import FluidModel

if TYPE_CHECKING:
    from ...fluids.base import Fluid
    from ...fluids.immersed_boundary import Immersed
    from ...fluids.shells.swimmer import Swimmer
    from ...fluids.spaces.base import Space
    from ...fluids.stokes import Solver
    from ..stacked import RodStack


class ImmersedBodiesModel(FluidModel):
    """Bodies of markers in a fluid that nodes push through a discrete delta kernel."""

    @property
    @abstractmethod
    def space(self) -> Space:
        """The space the fluid fills. Raises CaseError where that cannot be made."""

    @property
    def components(self) -> int:
        """How many numbers of a node go through the fluid: 3, or 4 with its twist torque."""
        return 4 if self.case.couples_torque else 3

    @abstractmethod
    def immersed(self, rods: RodStack) -> Immersed:
        """The ingredients of every fluid in this space."""

    lowest_marker = -np.inf  # the height below which markers of bodies may not come

    def with_bodies(self, rods: RodStack, immersed: Immersed, method: str, solver: Solver | None) -> Fluid:
        """Stokes flow about rods and bodies: by the exact table, or with a ``solver`` by FFT."""
        from ...fluids.shells.fourier import StokesByFFTWithBodies, TransformedBodies
        from ...fluids.shells.stokes import ImmersedBodies, StokesWithBodies

        assert isinstance(immersed, ImmersedBodies)
        if solver is None:
            return StokesWithBodies(immersed, self.lowest_marker)
        transformed = TransformedBodies.of(immersed, solver, self.swimmers(rods, method))
        return StokesByFFTWithBodies(transformed, self.lowest_marker)

    def swimmers(self, rods: RodStack, method: str) -> tuple[Swimmer, ...]:
        """The swimmers that a method by FFT solves for by themselves: all as one where M is the preconditioner."""
        return swimmers.apart(self.case, rods) if method == "krylov" else (swimmers.whole(self.case, rods),)

    def ingredients(self, rods: RodStack, fluid: Fluid) -> Immersed:
        """The ingredients of a fluid: with bodies those that it has, whose tables serve; else made anew."""
        if not rods.bodies:
            return self.immersed(rods)
        from ...fluids.shells.navier_stokes import NavierStokesWithBodies
        from ...fluids.shells.stokes import StokesWithBodies

        assert isinstance(fluid, StokesWithBodies | NavierStokesWithBodies)
        return fluid.pushing

    @cached_property
    def markers(self) -> list[int]:
        """How many markers each of the bodies has."""
        kernel, h = self.case.fluid.kernel, self.space.spacing
        return [len(shells.markers(self.case, name, body, kernel, h)) for name, body in self.case.each_body.items()]

    def reached(self, rods: RodStack) -> np.ndarray:
        """Places (k, 3) at the start between which all that pushes is: nodes, and bodies to their largest semi-axes."""
        r = [rods.start.r]
        sizes = [float(size(self.case, name, body).max()) for name, body in self.case.each_body.items()]
        if rods.bodies:
            centres = rods.start.r[rods.count : rods.count + 2 * len(sizes) : 2]
            r += [centres + sign * np.array(sizes)[:, None] for sign in (-1.0, 1.0)]
        return np.concatenate(r)

    def with_markers(
        self, rods: RodStack, evaluations: Mapping[str, float], pair: float = 1.0, inertia: float = 0.0
    ) -> dict[str, float]:
        """Seconds of a step with bodies by each method, from counts; ``evaluations``: of velocities by transforms.

        ``pair`` is what a pair costs, over what it does in the periodic table, ``inertia`` what a fluid's own takes.
        """
        found = costs.with_markers(self.case, self.counts(rods), self.components, evaluations, pair)
        more = inertia if self.case.fluid.inertial else 0.0
        return {method: seconds + more for method, seconds in found.items()}

    def counts(self, rods: RodStack) -> list[tuple[int, int]]:
        """How many nodes and markers each swimmer has."""
        return [
            (sum(rod.stop - rod.start for rod in one.rods), sum(self.markers[b] for b in one.bodies))
            for one in swimmers.apart(self.case, rods)
        ]

    def solved(self, rods: RodStack) -> list[str]:
        """How many markers and swimmers there are, and what of them is solved for at once."""
        if not rods.bodies:
            return []
        method, alone = self.method(rods), self.counts(rods)
        nodes, markers = sum(n for n, _ in alone), sum(k for _, k in alone)
        size = 2.0**-30 * costs.dense_bytes(nodes + markers, self.components)
        how = {
            "table": "all in one dense system",
            "krylov": "each solved for by itself, what they give each other by GMRES on the FFT",
        }.get(method, "all in one dense system, which GMRES on the FFT confirms")
        parts = "swimmer" if len(alone) == 1 else "swimmers or unjoined parts"
        return [
            f"{nodes} nodes and {markers} markers of bodies, in {len(alone)} {parts}: "
            f"{how}; dense matrices of all take {size:.2g} GiB"
        ]
