"""rotation = "grid": twist torques act on the fluid of the grid, and its vorticity turns the rods.

The generalised immersed boundary of Lim, Ferent, Wang & Peskin 2008 (SIAM J. Sci. Comput. 31, 273): a node gives the
fluid its force and, as half a curl, its twist torque; it moves with the velocity and spins with half the vorticity,

    f = S F + 1/2 curl S (T e3),     u = J v,     w3 = e3 . 1/2 J curl v + c T,     v = L^-1 f

so the mobility of (F, T) is symmetric, and F.u + T w3 is the power put into the fluid. Only the component about the
tangent is coupled: e1 is carried along with the tangent by parallel transport (Eq. 41), which has no spin about it,
and moments across it act through the shear forces of Eq. 44, which the grid gets as forces.

Below the kernel's scale. A line of torques on the grid spins like a cylinder of the kernel's twist radius b. About a
cylinder under a torque T per length the fluid turns at T/(4 pi eta r^2), so a rod of radius a < b spins faster by
what the fluid between a and b slips,

    c = [1/(4 pi eta a^2) - 1/(4 pi eta b^2)]/Lc

and one alone spins against 4 pi eta a^2, as in resistive-force theory.

Torques of nodes less than some cells apart lock as forces do (fluids/README.md): the grid hardly sees what changes sign
from node to node, and a prescribed spin is then answered by torques that do, twenty times too large. So c is at least
eps/(4 pi eta b^2 Lc) with the eps of the slip: a rod spins as one of radius b/sqrt(1 + eps) at most.

The curl is spectral, with the derivative's wave numbers of grid/periodic_grid.py (zero at Nyquist), so that these
blocks of the mobility table equal the FFTs to round-off: with K^2 the true square,

    R^ = 1/2 i k/(eta K^2),  u = R x T,  1/2 curl u = R x F,     W^ = 1/4 (k^2 - k k)/(eta K^2),  1/2 curl u = W T
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from scipy.fft import irfftn

from ..grid.far_pairs import moments
from ..grid.fft import VectorTransform
from ..grid.periodic_grid import Grid
from ..grid.spectral import StokesSymbol, half_curl, project
from ..grid.spreading import interpolate, spread
from ..linalg.compiled import njit
from .mobility_table import COMPONENTS, IN_ANY_ORDER, Octant, point_response, sum_any
from .velocity_gradient import advected

if TYPE_CHECKING:
    from .coupling import Nodes


_FIFTEEN = (0,) * 15  # G xx .. yz, R x y z, W xx .. yz


def torque_response(grid: Grid, viscosity: float, alpha: float = 0.0) -> np.ndarray:
    """R (x, y, z) and W (xx, yy, zz, xy, xz, yz) of a unit torque on one cell, as (9, nx, ny, nz)."""
    symbol = StokesSymbol(*grid.wave_numbers(), viscosity, alpha)
    total = symbol.total * grid.spacing**3
    symbols = [0.5j * symbol.k[a] / total for a in range(3)]
    symbols += [0.25 * symbol.twice_curled(a, b) / total for a, b in COMPONENTS]
    return np.stack([irfftn(one, s=tuple(grid.cells), axes=(0, 1, 2)) for one in symbols])


@njit(cache=True, inline="always")
def _cross(sums, sign, e, i):
    """Component i of R x e, R from the pair's sums."""
    j, k = (i + 1) % 3, (i + 2) % 3
    return sign[j] * sums[6 + j] * e[k] - sign[k] * sums[6 + k] * e[j]


@njit(cache=True, inline="always")
def _between(sums, sign, d, e):
    """d . W e."""
    out = 0.0
    for i in range(3):
        out += sums[9 + i] * d[i] * e[i]
    out += sign[0] * sign[1] * sums[12] * (d[0] * e[1] + d[1] * e[0])
    out += sign[0] * sign[2] * sums[13] * (d[0] * e[2] + d[2] * e[0])
    return out + sign[1] * sign[2] * sums[14] * (d[1] * e[2] + d[2] * e[1])


