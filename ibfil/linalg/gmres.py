"""Implicit steps by GMRES on a product that costs FFTs, and the preconditioners they are given.

The preconditioner P is the system rod by rod, factored. Residuals are measured after P, where they are errors of the
solution in the unknowns' own units: before it, a stiff rod of many nodes turns rounding of the smallest moves into
residuals above any useful tolerance (floor about 1e-11 for 200 nodes a tenth of a cell apart), and a residual of a
millionth may hide a solution that is wrong throughout.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from .compiled import njit
from .lapack import dgetrf, dgetrs

_WORST = 1e-6  # relative error above which a solution at the floor of its arithmetic is none
_LARGE = 2**24  # bytes of double precision beyond which factors are kept in single precision
_SINGLE = 0.01  # relative error of these that a preconditioner may have
CYCLE = 60  # vectors GMRES keeps

Product = Callable[[np.ndarray], np.ndarray]


class Factors(NamedTuple):
    """LU factors, with pivots, of a system whose rows were divided by their units."""

    lu: np.ndarray
    pivots: np.ndarray
    units: np.ndarray | None  # (n,); None: all are one

    def solve(self, right: np.ndarray) -> np.ndarray:
        """x with system x = right."""
        return dgetrs(self.lu, self.pivots, right if self.units is None else right / self.units)[0]


def factor(transposed: np.ndarray, units: np.ndarray | None = None) -> Factors:
    """The factors of a system (n, n) from its transpose, which is overwritten: LAPACK takes rows for columns.

    ``units`` (n,) are those of the rows: pivots are chosen among numbers that may be compared, whatever the units of
    a case. Raises numpy.linalg.LinAlgError where it is singular.
    """
    if units is not None:
        transposed /= units
    lu, pivots, fault = dgetrf(transposed.T, overwrite_a=True)
    if fault:
        raise np.linalg.LinAlgError("Singular matrix")
    return Factors(lu, pivots, units)


class Blocks(NamedTuple):
    """A preconditioner: LU factors of the system's diagonal block for each set of unknowns, and their scale.

    ``scale`` (n,) are the units that solutions are measured in: those of moves, and for the force that holds an unknown
    the force that would move it by one of them.
    """

    lu: np.ndarray  # the factors of all blocks, row by row, one after the other; single precision where they are large
    start: np.ndarray  # (b + 1,) where the unknowns of each begin in the two that follow
    at: np.ndarray  # (n,) the unknowns
    rows: np.ndarray  # (n,) the same in the order of pivots
    units: np.ndarray  # (n,) of rows
    scale: np.ndarray

    def solve(self, right: np.ndarray) -> np.ndarray:
        """The approximate x (n,)."""
        out = np.empty_like(right)
        _substitute(self.lu, self.start, self.at, self.rows, self.units, right, out)
        return out


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def _substitute(lu, start, at, rows, units, right, out):
    """Forward and backward through the factors of each block, by products of rows, which are read once."""
    place, room = 0, np.empty(np.max(start[1:] - start[:-1]))
    for b in range(len(start) - 1):
        first, n = start[b], start[b + 1] - start[b]
        for i in range(n):
            row, total = place + i * n, 0.0
            for j in range(i):
                total += lu[row + j] * room[j]
            room[i] = right[rows[first + i]] / units[rows[first + i]] - total
        for i in range(n - 1, -1, -1):
            row, total = place + i * n, 0.0
            for j in range(i + 1, n):
                total += lu[row + j] * room[j]
            room[i] = (room[i] - total) / lu[row + i]
        for i in range(n):
            out[at[first + i]] = room[i]
        place += n * n


Parts = Callable[[], Iterable[tuple[np.ndarray, np.ndarray]]]  # the unknowns (k,) and the system (k, k) of each block


def bytes_of(sizes: Iterable[int]) -> float:
    """The bytes of the factors of square blocks of ``sizes``: many are kept in single precision."""
    double = 8.0 * sum(float(n) ** 2 for n in sizes)
    return double if double <= _LARGE else 0.5 * double


def factored(parts: Parts, sizes: Sequence[int], held: np.ndarray, units: np.ndarray | None = None) -> Blocks:
    """The factors of square blocks of ``sizes``, by the unknowns each stands for, given transposed; overwrites them.

    ``units`` (n,) are those of moves; None: one. Many are kept in single precision, as a preconditioner may be, unless
    one of them is so stiff that this would make it another. ``parts`` may be asked again.
    """
    large = bytes_of(sizes) < 8.0 * sum(float(n) ** 2 for n in sizes)
    found = _factored(parts(), sizes, held, units, np.float32) if large else None
    return found or _factored(parts(), sizes, held, units, np.float64)  # type: ignore[return-value]


def _factored(
    parts: Iterable[tuple[np.ndarray, np.ndarray]],
    sizes: Sequence[int],
    held: np.ndarray,
    units: np.ndarray | None,
    number: type,
) -> Blocks | None:
    """The same in precision ``number``; None where single precision does not serve."""
    start = np.concatenate([[0], np.cumsum(sizes)])
    n, place = int(start[-1]), 0
    lu: np.ndarray = np.empty(sum(k * k for k in sizes), number)
    at, rows = np.empty(n, np.int64), np.empty(n, np.int64)
    scale, diagonal = np.ones(n) if units is None else units.copy(), np.empty(n)
    every = np.ones(n) if units is None else units
    for b, (unknowns, system) in enumerate(parts):
        size, here = len(unknowns), slice(start[b], start[b + 1])
        diagonal[unknowns] = np.diag(system)
        probe = every[unknowns] * np.cos(np.arange(size))
        image = probe @ system if number is np.float32 else probe
        factors = factor(system, None if units is None else units[unknowns])
        lu[place : place + size * size] = factors.lu.ravel()  # by rows
        at[here], rows[here] = unknowns, unknowns[_order(factors.pivots)]
        if number is np.float32:
            one, back = np.array([0, size]), np.empty(size)
            here_lu, own = lu[place : place + size * size], every[unknowns]
            _substitute(here_lu, one, np.arange(size), _order(factors.pivots), own, image, back)
            if not np.abs((back - probe) / own).max() < _SINGLE:
                return None
        place += size * size
    scale[held] /= diagonal[held]
    return Blocks(lu, start, at, rows, every, scale)


@njit(cache=True)
def _order(pivots):
    """The order of rows (k,) that LAPACK's exchanges lead to."""
    order = np.arange(len(pivots))
    for i in range(len(pivots)):
        j = pivots[i]
        order[i], order[j] = order[j], order[i]
    return order


class GmresResult(NamedTuple):
    """The result of GMRES: x (n,), how many products it took, and whether x is within the tolerance."""

    x: np.ndarray
    products: int
    found: bool


def solve(product: Product, right: np.ndarray, blocks: Blocks, tolerance: float, most: int) -> GmresResult:
    """x with product(x) = right to the relative error ``tolerance``, in some ``most`` products.

    Where rounding does not let it come so far, 1e-6 will do.
    """
    from scipy.sparse.linalg import LinearOperator, gmres

    count, errors = 0, [np.inf]

    def measured(z: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        return blocks.solve(product(blocks.scale * z)) / blocks.scale

    z, failed = gmres(
        LinearOperator((right.size, right.size), matvec=measured, dtype=float),
        blocks.solve(right) / blocks.scale,
        rtol=tolerance,
        atol=0.0,
        restart=min(most, CYCLE),
        maxiter=-(-most // CYCLE),
        callback=errors.append,
        callback_type="pr_norm",
    )
    found = bool(np.isfinite(z).all()) and (not failed or errors[-1] < _WORST)
    return GmresResult(blocks.scale * z, count, found)
