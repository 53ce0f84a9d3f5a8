"""The immersed-boundary Stokes fluid, by four ways to the same velocity, equal to round-off.

table    the exact mobility matrix, solved densely: cost free of the grid's size, for some hundreds of nodes
fft      the grid itself, implicit steps by GMRES preconditioned by the exact matrix of all nodes: the reference
pruned   the same with transforms of the filaments' bounding box only
averaged an approximation of the table, on request only
krylov   either FFT, for many nodes: the preconditioner is the exact matrix rod by rod, kept over several steps
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse.linalg import LinearOperator, gmres

from . import averaged, mobility
from .fluid import Memoryless
from .grid import Grid, interpolate, project, spread
from .immersed import Immersed, ImmersedResponse, Nodes
from .transforms import VectorTransform
from .turns import Reduced, RodStiffness

_EXACT = 1e-11  # relative residual of GMRES where its preconditioner is the operator itself
_LOOSE = 1e-6  # and where it is not: less than Newton gains in an iteration by the time it stops
_PATIENCE = 1.5  # times the products of its first solve, and a few, that a kept preconditioner may cost


class Solver(Protocol):
    """What turns the vectors that nodes put on the grid into those they take off it, by FFT: whole, or pruned."""

    def velocity(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocities (n, 3 v) that forces (n, 3 v) with stencils (base, weights) drive at their own nodes.

        v = 2: torques after the forces, and half the vorticities after the velocities.
        """


