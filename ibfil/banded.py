"""Band matrices by node: blocks of m unknowns, w nodes to either side, stored (n, m, (2 w + 1) m) from column i - w.

``solve`` eliminates block by block without pivoting between nodes, inside the profile of the stencils (six nodes at
an end, four inside). The matrices of an implicit step are drag plus stiffness over a step, whose symmetric part is
positive but for compressive geometric stiffness; a block that is nearly singular is noticed, and LAPACK solves with
pivoting instead.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.linalg import solve_banded

from .rods import Mesh

_RUN = 16  # entries of a factor's row beside the diagonal that are kept together: whole vector registers
_SMALLEST = 1e-12  # a pivot inside a diagonal block, relative to the block's largest entry


class Profile(NamedTuple):
    """Where a stack's band matrices are not zero: first node of a row (n,), last node of its factor's row (n,), w."""

    first: np.ndarray
    last: np.ndarray
    width: int


def profile(mesh: Mesh) -> Profile:
    """Which displacements a node's force feels: the stencils of the node and of its neighbours, fill included."""
    n, p = mesh.w1.shape
    columns = mesh.first[:, None] + np.arange(p)
    used = (mesh.w1 != 0) | (mesh.w2 != 0)
    rows = np.arange(n)
    low = np.minimum(np.where(used, columns, n).min(axis=1), rows)
    high = np.maximum(np.where(used, columns, -1).max(axis=1), rows)
    first, last = low.copy(), high.copy()
    joined = mesh.joined[:-1]
    first[1:] = np.where(joined, np.minimum(first[1:], low[:-1]), first[1:])
    first[:-1] = np.where(joined, np.minimum(first[:-1], low[1:]), first[:-1])
    last[1:] = np.where(joined, np.maximum(last[1:], high[:-1]), last[1:])
    last[:-1] = np.where(joined, np.maximum(last[:-1], high[1:]), last[:-1])
    for i in range(n):
        last[i] = max(last[i], last[first[i] : i + 1].max())
    # Kernels write whole stencils, zero weights and all, into the rows on either side: the band must hold them.
    reach = max(int(np.max(rows - mesh.first)), int(np.max(mesh.first + p - 1 - rows))) + 1
    return Profile(first, last, reach)


