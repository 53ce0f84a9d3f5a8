"""The common part of immersed-boundary fluids: the implicit statement on a grid's mobility, whatever evaluates it.

    u = u0 + (J L^-1 S + s) F          (Eq. 45 of the paper, with +f)

S spreads nodal forces with a discrete delta kernel, L^-1 is the fluid's solve, J interpolates back (S transposed, times
the cell's volume), s is the slip mobility that keeps nearly inextensible rods from locking when their nodes are closer
than the grid (fluids/README.md). A coupling says what of a node goes through the fluid: forces and velocities
(mobility_table.py), or torques and spins with them (torque_coupling.py). Reactions of supports are spread like any
force.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..grid.kernels import Kernel
from ..grid.spreading import Stencil
from ..linalg.constraints import Prescribed
from ..linalg.normal_numbers import Draw
from ..linalg.stiffness import Stiffness
from .base import Flow, Solution
from .condensation import Condensation, Group, Newton, NothingCondensed, Reduced, TwistCondensed
from .coupling import TRANSLATION, Coupling, Nodes
from .roots import Root
from .spaces.base import Mobility, Space
from .velocity_gradient import advected


@dataclass(frozen=True)
class Immersed:
    """The ingredients of an immersed-boundary fluid: space, kernel, eta, slip (n,), drag against spin (n,), flow.

    The drag against spin is None where nothing twists, or where twist torques go through the grid. ``twists`` (n,) is
    one where a background flow turns nodes against that drag, zero at those of rods that do not twist. ``groups`` are
    the node ranges of filaments, linked ones together: a node feels little of others. ``number`` is the type of the
    mobility table's numbers and of the fields of a fluid with inertia, double or single precision (relative error about
    1e-7).
    """

    space: Space
    kernel: Kernel
    viscosity: float
    slip: np.ndarray
    spin_drag: np.ndarray | None
    flow: Flow | None = None
    twists: np.ndarray | None = None
    groups: tuple[Group, ...] = ()
    number: type = np.float64
    coupling: Coupling = TRANSLATION

    @cached_property
    def condensation(self) -> Condensation:
        """Which unknowns go through the grid, and what the others do."""
        return NothingCondensed() if self.spin_drag is None else TwistCondensed(self.spin_drag)

    @cached_property
    def own(self) -> np.ndarray:
        """The self-mobility (n, c) of each node beyond the grid's response."""
        return self.coupling.own(self.slip)

    @cached_property
    def units(self) -> np.ndarray | None:
        """The units (c n,) of motions: a turn counts as what it moves at a cell's distance; None: all are moves."""
        own = np.ones_like(self.own)
        own[:, 3:] = 1.0 / self.space.spacing
        return own.ravel() if own.shape[1] > 3 else None

    def stencil(self, r: np.ndarray) -> Stencil:
        """First grid index (n, 3) and weights (n, 3, P) of the nodes r (n, 3)."""
        return self.space.stencil(self.kernel, r)

    def nodes(self, r: np.ndarray, e3: np.ndarray) -> Nodes:
        """The nodes r (n, 3) with tangents e3 (n, 3) on the grid."""
        return Nodes(*self.stencil(r), self.coupling.axes(e3))

    def pushed(self, r: np.ndarray, e3: np.ndarray, force: np.ndarray, time: float) -> tuple[Nodes, np.ndarray]:
        """All nodes that push the fluid, and what each does to it, (n, m), from places, tangents and ``force``."""
        return self.nodes(r, e3), force

    def advected(self, nodes: Nodes, r: np.ndarray, time: float) -> np.ndarray | None:
        """The motions (n, m) with which the background flow carries nodes at r (n, 3); None where there is none."""
        if self.flow is None:
            return None
        if self.spin_drag is None or self.twists is None:
            return self.coupling.advected(self.flow, r, nodes.axes, time, self.space.spacing)
        return advected(self.flow, r, self.twists[:, None] * nodes.axes, time, self.space.spacing)

    def carried(self, r: np.ndarray, e3: np.ndarray, time: float) -> np.ndarray | None:
        """The motions (n, c) or (n, m) with which the background flow carries all that pushes the fluid."""
        return self.advected(self.nodes(r, e3), r, time)

    def mobility(self, alpha: float = 0.0) -> Mobility:
        """The exact mobility of nodes, without their own; alpha is density over time, zero in Stokes flow."""
        return self.space.mobility(self.coupling, self.kernel.points, self.viscosity, alpha, self.number)


