"""The immersed-boundary Stokes fluid: u = J L^-1 S F + s F on a periodic grid (Eq. 45 of the paper, with +f).

S spreads nodal forces with a discrete delta kernel, L^-1 is the periodic Stokes solve, J interpolates back (S
transposed, times the cell's volume), s is the slip mobility that keeps nearly inextensible rods from locking when
their nodes are closer than the grid (numerics.md, 4.3). Two ways to the same velocity, equal to round-off: the exact
mobility table, whose matrix is then solved densely, and FFTs, with GMRES for the implicit step.

The spin is local: e1 turns against the rod's own drag, so the twist unknowns are eliminated node by node and the
linear system keeps three unknowns a node.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse.linalg import LinearOperator, gmres

from . import banded, mobility
from .fluid import Answer, Held
from .grid import Grid, interpolate, project, spread
from .kernels import Kernel
from .transforms import VectorTransform

Flow = Callable[[np.ndarray, float], np.ndarray]


@dataclass(frozen=True)
class Immersed:
    """What every grid fluid is made of: the grid, the kernel, eta, slip (n,), and the drag against spin (n,) or None."""

    grid: Grid
    kernel: Kernel
    viscosity: float
    slip: np.ndarray
    spin_drag: np.ndarray | None
    flow: Flow | None = None

    def spin(self) -> np.ndarray:
        """The drag of each node against spin; zeros where nothing twists."""
        return np.zeros(len(self.slip)) if self.spin_drag is None else self.spin_drag

    def stencil(self, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """First grid index (n, 3) and weights (n, 3, P) of the nodes r (n, 3)."""
        return self.kernel.stencil(self.grid.coordinates(r))


def slip_mobility(fraction: float, kernel: Kernel, grid: Grid, viscosity: float, ds: np.ndarray) -> np.ndarray:
    """s = eps (h / 2 ds)/(6 pi eta a), a the kernel's point radius: a constant slip per length of rod."""
    h = grid.spacing
    return fraction * (h / (2 * ds)) / (6 * np.pi * viscosity * kernel.point_radius * h)