@njit(cache=True)
def multiply(matrix, x):
    """The product (n, m) of a band matrix with x (n, m)."""
    n, m = matrix.shape[:2]
    w = (matrix.shape[2] // m - 1) // 2
    out = np.zeros((n, m))
    flat = x.ravel()
    for i in range(n):
        low, high = max(0, i - w), min(n, i + w + 1)
        shift = (low - i + w) * m
        for a in range(m):
            s = 0.0
            for k in range((high - low) * m):
                s += matrix[i, a, shift + k] * flat[low * m + k]
            out[i, a] = s
    return out


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _invert(block, unit, smallest):
    """Inverts a small block in place by Gauss-Jordan with row pivoting. False where a pivot vanishes."""
    m = len(unit)
    size = 0.0
    for a in range(m):
        for b in range(m):
            size = max(size, abs(block[a, b]))
    swap = np.empty(4, np.int64)
    for k in range(m):
        p = k
        for a in range(k + 1, m):
            if abs(block[a, k]) > abs(block[p, k]):
                p = a
        swap[k] = p
        if not abs(block[p, k]) > smallest * size:
            return False
        for b in range(m):
            block[k, b], block[p, b] = block[p, b], block[k, b]
        f = 1.0 / block[k, k]
        block[k, k] = 1.0
        for b in range(m):
            block[k, b] *= f
        for a in range(m):
            if a != k:
                f = block[a, k]
                block[a, k] = 0.0
                for b in range(m):
                    block[a, b] -= f * block[k, b]
    for k in range(m - 1, -1, -1):
        for a in range(m):
            block[a, k], block[a, swap[k]] = block[a, swap[k]], block[a, k]
    return True


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _eliminate(matrix, x, first, last, unit, near, smallest):
    """Block elimination; the answer overwrites ``x`` (n, m). False where a diagonal block is nearly singular.

    Rows of the factor lie packed in ``upper``: a block row beside the diagonal as m runs of 16 entries, then, where
    a row reaches further, its rest; ``unit`` and ``near`` are tuples of m and of 16 entries, lengths the compiler
    knows. Every inner loop is then a fixed number of products of numbers that lie side by side.
    """
    n, m, c4 = matrix.shape[0], len(unit), len(near)
    columns = matrix.shape[2]
    width = columns + c4  # of the working row: the last runs may read past the band, into zeros
    middle = (columns // m - 1) // 2 * m
    upper, inverse = np.zeros((n, m * len(near))), np.empty((n, m * m))
    far = np.empty((n, m, middle))
    work, factor, block = np.zeros(m * width), np.empty(m * m), np.empty((m, m))
    right = np.empty(m)
    for i in range(n):
        for a in range(m):
            right[a] = x[i, a]
            for c in range(columns):
                work[a * width + c] = matrix[i, a, c]
            for c in range(columns, width):
                work[a * width + c] = 0.0
        for k in range(first[i], i):
            at = (k - i) * m + middle
            for a in range(m):
                for b in range(m):
                    s = 0.0
                    for c in range(m):
                        s += work[a * width + at + c] * inverse[k, c * m + b]
                    factor[a * m + b] = s
            for a in range(m):
                to = a * width + at + m
                if len(unit) == 3:
                    f0, f1, f2 = factor[a * 3], factor[a * 3 + 1], factor[a * 3 + 2]
                    for c in range(len(near)):
                        work[to + c] -= f0 * upper[k, c] + f1 * upper[k, 16 + c] + f2 * upper[k, 32 + c]
                else:
                    f0, f1, f2, f3 = factor[a * 4], factor[a * 4 + 1], factor[a * 4 + 2], factor[a * 4 + 3]
                    for c in range(len(near)):
                        v = f0 * upper[k, c] + f1 * upper[k, 16 + c] + f2 * upper[k, 32 + c] + f3 * upper[k, 48 + c]
                        work[to + c] -= v
                for b in range(m):
                    right[a] -= factor[a * m + b] * x[k, b]
            beyond = (last[k] - k) * m - c4
            if beyond > 0:
                for a in range(m):
                    for b in range(m):
                        for c in range(beyond):
                            work[a * width + at + m + c4 + c] -= factor[a * m + b] * far[k, b, c]
        for a in range(m):
            for b in range(m):
                block[a, b] = work[a * width + middle + b]
        if not _invert(block, unit, smallest):
            return False
        for a in range(m):
            x[i, a] = right[a]
            for b in range(m):
                inverse[i, a * m + b] = block[a, b]
            for c in range(min(c4, (last[i] - i) * m)):
                upper[i, a * c4 + c] = work[a * width + middle + m + c]
            for c in range((last[i] - i) * m - c4):
                far[i, a, c] = work[a * width + middle + m + c4 + c]
    flat = x.ravel()
    for i in range(n - 1, -1, -1):
        reach = (last[i] - i) * m
        for a in range(m):
            s = flat[i * m + a]
            for c in range(min(c4, reach)):
                s -= upper[i, a * c4 + c] * flat[(i + 1) * m + c]
            for c in range(c4, reach):
                s -= far[i, a, c - c4] * flat[(i + 1) * m + c]
            right[a] = s
        for a in range(m):
            s = 0.0
            for b in range(m):
                s += inverse[i, a * m + b] * right[b]
            x[i, a] = s
    return True


def solve(matrix: np.ndarray, right: np.ndarray, where: Profile) -> np.ndarray:
    """x (n, m) with ``matrix`` x = ``right``. Raises numpy.linalg.LinAlgError where the matrix is singular."""
    m = right.shape[1]
    x = right.copy()
    zeros = (0,) * m
    if _eliminate(matrix, x, where.first, where.last, zeros, (0,) * _RUN, _SMALLEST):
        return x
    upper, diagonals = lapack_form(matrix)
    return solve_banded((upper, upper), diagonals, right.ravel()).reshape(right.shape)


def lapack_form(matrix: np.ndarray) -> tuple[int, np.ndarray]:
    """The same matrix by diagonals: the number of upper (and lower) ones in use, and the array solve_banded takes."""
    n, m, width = matrix.shape
    w = (width // m - 1) // 2
    rows, upper = n * m, (w + 1) * m - 1
    diagonals = np.zeros((2 * upper + 1, rows))
    flat = matrix.reshape(rows, width)
    for r in range(rows):
        base = (r // m - w) * m
        columns = np.arange(max(0, base), min(rows, base + width))
        diagonals[upper + r - columns, columns] = flat[r, columns - base]
    used = np.nonzero(diagonals.any(axis=1))[0]
    spare = int(min(used[0], 2 * upper - used[-1]))
    return upper - spare, diagonals[spare : 2 * upper + 1 - spare]


@njit(cache=True)
def dense(matrix):
    """The same matrix in full, (n, m, n, m)."""
    n, m = matrix.shape[:2]
    w = (matrix.shape[2] // m - 1) // 2
    out = np.zeros((n, m, n, m))
    for i in range(n):
        for a in range(m):
            for j in range(max(0, i - w), min(n, i + w + 1)):
                for b in range(m):
                    out[i, a, j, b] = matrix[i, a, (j - i + w) * m + b]
    return out
