"""The immersed-boundary Stokes fluid, by three ways to the same velocity, equal to round-off.

table    the exact mobility matrix, solved densely: cost free of the grid's size, for some hundreds of nodes
fft      the grid itself, implicit steps by GMRES preconditioned by the exact matrix of all nodes: the reference
pruned   the same with transforms of the filaments' bounding box only
krylov   either FFT, for many nodes: the preconditioner is the exact matrix rod by rod, kept over several steps

An implicit step goes down through four files: the response here, its preconditioner, GMRES, and the product with the
FFT operator.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property
from typing import Protocol

import numpy as np

from ..grid.fft import MEASURED, VectorTransform
from ..grid.periodic_grid import Grid
from ..grid.spectral import project
from ..grid.spreading import interpolate, spread
from ..linalg import gmres
from ..linalg.stiffness import Stiffness
from .base import Memoryless
from .condensation import Reduced
from .coupling import Nodes
from .immersed_boundary import Immersed, ImmersedResponse
from .preconditioner import Asked, Matrix, Preconditioner, RodByRod, WholeMatrix
from .roots import DenseRoot, Root
from .spaces.base import velocity_of


class Solver(Protocol):
    """A map by FFTs, whole or pruned, from the vectors that nodes put on the grid to those they take off it."""

    def velocity(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocities (n, 3 v) that forces (n, 3 v) with stencils (base, weights) drive at their own nodes.

        v = 2: torques after the forces, and half the vorticities after the velocities.
        """


