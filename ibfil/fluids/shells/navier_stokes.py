"""Navier-Stokes flow about rods and bodies: its past carries markers as it does nodes, and they push it as nodes do.

A shell is filled with the fluid, which goes along with it: a body has the inertia of the fluid that it displaces.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ..base import Response
from ..coupling import Nodes
from ..history import weights
from ..navier_stokes import Asked, NavierStokes
from ..stokes import StokesByFFT, Tabulated
from .interplay import ByTransforms, Means
from .response import Rigid, WithShells
from .stokes import ImmersedBodies
from .swimmer import Swimmer

MARKERS = "markers"  # of the forces of markers in a checkpoint


@dataclass(frozen=True)
class InertialBodies(ImmersedBodies):
    """The same, with the forces (k, 3) of markers in the last step: here they follow from no others."""

    marker_forces: Callable[[], np.ndarray] | None = None

    def pushed(self, r: np.ndarray, e3: np.ndarray, force: np.ndarray, time: float) -> tuple[Nodes, np.ndarray]:
        """Nodes and markers, and what each does to the fluid (n + k, m)."""
        assert self.marker_forces is not None
        return self.all_nodes(r, e3), self.joined(force, self.marker_forces())


class NavierStokesWithBodies(NavierStokes):
    """The fluid about rods and bodies, forces answered by the exact table."""

    immersed: ImmersedBodies
    _markers: np.ndarray | None = None  # their forces (k, 3) in the last step

    def __init__(
        self,
        immersed: ImmersedBodies,
        density: float,
        operator: Callable[[float], Tabulated],
        *parts: Any,
        swimmers: tuple[Swimmer, ...],
    ):
        """Made of the same parts as that of rods alone, and the swimmers that FFTs are preconditioned by."""
        super().__init__(immersed, density, operator, *parts)
        self.swimmers = swimmers

    def response(
        self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0
    ) -> WithShells | ByTransforms:
        """The mobility of rods and bodies, and the velocity with which the fluid coasts into the step."""
        immersed, n = self.immersed, self.immersed.shells.nodes
        alpha, operator = self._operator(self.density / tau)
        nodes, past = immersed.all_nodes(r, e3), weights(alpha, tau, w, self.history.dt_old)
        felt = self._coast(nodes, past)
        u0, c = immersed.coupling.from_grid(nodes.axes, felt), immersed.coupling.components
        flow, drift = immersed.advected(nodes[:n], r[:n], time), u0[n:, :3]
        rods = u0[:n]
        if flow is not None:
            assert immersed.flow is not None
            rods = np.column_stack([rods + flow[:, :c], flow[:, c:]])
            drift = drift + immersed.flow(immersed.shells.places(r, e3), time)
        response: WithShells | ByTransforms
        if isinstance(operator, StokesByFFT):
            means = Means(operator.solver, operator.matrix, self.swimmers)
            response = ByTransforms(immersed, means, nodes, e3, immersed.both(rods, drift), tau)
        else:
            levers = immersed.shells.levers(e3, immersed.shells.unknowns(len(r)))
            rigid = Rigid(operator.matrix(nodes, immersed.own), c * n, c, levers, drift.ravel())
            response = WithShells(rigid, immersed.shells, rods, immersed.spin_drag, tau)
        self._asked = Asked(response, nodes, past)
        return response

    def advance(self, response: Response, velocity: np.ndarray, force: np.ndarray) -> None:
        """The same, markers pushing as the step found."""
        assert isinstance(response, WithShells | ByTransforms)
        self._markers = response.marker_forces()
        super().advance(response, velocity, self.immersed.joined(force, self._markers))

    def marker_forces(self) -> np.ndarray:
        """Of the last step (k, 3); before the first one, of that which was asked for."""
        if self._markers is not None:
            return self._markers
        assert self._asked is not None
        assert isinstance(self._asked.response, WithShells | ByTransforms)
        return self._asked.response.marker_forces()

    @property
    def pushing(self) -> InertialBodies:
        """The ingredients, which tell what all nodes do to the fluid."""
        known = {part.name: getattr(self.immersed, part.name) for part in fields(self.immersed)}
        return InertialBodies(**known, marker_forces=self.marker_forces)

    def memory(self) -> dict[str, np.ndarray | float]:
        """The past, and the forces of markers."""
        out = super().memory()
        return out | {MARKERS: self._markers} if out and self._markers is not None else out

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Takes them up."""
        super().recall(memory)
        self._markers = np.asarray(memory[MARKERS])
