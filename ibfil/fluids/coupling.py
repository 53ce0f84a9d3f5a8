"""The coupling of nodes to the grid: by force and velocity (`Translation`), or torque and spin with them.

`Coupling` is the interface; torque_coupling.py has the other one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..grid.periodic_grid import Grid
from ..grid.spreading import Stencil
from .base import Flow
from .mobility_table import Octant, mobility, pairs, point_response


class Coupling(Protocol):
    """The numbers of a node that go through the grid, ``components`` of it, c below: forces in and motions out.

    On the grid these are ``grid_vectors`` vectors a node, v below: the force, and the torque with it.
    """

    components: int
    grid_vectors: int

    def response(self, grid: Grid, viscosity: float, alpha: float) -> np.ndarray:
        """The grid's response (k, nx, ny, nz) to one cell's unit force, all components that a pair of nodes needs."""

    def matrix(self, octant: Octant, nodes: Nodes, own: np.ndarray) -> np.ndarray:
        """The whole mobility (c n, c n), with ``own`` (n, c) on its diagonal; of the octant of ``response``."""

    def block(self, octant: Octant, nodes: Nodes, own: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """The mobility (c k, c l) between nodes ``rows`` (k,) and ``columns`` (l,)."""

    def own(self, slip: np.ndarray) -> np.ndarray:
        """The self-mobility (n, c) of nodes beyond the grid's response, given the slip (n,)."""

    def axes(self, e3: np.ndarray) -> np.ndarray:
        """The axes (n, 3) about which nodes with tangents e3 (n, 3) spin; zero where they do not."""

    def to_grid(self, axes: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The vectors (n, 3 v) that go onto the grid, of forces (n, m), m at least c."""

    def from_grid(self, axes: np.ndarray, motion: np.ndarray) -> np.ndarray:
        """The motions (n, c) from the vectors (n, 3 v) that come off the grid."""

    def advected(self, flow: Flow, r: np.ndarray, axes: np.ndarray, time: float, h: float) -> np.ndarray:
        """The motions (n, c) of nodes that a background flow carries; h is the grid's spacing."""


@dataclass(frozen=True)
class Nodes:
    """Where nodes are on the grid: first index (n, 3), weights (n, 3, P), and what they spin about (n, 3)."""

    base: np.ndarray
    weights: np.ndarray
    axes: np.ndarray

    @property
    def stencil(self) -> Stencil:
        """Where they are, without what they spin about."""
        return Stencil(self.base, self.weights)

    def __getitem__(self, part: slice | np.ndarray) -> Nodes:
        """Some of them."""
        return Nodes(self.base[part], self.weights[part], self.axes[part])


class Translation:
    """Forces move nodes (`Coupling`): three numbers a node go through the grid, all of them vectors."""

    components, grid_vectors = 3, 1

    def response(self, grid: Grid, viscosity: float, alpha: float = 0.0) -> np.ndarray:
        """The velocity of a unit force on one cell."""
        return point_response(grid, viscosity, alpha)

    def matrix(self, octant: Octant, nodes: Nodes, own: np.ndarray) -> np.ndarray:
        """The whole mobility (3 n, 3 n)."""
        n = len(own)
        return mobility(octant, nodes.base, nodes.weights, own[:, 0]).reshape(3 * n, 3 * n)

    def block(self, octant: Octant, nodes: Nodes, own: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """The mobility (3 k, 3 l) between nodes ``rows`` (k,) and ``columns`` (l,)."""
        out = pairs(octant, nodes.base, nodes.weights, own[:, 0], rows, columns)
        return out.reshape(3 * len(rows), 3 * len(columns))

    def own(self, slip: np.ndarray) -> np.ndarray:
        """The slip, in each direction."""
        return np.repeat(slip[:, None], 3, axis=1)

    def axes(self, e3: np.ndarray) -> np.ndarray:
        """The tangents; no use is made of them."""
        return np.ascontiguousarray(e3)

    def to_grid(self, axes: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The forces."""
        return np.ascontiguousarray(force[:, :3])

    def from_grid(self, axes: np.ndarray, motion: np.ndarray) -> np.ndarray:
        """The velocities."""
        return motion

    def advected(
        self, flow: Callable[[np.ndarray, float], np.ndarray], r: np.ndarray, axes: np.ndarray, time: float, h: float
    ) -> np.ndarray:
        """The flow's velocity (n, 3)."""
        return flow(r, time)


TRANSLATION = Translation()