@njit(cache=True, fastmath=IN_ANY_ORDER)
def _pairs(octant, base, weights, axes, own, rows, columns, points):
    terms, centres = 2 * len(points) - 1, moments(base, weights)
    c, acc, sums = np.empty((3, terms)), np.empty(15 * terms), np.empty(15)
    out = np.empty((rows.size, 4, columns.size, 4))
    for i in range(rows.size):
        for j in range(columns.size):
            a, b = rows[i], columns[j]
            sign = sum_any(octant, base, weights, centres, a, b, c, acc, sums, _FIFTEEN, points)
            if a == b:
                sums[6:9] = 0.0  # odd, and so nothing but round-off
            for x in range(3):
                out[i, x, j, x] = sums[x]
                out[i, x, j, 3] = _cross(sums, sign, axes[b], x)
                out[i, 3, j, x] = -_cross(sums, sign, axes[a], x)
            out[i, 0, j, 1] = out[i, 1, j, 0] = sums[3]
            out[i, 0, j, 2] = out[i, 2, j, 0] = sums[4]
            out[i, 1, j, 2] = out[i, 2, j, 1] = sums[5]
            out[i, 3, j, 3] = _between(sums, sign, axes[a], axes[b])
            if a == b:
                for x in range(4):
                    out[i, x, j, x] += own[a, x]
    return out


@njit(cache=True, fastmath=IN_ANY_ORDER)
def _mobility(octant, base, weights, axes, own, points):
    n, terms, centres = weights.shape[0], 2 * len(points) - 1, moments(base, weights)
    c, acc, sums = np.empty((3, terms)), np.empty(15 * terms), np.empty(15)
    out = np.empty((n, 4, n, 4))
    for a in range(n):
        for b in range(a, n):
            sign = sum_any(octant, base, weights, centres, a, b, c, acc, sums, _FIFTEEN, points)
            if a == b:
                sums[6:9] = 0.0  # odd, and so nothing but round-off
            for x in range(3):
                out[a, x, b, x] = out[b, x, a, x] = sums[x]
                out[a, x, b, 3] = out[b, 3, a, x] = _cross(sums, sign, axes[b], x)
                out[b, x, a, 3] = out[a, 3, b, x] = -_cross(sums, sign, axes[a], x)
            out[a, 0, b, 1] = out[b, 1, a, 0] = out[a, 1, b, 0] = out[b, 0, a, 1] = sums[3]
            out[a, 0, b, 2] = out[b, 2, a, 0] = out[a, 2, b, 0] = out[b, 0, a, 2] = sums[4]
            out[a, 1, b, 2] = out[b, 2, a, 1] = out[a, 2, b, 1] = out[b, 1, a, 2] = sums[5]
            out[a, 3, b, 3] = out[b, 3, a, 3] = _between(sums, sign, axes[a], axes[b])
        for x in range(4):
            out[a, x, a, x] += own[a, x]
    return out


def pairs(
    octant: Octant,
    base: np.ndarray,
    weights: np.ndarray,
    axes: np.ndarray,
    own: np.ndarray,
    rows: np.ndarray,
    columns: np.ndarray,
) -> np.ndarray:
    """The mobility (len(rows), 4, len(columns), 4) between nodes with spin axes (n, 3); ``own`` (n, 4) on the diagonal.

    ``axes`` are unit tangents, zero where a node does not twist: then no torque of it, and no spin.
    """
    return _pairs(octant, base, weights, axes, own, rows, columns, (0,) * weights.shape[2])


def mobility(octant: Octant, base: np.ndarray, weights: np.ndarray, axes: np.ndarray, own: np.ndarray) -> np.ndarray:
    """The whole matrix (n, 4, n, 4), symmetric to the last bit; arguments as for ``pairs``."""
    return _mobility(octant, base, weights, axes, own, (0,) * weights.shape[2])