class StokesSolve:
    """Velocities by FFT: spread, transform, project, transform back, interpolate."""

    def __init__(self, grid: Grid, viscosity: float, threads: int = 1) -> None:
        self.grid, self.viscosity = grid, viscosity
        nx, ny, nz = (int(n) for n in grid.cells)
        self._transform = VectorTransform((nx, ny, nz), threads)
        self._reals = self._transform.modes.view(float)
        (kx, ky, kz), (sx, sy, sz) = grid.wave_numbers()
        self._waves = (kx, ky, np.repeat(kz, 2), sx, sy, np.repeat(sz, 2))
        self._scale = 1.0 / (self._transform.size * grid.spacing**3)

    def field(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocity (3, nx, ny, nz) that nodal forces (n, 3) drive; overwritten by the next call."""
        t = self._transform
        t.real[:] = 0.0
        spread(base, weights, force, t.real)
        t.forward()
        project(self._reals, *self._waves, 0.0, self.viscosity, self._scale)
        return t.backward()

    def velocity(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The velocity (n, 3) at the nodes."""
        return interpolate(base, weights, self.field(base, weights, force))


class _Twistless:
    """The implicit statement for the positions alone, the twist unknowns (if any) eliminated.

    (Zr/tau - K_pp) dp = Zr/tau (target - phi) + g_p + K_pr dr: the turns answer to their own drag only. What is left
    is a stiffness on positions, K_rr + K_rp (Zr/tau - K_pp)^-1 K_pr, and a force.
    """

    def __init__(self, force, stiffness, held: Held, y, target, spin_drag, tau: float) -> None:
        n, m = force.shape
        full = banded.dense(stiffness)
        self.n, self.m = n, m
        self.matrix = np.ascontiguousarray(full[:, :3, :, :3]).reshape(3 * n, 3 * n)
        self.force = np.ascontiguousarray(force[:, :3]).ravel()
        node, part = held.at // m, held.at % m
        spin = part == 3
        self.index = (3 * node + part)[~spin]
        self.move = (held.value - y.ravel()[held.at])[~spin]
        if m == 3:
            return
        right = spin_drag / tau * (target[:, 3] - y[:, 3]) + force[:, 3]
        turns = np.diag(spin_drag / tau) - full[:, 3, :, 3]
        couple = full[:, 3, :, :3].reshape(n, 3 * n).copy()
        at = node[spin]
        turns[at], couple[at] = 0.0, 0.0
        turns[at, at] = 1.0
        right[at] = (held.value - y.ravel()[held.at])[spin]
        answer = np.linalg.solve(turns, np.column_stack([couple, right]))
        self._couple, self._right = answer[:, :-1], answer[:, -1]
        back = full[:, :3, :, 3].reshape(3 * n, n)
        self.matrix = self.matrix + back @ self._couple
        self.force = self.force + back @ self._right

    def whole(self, d: np.ndarray) -> np.ndarray:
        """The moves (n, m) of all unknowns from those of the positions (3 n,)."""
        out = np.empty((self.n, self.m))
        out[:, :3] = d.reshape(self.n, 3)
        if self.m == 4:
            out[:, 3] = self._couple @ d + self._right
        return out


class _Response:
    """Positions frozen; ``apply`` gives J L^-1 S f + s f of forces (3 n,), ``solve_held`` the supports' forces."""

    def __init__(self, fluid: Immersed, r: np.ndarray, time: float, tau: float) -> None:
        self.fluid, self.tau = fluid, tau
        self.base, self.weights = fluid.stencil(r)
        self.flow = None if fluid.flow is None else fluid.flow(r, time)

    def apply(self, force: np.ndarray) -> np.ndarray:
        """Velocities (3 n,) of forces (3 n,), without the background flow."""
        raise NotImplementedError

    def columns(self, index: np.ndarray) -> np.ndarray:
        """Columns (3 n, k) of the mobility at the flat position indices (k,)."""
        raise NotImplementedError

    def _linear_solve(self, matrix: np.ndarray, right: np.ndarray, index: np.ndarray) -> np.ndarray:
        """x of (1 - tau M K) x = right, columns ``index`` replaced by those of -tau M."""
        raise NotImplementedError

    def _base(self, target: np.ndarray) -> np.ndarray:
        if self.flow is None:
            return target[:, :3].ravel()
        return (target[:, :3] + self.tau * self.flow).ravel()

    def forced(self, force: np.ndarray, held: Held, target: np.ndarray) -> Answer:
        n, m = force.shape
        f = np.ascontiguousarray(force[:, :3]).ravel()
        node, part = held.at // m, held.at % m
        index, value = (3 * node + part)[part < 3], held.value[part < 3]
        base = self._base(target)
        reaction = np.zeros((n, m))
        move = base + self.tau * self.apply(f)
        if index.size:
            columns = self.columns(index)
            push = np.linalg.solve(self.tau * columns[index], value - move[index])
            move = move + self.tau * columns @ push
            reaction[node[part < 3], part[part < 3]] = push
        y = np.empty((n, m))
        y[:, :3] = move.reshape(n, 3)
        if m == 4:
            spin = self.fluid.spin()
            y[:, 3] = target[:, 3] + self.tau * force[:, 3] / spin
            y.ravel()[held.at[part == 3]] = held.value[part == 3]
            rest = spin * (y[:, 3] - target[:, 3]) / self.tau - force[:, 3]
            reaction[node[part == 3], 3] = rest[node[part == 3]]
        return Answer(y, force + reaction, reaction)

    def implicit(
        self, force: np.ndarray, stiffness: np.ndarray, held: Held, y: np.ndarray, target: np.ndarray
    ) -> Answer:
        tau, spin = self.tau, self.fluid.spin()
        small = _Twistless(force, stiffness, held, y, target, spin, tau)
        known = np.zeros(small.force.size)
        known[small.index] = small.move
        push = small.force + small.matrix @ known
        right = self._base(target) - y[:, :3].ravel() + tau * self.apply(push)
        right[small.index] -= small.move
        x = self._linear_solve(small.matrix, right, small.index)
        d, reaction = x.copy(), np.zeros(force.shape)
        d[small.index] = small.move
        reaction[small.index // 3, small.index % 3] = x[small.index]
        move = small.whole(d)
        felt = force + banded.multiply(stiffness, move) + reaction
        if force.shape[1] == 4:
            part = held.at % 4 == 3
            at = held.at[part] // 4
            rest = spin * (y[:, 3] + move[:, 3] - target[:, 3]) / tau - felt[:, 3]
            reaction[at, 3] = rest[at]
            felt[at, 3] += rest[at]
        return Answer(move, felt, reaction)


class _Table(_Response):
    """The dense matrix of the exact table."""

    def __init__(self, fluid: Immersed, table: np.ndarray, r: np.ndarray, time: float, tau: float) -> None:
        super().__init__(fluid, r, time, tau)
        matrix = mobility.mobility(table, fluid.grid.cells, self.base, self.weights, fluid.slip)
        self.matrix = matrix.reshape(3 * len(r), 3 * len(r))

    def apply(self, force: np.ndarray) -> np.ndarray:
        return self.matrix @ force

    def columns(self, index: np.ndarray) -> np.ndarray:
        return self.matrix[:, index]

    def system(self, matrix: np.ndarray, index: np.ndarray) -> np.ndarray:
        """1 - tau M K with the columns of held unknowns replaced by those of -tau M: their forces are sought."""
        system = self.matrix @ matrix
        system *= -self.tau
        system.ravel()[:: len(system) + 1] += 1.0
        system[:, index] = -self.tau * self.matrix[:, index]
        return system

    def _linear_solve(self, matrix: np.ndarray, right: np.ndarray, index: np.ndarray) -> np.ndarray:
        return np.linalg.solve(self.system(matrix, index), right)


class _Fourier(_Response):
    """FFT velocities; the implicit step by GMRES on them, preconditioned by the exact table's matrix."""

    def __init__(
        self, fluid: Immersed, solve: StokesSolve, table: np.ndarray, r: np.ndarray, time: float, tau: float
    ) -> None:
        super().__init__(fluid, r, time, tau)
        self._solve, self._table, self._place = solve, table, (r, time)

    def apply(self, force: np.ndarray) -> np.ndarray:
        f = force.reshape(-1, 3)
        u = self._solve.velocity(self.base, self.weights, f) + self.fluid.slip[:, None] * f
        return u.ravel()

    def columns(self, index: np.ndarray) -> np.ndarray:
        out = np.empty((3 * len(self.base), index.size))
        for k, i in enumerate(index):
            unit = np.zeros(len(out))
            unit[i] = 1.0
            out[:, k] = self.apply(unit)
        return out

    def _linear_solve(self, matrix: np.ndarray, right: np.ndarray, index: np.ndarray) -> np.ndarray:
        exact = _Table(self.fluid, self._table, self._place[0], self._place[1], self.tau)
        factors = lu_factor(exact.system(matrix, index), check_finite=False)
        free = np.ones(right.size)
        free[index] = 0.0

        def product(x: np.ndarray) -> np.ndarray:
            force = matrix @ (free * x)
            force[index] += x[index]
            return free * x - self.tau * self.apply(force)

        shape = (right.size, right.size)
        x, failed = gmres(
            LinearOperator(shape, matvec=product, dtype=float),
            right,
            rtol=1e-11,
            atol=0.0,
            maxiter=50,
            M=LinearOperator(shape, matvec=lambda v: lu_solve(factors, v, check_finite=False), dtype=float),
        )
        if failed:
            raise FloatingPointError("GMRES did not converge on the FFT operator")
        return x


class StokesByTable:
    """IB Stokes by the exact mobility table: a small dense solve with the true operator, cost free of the grid's size."""

    def __init__(self, fluid: Immersed) -> None:
        self.fluid = fluid
        self._table = mobility.octant(
            mobility.point_response(fluid.grid, fluid.viscosity), fluid.kernel.points
        )

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float) -> _Table:
        """The mobility of nodes r (n, 3)."""
        return _Table(self.fluid, self._table, r, time, tau)


class StokesByFFT:
    """IB Stokes by FFT: the reference path, and the one that needs no table when nothing is implicit."""

    def __init__(self, fluid: Immersed, solve: StokesSolve) -> None:
        self.fluid, self._solve = fluid, solve
        self._table = mobility.octant(
            mobility.point_response(fluid.grid, fluid.viscosity), fluid.kernel.points
        )

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float) -> _Fourier:
        """The FFT operator between nodes r (n, 3)."""
        return _Fourier(self.fluid, self._solve, self._table, r, time, tau)
