"""Sparse matrices by node: block elimination in an order that keeps what is filled in small.

Where nodes far apart are coupled a band no longer holds the matrix. Its rows and columns are put into the order of two
candidates, minimum degree and reverse Cuthill-McKee, that takes fewer operations; the pattern of the factors follows
from the elimination tree (Liu, SIAM J. Matrix Anal. Appl. 11, 134 (1990)); and the factors are made row by row without
pivoting between nodes, as in banded.py:

    L_ik = A_ik D_k^-1,   A_ij -= L_ik U_kj,   D_i^-1 kept

Order and pattern are kept for as long as the same pairs of nodes are coupled. A diagonal block that is nearly singular
is noticed, and SuperLU solves with pivoting instead.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.sparse import bsr_array, csc_array, csr_array, eye_array
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import splu

from .banded import Profile
from .blocks import inverse, less, less_times, part, product, put, put_part, take, times
from .compiled import njit
from .stiffness import Stiffness

Solve = Callable[[np.ndarray], np.ndarray]  # right side (n, m) -> x (n, m)


class Pattern(NamedTuple):
    """Where the blocks of the factors L + U are, in the order of elimination, and where those of the matrix go."""

    order: np.ndarray  # (n,) the node that is eliminated at each place
    start: np.ndarray  # (n + 1,) of each row among the blocks
    column: np.ndarray  # (b,) place of each block's column, increasing in a row
    diagonal: np.ndarray  # (n,) each row's diagonal block
    band: np.ndarray  # (n, 2 w + 1) the block that each of the band goes to, by node; -1 outside the profile
    pairs: np.ndarray  # (l,) the block that each coupled pair goes to

    @property
    def operations(self) -> int:
        """Products of blocks that elimination takes."""
        return int(np.sum((self.start[1:] - self.diagonal - 1) ** 2))


@njit(cache=True)
def _tree(start, column):
    """The elimination tree of a symmetric pattern, rows (n + 1,), (e,): the parent (n,) of each place, -1 of a root."""
    n = start.size - 1
    parent, ancestor = np.full(n, -1), np.full(n, -1)
    for i in range(n):
        for e in range(start[i], start[i + 1]):
            k = column[e]
            while k != -1 and k < i:
                following = ancestor[k]
                ancestor[k] = i
                if following == -1:
                    parent[k] = i
                k = following
    return parent


@njit(cache=True)
def _reach(start, column, parent, i, seen, out):
    """The columns k < i of row i of L into ``out``, in no order; how many. ``seen`` (n,) holds the row seen last."""
    count = 0
    seen[i] = i
    for e in range(start[i], start[i + 1]):
        k = column[e]
        while k < i and seen[k] != i:
            seen[k] = i
            out[count] = k
            count += 1
            k = parent[k]
    return count


@njit(cache=True)
def _counts(start, column, parent):
    """Blocks of each row of L (n,) and of each row of U (n,), diagonals left out."""
    n = parent.size
    lower, upper, seen, out = np.zeros(n, np.int64), np.zeros(n, np.int64), np.full(n, -1), np.empty(n, np.int64)
    for i in range(n):
        lower[i] = _reach(start, column, parent, i, seen, out)
        for k in range(lower[i]):
            upper[out[k]] += 1
    return lower, upper


@njit(cache=True)
def _fill(start, column, parent, lower, upper):
    """Rows (n + 1,), columns (b,) and diagonals (n,) of L + U."""
    n = parent.size
    rows, diagonal = np.zeros(n + 1, np.int64), np.empty(n, np.int64)
    for i in range(n):
        rows[i + 1] = rows[i] + lower[i] + 1 + upper[i]
        diagonal[i] = rows[i] + lower[i]
    columns, after = np.empty(rows[n], np.int64), diagonal + 1
    seen, out = np.full(n, -1), np.empty(n, np.int64)
    for i in range(n):
        count = _reach(start, column, parent, i, seen, out)
        columns[rows[i] : diagonal[i]] = np.sort(out[:count])
        columns[diagonal[i]] = i
        for k in range(count):  # of U, the transpose: row k has column i
            columns[after[out[k]]] = i
            after[out[k]] += 1
    return rows, columns, diagonal


@njit(cache=True)
def _places(place, rows, columns, start, column):
    """The block (l,) of L + U at each pair of nodes."""
    out = np.empty(rows.size, np.int64)
    for e in range(rows.size):
        i, j = place[rows[e]], place[columns[e]]
        out[e] = start[i] + np.searchsorted(column[start[i] : start[i + 1]], j)
    return out


def _minimum_degree(graph: csr_array) -> np.ndarray:
    """Each node's place (n,) in the order of minimum degree on A + A^T, by SuperLU; numbers do not count."""
    n = graph.shape[0]
    dominant = csc_array(graph + n * eye_array(n))
    options = {"SymmetricMode": True}
    return splu(dominant, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).perm_c.astype(np.int64)


def _cuthill_mckee(graph: csr_array) -> np.ndarray:
    """Each node's place (n,) in the order of least band width."""
    return np.argsort(reverse_cuthill_mckee(graph, symmetric_mode=True)).astype(np.int64)


class _Ordered(NamedTuple):
    """A graph in an order of elimination: each node's place, rows in that order, tree, counts."""

    place: np.ndarray
    start: np.ndarray
    column: np.ndarray
    parent: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    @property
    def operations(self) -> int:
        """Products of blocks that elimination takes."""
        return int(np.sum(self.upper**2))


def _ordered(graph: csr_array, place: np.ndarray) -> _Ordered:
    order = np.argsort(place)
    permuted = csr_array(graph[order][:, order])
    start, column = permuted.indptr.astype(np.int64), permuted.indices.astype(np.int64)
    parent = _tree(start, column)
    return _Ordered(place, start, column, parent, *_counts(start, column, parent))


