"""Stokes flow about rods and bodies, by FFT."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np

from ..coupling import Nodes
from ..stokes import Solver
from .interplay import ByTransforms, Means
from .stokes import ImmersedBodies, StokesWithBodies
from .swimmer import Swimmer


@dataclass(frozen=True)
class TransformedBodies(ImmersedBodies):
    """The ingredients, where velocities come by FFT."""

    solver: Solver = field(kw_only=True)
    swimmers: tuple[Swimmer, ...] = field(kw_only=True)

    @classmethod
    def of(cls, immersed: ImmersedBodies, solver: Solver, swimmers: tuple[Swimmer, ...]) -> TransformedBodies:
        """The same ingredients, with a solver, and the swimmers that are solved for by themselves."""
        known = {part.name: getattr(immersed, part.name) for part in fields(immersed)}
        return cls(**known, solver=solver, swimmers=swimmers)

    def respond(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float) -> ByTransforms:
        """The response at r, e3 (N, 3), in the background flow of ``time``."""
        means = Means(self.solver, self.exact.matrix, self.swimmers)
        return ByTransforms(self, means, self.all_nodes(r, e3), e3, self.carried(r, e3, time), tau)

    def pushed(self, r: np.ndarray, e3: np.ndarray, force: np.ndarray, time: float) -> tuple[Nodes, np.ndarray]:
        """Nodes and markers, and what each does to the fluid (n + k, m)."""
        response = self.respond(r, e3, time, 1.0)
        return response.nodes, self.joined(force, response.recovered(force))


class StokesByFFTWithBodies(StokesWithBodies):
    """IB Stokes about rods and bodies by FFT: GMRES, whose preconditioner is the exact matrix of each swimmer."""

    immersed: TransformedBodies

    def response(  # type: ignore[override]
        self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0
    ) -> ByTransforms:
        """The mobility of rods and bodies at r, e3 (N, 3), in the background flow of ``time``."""
        self.refuse(r, e3)
        return self.immersed.respond(r, e3, time, tau)
