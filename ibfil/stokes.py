"""The immersed-boundary Stokes fluid, by four ways to the same velocity, equal to round-off.

table    the exact mobility matrix, solved densely: cost free of the grid's size, for some hundreds of nodes
fft      the grid itself, implicit steps by GMRES preconditioned by the exact matrix of all nodes: the reference
pruned   the same with transforms of the filaments' bounding box only
averaged an approximation of the table, on request only
krylov   either FFT, for many nodes: the preconditioner is the exact matrix rod by rod, kept over several steps
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from . import krylov, mobility, mobility_averaged
from .condensation import Reduced, RodStiffness
from .fluid import Memoryless
from .grid import Grid, interpolate, project, spread
from .immersed_boundary import Immersed, ImmersedResponse, Nodes
from .transforms import VectorTransform

_EXACT = 1e-8  # relative error of GMRES where its preconditioner is the operator itself
_LOOSE = 1e-6  # and where it is not: less than Newton gains in an iteration by the time it stops
_STIRRED = 0.01  # of that with torques: those that hold a turn, and turns in radians, outweigh moves by so much
_MOST = 5 * 60  # products of a solve, before it is given up


class Solver(Protocol):
    """What turns the vectors that nodes put on the grid into those they take off it, by FFT: whole, or pruned."""

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
        planning: str = "FFTW_MEASURE",
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


class _Dense(ImmersedResponse):
    """A dense mobility matrix (c n, c n), exact or averaged; keeps the factors of the last system."""

    keeps = True

    def __init__(
        self,
        fluid: Immersed,
        matrix: Callable[[Nodes], np.ndarray],
        r: np.ndarray,
        e3: np.ndarray,
        time: float,
        tau: float,
    ) -> None:
        super().__init__(fluid, r, e3, time, tau)
        self.matrix = matrix(self.nodes)
        self._factors: tuple[np.ndarray, krylov.Factors] | None = None  # and the stiffness they are of

    def apply(self, force: np.ndarray) -> np.ndarray:
        return self.matrix @ force

    def columns(self, index: np.ndarray) -> np.ndarray:
        return self.matrix[:, index]

    def solve(self, statement: Reduced, right: np.ndarray) -> np.ndarray:
        rods = statement.frozen()
        if self._factors is None or self._factors[0] is not rods.band:
            system = rods.system(slice(0, len(self.nodes.axes)), self.matrix, self.tau)
            self._factors = rods.band, krylov.factor(system)
        return self._factors[1].solve(right)


class Tabulated(Memoryless, ABC):
    """A Stokes fluid that has the grid's response to a point force at hand.

    With an ``alpha``, density over time, it is the part of an unsteady one that answers to forces (navier_stokes.py).
    """

    def __init__(self, fluid: Immersed, alpha: float = 0.0) -> None:
        self.fluid = fluid
        response = fluid.coupling.response(fluid.grid, fluid.viscosity, alpha)
        self._table: np.ndarray = mobility.octant(response, fluid.kernel.points).astype(fluid.number)

    def velocity_at(
        self, points: np.ndarray, r: np.ndarray, e3: np.ndarray, force: np.ndarray, time: float
    ) -> np.ndarray:
        """The velocity (k, 3) at ``points`` (k, 3), as a node there would feel it, of forces (n, m) at r (n, 3)."""
        fluid, k, n, c = self.fluid, len(points), len(r), self.fluid.coupling.parts
        axes = np.concatenate([np.zeros_like(points), fluid.coupling.axes(e3)])
        nodes = Nodes(*fluid.stencil(np.concatenate([points, r])), axes)
        rows, columns = np.arange(k), np.arange(k, k + n)
        block = fluid.coupling.block(self._table, fluid.grid.cells, nodes, np.zeros((k + n, c)), rows, columns)
        u = (block @ force[:, :c].ravel()).reshape(k, c)[:, :3]
        return u if fluid.flow is None else u + fluid.flow(points, time)

    @abstractmethod
    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> ImmersedResponse:
        """The mobility of nodes r (n, 3) with tangents e3 (n, 3)."""

    def matrix(self, nodes: Nodes, own: np.ndarray) -> np.ndarray:
        """The exact mobility (c n, c n) of nodes, with ``own`` (n, c) on its diagonal."""
        return self.fluid.coupling.matrix(self._table, self.fluid.grid.cells, nodes, own)


class StokesByTable(Tabulated):
    """IB Stokes by the exact mobility table: a small dense solve with the true operator."""

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> _Dense:
        """The mobility of nodes r (n, 3) with tangents e3 (n, 3)."""
        return _Dense(self.fluid, lambda nodes: self.matrix(nodes, self.fluid.own), r, e3, time, tau)


class StokesByAverage(Tabulated):
    """The approximation of mobility_averaged.py: cheaper by the kernel's size, blind to where nodes lie in a cell."""

    def __init__(self, fluid: Immersed) -> None:
        super().__init__(fluid)
        self._averaged = mobility_averaged.table(mobility.point_response(fluid.grid, fluid.viscosity), fluid.kernel)

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> _Dense:
        """The averaged mobility of nodes r (n, 3)."""
        fluid, n = self.fluid, len(r)
        matrix = mobility_averaged.mobility(self._averaged, fluid.grid.cells, fluid.grid.coordinates(r), fluid.slip)
        return _Dense(fluid, lambda nodes: matrix.reshape(3 * n, 3 * n), r, e3, time, tau)