def pattern(profile: Profile, rows: np.ndarray, columns: np.ndarray) -> Pattern:
    """The pattern of the factors of a band matrix with further blocks at the pairs ``rows``, ``columns`` (l,)."""
    n, w = len(profile.first), profile.width
    i = np.repeat(np.arange(n), 2 * w + 1)
    j = i + np.tile(np.arange(-w, w + 1), n)
    inside = (j >= profile.first[i]) & (j <= profile.last[i])
    i, j = i[inside], j[inside]
    ends = np.concatenate([i, j, rows, columns]), np.concatenate([j, i, columns, rows])
    graph = csr_array((np.ones(len(ends[0])), ends), shape=(n, n))
    found = min((_ordered(graph, of(graph)) for of in (_minimum_degree, _cuthill_mckee)), key=lambda o: o.operations)
    start, column, diagonal = _fill(*found[1:])
    band = np.full(n * (2 * w + 1), -1)
    band[inside] = _places(found.place, i, j, start, column)
    pairs = _places(found.place, rows, columns, start, column)
    return Pattern(np.argsort(found.place), start, column, diagonal, band.reshape(n, 2 * w + 1), pairs)


@njit(cache=True)
def _assemble(band, blocks, where: Pattern, values):
    """Puts the matrix into its places among the blocks ``values`` (b, 1, m, m)."""
    n, m = band.shape[:2]
    for i in range(n):
        for k in range(where.band.shape[1]):
            at = where.band[i, k]
            if at >= 0:
                for a in range(m):
                    for b in range(m):
                        values[at, 0, a, b] += band[i, a, k * m + b]
    for k in range(where.pairs.size):
        for a in range(m):
            for b in range(m):
                values[where.pairs[k], 0, a, b] += blocks[k, a, b]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _factor(where: Pattern, values, unit):
    """Factors in place, inverses on the diagonal. False where a diagonal block is nearly singular."""
    start, column, diagonal = where.start, where.column, where.diagonal
    n = diagonal.size
    slot = np.empty(n, np.int64)
    for i in range(n):
        for e in range(start[i], start[i + 1]):
            slot[column[e]] = e
        for e in range(start[i], diagonal[i]):
            k = column[e]
            factor = product(take(values, e, 0, unit), take(values, diagonal[k], 0, unit))
            put(values, e, 0, factor)
            for f in range(diagonal[k] + 1, start[k + 1]):
                at = slot[column[f]]
                put(values, at, 0, less(take(values, at, 0, unit), factor, take(values, f, 0, unit)))
        inverted, good = inverse(take(values, diagonal[i], 0, unit))
        put(values, diagonal[i], 0, inverted)
        if not good:
            return False
    return True


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _substitute(where: Pattern, values, right, x, unit):
    """x (n, m) of a right side (n, m), by factors."""
    start, column, diagonal, order = where.start, where.column, where.diagonal, where.order
    n = diagonal.size
    z = np.empty(right.shape)
    for i in range(n):
        y = part(right, order[i], unit)
        for e in range(start[i], diagonal[i]):
            y = less_times(y, take(values, e, 0, unit), part(z, column[e], unit))
        put_part(z, i, y)
    for i in range(n - 1, -1, -1):
        y = part(z, i, unit)
        for e in range(diagonal[i] + 1, start[i + 1]):
            y = less_times(y, take(values, e, 0, unit), part(z, column[e], unit))
        put_part(z, i, times(take(values, diagonal[i], 0, unit), y))
    for i in range(n):
        put_part(x, order[i], part(z, i, unit))


class BlockSparse:
    """The factorisation of band matrices with further blocks, all of one profile; keeps the last pattern."""

    def __init__(self, profile: Profile) -> None:
        self._profile = profile
        self._known: tuple[np.ndarray, np.ndarray, Pattern] | None = None  # rows, columns and what they lead to
        self.made = 0  # how often a pattern was

    def _pattern(self, rows: np.ndarray, columns: np.ndarray) -> Pattern:
        known = self._known
        if known is None or not (np.array_equal(known[0], rows) and np.array_equal(known[1], columns)):
            known = self._known = rows, columns, pattern(self._profile, rows, columns)
            self.made += 1
        return known[2]

    def factored(self, matrix: Stiffness) -> Solve:
        """A solver by the factors of a matrix. Raises numpy.linalg.LinAlgError where it is singular."""
        m = matrix.band.shape[1]
        unit, where = (0,) * m, self._pattern(matrix.pairs.rows, matrix.pairs.columns)
        values = np.zeros((len(where.column), 1, m, m))
        _assemble(matrix.band, matrix.pairs.blocks, where, values)
        if not _factor(where, values, unit):
            return _pivoted(matrix, where)

        def solve(right: np.ndarray) -> np.ndarray:
            x = np.empty_like(right)
            _substitute(where, values, right, x, unit)
            return x

        return solve


def _pivoted(matrix: Stiffness, where: Pattern) -> Solve:
    """The same by SuperLU, with pivoting. Raises numpy.linalg.LinAlgError where the matrix is singular."""
    n, m = matrix.band.shape[:2]
    values = np.zeros((len(where.column), 1, m, m))
    _assemble(matrix.band, matrix.pairs.blocks, where, values)
    whole = bsr_array((values[:, 0], where.column, where.start), shape=(n * m, n * m))
    try:
        factors = splu(csc_array(whole))
    except RuntimeError:
        raise np.linalg.LinAlgError("Singular matrix") from None
    place = np.argsort(where.order)
    return lambda right: factors.solve(right[where.order].ravel()).reshape(n, m)[place]
