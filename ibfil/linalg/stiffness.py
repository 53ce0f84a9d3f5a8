"""The stiffness of rods that may be coupled: a band matrix by node, and blocks for pairs of nodes beyond the band.

Forces of a rod reach a few nodes to either side: a band. Links, contact and the closure of rings couple any two nodes:
a list of blocks. Where nothing is coupled the list is empty, and costs nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from . import banded
from .compiled import njit

NO_NODES = np.zeros(0, np.int64)


class Pairs(NamedTuple):
    """Blocks for pairs of nodes: of node ``rows[k]`` by node ``columns[k]``; a pair may come more than once."""

    rows: np.ndarray  # (l,)
    columns: np.ndarray  # (l,)
    blocks: np.ndarray  # (l, m, m)

    def held(self, at: np.ndarray, n: int) -> Pairs:
        """The same with zero rows of the unknowns ``at`` (k,) of n nodes."""
        free = np.ones((n, self.blocks.shape[1]))
        free.ravel()[at] = 0.0
        return self._replace(blocks=self.blocks * free[self.rows][:, :, None])


@cache
def no_pairs(m: int) -> Pairs:
    """None, of m unknowns a node."""
    return Pairs(NO_NODES, NO_NODES, np.zeros((0, m, m)))


class Stiffness(NamedTuple):
    """K of n nodes with m unknowns: a band matrix by node (banded.py), and blocks for pairs of nodes."""

    band: np.ndarray  # (n, m, (2 w + 1) m)
    pairs: Pairs

    @property
    def coupled(self) -> bool:
        """Whether there is more than the band."""
        return self.pairs.rows.size > 0

    def copy(self) -> Stiffness:
        """A copy, for what uses its band up; blocks are never written to."""
        return self._replace(band=self.band.copy())

    def times(self, x: np.ndarray) -> np.ndarray:
        """K x (n, m) for x (n, m)."""
        out = banded.multiply(self.band, x)
        if self.coupled:
            _add_products(*self.pairs, x, out)
        return out

    def times_each(self, x: np.ndarray) -> np.ndarray:
        """K x (k, n, m) for each of x (k, n, m)."""
        out = banded.multiply_each(self.band, np.ascontiguousarray(x))
        if self.coupled:
            for one, product in zip(x, out, strict=True):
                _add_products(*self.pairs, one, product)
        return out

    def dense(self) -> np.ndarray:
        """The same matrix in full, (n, m, n, m)."""
        out = banded.dense(self.band)
        for i, j, block in zip(*self.pairs, strict=True):
            out[i, :, j] += block
        return out

    def transposed_product(self, full: np.ndarray, factor: float) -> np.ndarray:
        """``factor`` K^T A (n, m, l) of K and a full A (c n, l), c = 3 or 4: of K, the first c rows a node."""
        out = banded.transposed_product(self.band, full, factor)
        if self.coupled:
            _add_transposed_products(*self.pairs, full, factor, out)
        return out

    def of(self, ranges: Sequence[slice]) -> Stiffness:
        """K of some rods by themselves, one after the other: all nodes of each, in ``ranges``."""
        n = len(self.band)
        if len(ranges) == 1 and ranges[0] == slice(0, n):
            return self
        band = self.band[ranges[0]] if len(ranges) == 1 else np.concatenate([self.band[rod] for rod in ranges])
        if not self.coupled:
            return Stiffness(band, self.pairs)
        place = np.full(n, -1)
        place[nodes_of(ranges)] = np.arange(len(band))
        rows, columns = place[self.pairs.rows], place[self.pairs.columns]
        inside = (rows >= 0) & (columns >= 0)
        return Stiffness(band, Pairs(rows[inside], columns[inside], self.pairs.blocks[inside]))


class Rows(NamedTuple):
    """The rows of a stiffness at a few ``nodes`` (k,): of the band (k, m, ..), and the coupled pairs of these nodes."""

    nodes: np.ndarray
    band: np.ndarray
    pairs: Pairs

    @classmethod
    def of(cls, stiffness: Stiffness, nodes: np.ndarray) -> Rows:
        """A copy of the rows."""
        rows, columns, blocks = stiffness.pairs
        here = np.isin(rows, nodes) if stiffness.coupled else slice(0)
        return cls(nodes, stiffness.band[nodes], Pairs(rows[here], columns[here], blocks[here]))

    def times(self, d: np.ndarray) -> np.ndarray:
        """(K d) at the nodes (k, m)."""
        n, m = d.shape
        w = (self.band.shape[2] // m - 1) // 2
        padded = np.zeros((n + 2 * w, m))
        padded[w : n + w] = d
        rows = zip(self.band, self.nodes, strict=True)
        out = np.array([row @ padded[i : i + 2 * w + 1].ravel() for row, i in rows]).reshape(-1, m)
        if self.pairs.rows.size:
            products = (self.pairs.blocks @ d[self.pairs.columns][:, :, None])[:, :, 0]
            np.add.at(out, np.searchsorted(self.nodes, self.pairs.rows), products)
        return out


def nodes_of(ranges: Sequence[slice]) -> np.ndarray:
    """The nodes (k,) of ranges, one after the other."""
    return np.concatenate([np.arange(rod.start, rod.stop) for rod in ranges])


@njit(cache=True)
def _add_products(rows, columns, blocks, x, out):
    """Adds the products of the blocks with x (n, m) to ``out`` (n, m)."""
    m = x.shape[1]
    for k in range(rows.size):
        i, j = rows[k], columns[k]
        for a in range(m):
            for b in range(m):
                out[i, a] += blocks[k, a, b] * x[j, b]


@njit(cache=True, fastmath={"contract"})
def _add_transposed_products(rows, columns, blocks, full, factor, out):
    """Adds ``factor`` B^T A of each block B to ``out`` (n, m, l); A (c n, l)."""
    n, m, length = out.shape
    c = full.shape[0] // n
    for k in range(rows.size):
        i, j = rows[k], columns[k]
        for a in range(c):
            for b in range(m):
                value = factor * blocks[k, a, b]
                if value != 0.0:
                    for e in range(length):
                        out[j, b, e] += value * full[c * i + a, e]