class _Fourier(ImmersedResponse):
    """FFT velocities; implicit steps by GMRES on them."""

    def __init__(self, owner: StokesByFFT, r: np.ndarray, e3: np.ndarray, time: float, tau: float) -> None:
        super().__init__(owner.fluid, r, e3, time, tau)
        self.owner, self.solves, self.keeps = owner, 0, owner.keeps
        self.blocks: tuple[np.ndarray, krylov.Blocks] | None = None  # and the stiffness they are of

    def apply(self, force: np.ndarray) -> np.ndarray:
        f, nodes, coupling = force.reshape(-1, self.parts), self.nodes, self.fluid.coupling
        moved = self.owner.solver.velocity(nodes.base, nodes.weights, coupling.lift(nodes.axes, f))
        return (coupling.drop(nodes.axes, moved) + self.fluid.own * f).ravel()

    def columns(self, index: np.ndarray) -> np.ndarray:
        nodes, parts = index // self.parts, index % self.parts
        block = self.owner.block(self.nodes, np.arange(len(self.nodes.axes)), np.unique(nodes))
        return block[:, self.parts * np.searchsorted(np.unique(nodes), nodes) + parts]

    def solve(self, statement: Reduced, right: np.ndarray) -> np.ndarray:
        free, index = statement.free, statement.index

        def product(x: np.ndarray) -> np.ndarray:
            force = statement.times(free * x)
            force[index] += x[index]
            return free * x - self.tau * self.apply(force)

        return self.owner.solve(self, statement, product, right)


class StokesByFFT(Tabulated):
    """IB Stokes by FFT; GMRES is preconditioned by the exact matrix of all nodes and so needs an iteration or two."""

    keeps = True

    def __init__(self, fluid: Immersed, solver: Solver, alpha: float = 0.0) -> None:
        super().__init__(fluid, alpha)
        self.solver = solver

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> _Fourier:
        """The FFT operator between nodes r (n, 3) with tangents e3 (n, 3)."""
        return _Fourier(self, r, e3, time, tau)

    def block(self, nodes: Nodes, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """The exact mobility (c k, c l) between nodes ``rows`` (k,) and ``columns`` (l,)."""
        fluid = self.fluid
        return fluid.coupling.block(self._table, fluid.grid.cells, nodes, fluid.own, rows, columns)

    def solve(self, response: _Fourier, statement: Reduced, product: krylov.Product, right: np.ndarray) -> np.ndarray:
        """x with product(x) = right, preconditioned by the exact matrix of all nodes."""
        nodes, rods = response.nodes, statement.frozen()
        if response.blocks is None or response.blocks[0] is not rods.band:
            response.blocks = rods.band, self._factored(nodes, response.tau, rods, (slice(0, len(nodes.axes)),))
        return _checked(krylov.solve(product, right, response.blocks[1], _EXACT, _MOST))

    def _factored(self, nodes: Nodes, tau: float, rods: RodStiffness, ranges: tuple[slice, ...]) -> krylov.Blocks:
        parts, c = [], self.fluid.coupling.parts
        for rod in ranges:
            matrix = self.matrix(nodes[rod], self.fluid.own[rod])
            parts.append((slice(c * rod.start, c * rod.stop), rods.system(rod, matrix, tau)))
        return krylov.factored(parts, rods.held)


def _checked(solution: krylov.Solution) -> np.ndarray:
    if not solution.found:
        raise np.linalg.LinAlgError(f"GMRES found no solution in {solution.products} products with the FFT operator")
    return solution.x


class _Source(NamedTuple):
    """What a kept preconditioner was made from."""

    nodes: Nodes
    tau: float
    rods: RodStiffness


class StokesByKrylov(StokesByFFT):
    """IB Stokes for many nodes: GMRES on the FFT operator, preconditioned rod by rod, factors kept while they serve.

    ``cost`` is what making them costs, in products. What they were made from is part of a run's state, so that a
    resumed run has the same ones.
    """

    keeps = False

    def __init__(self, fluid: Immersed, solver: Solver, cost: float, alpha: float = 0.0) -> None:
        super().__init__(fluid, solver, alpha)
        self._kept = krylov.KeptFactors(cost)
        self._loose = _LOOSE if fluid.coupling.vectors == 1 else _STIRRED * _LOOSE
        self._source: _Source | None = None

    def solve(self, response: _Fourier, statement: Reduced, product: krylov.Product, right: np.ndarray) -> np.ndarray:
        """x with product(x) = right, by the factors kept, and where these do not serve by new ones."""
        kept = self._kept
        response.solves += 1
        fresh = not kept.fits(response.tau) or (response.solves == 2 and kept.end_round())
        while True:
            if fresh:
                self._make(_Source(response.nodes, response.tau, statement.frozen()))
            assert kept.blocks is not None
            found = krylov.solve(product, right, kept.blocks, self._loose, _MOST if fresh else kept.patience)
            kept.took(found)
            if found.found or fresh:
                return _checked(found)
            fresh = True

    def _make(self, source: _Source) -> None:
        self._source = source
        self._kept.blocks = None  # two of them at a time would be the most of a run's memory
        self._kept.renew(self._factored(source.nodes, source.tau, source.rods, self.fluid.rods), source.tau)

    def memory(self) -> dict[str, np.ndarray | float]:
        """What the kept factors were made from; empty before there are any."""
        if self._source is None:
            return {}
        rods = {name: value for name, value in self._source.rods._asdict().items() if value is not None}
        return {**rods, **vars(self._source.nodes), **self._kept.memory()}

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Makes the factors of ``memory`` again."""
        arrays = {k: np.asarray(v) for k, v in memory.items()}
        rods = RodStiffness(arrays["band"], arrays["held"].astype(np.int64), arrays.get("turns"), arrays.get("still"))
        nodes = Nodes(arrays["base"].astype(np.int64), arrays["weights"], arrays["axes"])
        self._make(_Source(nodes, float(arrays["tau"]), rods))
        self._kept.recall({k: float(v) for k, v in memory.items() if not isinstance(v, np.ndarray)})
