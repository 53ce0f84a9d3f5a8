"""Stokes flow about rods and bodies, by the exact mobility table of nodes and markers."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...errors import StepFailed
from ..base import Memoryless
from ..coupling import Nodes
from ..immersed_boundary import Immersed
from ..spaces.base import Mobility, velocity_of
from .response import Rigid, WithShells
from .shell import Shells


@dataclass(frozen=True)
class ImmersedBodies(Immersed):
    """The ingredients of a fluid about rods and ``shells``: those of rods have a row a node, and none a body."""

    shells: Shells = field(kw_only=True)

    @property
    def own(self) -> np.ndarray:
        """That of nodes (n + k, c), and none of markers."""
        own = self.coupling.own(self.slip)
        return np.concatenate([own, np.zeros((self.shells.count, own.shape[1]))])

    @cached_property
    def exact(self) -> Mobility:
        """The exact mobility of nodes and markers."""
        return self.mobility()

    def all_nodes(self, r: np.ndarray, e3: np.ndarray) -> Nodes:
        """Nodes and markers on the grid, from places and tangents (N, 3) of all rows."""
        n, places = self.shells.nodes, self.shells.places(r, e3)
        axes = np.concatenate([self.coupling.axes(e3[:n]), np.zeros_like(places)])
        return Nodes(*self.stencil(np.concatenate([r[:n], places])), axes)

    def rigid(self, nodes: Nodes, r: np.ndarray, e3: np.ndarray, time: float, p: int) -> Rigid:
        """The mobility of ``nodes``, with markers taken out."""
        matrix = self.exact.matrix(nodes, self.own)
        drift = None if self.flow is None else self.flow(self.shells.places(r, e3), time).ravel()
        c = self.coupling.components
        return Rigid(matrix, c * self.shells.nodes, c, self.shells.levers(e3, p), drift)

    def pushed(self, r: np.ndarray, e3: np.ndarray, force: np.ndarray, time: float) -> tuple[Nodes, np.ndarray]:
        """Nodes and markers, and what each does to the fluid (n + k, m).

        ``force`` (N, m) has the bodies' force and torque; of markers that are rigid only these forces have them.
        """
        n, c, nodes = self.shells.nodes, self.coupling.components, self.all_nodes(r, e3)
        whole = self.shells.of_rows(force)
        rigid, felt = self.rigid(nodes, r, e3, time, len(whole)), force[:n, :c].ravel()
        return nodes, self.joined(force, rigid.pushes(rigid.rates(whole, felt), felt).reshape(-1, 3))

    def carried(self, r: np.ndarray, e3: np.ndarray, time: float) -> np.ndarray | None:
        """The motions with which the background flow carries nodes and markers."""
        if self.flow is None:
            return None
        n, places = self.shells.nodes, self.shells.places(r, e3)
        rods = self.advected(self.all_nodes(r, e3)[:n], r[:n], time)
        assert rods is not None
        return self.both(rods, self.flow(places, time))

    def both(self, rods: np.ndarray, markers: np.ndarray) -> np.ndarray:
        """Motions (n + k, c) of nodes (n, c) and markers (k, 3), which do not spin."""
        out = np.zeros((len(rods) + len(markers), rods.shape[1]))
        out[: len(rods)], out[len(rods) :, :3] = rods, markers
        return out

    def joined(self, force: np.ndarray, markers: np.ndarray) -> np.ndarray:
        """The forces (n + k, m) of nodes, from those of all rows (N, m), and of markers (k, 3)."""
        return self.both(force[: self.shells.nodes], markers)


class BodyInWall(StepFailed):
    """A body's marker came too near to a wall."""


class StokesWithBodies(Memoryless):
    """IB Stokes about rods and bodies, by the exact table."""

    def __init__(self, immersed: ImmersedBodies, lowest: float = -np.inf) -> None:
        """``lowest``: the height below which markers may not come."""
        self.immersed, self.lowest = immersed, lowest

    @property
    def pushing(self) -> ImmersedBodies:
        """The ingredients, which tell what all nodes do to the fluid."""
        return self.immersed

    def velocity_at(
        self, points: np.ndarray, r: np.ndarray, e3: np.ndarray, force: np.ndarray, time: float
    ) -> np.ndarray:
        """The velocity (k, 3) at ``points`` (k, 3), as a node there would feel it, of nodes and bodies."""
        immersed = self.immersed
        nodes, pushed = immersed.pushed(r, e3, force, time)
        c, places = immersed.coupling.components, immersed.stencil(points)
        u = velocity_of(immersed.exact, immersed.coupling, places, nodes, pushed[:, :c])
        return u if immersed.flow is None else u + immersed.flow(points, time)

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> WithShells:
        """The mobility of rods and bodies at r, e3 (N, 3), in the background flow of ``time``."""
        self.refuse(r, e3)
        immersed, n = self.immersed, self.immersed.shells.nodes
        nodes, p = immersed.all_nodes(r, e3), immersed.shells.unknowns(len(r))
        rods = nodes[:n]
        flow = immersed.advected(rods, r[:n], time)
        rigid = immersed.rigid(nodes, r, e3, time, p)
        return WithShells(rigid, immersed.shells, flow, immersed.spin_drag, tau)

    def refuse(self, r: np.ndarray, e3: np.ndarray) -> None:
        """Raises BodyInWall where a marker is too low."""
        if not np.isfinite(self.lowest):
            return
        height = float(np.min(self.immersed.shells.places(r, e3)[:, 2], initial=np.inf))
        if height < self.lowest:
            raise BodyInWall(f"a body went into the wall: a marker at z = {height:.3g}, allowed {self.lowest:.3g}", 0)