class TorqueStokesSolve:
    """Velocities and half vorticities of forces and torques, by whole FFTs (stokes.Solver).

    ``alpha`` is density over time, zero in Stokes flow; a ``transform`` of 6 fields at hand is used, and what it held
    is lost.
    """

    def __init__(
        self,
        grid: Grid,
        viscosity: float,
        threads: int = 1,
        alpha: float = 0.0,
        transform: VectorTransform | None = None,
    ) -> None:
        self.grid, self.viscosity, self.alpha = grid, viscosity, alpha
        nx, ny, nz = (int(n) for n in grid.cells)
        self._transform = transform or VectorTransform((nx, ny, nz), threads, fields=6)
        self._k, (sx, sy, sz) = grid.wave_numbers()
        kx, ky, kz = self._k
        self._waves = (kx, ky, np.repeat(kz, 2), sx, sy, np.repeat(sz, 2))
        self._scale = 1.0 / (self._transform.size * grid.spacing**3)

    def velocity(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Velocity and half the vorticity (n, 6) at the nodes, of their forces and torques (n, 6)."""
        t = self._transform
        t.real[:] = 0.0
        spread(base, weights, force[:, :3], t.real[:3])
        spread(base, weights, force[:, 3:], t.real[3:])
        t.forward(6)
        flow, spin = t.modes[:3], t.modes[3:]
        half_curl(spin, *self._k, flow)
        project(flow.view(float), *self._waves, self.alpha, self.viscosity, self._scale)
        spin[:] = 0.0
        half_curl(flow, *self._k, spin)
        t.backward(6)
        return np.hstack([interpolate(base, weights, t.real[:3]), interpolate(base, weights, t.real[3:])])


def spin_mobility(radius: np.ndarray, widest: float, slip: float, viscosity: float, volume: np.ndarray) -> np.ndarray:
    """c (n,): the spin per torque that rods of ``radius`` (n,) have beyond the grid's, of which ``slip`` at least.

    ``widest`` is b/sqrt(1 + slip), the largest radius that a rod has when it spins, ``volume`` (n,) control volumes.
    """
    inside = 1.0 / np.minimum(radius, widest) ** 2 - 1.0 / (widest**2 * (1.0 + slip))
    return inside / (4 * np.pi * viscosity * volume)


class TorqueCoupling:
    """Torques and spins go through the grid with forces and velocities (coupling.Coupling): four numbers a node.

    ``spin`` (n,) is what a node spins per torque beyond the grid's answer, ``twists`` (n,) is one where the rod twists
    and zero where it does not: there a torque acts on the node's own spin only, and stirs nothing.
    """

    components, grid_vectors = 4, 2

    def __init__(self, spin: np.ndarray, twists: np.ndarray) -> None:
        self.spin, self.twists = spin, twists

    def response(self, grid: Grid, viscosity: float, alpha: float) -> np.ndarray:
        """G, R and W."""
        return np.concatenate([point_response(grid, viscosity, alpha), torque_response(grid, viscosity, alpha)])

    def matrix(self, octant: Octant, nodes: Nodes, own: np.ndarray) -> np.ndarray:
        """The whole mobility (4 n, 4 n)."""
        n = len(own)
        return mobility(octant, nodes.base, nodes.weights, nodes.axes, own).reshape(4 * n, 4 * n)

    def block(self, octant: Octant, nodes: Nodes, own: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """The mobility (4 k, 4 l) between nodes ``rows`` (k,) and ``columns`` (l,)."""
        out = pairs(octant, nodes.base, nodes.weights, nodes.axes, own, rows, columns)
        return out.reshape(4 * len(rows), 4 * len(columns))

    def own(self, slip: np.ndarray) -> np.ndarray:
        """The slip in each direction, and the spin."""
        return np.column_stack([slip, slip, slip, self.spin])

    def axes(self, e3: np.ndarray) -> np.ndarray:
        """The axes (n, 3) about which nodes with tangents e3 (n, 3) spin."""
        return self.twists[:, None] * e3

    def to_grid(self, axes: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Forces and torques (n, 6)."""
        return np.hstack([force[:, :3], force[:, 3:] * axes])

    def from_grid(self, axes: np.ndarray, motion: np.ndarray) -> np.ndarray:
        """Velocities and spins (n, 4)."""
        return np.column_stack([motion[:, :3], np.sum(motion[:, 3:] * axes, axis=1)])

    def advected(
        self, flow: Callable[[np.ndarray, float], np.ndarray], r: np.ndarray, axes: np.ndarray, time: float, h: float
    ) -> np.ndarray:
        """The flow's velocity and its spin about the tangents, (n, 4)."""
        return advected(flow, r, axes, time, h)
