"""Preconditioners of GMRES on a product that costs FFTs: the exact matrix of all nodes, or rod by rod, kept in use.

GMRES with the matrix of all nodes needs an iteration or two, as it is the operator itself; making it costs as much as a
dense solve. That of each rod by itself is cheap, is kept from step to step for as long as it serves, and what it was
made from is part of a run's state, so that a resumed run has the same one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from ..linalg import gmres
from ..linalg.gmres import CYCLE, Blocks, GmresResult, Product
from ..linalg.stiffness import Stiffness, nodes_of
from .condensation import Group, Reduced, RodStiffness
from .coupling import Nodes

_EXACT = 1e-8  # relative error of GMRES where its preconditioner is the operator itself
_LOOSE = 1e-6  # and where it is not: less than Newton gains in an iteration by the time it stops
_WITH_TORQUES = 0.01  # of that with torques: those that hold a turn, and turns in radians, outweigh moves by so much
MOST = 5 * 60  # products of a solve, before it is given up
_DRIFT = 0.4  # of tau, by which a kept preconditioner may be off: less than the change from Euler to BDF2
_TRIAL = 8  # of so many preconditioners one is kept for longer, to find how long they serve

_COUNTS = ("tau", "age", "before", "now", "fresh", "life", "made")  # of KeptFactors, that a run's state holds


@dataclass
class KeptFactors:
    """A preconditioner that is kept from step to step, what it has cost, and for how long those before it served.

    A round is the solves of a step after its first, and the first of the next step: all are near one solution, and
    factors made at a step's second solve serve them. Factors are kept for as long as a round takes fewer products than
    the mean round since they were made, where that counts what making them cost (``cost``, in products): beyond it the
    mean would grow. The number of rounds found so (``life``) holds for the next factors, and every eighth are kept for
    longer, to find it again. Counts decide, never a clock.
    """

    cost: float
    blocks: Blocks | None = None
    tau: float = 0.0
    age: int = 0  # rounds ended since it was made
    before: int = 0  # products of those rounds
    now: int = 0  # products of the present round
    fresh: int = 0  # products of the first solve with it
    life: int = 1  # rounds after which it is made again
    made: int = 0  # how often it was

    def renew(self, blocks: Blocks, tau: float) -> None:
        """Puts new factors in; a round begins."""
        self.blocks, self.tau, self.age, self.before, self.now, self.fresh = blocks, tau, 0, 0, 0, 0
        self.made += 1

    def end_round(self) -> bool:
        """Ends a round of solves; whether the factors should be made again for the next."""
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
        """The products after which a solve is better resumed by new factors."""
        return self.fresh + int(min(CYCLE, self.cost + 10))

    def took(self, solution: GmresResult) -> None:
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


class Asked(NamedTuple):
    """A linear system to be solved: (1 - tau M K) x = right, by its ``product``, to a relative ``error`` of x."""

    nodes: Nodes
    tau: float
    statement: Reduced
    product: Product
    error: float = 0.0


class Matrix(NamedTuple):
    """The exact mobility of nodes: ``of`` (nodes, own), what each moves alone (n, c), c, and units of motions."""

    of: Callable[[Nodes, np.ndarray], np.ndarray]
    own: np.ndarray
    parts: int
    units: np.ndarray | None  # (c n,); None: all are one

    def factored(self, nodes: Nodes, tau: float, rods: RodStiffness, groups: tuple[Group, ...]) -> Blocks:
        """The factors of the systems of groups of filaments, each by itself."""
        c = self.parts

        def parts() -> Iterator[tuple[np.ndarray, np.ndarray]]:
            for group in groups:
                at = nodes_of(group)
                matrix = self.of(nodes[at], self.own[at])
                yield (c * at[:, None] + np.arange(c)).ravel(), rods.system(group, matrix, tau)

        sizes = [c * sum(where.stop - where.start for where in group) for group in groups]
        return gmres.factored(parts, sizes, rods.held, self.units)


class Preconditioner(Protocol):
    """A solver for the systems of a response; ``keeps``: it has the factors of the last one again."""

    keeps: bool

    def solve(self, asked: Asked, right: np.ndarray) -> np.ndarray:
        """x with product(x) = right. Raises numpy.linalg.LinAlgError where none is found."""


class WholeMatrix:
    """The exact matrix of all nodes, of one response; its factors serve as long as the stiffness is the same array."""

    keeps = True

    def __init__(self, matrix: Matrix, nodes: Nodes) -> None:
        self._matrix, self._nodes = matrix, nodes
        self._known: tuple[Stiffness, Blocks] | None = None  # the stiffness, and the factors

    @cached_property
    def mobility(self) -> np.ndarray:
        """The matrix (c n, c n)."""
        return self._matrix.of(self._nodes, self._matrix.own)

    def solve(self, asked: Asked, right: np.ndarray) -> np.ndarray:
        """By an iteration or two."""
        rods = asked.statement.frozen()
        if self._known is None or self._known[0] is not rods.stiffness:
            n = len(asked.nodes.axes)
            system = rods.system((slice(0, n),), self.mobility, asked.tau)
            every = np.arange(self._matrix.parts * n)
            self._known = (
                rods.stiffness,
                gmres.factored(lambda: [(every, system)], [len(every)], rods.held, self._matrix.units),
            )
        return _checked(gmres.solve(asked.product, right, self._known[1], _EXACT, MOST))


class _Source(NamedTuple):
    """The source of kept factors."""

    nodes: Nodes
    tau: float
    rods: RodStiffness


class RodByRod:
    """The exact matrix of each group of filaments by itself, of the steps of a run one after the other."""

    keeps = False

    def __init__(self, matrix: Matrix, groups: tuple[Group, ...], cost: float, couples_torque: bool) -> None:
        """``cost``: what making the factors costs, in products; ``couples_torque``: torques are among the unknowns."""
        self._matrix, self._groups = matrix, groups
        self.kept = KeptFactors(cost)
        self._share = _WITH_TORQUES if couples_torque else 1.0
        self._source: _Source | None = None
        self._solves = 0

    def begin(self) -> None:
        """A step begins, at new positions."""
        self._solves = 0

    def solve(self, asked: Asked, right: np.ndarray) -> np.ndarray:
        """By the factors kept, and where these do not serve by new ones."""
        kept = self.kept
        self._solves += 1
        fresh = not kept.fits(asked.tau) or (self._solves == 2 and kept.end_round())
        while True:
            if fresh:
                self._make(_Source(asked.nodes, asked.tau, asked.statement.frozen()))
            assert kept.blocks is not None
            tolerance = self._share * max(_LOOSE, asked.error)
            found = gmres.solve(asked.product, right, kept.blocks, tolerance, MOST if fresh else kept.patience)
            kept.took(found)
            if found.found or fresh:
                return _checked(found)
            fresh = True

    def _make(self, source: _Source) -> None:
        self._source = source
        self.kept.blocks = None  # two of them at a time would be the most of a run's memory
        self.kept.renew(self._matrix.factored(source.nodes, source.tau, source.rods, self._groups), source.tau)

    def memory(self) -> dict[str, np.ndarray | float]:
        """The source of the factors; empty before there are any."""
        if self._source is None:
            return {}
        return {**self._source.rods.memory(), **vars(self._source.nodes), **self.kept.memory()}

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Makes the factors of ``memory`` again."""
        arrays = {k: np.asarray(v) for k, v in memory.items()}
        rods = RodStiffness.recalled(arrays)
        nodes = Nodes(arrays["base"].astype(np.int64), arrays["weights"], arrays["axes"])
        self._make(_Source(nodes, float(arrays["tau"]), rods))
        self.kept.recall({k: float(v) for k, v in memory.items() if not isinstance(v, np.ndarray)})


def _checked(solution: GmresResult) -> np.ndarray:
    if not solution.found:
        raise np.linalg.LinAlgError(f"GMRES found no solution in {solution.products} products with the FFT operator")
    return solution.x
