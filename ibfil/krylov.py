"""Implicit steps by GMRES on a product that costs FFTs, and the preconditioners they are given.

The preconditioner P is the system rod by rod, factored. Residuals are measured after P, where they are errors of the
solution in the unknowns' own units: before it, a stiff rod of many nodes turns rounding of the smallest moves into
residuals above any useful tolerance (floor about 1e-11 for 200 nodes a tenth of a cell apart), and a residual of a
millionth may hide a solution that is wrong throughout.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse.linalg import LinearOperator, gmres

_WORST = 1e-6  # relative error above which a solution at the floor of its arithmetic is none
_CYCLE = 60  # vectors GMRES keeps
_DRIFT = 0.4  # of tau, by which a kept preconditioner may be off: less than the change from Euler to BDF2
_TRIAL = 8  # of so many preconditioners one is kept for longer, to find how long they serve

Product = Callable[[np.ndarray], np.ndarray]


class Factors(NamedTuple):
    """LU factors, with pivots, of a system."""

    lu: np.ndarray
    pivots: np.ndarray

    def solve(self, right: np.ndarray) -> np.ndarray:
        """x with system x = right."""
        return dgetrs(self.lu, self.pivots, right)[0]


def factor(transposed: np.ndarray) -> Factors:
    """The factors of a system (n, n) from its transpose, which is overwritten: LAPACK takes rows for columns.

    Raises numpy.linalg.LinAlgError where it is singular.
    """
    lu, pivots, fault = dgetrf(transposed.T, overwrite_a=True)
    if fault:
        raise np.linalg.LinAlgError("Singular matrix")
    return Factors(lu, pivots)


class Blocks(NamedTuple):
    """A preconditioner: LU factors of the system's diagonal block for each range of unknowns, and their scale.

    ``scale`` (n,) are the units that solutions are measured in: one for a move, and for the force that holds an
    unknown the force that would move it by one.
    """

    factors: list[tuple[slice, Factors]]
    scale: np.ndarray

    def solve(self, right: np.ndarray) -> np.ndarray:
        """The approximate x (n,)."""
        out = np.empty_like(right)
        for at, factors in self.factors:
            out[at] = factors.solve(right[at])
        return out


def factored(parts: list[tuple[slice, np.ndarray]], held: np.ndarray) -> Blocks:
    """The factors of square blocks, by the range of unknowns each stands for, given transposed; overwrites them."""
    diagonal = np.concatenate([np.diag(system) for _, system in parts])
    scale = np.ones(len(diagonal))
    scale[held] = 1.0 / diagonal[held]
    return Blocks([(at, factor(system)) for at, system in parts], scale)


class Solution(NamedTuple):
    """What GMRES found: x (n,), how many products it took, and whether x is within the tolerance."""

    x: np.ndarray
    products: int
    found: bool


def solve(product: Product, right: np.ndarray, blocks: Blocks, tolerance: float, most: int) -> Solution:
    """x with product(x) = right to the relative error ``tolerance``, in some ``most`` products.

    Where rounding does not let it come so far, 1e-6 will do.
    """
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
        restart=min(most, _CYCLE),
        maxiter=-(-most // _CYCLE),
        callback=errors.append,
        callback_type="pr_norm",
    )
    found = bool(np.isfinite(z).all()) and (not failed or errors[-1] < _WORST)
    return Solution(blocks.scale * z, count, found)


_COUNTS = ("tau", "age", "before", "now", "fresh", "life", "made")  # of KeptFactors, that a run's state holds


@dataclass
class KeptFactors:
    """A preconditioner that is kept from step to step, what it has cost, and for how long those before it served.

    A round is the solves of a step after its first, and the first of the next step: all are near one solution, and
    factors made at a step's second solve serve them. Factors are kept for as long as a round takes fewer products than
    the mean round since they were made, where that counts what making them cost (``cost``, in products): beyond it the
    mean would grow. The number of rounds found so (``life``) holds for the next factors, and every eighth are kept for
    longer, to find it anew. Counts decide, never a clock.
    """

    cost: float
    blocks: Blocks | None = None
    tau: float = 0.0
    age: int = 0  # rounds ended since it was made
    before: int = 0  # products of those rounds
    now: int = 0  # products of the present round
    fresh: int = 0  # products of the first solve with it
    life: int = 1  # rounds after which it is made anew
    made: int = 0  # how often it was

    def renew(self, blocks: Blocks, tau: float) -> None:
        """Puts new factors in; a round begins."""
        self.blocks, self.tau, self.age, self.before, self.now, self.fresh = blocks, tau, 0, 0, 0, 0
        self.made += 1

    def end_round(self) -> bool:
        """Ends a round of solves; whether the factors should be made anew for the next."""
        mean = (self.cost + self.before) / max(1, self.age)
        self.age += 1
        self.before += self.now
        spent, self.now = self.now, 0
        if self.age > 1 and spent > mean:
            self.life = self.age - 1
            return True
        if self.age >= self.life and self.made % _TRIAL != 1:
            return True
        self.life = max(self.life, self.age)
        return False

    def fits(self, tau: float) -> bool:
        """Whether there are factors, for a step of about this effective length."""
        return self.blocks is not None and abs(self.tau - tau) <= _DRIFT * tau

    @property
    def patience(self) -> int:
        """The products after which a solve is better gone on with by new factors."""
        return self.fresh + int(min(_CYCLE, self.cost + 10))

    def took(self, solution: Solution) -> None:
        """Told what came of a solve."""
        self.now += solution.products
        self.fresh = self.fresh or solution.products
        if not solution.found:
            self.life = max(1, self.age)

    def memory(self) -> dict[str, float]:
        """Its counts by name."""
        return {name: float(getattr(self, name)) for name in _COUNTS}

    def recall(self, memory: dict[str, float]) -> None:
        """Takes up what ``memory`` gave."""
        self.tau = float(memory["tau"])
        for name in _COUNTS[1:]:
            setattr(self, name, int(memory[name]))
