"""The half space above a plane z = 0, on which the fluid sticks or along which it slides.

A no-slip plane is Blake's image (wall_pairs.py), and stencils are folded at it: a weight on a point below is taken off
its mirror image above, w[-z] -= w[z], and what lies on the plane is dropped. Interpolation of a linear shear is then
exact at any height, the mobility goes to zero with the height, and spreading and interpolation stay adjoint.

A plane without friction is a mirror: the flow of a node is that of free space and of the node's image, whose force has
the other sign along z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...grid import wall_tables
from ...grid.kernels import Kernel
from ...grid.spreading import Stencil, mirrored
from ..coupling import Coupling, Nodes
from . import wall_pairs
from .base import Mobility
from .free import FreeSpace, octant

MIRROR = np.array([1.0, 1.0, -1.0])


@dataclass(frozen=True)
class NoSlipWall(FreeSpace):
    """The half space above a plane on which the fluid sticks; a point is at the origin, others ``spacing`` apart."""

    def stencil(self, kernel: Kernel, r: np.ndarray) -> Stencil:
        """The kernel's own, folded at the plane; of a place below it nothing."""
        return folded(super().stencil(kernel, r), r[:, 2] >= 0)

    def mobility(
        self, coupling: Coupling, points: int, viscosity: float, alpha: float = 0.0, number: type = np.float64
    ) -> Mobility:
        """By two tables. Raises ValueError for a fluid with inertia, and where torques go through the fluid."""
        if alpha or coupling.grid_vectors > 1:
            raise ValueError("the image of a force is that of Stokes flow, and torques have none here")
        scale = 1.0 / (viscosity * self.spacing)
        images = wall_tables.octant(points - 1, scale, number)
        free = octant(1, points, self.spacing, viscosity, number)
        return WallMobility(wall_pairs.Walled(free, images.reshape(*images.shape[:2], -1), scale))


@dataclass(frozen=True)
class FreeSlipWall(FreeSpace):
    """The half space above a plane along which the fluid slides."""

    def stencil(self, kernel: Kernel, r: np.ndarray) -> Stencil:
        """The kernel's own; of a place below the plane nothing."""
        base, weights = super().stencil(kernel, r)
        return Stencil(base, weights * (r[:, 2] >= 0)[:, None, None])

    def mobility(
        self, coupling: Coupling, points: int, viscosity: float, alpha: float = 0.0, number: type = np.float64
    ) -> Mobility:
        """By the table of free space. Raises ValueError as the other."""
        if coupling.grid_vectors > 1:
            raise ValueError("torques have no image here")
        return MirrorMobility(super().mobility(coupling, points, viscosity, alpha, number))


def folded(stencil: Stencil, above: np.ndarray) -> Stencil:
    """A stencil folded at z = 0; nothing is left of nodes that are not ``above`` (n,)."""
    base, weights = stencil.base.copy(), stencil.weights.copy()
    for q in np.flatnonzero(base[:, 2] < 1):
        height = base[q, 2] + np.arange(weights.shape[2])
        base[q, 2], weights[q, 2] = 0, 0.0
        if above[q]:
            np.add.at(weights[q, 2], np.abs(height), np.sign(height) * stencil.weights[q, 2])
    return Stencil(base, weights)


class WallMobility:
    """The mobility above a no-slip plane, of forces."""

    def __init__(self, walled: wall_pairs.Walled) -> None:
        self._walled = walled

    def matrix(self, nodes: Nodes, own: np.ndarray) -> np.ndarray:
        """Pair by pair, each once."""
        n = len(own)
        return wall_pairs.mobility(self._walled, nodes.base, nodes.weights, own[:, 0]).reshape(3 * n, 3 * n)

    def block(self, nodes: Nodes, own: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Pair by pair."""
        out = wall_pairs.pairs(self._walled, nodes.base, nodes.weights, own[:, 0], rows, columns)
        return out.reshape(3 * len(rows), 3 * len(columns))


class MirrorMobility:
    """The mobility above a plane without friction, of forces, by that of free space."""

    def __init__(self, free: Mobility) -> None:
        self._free = free

    def matrix(self, nodes: Nodes, own: np.ndarray) -> np.ndarray:
        """Each pair, and each node with each image; the rounding of the latter is made symmetric."""
        index = np.arange(len(own))
        reflected = self._reflected(nodes, index, index)
        return self._free.matrix(nodes, own) + 0.5 * (reflected + reflected.T)

    def block(self, nodes: Nodes, own: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Each pair, and each node with each image."""
        return self._free.block(nodes, own, rows, columns) + self._reflected(nodes, rows, columns)

    def _reflected(self, nodes: Nodes, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """The part (3 k, 3 l) of ``rows`` and the images of ``columns``."""
        n, image = len(nodes.axes), mirrored(nodes.stencil)
        base, weights = (np.concatenate(pair) for pair in zip(nodes.stencil, image, strict=True))
        both = Nodes(base, weights, np.concatenate([nodes.axes, nodes.axes]))
        block = self._free.block(both, np.zeros((2 * n, 3)), rows, columns + n)
        return block * np.tile(MIRROR, len(columns))
