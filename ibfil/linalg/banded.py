"""Band matrices by node: blocks of m unknowns, w nodes to either side, stored (n, m, (2 w + 1) m) from column i - w.

``solve`` eliminates block by block without pivoting between nodes, inside the profile of the stencils (six nodes at
an end, four inside). The matrices of an implicit step are drag plus stiffness over a step, whose symmetric part is
positive but for compressive geometric stiffness; a block that is nearly singular is noticed, and LAPACK solves with
pivoting instead.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .blocks import inverse, less, less_times, part, product, put, put_part, take, times
from .compiled import njit
from .lapack import dgbtrf, dgbtrs, solve_banded
from .vectors import NOT_NEGATIVE


class Profile(NamedTuple):
    """Where a stack's band matrices are not zero: first node of a row (n,), last node of its factor's row (n,), w."""

    first: np.ndarray
    last: np.ndarray
    width: int


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _multiply(matrix, flat, out):
    n, m = out.shape
    w = (matrix.shape[2] // m - 1) // 2
    for i in range(n):
        low, high = (i - w if i > w else 0), (i + w + 1 if i + w < n else n)
        shift = (low - i + w) * m
        for a in range(m):
            s = 0.0
            for k in range((high - low) * m):
                s += matrix[i, a, shift + k] * flat[low * m + k]
            out[i, a] = s


def multiply(matrix: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The product (n, m) of a band matrix with x (n, m)."""
    out = np.empty(x.shape)
    _multiply(matrix, x.ravel(), out)
    return out


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def multiply_each(matrix, x):
    """The products (k, n, m) of a band matrix with each of x (k, n, m)."""
    n, m = matrix.shape[:2]
    w = (matrix.shape[2] // m - 1) // 2
    out = np.zeros(x.shape)
    flat = x.reshape(len(x), -1)
    for i in range(n):
        low, high = max(0, i - w), min(n, i + w + 1)
        shift = (low - i + w) * m
        for each in range(len(x)):
            for a in range(m):
                s = 0.0
                for k in range((high - low) * m):
                    s += matrix[i, a, shift + k] * flat[each, low * m + k]
                out[each, i, a] = s
    return out


@njit(cache=True, fastmath={"contract"})
def _transposed_product(matrix, full, factor, out):
    n, m, length = out.shape
    c, w = full.shape[0] // n, (matrix.shape[2] // m - 1) // 2
    for j in range(n):
        for i in range(j - w if j > w else 0, j + w + 1 if j + w < n else n):
            at, row = (j - i + w) * m, (c * i) & NOT_NEGATIVE
            size = 0.0
            for a in range(c):
                for b in range(m):
                    size += abs(matrix[i, a, at + b])
            if size == 0.0:
                continue
            x0, y0, z0 = matrix[i, 0, at] * factor, matrix[i, 1, at] * factor, matrix[i, 2, at] * factor
            x1, y1, z1 = matrix[i, 0, at + 1] * factor, matrix[i, 1, at + 1] * factor, matrix[i, 2, at + 1] * factor
            x2, y2, z2 = matrix[i, 0, at + 2] * factor, matrix[i, 1, at + 2] * factor, matrix[i, 2, at + 2] * factor
            for k in range(length):
                x, y, z = full[row, k], full[row + 1, k], full[row + 2, k]
                out[j, 0, k] += x0 * x + y0 * y + z0 * z
                out[j, 1, k] += x1 * x + y1 * y + z1 * z
                out[j, 2, k] += x2 * x + y2 * y + z2 * z
            for b in range(m):
                for a in range(3 if b < 3 else 0, c):
                    x = matrix[i, a, at + b] * factor
                    for k in range(length):
                        out[j, b, k] += x * full[row + a, k]


def transposed_product(matrix: np.ndarray, full: np.ndarray, factor: float) -> np.ndarray:
    """``factor`` K^T A (n, m, l) of a band matrix K and a full A (c n, l), c = 3 or 4: of K, the first c rows a node.

    Three rows of A go into three of the product at a time, so that each number is fetched for three products.
    """
    out = np.zeros((*matrix.shape[:2], full.shape[1]))
    _transposed_product(matrix, full, factor, out)
    return out


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def eliminate(matrix, x, first, last, unit):
    """Block elimination; the answer overwrites ``x`` (n, m). False where a diagonal block is nearly singular.

    Row by row, A_ij - sum_k L_ik U_kj is gathered in registers over all k and written once: it is L_ij times the
    diagonal block j, or that diagonal block, or U_ij. ``unit`` is a tuple of m entries.
    """
    n, m, columns = matrix.shape
    w = (columns // m - 1) // 2
    blocks = matrix.reshape(n, m, columns // m, m).transpose(0, 2, 1, 3)
    upper, factor, diagonal = np.empty((n, w, m, m)), np.empty((1, w, m, m)), np.empty((n, 1, m, m))
    for i in range(n):
        low = first[i]
        for j in range(low, last[i] + 1):
            s = take(blocks, i, j - i + w, unit)
            for k in range(low, min(i, j)):
                if last[k] >= j:
                    s = less(s, take(factor, 0, k - low, unit), take(upper, k, j - k - 1, unit))
            if j < i:
                put(factor, 0, j - low, product(s, take(diagonal, j, 0, unit)))
            elif j > i:
                put(upper, i, j - i - 1, s)
            else:
                s, good = inverse(s)
                put(diagonal, i, 0, s)
                if not good:
                    return False
        y = part(x, i, unit)
        for k in range(low, i):
            y = less_times(y, take(factor, 0, k - low, unit), part(x, k, unit))
        put_part(x, i, y)
    for i in range(n - 1, -1, -1):
        y = part(x, i, unit)
        for j in range(i + 1, last[i] + 1):
            y = less_times(y, take(upper, i, j - i - 1, unit), part(x, j, unit))
        put_part(x, i, times(take(diagonal, i, 0, unit), y))
    return True


def solve(matrix: np.ndarray, right: np.ndarray, where: Profile) -> np.ndarray:
    """x (n, m) with ``matrix`` x = ``right``. Raises numpy.linalg.LinAlgError where the matrix is singular."""
    x = right.copy()
    if eliminate(matrix, x, where.first, where.last, (0,) * right.shape[1]):
        return x
    return solve_pivoted(matrix, right)


def solve_pivoted(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The same by LAPACK, with pivoting; no numbers where the matrix or ``right`` has some that are none.

    Raises numpy.linalg.LinAlgError where the matrix is singular.
    """
    upper, diagonals = lapack_form(matrix)
    if not (np.isfinite(diagonals).all() and np.isfinite(right).all()):
        return np.full(right.shape, np.nan)
    return solve_banded(upper, diagonals, right.ravel()).reshape(right.shape)


def lapack_form(matrix: np.ndarray) -> tuple[int, np.ndarray]:
    """The same matrix by diagonals: the number of upper (and lower) ones in use, and the array solve_banded takes."""
    n, m, width = matrix.shape
    w = (width // m - 1) // 2
    count, upper = n * m, (w + 1) * m - 1
    rows = np.arange(count)[:, None]
    columns = (rows // m - w) * m + np.arange(width)
    inside = (columns >= 0) & (columns < count)
    diagonals = np.zeros((2 * upper + 1, count))
    diagonals[(upper + rows - columns)[inside], columns[inside]] = matrix.reshape(count, width)[inside]
    used = np.nonzero(diagonals.any(axis=1))[0]
    spare = int(min(used[0], 2 * upper - used[-1]))
    return upper - spare, diagonals[spare : 2 * upper + 1 - spare]


class Factored:
    """LU factors, with pivots, of a band matrix. Raises numpy.linalg.LinAlgError where it is singular."""

    def __init__(self, matrix: np.ndarray) -> None:
        self._upper, diagonals = lapack_form(matrix)
        room = np.zeros((self._upper, diagonals.shape[1]))
        self._lu, self._pivots, fault = dgbtrf(np.vstack([room, diagonals]), self._upper, self._upper)
        if fault:
            raise np.linalg.LinAlgError("Singular matrix")

    def solve(self, right: np.ndarray) -> np.ndarray:
        """x (n m,) of the matrix times x = ``right`` (n m,)."""
        return np.asarray(dgbtrs(self._lu, self._upper, self._upper, right, self._pivots)[0])


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
