"""Implicit steps by GMRES on a product that costs FFTs, and the preconditioners they are given.

The preconditioner P is the system rod by rod, factored. Residuals are measured after P, where they are errors of the
solution in the unknowns' own units: before it, a stiff rod of many nodes turns rounding of the smallest moves into
residuals above any useful tolerance (floor about 1e-11 for 200 nodes a tenth of a cell apart), and a residual of a
millionth may hide a solution that is wrong throughout.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .lapack import dgetrf, dgetrs

_WORST = 1e-6  # relative error above which a solution at the floor of its arithmetic is none
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

    factors: list[tuple[np.ndarray, Factors]]
    scale: np.ndarray

    def solve(self, right: np.ndarray) -> np.ndarray:
        """The approximate x (n,)."""
        out = np.empty_like(right)
        for at, factors in self.factors:
            out[at] = factors.solve(right[at])
        return out


def factored(parts: list[tuple[np.ndarray, np.ndarray]], held: np.ndarray, units: np.ndarray | None = None) -> Blocks:
    """The factors of square blocks, by the unknowns (k,) each stands for, given transposed; overwrites them.

    ``units`` (n,) are those of moves; None: one.
    """
    diagonal = np.empty(sum(len(at) for at, _ in parts))
    for at, system in parts:
        diagonal[at] = np.diag(system)
    scale = np.ones(len(diagonal)) if units is None else units.copy()
    scale[held] /= diagonal[held]
    return Blocks([(at, factor(system, None if units is None else units[at])) for at, system in parts], scale)


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
