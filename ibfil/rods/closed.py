"""Closed rods: rods whose last node is the first, and whose stencils reach round through copies of nodes.

A closed rod of N segments has nodes 0 .. N, of which N is node 0 again, and g further copies on either side (g = 3 for
derivatives of order 6, 1 for order 2). Copies move as their source does, and what acts on a copy acts on its source:

    y_i = y_{source(i)},      f_j = sum_{source(i) = j} f_i,      K_jl = sum_{source(i) = j, source(k) = l} K_ik

So Eq. 44 and its stiffness are those of open rods, term by term, and nothing else knows of rings. e1 of node N is that
of node 0 to the last bit: the linking number cannot change but where strands pass through each other. Blocks of the
stiffness that reach round are pairs of nodes beside the band.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..linalg.stiffness import Pairs, Stiffness
from .elastic_force import Moment
from .geometry import Configuration
from .system import RodSystem


class _Fold:
    """Where the blocks (l,) of a band matrix go that are of copies."""

    def __init__(self, source: np.ndarray, first: np.ndarray, last: np.ndarray, width: int) -> None:
        """``first``, ``last`` (n,) are the columns that rows of the band have room for."""
        n = len(source)
        i, k = (grid.ravel() for grid in np.meshgrid(np.arange(n), np.arange(2 * width + 1), indexing="ij"))
        j = i + k - width
        there = (j >= 0) & (j < n)
        i, j, k = i[there], j[there], k[there]
        copied = (source[i] != i) | (source[j] != j)
        self.rows, self.places = i[copied], k[copied]
        to, by = source[self.rows], source[j[copied]]
        self.in_band = (by >= first[to]) & (by <= last[to])
        self.band = to[self.in_band], (by - to + width)[self.in_band]
        self.pairs = to[~self.in_band], by[~self.in_band]


class ClosedRods(RodSystem):
    """Rods of which some are closed. ``source`` (n,) is the node that each is, itself but for copies."""

    def __init__(self, *args: Any, source: np.ndarray, closures: Sequence[tuple[int, int]]) -> None:
        """``closures`` are the first and last node of each closed rod, the last one the copy of the first."""
        super().__init__(*args)
        self.source, self.closures = source, tuple(closures)
        self.copies = np.nonzero(source != np.arange(len(source)))[0]
        ends = [end for closure in closures for end in closure]
        self._held[ends] = True  # so that ``turned`` closes them
        self._fold = _Fold(source, self.profile.first, self.profile.last, self.profile.width)

    @property
    def volume(self) -> np.ndarray:
        """Control volumes (n,), a copy's that of its source."""
        volume = self.mesh.volume.copy()
        for first, last in self.closures:
            volume[first] += volume[last]
        return volume[self.source]

    def complete(self, y: np.ndarray) -> np.ndarray:
        """y (n, m) with copies as their sources are."""
        return y[self.source]

    def start(self, r: np.ndarray, e1: np.ndarray) -> Configuration:
        """As of open rods, the frame that of the sources."""
        return super().start(r[self.source], e1[self.source])

    def move(self, start: Configuration, y: np.ndarray) -> Configuration:
        """As of open rods."""
        return super().move(start, self.complete(y))

    def turned(self, start: Configuration, y: np.ndarray) -> np.ndarray:
        """As of open rods; what does not close is shared out along the rod."""
        return super().turned(start, self.complete(y))

    def forces(self, configuration: Configuration, time: float) -> tuple[np.ndarray, Moment]:
        """Eq. 44 and the loads, those on copies with their sources."""
        force, moment = super().forces(configuration, time)
        extra = force[self.copies]
        force[self.copies] = 0.0
        np.add.at(force, self.source[self.copies], extra)
        return force, moment

    def _stiffness(
        self, configuration: Configuration, start: Configuration, moment: Moment, time: float, least: float
    ) -> Stiffness:
        """Rows and columns of copies with those of their sources."""
        (band, pairs), fold = super()._stiffness(configuration, start, moment, time, least), self._fold
        by_node = band.reshape(*band.shape[:2], -1, band.shape[1]).transpose(0, 2, 1, 3)  # (n, 2 w + 1, m, m), a view
        blocks = by_node[fold.rows, fold.places]
        by_node[fold.rows, fold.places] = 0.0
        np.add.at(by_node, fold.band, blocks[fold.in_band])
        rows, columns = (self.source[nodes] for nodes in (pairs.rows, pairs.columns))
        beside = Pairs(*fold.pairs, blocks[~fold.in_band])
        joined = (np.concatenate(parts) for parts in zip((rows, columns, pairs.blocks), beside, strict=True))
        return Stiffness(band, Pairs(*joined))