def slip_mobility(fraction: float, kernel: Kernel, h: float, viscosity: float, volume: np.ndarray) -> np.ndarray:
    """s = eps (h / 2 Lc)/(6 pi eta a), a the kernel's point radius, Lc (n,) the nodes' control volumes.

    The same slip per length of rod everywhere: an end's node, of half a volume, slips by twice as much under a force.
    With the spacing in place of Lc the ends would be off, and the whole only of first order in the spacing.
    """
    return fraction * (h / (2 * volume)) / (6 * np.pi * viscosity * kernel.point_radius * h)


class ImmersedResponse(ABC):
    """Positions frozen over a step of effective length tau. Subclasses evaluate the mobility.

    c numbers of a node go through the grid.
    """

    keeps = False

    def __init__(self, immersed: Immersed, nodes: Nodes, flow: np.ndarray | None, tau: float) -> None:
        """``flow`` (n, c) or (n, m) are the motions that nodes have without any force, None where they have none."""
        self.immersed, self.nodes, self.flow, self.tau = immersed, nodes, flow, tau
        self.components = immersed.coupling.components

    @abstractmethod
    def apply(self, force: np.ndarray) -> np.ndarray:
        """Velocities (c n,) of forces (c n,), without the background flow."""

    @abstractmethod
    def columns(self, index: np.ndarray) -> np.ndarray:
        """Columns (c n, k) of the mobility at flat indices (k,)."""

    @property
    @abstractmethod
    def root(self) -> Root:
        """The root of the mobility."""

    @abstractmethod
    def solve(self, statement: Reduced, right: np.ndarray, error: float) -> np.ndarray:
        """x (c n,) with (1 - tau M K) x = right; at held unknowns columns of -tau M: forces are sought.

        ``error``: the relative error of x that serves, zero where ``keeps`` says that factors of this system are made.
        """

    def _carried(self, target: np.ndarray) -> np.ndarray:
        """The displacements (n, m) without any force: target + tau u0."""
        if self.flow is None:
            return target
        out = target.copy()
        out[:, : self.flow.shape[1]] += self.tau * self.flow
        return out

    def forced(self, force: np.ndarray, held: Prescribed, target: np.ndarray) -> Solution:
        """y = target + tau (u0 + M (force + R)), R such that held unknowns move as prescribed."""
        condensation, (n, m), c = self.immersed.condensation, force.shape, self.components
        reaction, base = np.zeros((n, m)), self._carried(target)
        move = base[:, :c].ravel() + self.tau * self.apply(np.ascontiguousarray(force[:, :c]).ravel())
        here, index = condensation.held_in_fluid(held, m)
        if index.size:
            columns = self.columns(index)
            push = np.linalg.solve(self.tau * columns[index], held.value[here] - move[index])
            move = move + self.tau * columns @ push
            reaction[index // c, index % c] = push
        y = np.zeros((n, m))
        y[:, :c] = move.reshape(n, c)
        condensation.move_rest(y, force, base, self.tau)
        y.ravel()[held.at] = held.value
        reaction += condensation.react_rest(y, base, force, held, self.tau)
        return Solution(y, force + reaction, reaction)

    def implicit(
        self,
        force: np.ndarray,
        stiffness: Stiffness,
        held: Prescribed,
        y: np.ndarray,
        target: np.ndarray,
        error: float = 0.0,
    ) -> Solution:
        """One Newton correction: y + d = target + tau (u0 + M (force + K d + R))."""
        condensation, c, base = self.immersed.condensation, self.components, self._carried(target)
        statement = condensation.reduced(Newton(force, stiffness, held, y, base, self.tau))
        index, push, x = statement.index, statement.force, (base - y)[:, :c].ravel()
        if index.size:
            known = np.zeros(push.size)
            known[index] = statement.value
            push, x = push + statement.times(known), x - known
        # Reactions are sought whole, so that an error relative to x would be one of what they carry, not of the move.
        error = 0.0 if self.keeps or index.size else error
        x = self.solve(statement, x + self.tau * self.apply(push), error)
        reaction = np.zeros(force.shape)
        if index.size:
            reaction[index // c, index % c] = x[index]
            x = x.copy()
            x[index] = statement.value
        move = statement.whole(x)
        felt = force + stiffness.times(move)
        reaction += condensation.react_rest(y + move, base, felt, held, self.tau)
        return Solution(move, felt + reaction, reaction, error)

    def fluctuation(self, draw: Draw, shape: tuple[int, int]) -> np.ndarray:
        """A random motion of mean zero and covariance M (base.py). Raises NoRoot."""
        motion = np.zeros(shape)
        motion[:, : self.components] = self.root.motion(self.nodes, draw)
        self.immersed.condensation.fluctuate_rest(motion, draw)
        return motion