class StokesSolve:
    """Velocities by FFT: spread, transform, project, transform back, interpolate.

    ``alpha`` is density over time, zero in Stokes flow; a ``transform`` at hand is used, and what it held is lost.
    """

    def __init__(
        self,
        grid: Grid,
        viscosity: float,
        threads: int = 1,
        planning: str = MEASURED,
        alpha: float = 0.0,
        transform: VectorTransform | None = None,
    ) -> None:
        self.grid, self.viscosity, self.alpha = grid, viscosity, alpha
        nx, ny, nz = (int(n) for n in grid.cells)
        self.transform = transform or VectorTransform((nx, ny, nz), threads, planning)
        self._reals = self.transform.modes.view(float)[:3]
        (kx, ky, kz), (sx, sy, sz) = grid.wave_numbers()
        self._waves = (kx, ky, np.repeat(kz, 2), sx, sy, np.repeat(sz, 2))
        self._scale = 1.0 / (self.transform.size * grid.spacing**3)

    def field(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocity (3, nx, ny, nz) that nodal forces (n, 3) drive; overwritten by the next call."""
        t = self.transform
        t.real[:3] = 0.0
        spread(base, weights, force, t.real)
        t.forward()
        project(self._reals, *self._waves, self.alpha, self.viscosity, self._scale)
        return t.backward()

    def velocity(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocity (n, 3) at the nodes."""
        return interpolate(base, weights, self.field(base, weights, force))


class DenseResponse(ImmersedResponse):
    """The dense mobility matrix (c n, c n); keeps the factors of the last system."""

    keeps = True

    def __init__(
        self, immersed: Immersed, nodes: Nodes, flow: np.ndarray | None, tau: float, matrix: np.ndarray
    ) -> None:
        super().__init__(immersed, nodes, flow, tau)
        self.matrix = matrix
        self._factors: tuple[Stiffness, gmres.Factors] | None = None  # and the stiffness they are of

    def apply(self, force: np.ndarray) -> np.ndarray:
        """By the matrix."""
        return self.matrix @ force

    def columns(self, index: np.ndarray) -> np.ndarray:
        """Of the matrix."""
        return self.matrix[:, index]

    @cached_property
    def root(self) -> DenseRoot:
        """Its Cholesky factor."""
        return DenseRoot(self.matrix)

    def solve(self, statement: Reduced, right: np.ndarray, error: float) -> np.ndarray:
        """By LU factors, those of before where the stiffness is the same."""
        rods = statement.frozen()
        if self._factors is None or self._factors[0] is not rods.stiffness:
            system = rods.system((slice(0, len(self.nodes.axes)),), self.matrix, self.tau)
            self._factors = rods.stiffness, gmres.factor(system, self.immersed.units)
        return self._factors[1].solve(right)


class Tabulated(Memoryless, ABC):
    """A Stokes fluid that has the grid's response to a point force at hand.

    With an ``alpha``, density over time, it is the part of an unsteady one that answers to forces (navier_stokes.py).
    """

    def __init__(self, immersed: Immersed, alpha: float = 0.0) -> None:
        self.immersed = immersed
        self._mobility = immersed.mobility(alpha)

    def velocity_at(
        self, points: np.ndarray, r: np.ndarray, e3: np.ndarray, force: np.ndarray, time: float
    ) -> np.ndarray:
        """The velocity (k, 3) at ``points`` (k, 3), as a node there would feel it, of forces (n, m) at r (n, 3)."""
        immersed, coupling = self.immersed, self.immersed.coupling
        places, nodes = immersed.stencil(points), immersed.nodes(r, e3)
        u = velocity_of(self._mobility, coupling, places, nodes, force[:, : coupling.components])
        return u if immersed.flow is None else u + immersed.flow(points, time)

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> ImmersedResponse:
        """The mobility of nodes r (n, 3) with tangents e3 (n, 3), in the background flow of ``time``."""
        nodes = self.immersed.nodes(r, e3)
        return self.respond(nodes, self.immersed.advected(nodes, r, time), tau)

    @abstractmethod
    def respond(self, nodes: Nodes, flow: np.ndarray | None, tau: float) -> ImmersedResponse:
        """The mobility of nodes that ``flow`` (n, c) or (n, m) carries along, None where nothing does."""

    def matrix(self, nodes: Nodes, own: np.ndarray) -> np.ndarray:
        """The exact mobility (c n, c n) of nodes, with ``own`` (n, c) on its diagonal."""
        return self._mobility.matrix(nodes, own)

    def block(self, nodes: Nodes, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """The exact mobility (c k, c l) between nodes ``rows`` (k,) and ``columns`` (l,)."""
        return self._mobility.block(nodes, self.immersed.own, rows, columns)


class StokesByTable(Tabulated):
    """IB Stokes by the exact mobility table: a small dense solve with the true operator."""

    def respond(self, nodes: Nodes, flow: np.ndarray | None, tau: float) -> DenseResponse:
        """The whole matrix."""
        return DenseResponse(self.immersed, nodes, flow, tau, self.matrix(nodes, self.immersed.own))


Block = Callable[[Nodes, np.ndarray, np.ndarray], np.ndarray]  # of nodes, rows (k,), columns (l,)


class _Fourier(ImmersedResponse):
    """FFT velocities; implicit steps by GMRES on them, with a preconditioner."""

    def __init__(
        self,
        immersed: Immersed,
        nodes: Nodes,
        flow: np.ndarray | None,
        tau: float,
        solver: Solver,
        block: Block,
        preconditioner: Preconditioner,
        root: Callable[[], Root],
    ) -> None:
        super().__init__(immersed, nodes, flow, tau)
        self._solver, self._block, self._preconditioner, self._make_root = solver, block, preconditioner, root
        self.keeps = preconditioner.keeps

    def apply(self, force: np.ndarray) -> np.ndarray:
        f, nodes, coupling = force.reshape(-1, self.components), self.nodes, self.immersed.coupling
        moved = self._solver.velocity(nodes.base, nodes.weights, coupling.to_grid(nodes.axes, f))
        return (coupling.from_grid(nodes.axes, moved) + self.immersed.own * f).ravel()

    def columns(self, index: np.ndarray) -> np.ndarray:
        nodes, components = index // self.components, index % self.components
        held = np.unique(nodes)
        block = self._block(self.nodes, np.arange(len(self.nodes.axes)), held)
        return block[:, self.components * np.searchsorted(held, nodes) + components]

    @cached_property
    def root(self) -> Root:
        return self._make_root()

    def solve(self, statement: Reduced, right: np.ndarray, error: float) -> np.ndarray:
        free, index = statement.free, statement.index

        def product(x: np.ndarray) -> np.ndarray:
            force = statement.times(free * x)
            force[index] += x[index]
            return free * x - self.tau * self.apply(force)

        return self._preconditioner.solve(Asked(self.nodes, self.tau, statement, product, error), right)


class StokesByFFT(Tabulated):
    """IB Stokes by FFT; GMRES is preconditioned by the exact matrix of all nodes and so needs an iteration or two."""

    def __init__(self, immersed: Immersed, solver: Solver, alpha: float = 0.0) -> None:
        super().__init__(immersed, alpha)
        self.solver = solver

    def respond(self, nodes: Nodes, flow: np.ndarray | None, tau: float) -> _Fourier:
        """The FFT operator between nodes."""
        whole = WholeMatrix(self._exact(), nodes)
        return self._by(nodes, flow, tau, whole, lambda: DenseRoot(whole.mobility))

    def _by(
        self,
        nodes: Nodes,
        flow: np.ndarray | None,
        tau: float,
        preconditioner: Preconditioner,
        root: Callable[[], Root],
    ) -> _Fourier:
        """The FFT operator between nodes, with a preconditioner, and with a root that is made when it is asked for."""
        return _Fourier(self.immersed, nodes, flow, tau, self.solver, self.block, preconditioner, root)

    def _exact(self) -> Matrix:
        """The exact matrices of nodes."""
        return Matrix(self.matrix, self.immersed.own, self.immersed.coupling.components, self.immersed.units)


class StokesByKrylov(StokesByFFT):
    """IB Stokes for many nodes: GMRES on the FFT operator, preconditioned rod by rod, factors kept while they serve.

    ``cost`` is what making them costs, in products; ``root`` makes the root of the mobility, for thermal forces.
    """

    def __init__(
        self,
        immersed: Immersed,
        solver: Solver,
        cost: float,
        alpha: float = 0.0,
        root: Callable[[], Root] | None = None,
    ) -> None:
        super().__init__(immersed, solver, alpha)
        self.kept = RodByRod(self._exact(), immersed.groups, cost, couples_torque=immersed.coupling.grid_vectors > 1)
        self._make_root = root

    @cached_property
    def _root(self) -> Root:
        assert self._make_root is not None
        return self._make_root()

    def respond(self, nodes: Nodes, flow: np.ndarray | None, tau: float) -> _Fourier:
        """The FFT operator between nodes."""
        self.kept.begin()
        return self._by(nodes, flow, tau, self.kept, lambda: self._root)

    def memory(self) -> dict[str, np.ndarray | float]:
        """The source of the kept factors; empty before there are any."""
        return self.kept.memory()

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Makes the factors of ``memory`` again."""
        self.kept.recall(memory)
