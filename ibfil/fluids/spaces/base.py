"""The interface of a space that a fluid fills: its points, stencils on them, and the exact mobility of nodes."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ...grid.kernels import Kernel
from ...grid.spreading import Stencil
from ..coupling import Coupling, Nodes
from ..mobility_table import Octant

_MOST = 2**23  # numbers of a block between places and nodes that is made at once


class Mobility(Protocol):
    """The exact mobility J L^-1 S of nodes in a space; c numbers of a node go through the fluid."""

    def matrix(self, nodes: Nodes, own: np.ndarray) -> np.ndarray:
        """The whole matrix (c n, c n), symmetric to the last bit, with ``own`` (n, c) on its diagonal."""

    def block(self, nodes: Nodes, own: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """The part (c k, c l) between nodes ``rows`` (k,) and ``columns`` (l,)."""


class Space(Protocol):
    """The space a fluid fills, with points ``spacing`` apart on which forces are spread."""

    @property
    def spacing(self) -> float:
        """The spacing h of the points."""

    def coordinates(self, r: np.ndarray) -> np.ndarray:
        """Positions (n, 3) in units of the spacing, from index (0, 0, 0)."""

    def stencil(self, kernel: Kernel, r: np.ndarray) -> Stencil:
        """The points that nodes at r (n, 3) push, and how much each."""

    def mobility(self, coupling: Coupling, points: int, viscosity: float, alpha: float, number: type) -> Mobility:
        """The mobility of nodes whose kernel has so many points; alpha is density over time, zero in Stokes flow.

        ``number`` is the type of its tables' numbers.
        """


def velocity_of(mobility: Mobility, coupling: Coupling, places: Stencil, nodes: Nodes, force: np.ndarray) -> np.ndarray:
    """The velocity (k, 3) at ``places``, as a node there would feel it, of nodes that push with forces (n, c)."""
    c, n, k = coupling.components, len(nodes.axes), len(places.base)
    out, columns = np.empty((k, 3)), np.arange(n)
    at_once = max(1, _MOST // (n * c * c))
    for start in range(0, k, at_once):
        here = slice(start, min(start + at_once, k))
        count = here.stop - start
        base, weights = (
            np.concatenate([nodes.base, places.base[here]]),
            np.concatenate([nodes.weights, places.weights[here]]),
        )
        both = Nodes(base, weights, np.concatenate([nodes.axes, np.zeros((count, 3))]))
        block = mobility.block(both, np.zeros((n + count, c)), np.arange(n, n + count), columns)
        out[here] = (block @ force.ravel()).reshape(count, c)[:, :3]
    return out


class TableMobility:
    """The mobility by the octant of a response (mobility_table.py)."""

    def __init__(self, coupling: Coupling, octant: Octant) -> None:
        self._coupling, self._octant = coupling, octant

    def matrix(self, nodes: Nodes, own: np.ndarray) -> np.ndarray:
        """Pair by pair, each once."""
        return self._coupling.matrix(self._octant, nodes, own)

    def block(self, nodes: Nodes, own: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Pair by pair."""
        return self._coupling.block(self._octant, nodes, own, rows, columns)