class StokesSolve:
    """Velocities by FFT: spread, transform, project, transform back, interpolate."""

    def __init__(self, grid: Grid, viscosity: float, threads: int = 1) -> None:
        self.grid, self.viscosity = grid, viscosity
        nx, ny, nz = (int(n) for n in grid.cells)
        self.transform = VectorTransform((nx, ny, nz), threads)
        self._reals = self.transform.modes.view(float)
        (kx, ky, kz), (sx, sy, sz) = grid.wave_numbers()
        self._waves = (kx, ky, np.repeat(kz, 2), sx, sy, np.repeat(sz, 2))
        self._scale = 1.0 / (self.transform.size * grid.spacing**3)

    def field(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocity (3, nx, ny, nz) that nodal forces (n, 3) drive; overwritten by the next call."""
        t = self.transform
        t.real[:] = 0.0
        spread(base, weights, force, t.real)
        t.forward()
        project(self._reals, *self._waves, 0.0, self.viscosity, self._scale)
        return t.backward()

    def velocity(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocity (n, 3) at the nodes."""
        return interpolate(base, weights, self.field(base, weights, force))


def dense_system(matrix: np.ndarray, stiffness: np.ndarray, tau: float, index: np.ndarray) -> np.ndarray:
    """1 - tau M K with the columns of held unknowns replaced by those of -tau M."""
    system = matrix @ stiffness
    system *= -tau
    system.ravel()[:: len(system) + 1] += 1.0
    system[:, index] = -tau * matrix[:, index]
    return system


class _Dense(ImmersedResponse):
    """A dense mobility matrix (c n, c n), exact or averaged."""

    def __init__(
        self, fluid: Immersed, matrix: np.ndarray, r: np.ndarray, e3: np.ndarray, time: float, tau: float
    ) -> None:
        super().__init__(fluid, r, e3, time, tau)
        self.matrix = matrix

    def apply(self, force: np.ndarray) -> np.ndarray:
        return self.matrix @ force

    def columns(self, index: np.ndarray) -> np.ndarray:
        return self.matrix[:, index]

    def solve(self, statement: Reduced, right: np.ndarray) -> np.ndarray:
        stiffness = statement.frozen().matrix(slice(0, len(self.nodes.axes)))
        return np.linalg.solve(dense_system(self.matrix, stiffness, self.tau, statement.index), right)


class Tabulated(Memoryless):
    """A Stokes fluid that has the grid's response to a point force at hand."""

    def __init__(self, fluid: Immersed) -> None:
        self.fluid = fluid
        response = fluid.coupling.response(fluid.grid, fluid.viscosity, 0.0)
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

    def matrix(self, nodes: Nodes, own: np.ndarray) -> np.ndarray:
        """The exact mobility (c n, c n) of nodes, with ``own`` (n, c) on its diagonal."""
        return self.fluid.coupling.matrix(self._table, self.fluid.grid.cells, nodes, own)


class StokesByTable(Tabulated):
    """IB Stokes by the exact mobility table: a small dense solve with the true operator."""

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> _Dense:
        """The mobility of nodes r (n, 3) with tangents e3 (n, 3)."""
        fluid = self.fluid
        return _Dense(fluid, self.matrix(fluid.nodes(r, e3), fluid.own), r, e3, time, tau)


class StokesByAverage(Tabulated):
    """The stated approximation of averaged.py: cheaper by the kernel's size, and blind to where nodes lie in a cell."""

    def __init__(self, fluid: Immersed) -> None:
        super().__init__(fluid)
        self._averaged = averaged.table(mobility.point_response(fluid.grid, fluid.viscosity), fluid.kernel)

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> _Dense:
        """The averaged mobility of nodes r (n, 3)."""
        fluid, n = self.fluid, len(r)
        matrix = averaged.mobility(self._averaged, fluid.grid.cells, fluid.grid.coordinates(r), fluid.slip)
        return _Dense(fluid, matrix.reshape(3 * n, 3 * n), r, e3, time, tau)


class _Blocks(NamedTuple):
    """A preconditioner: LU factors of 1 - tau M K for each range of nodes, ``parts`` unknowns a node."""

    parts: int
    factors: list[tuple[slice, tuple[np.ndarray, np.ndarray]]]

    def solve(self, right: np.ndarray) -> np.ndarray:
        """The approximate x (c n,)."""
        out = np.empty_like(right)
        for rod, factors in self.factors:
            at = slice(self.parts * rod.start, self.parts * rod.stop)
            out[at] = lu_solve(factors, right[at], check_finite=False)
        return out


class _Fourier(ImmersedResponse):
    """FFT velocities; implicit steps by GMRES on them."""

    def __init__(self, owner: StokesByFFT, r: np.ndarray, e3: np.ndarray, time: float, tau: float) -> None:
        super().__init__(owner.fluid, r, e3, time, tau)
        self.owner = owner

    def apply(self, force: np.ndarray) -> np.ndarray:
        f, nodes, coupling = force.reshape(-1, self.parts), self.nodes, self.fluid.coupling
        moved = self.owner.solver.velocity(nodes.base, nodes.weights, coupling.lift(nodes.axes, f))
        return (coupling.drop(nodes.axes, moved) + self.fluid.own * f).ravel()

    def columns(self, index: np.ndarray) -> np.ndarray:
        nodes, parts = index // self.parts, index % self.parts
        block = self.owner.block(self.nodes, np.arange(len(self.nodes.axes)), np.unique(nodes))
        return block[:, self.parts * np.searchsorted(np.unique(nodes), nodes) + parts]

    def solve(self, statement: Reduced, right: np.ndarray) -> np.ndarray:
        blocks = self.owner.preconditioner(self, statement)
        x, count = self._gmres(statement, right, blocks)
        self.owner.took(count)
        return x

    def _gmres(self, statement: Reduced, right: np.ndarray, blocks: _Blocks) -> tuple[np.ndarray, int]:
        free, index, count = statement.free, statement.index, 0

        def product(x: np.ndarray) -> np.ndarray:
            nonlocal count
            count += 1
            force = statement.times(free * x)
            force[index] += x[index]
            return free * x - self.tau * self.apply(force)

        shape = (right.size, right.size)
        x, failed = gmres(
            LinearOperator(shape, matvec=product, dtype=float),
            right,
            rtol=self.owner.residual,
            atol=0.0,
            restart=60,
            maxiter=5,
            M=LinearOperator(shape, matvec=blocks.solve, dtype=float),
        )
        if failed:
            raise np.linalg.LinAlgError(f"GMRES did not reach its residual in {count} products with the FFT operator")
        return x, count


class StokesByFFT(Tabulated):
    """IB Stokes by FFT; GMRES is preconditioned by the exact matrix of all nodes and so needs an iteration or two."""

    residual = _EXACT

    def __init__(self, fluid: Immersed, solver: Solver) -> None:
        super().__init__(fluid)
        self.solver = solver

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> _Fourier:
        """The FFT operator between nodes r (n, 3) with tangents e3 (n, 3)."""
        return _Fourier(self, r, e3, time, tau)

    def block(self, nodes: Nodes, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """The exact mobility (c k, c l) between nodes ``rows`` (k,) and ``columns`` (l,)."""
        fluid = self.fluid
        return fluid.coupling.block(self._table, fluid.grid.cells, nodes, fluid.own, rows, columns)

    def preconditioner(self, response: _Fourier, statement: Reduced) -> _Blocks:
        """The exact matrix of all nodes, factored."""
        nodes = response.nodes
        return self._factor(nodes, response.tau, statement.frozen(), (slice(0, len(nodes.axes)),))

    def took(self, count: int) -> None:
        """Told how many products a solve took."""

    def _factor(self, nodes: Nodes, tau: float, rods: RodStiffness, ranges: tuple[slice, ...]) -> _Blocks:
        factors, c = [], self.fluid.coupling.parts
        for rod in ranges:
            matrix = self.matrix(nodes[rod], self.fluid.own[rod])
            inside = (rods.held >= c * rod.start) & (rods.held < c * rod.stop)
            system = dense_system(matrix, rods.matrix(rod), tau, rods.held[inside] - c * rod.start)
            factors.append((rod, lu_factor(system, overwrite_a=True, check_finite=False)))
        return _Blocks(c, factors)


class _Kept(NamedTuple):
    """A preconditioner that is kept, and all it was made from."""

    blocks: _Blocks
    nodes: Nodes
    tau: float
    rods: RodStiffness


class StokesByKrylov(StokesByFFT):
    """IB Stokes for many nodes: GMRES on the FFT operator, preconditioned rod by rod, factors kept while they serve.

    They are made anew when tau changes by more than a fifth, or after a solve took half as many products again as their
    first: counts decide, never a clock. What they were made from is part of a run's state, so that a resumed run has
    the same ones.
    """

    residual = _LOOSE

    def __init__(self, fluid: Immersed, solver: Solver) -> None:
        super().__init__(fluid, solver)
        self._kept: _Kept | None = None
        self._tired, self._first = False, 0

    def preconditioner(self, response: _Fourier, statement: Reduced) -> _Blocks:
        """The kept factors, or new ones."""
        kept = self._kept
        if kept is None or self._tired or abs(kept.tau - response.tau) > 0.2 * response.tau:
            kept = self._keep(response.nodes, response.tau, statement.frozen())
        return kept.blocks

    def _keep(self, nodes: Nodes, tau: float, rods: RodStiffness) -> _Kept:
        self._kept = _Kept(self._factor(nodes, tau, rods, self.fluid.rods), nodes, tau, rods)
        self._tired, self._first = False, 0
        return self._kept

    def took(self, count: int) -> None:
        """New factors for the next solve where this one took too long."""
        self._first = self._first or count
        self._tired = count > _PATIENCE * self._first + 4

    def memory(self) -> dict[str, np.ndarray | float]:
        """What the kept factors were made from; empty before there are any."""
        if self._kept is None:
            return {}
        kept = self._kept
        named = {k: v for k, v in kept.rods._asdict().items() if v is not None} | vars(kept.nodes)
        return {"tau": kept.tau, "tired": float(self._tired), "first": float(self._first), **named}

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Makes the factors of ``memory`` again."""
        arrays = {k: np.asarray(v) for k, v in memory.items()}
        rods = RodStiffness(arrays["band"], arrays["held"].astype(np.int64), arrays.get("turns"), arrays.get("still"))
        nodes = Nodes(arrays["base"].astype(np.int64), arrays["weights"], arrays["axes"])
        self._keep(nodes, float(arrays["tau"]), rods)
        self._tired, self._first = bool(arrays["tired"]), int(arrays["first"])
