"""Rods and bodies by FFT: each swimmer by itself is solved for exactly, what swimmers give each other by GMRES.

All nodes and markers have the mobility M by FFT; M~ is the exact matrix of each swimmer, and nothing between them. With
motions g, over the step, that come to a swimmer from elsewhere, it answers exactly (response.py): forces F(g) that obey
all its balances to round-off, markers that move rigidly, and motions b + g + tau M~ F(g), where b are those without any
force. Those that do come are tau (M - M~) F, so that g is sought with

    b + tau M F(g) = b + g + tau M~ F(g)

F is linear but for a constant F', so that the correction of g is that of a linear system, g + tau (M~ - M) F'(g).
Whatever is left of it is an error of velocities alone: sums of forces stay exact. With one swimmer, of all, M~ is M.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from ...linalg.constraints import Prescribed
from ...linalg.gmres import CYCLE
from ...linalg.normal_numbers import Draw
from ...linalg.stiffness import Stiffness
from ..base import Solution
from ..coupling import Nodes
from ..preconditioner import MOST
from ..stokes import Solver
from .response import Rigid, WithShells, without_stiffness
from .stokes import ImmersedBodies
from .swimmer import Part, Statement, Swimmer

TIGHT = 1e-9  # of a correction, to which motions are found where no error is allowed
_SHARE = 0.1  # of the error that is allowed
_FLOOR = 1e-10  # of all motions, below which is rounding
_WORST = 1e-6  # of all motions, above which a solution is none


class Means(NamedTuple):
    """How velocities come by FFT, exact matrices of some nodes with what each moves alone; and the swimmers."""

    solver: Solver
    matrix: Callable[[Nodes, np.ndarray], np.ndarray]
    swimmers: tuple[Swimmer, ...]


class _Answer(NamedTuple):
    """The motions of all nodes and markers over the step, and the forces with which they push: (n + k, c) each."""

    moves: np.ndarray
    pushes: np.ndarray
    parts: list[Solution]


class _Alone(NamedTuple):
    """A swimmer by itself: its part of the scene, its mobility, its response, and the levers of its markers."""

    swimmer: Swimmer
    part: Part
    rigid: Rigid
    response: WithShells
    levers: np.ndarray


class ByTransforms:
    """The response of rods and bodies, positions frozen over a step of effective length tau.

    ``products``: how often the FFT was asked.
    """

    keeps = True

    def __init__(
        self,
        immersed: ImmersedBodies,
        means: Means,
        nodes: Nodes,
        e3: np.ndarray,
        coming: np.ndarray | None,
        tau: float,
    ) -> None:
        """``nodes`` and markers, tangents ``e3`` (N, 3) of all rows, and how the flow carries nodes and markers,

        ``coming`` (n + k, c) or (n + k, m), None where it does not.
        """
        self.immersed, self.nodes, self.tau, self.products = immersed, nodes, tau, 0
        self._means, self._e3, self._c = means, e3, immersed.coupling.components
        shape = (len(nodes.axes), self._c)
        self._base = np.zeros(shape) if coming is None else tau * coming
        self._found = np.zeros(shape)  # what comes from elsewhere, by the last correction
        self._units = np.ones(shape) if immersed.units is None else immersed.units.reshape(shape)
        self._swimmers: list[_Alone] = []
        self._pushes: np.ndarray | None = None

    def fluctuation(self, draw: Draw, shape: tuple[int, int]) -> np.ndarray:
        """Not of scenes with bodies, which have no thermal forces."""
        raise NotImplementedError

    def apply(self, force: np.ndarray) -> np.ndarray:
        """Velocities of forces on nodes and markers, c numbers of each (flat), without the background flow."""
        nodes, coupling, f = self.nodes, self.immersed.coupling, force.reshape(-1, self._c)
        self.products += 1
        moved = self._means.solver.velocity(nodes.base, nodes.weights, coupling.to_grid(nodes.axes, f))
        return (coupling.from_grid(nodes.axes, moved) + self.immersed.own * f).ravel()

    def forced(self, force: np.ndarray, held: Prescribed, target: np.ndarray) -> Solution:
        """The displacements without stiffness: by that of none."""
        n = self.immersed.shells.nodes
        return self.implicit(*without_stiffness(force, held, n), np.zeros_like(force), target)

    def implicit(
        self,
        force: np.ndarray,
        stiffness: Stiffness,
        held: Prescribed,
        y: np.ndarray,
        target: np.ndarray,
        error: float = 0.0,
    ) -> Solution:
        """One correction of nodes and bodies: exact in all but velocities, whose error is told."""
        alone = self._apart(stiffness)
        whole = Statement(force, stiffness, held, y, target)
        asked = [one.part.statement(whole) for one in alone]
        still = [statement.still() for statement in asked]
        tolerance = _SHARE * error or TIGHT

        def allowed(answer: _Answer) -> float:
            return tolerance * max(float(np.abs(part.move).max(initial=0.0)) for part in answer.parts)

        def answer(g: np.ndarray) -> _Answer:
            coming = self._base.copy()
            coming[:, : self._c] += g
            return self._answer(alone, asked, coming)

        found = self._sought(answer, lambda g: self._answer(alone, still, g), self._base[:, : self._c], allowed)
        self._pushes = found.pushes
        out = Solution(np.zeros_like(y), np.zeros_like(y), np.zeros_like(y), error)
        for one, solution in zip(alone, found.parts, strict=True):
            for all_rows, own in zip(out[:3], solution[:3], strict=True):
                all_rows[one.part.rows] = own
        return out

    def marker_forces(self) -> np.ndarray:
        """The forces of markers on the fluid (k, 3), by the last correction."""
        assert self._pushes is not None
        return self._pushes[self.immersed.shells.nodes :, :3]

    def recovered(self, force: np.ndarray) -> np.ndarray:
        """The forces of markers (k, 3) that move rigidly, where nodes and bodies push with ``force`` (N, m)."""
        n, alone = self.immersed.shells.nodes, self._apart(None)

        def answer(push: np.ndarray, coming: np.ndarray) -> _Answer:
            out = _Answer(np.zeros_like(self._found), np.zeros_like(self._found), [])
            for one in alone:
                at, felt = n + one.part.markers, push[one.part.nodes, : self._c]
                rigid = one.rigid.drifting(coming[at, :3].ravel())
                rates = rigid.rates(one.part.shells.of_rows(push[one.part.rows]), felt.ravel())
                out.pushes[one.part.nodes] = felt
                out.moves[at, :3] = (one.levers @ rates).reshape(-1, 3)
                out.pushes[at, :3] = rigid.pushes(rates, felt.ravel()).reshape(-1, 3)
            return out

        base, nothing = self._base[:, : self._c], np.zeros_like(force)
        found = self._sought(
            lambda g: answer(force, base + g),
            lambda g: answer(nothing, g),
            base,
            lambda got: TIGHT * float(np.abs(got.moves).max(initial=0.0)),
            markers_alone=True,
        )
        return found.pushes[n:, :3]

    # --- swimmers by themselves ---------------------------------------------------------------------------------------

    def _apart(self, stiffness: Stiffness | None) -> list[_Alone]:
        """The swimmers by themselves; those between which forces act count as one."""
        wanted = [one.swimmer for one in self._swimmers] or list(self._means.swimmers)
        if stiffness is not None and stiffness.coupled:
            wanted = _merged(wanted, stiffness)
        if len(wanted) != len(self._swimmers):
            self._swimmers = [self._alone(swimmer) for swimmer in wanted]
        return self._swimmers

    def _alone(self, swimmer: Swimmer) -> _Alone:
        immersed, c = self.immersed, self._c
        part = Part(swimmer, immersed.shells, len(self._e3))
        matrix = self._means.matrix(self.nodes[part.points], immersed.own[part.points])
        levers = part.shells.levers(self._e3[part.rows], len(part.q))
        rigid = Rigid(matrix, c * len(part.nodes), c, levers, None)
        spin = None if immersed.spin_drag is None else immersed.spin_drag[part.nodes]
        return _Alone(swimmer, part, rigid, WithShells(rigid, part.shells, None, spin, self.tau), levers)

    def _answer(self, alone: list[_Alone], asked: list[Statement], coming: np.ndarray) -> _Answer:
        """The answer of each swimmer to what comes from elsewhere."""
        c, out = self._c, _Answer(np.zeros_like(self._found), np.zeros_like(self._found), [])
        for one, statement in zip(alone, asked, strict=True):
            part, response = one.part, one.response
            solution = response.implicit(*statement, coming=coming[part.points])
            nodes, markers = len(part.nodes), self.immersed.shells.nodes + part.markers
            moved = statement.y + solution.move - statement.target
            out.moves[part.nodes] = moved[:nodes, :c]
            out.moves[markers, :3] = (one.levers @ part.shells.of_rows(moved)).reshape(-1, 3)
            out.pushes[part.nodes] = solution.force[:nodes, :c]
            out.pushes[markers, :3] = response.marker_forces()
            out.parts.append(solution)
        return out

    # --- what comes from elsewhere ------------------------------------------------------------------------------------

    def _sought(
        self,
        answer: Callable[[np.ndarray], _Answer],
        linear: Callable[[np.ndarray], _Answer],
        base: np.ndarray,
        allowed: Callable[[_Answer], float],
        markers_alone: bool = False,
    ) -> _Answer:
        """The answer to what comes from elsewhere, to an error of motions that is ``allowed``; ``linear`` its change.

        Raises numpy.linalg.LinAlgError where none is found.
        """
        units, first = self._units, self.immersed.shells.nodes if markers_alone else 0

        def short(got: _Answer, base: np.ndarray | float) -> np.ndarray:
            """How far motions by M are from those that were taken, of all that have some."""
            out = (base + self.tau * self.apply(got.pushes).reshape(units.shape) - got.moves) / units
            out[self.immersed.shells.nodes :, 3:] = 0.0  # markers do not spin
            out[:first] = 0.0
            return out.ravel()

        got = answer(self._found)
        left = short(got, base)
        all_of_it = float(np.abs(got.moves).max(initial=0.0))
        enough = max(allowed(got), _FLOOR * all_of_it)
        if np.abs(left).max(initial=0.0) <= enough:
            return got

        def product(z: np.ndarray) -> np.ndarray:
            return -short(linear(units * z.reshape(units.shape)), 0.0)

        operator = LinearOperator((left.size, left.size), matvec=product, dtype=float)
        z, failed = gmres(
            operator, left, rtol=0.0, atol=enough * np.sqrt(left.size), restart=CYCLE, maxiter=MOST // CYCLE
        )
        if failed and not np.linalg.norm(left - product(z)) <= _WORST * all_of_it:
            raise np.linalg.LinAlgError(f"GMRES found no motions in {MOST} products with the FFT operator")
        self._found = self._found + units * z.reshape(units.shape)
        return answer(self._found)


def _merged(swimmers: list[Swimmer], stiffness: Stiffness) -> list[Swimmer]:
    """The swimmers, those that pairs of a stiffness couple as one."""
    of = np.zeros(len(stiffness.band), np.int64)
    for k, swimmer in enumerate(swimmers):
        for rod in swimmer.rods:
            of[rod] = k
    both = np.unique(np.stack([of[stiffness.pairs.rows], of[stiffness.pairs.columns]], axis=1), axis=0)
    group = np.arange(len(swimmers))
    for i, j in both:
        group[group == group[j]] = group[i]
    out: dict[int, Swimmer] = {}
    for number, swimmer in zip(group, swimmers, strict=True):
        out[int(number)] = out[int(number)] | swimmer if int(number) in out else swimmer
    return list(out.values())
