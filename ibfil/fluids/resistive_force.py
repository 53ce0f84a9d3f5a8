"""Resistive-force theory: a drag on every node, and nothing between nodes (Sec. 2 and Eq. 16-17 of the paper).

    Z_i = Lc [ zeta_perp (1 - e3 e3) + zeta_par e3 e3 ],   and Lc zeta_r for the spin:   Z (u - u0) = F

u0 is the background flow, and half its curl about the tangent. M = Z^-1, so the implicit step is multiplied by Z and is
as sparse as K: (Z/tau - K) d = Z/tau (target - y) + Z u0 + f, a band unless far nodes are coupled (block_sparse.py).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..linalg import banded
from ..linalg.compiled import njit
from ..linalg.constraints import Prescribed
from ..linalg.normal_numbers import Draw, Purpose
from ..linalg.stiffness import Rows, Stiffness
from ..linalg.vectors import at, dot, mix, put
from .base import Flow, Memoryless, Solution
from .velocity_gradient import advected

if TYPE_CHECKING:
    from ..linalg.block_sparse import BlockSparse


class Drag(NamedTuple):
    """Drag of each node's control volume (n,): across, along the tangent, and against spin (zero: no twist)."""

    perp: np.ndarray
    par: np.ndarray
    spin: np.ndarray


@njit(cache=True)
def resist(drag: Drag, e3, u):
    """Z u for u (n, m)."""
    n, m = u.shape
    out = np.empty((n, m))
    for i in range(n):
        t, v = at(e3, i, 0), at(u, i, 0)
        put(out, i, 0, mix(drag.perp[i], v, (drag.par[i] - drag.perp[i]) * dot(v, t), t))
        if m == 4:
            out[i, 3] = drag.spin[i] * u[i, 3]
    return out


@njit(cache=True)
def mobilize(drag: Drag, e3, force):
    """Z^-1 F for F (n, m)."""
    n, m = force.shape
    out = np.empty((n, m))
    for i in range(n):
        t, f = at(e3, i, 0), at(force, i, 0)
        put(out, i, 0, mix(1.0 / drag.perp[i], f, (1.0 / drag.par[i] - 1.0 / drag.perp[i]) * dot(f, t), t))
        if m == 4:
            out[i, 3] = force[i, 3] / drag.spin[i]
    return out


@njit(cache=True)
def random_motion(drag: Drag, e3, normal):
    """Z^-1/2 w for normal numbers w (n, m)."""
    n, m = normal.shape
    out = np.empty((n, m))
    for i in range(n):
        t, w = at(e3, i, 0), at(normal, i, 0)
        across = 1.0 / np.sqrt(drag.perp[i])
        put(out, i, 0, mix(across, w, (1.0 / np.sqrt(drag.par[i]) - across) * dot(w, t), t))
        if m == 4:
            out[i, 3] = normal[i, 3] / np.sqrt(drag.spin[i])
    return out


@njit(cache=True)
def _add_drag(matrix, drag: Drag, e3, factor):
    """Adds ``factor`` Z to a band matrix, in place."""
    n, m, width = matrix.shape
    here = (width - m) // 2
    for i in range(n):
        t, along = at(e3, i, 0), (drag.par[i] - drag.perp[i]) * factor
        for a in range(3):
            for b in range(3):
                matrix[i, a, here + b] += along * t[a] * t[b]
            matrix[i, a, here + a] += drag.perp[i] * factor
        if m == 4:
            matrix[i, 3, here + 3] += drag.spin[i] * factor


@njit(cache=True)
def _system(stiffness, drag: Drag, e3, moved, force, inverse):
    """Turns K into K - Z/tau in place, and returns the right side Z moved/tau - f (n, m)."""
    n, m = force.shape
    right = resist(drag, e3, moved)
    for i in range(n):
        for a in range(m):
            right[i, a] = inverse * right[i, a] - force[i, a]
    _add_drag(stiffness, drag, e3, -inverse)
    return right


@njit(cache=True)
def _hold(stiffness, right, held, value):
    """Puts the rows d = value (k,) of the held unknowns (k,) into the system and its right side."""
    m, width = stiffness.shape[1:]
    for k in range(held.size):
        i, a = held[k] // m, held[k] % m
        stiffness[i, a, :] = 0.0
        stiffness[i, a, (width - m) // 2 + a] = 1.0
        right[i, a] = value[k]


@njit(cache=True)
def _correct(stiffness, drag: Drag, e3, moved, force, inverse, held, value, profile, unit):
    """Solves (K - Z/tau) d = Z moved/tau - f with d = value (k,) at the held unknowns (k,).

    Returns d, the force felt Z (moved + d)/tau, and whether elimination without pivoting went well; if not, d is of no
    use. ``stiffness`` is used up, ``unit`` a tuple of m entries.
    """
    d = _system(stiffness, drag, e3, moved, force, inverse)
    _hold(stiffness, d, held, value)
    good = banded.eliminate(stiffness, d, profile.first, profile.last, unit)
    return d, resist(drag, e3, (moved + d) * inverse), good


class _Response:
    keeps = False

    def __init__(self, fluid: ResistiveForce, e3: np.ndarray, flow: np.ndarray | None, tau: float) -> None:
        self.drag, self._fluid, self.e3, self.flow, self.tau = fluid.drag, fluid, e3, flow, tau

    def _carried(self, target: np.ndarray) -> np.ndarray:
        """The displacements (n, m) without any force: target + tau u0."""
        return target if self.flow is None else target + self.tau * self.flow

    def forced(self, force: np.ndarray, held: Prescribed, target: np.ndarray) -> Solution:
        with np.errstate(invalid="ignore"):  # a flow or force without a value ends the step, which tells its node
            base = self._carried(target)
            y = base + self.tau * mobilize(self.drag, self.e3, force)
            y.ravel()[held.at] = held.value
            felt = resist(self.drag, self.e3, (y - base) / self.tau)
        return Solution(y, felt, _at(held, felt - force))

    def implicit(
        self,
        force: np.ndarray,
        stiffness: Stiffness,
        held: Prescribed,
        y: np.ndarray,
        target: np.ndarray,
        error: float = 0.0,
    ) -> Solution:
        """(K - Z/tau) d = Z/tau (y - target) - Z u0 - f; uses ``stiffness`` up."""
        base = self._carried(target)
        moved, m = y - base, force.shape[1]
        solve = self._coupled if stiffness.coupled else self._banded
        if not held.at.size:
            d, felt = solve(stiffness, moved, force, held.at, held.value)
            return Solution(d, felt, np.zeros(d.shape))
        rows = Rows.of(stiffness, np.unique(held.at // m))
        d, felt = solve(stiffness, moved, force, held.at, held.value - y.ravel()[held.at])
        rest = felt - force
        rest[rows.nodes] -= rows.times(d)
        return Solution(d, felt, _at(held, rest))

    def _banded(
        self, stiffness: Stiffness, moved: np.ndarray, force: np.ndarray, at: np.ndarray, value: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """d and the force felt, where there is nothing but a band."""
        band, m, inverse = stiffness.band, force.shape[1], 1.0 / self.tau
        if self._fluid.compiled:
            system = band, self.drag, self.e3, moved, force, inverse, at, value
            d, felt, good = _correct(*system, self._fluid.profile, (0,) * m)
            if good:
                return d, felt
        else:
            _add_drag(band, self.drag, self.e3, -inverse)
        right = inverse * resist(self.drag, self.e3, moved) - force
        _hold(band, right, at, value)
        d = banded.solve_pivoted(band, right)
        return d, resist(self.drag, self.e3, (moved + d) * inverse)

    def _coupled(
        self, stiffness: Stiffness, moved: np.ndarray, force: np.ndarray, at: np.ndarray, value: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The same where nodes beyond the band are coupled."""
        (band, pairs), inverse = stiffness, 1.0 / self.tau
        right = _system(band, self.drag, self.e3, moved, force, inverse)
        _hold(band, right, at, value)
        d = self._fluid.coupled.factored(Stiffness(band, pairs.held(at, len(band))))(right)
        return d, resist(self.drag, self.e3, (moved + d) * inverse)

    def fluctuation(self, draw: Draw, shape: tuple[int, int]) -> np.ndarray:
        return random_motion(self.drag, self.e3, draw(Purpose.MOTION, shape))


def _at(held: Prescribed, values: np.ndarray) -> np.ndarray:
    """``values`` at the held unknowns, zero elsewhere."""
    out = np.zeros_like(values)
    out.ravel()[held.at] = values.ravel()[held.at]
    return out


class LinearStep(NamedTuple):
    """y -> (1 - tau M K)^-1 y for displacements y (n, m) of nodes at frozen positions."""

    solve: Callable[[np.ndarray], np.ndarray]  # by the factors of Z/tau - K, of right sides (n, m)
    drag: Drag
    e3: np.ndarray
    held: np.ndarray
    tau: float

    def __call__(self, y: np.ndarray, /) -> np.ndarray:
        """The displacements (n, m) a step later."""
        right = resist(self.drag, self.e3, y / self.tau)
        right.ravel()[self.held] = 0.0
        return self.solve(right)


class ResistiveForce(Memoryless):
    """The RFT fluid.

    ``drag`` holds the coefficients times the control volumes, ``profile`` where the rods' matrices are not zero;
    ``flow(r, t)`` the background velocity (n, 3) at the nodes, or None (Eq. 48); ``twists`` (n,) is one at nodes that
    the flow turns and zero at others, None where none has a turn; ``spacing`` is that of the nodes.
    """

    def __init__(
        self,
        drag: Drag,
        profile: banded.Profile,
        flow: Flow | None = None,
        twists: np.ndarray | None = None,
        spacing: float = 1.0,
    ) -> None:
        self.drag, self.profile, self.flow, self.twists, self.spacing = drag, profile, flow, twists, spacing
        self.compiled = True  # elimination; False: by LAPACK, where a few steps are not worth seconds of compiling

    def advected(self, r: np.ndarray, e3: np.ndarray, time: float) -> np.ndarray | None:
        """The motions (n, m) with which the background flow carries nodes; None where there is none."""
        if self.flow is None:
            return None
        return advected(self.flow, r, None if self.twists is None else self.twists[:, None] * e3, time, self.spacing)

    @cached_property
    def coupled(self) -> BlockSparse:
        """The factorisation of systems of rods that are coupled, loaded where there are any."""
        from ..linalg.block_sparse import BlockSparse

        return BlockSparse(self.profile)

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> _Response:
        """Drag of each node about the tangents e3, in the background flow of ``time``."""
        return _Response(self, e3, self.advected(r, e3, time), tau)

    def linear_step(self, e3: np.ndarray, stiffness: Stiffness, held: np.ndarray, tau: float) -> LinearStep:
        """The step y -> (1 - tau M K)^-1 y of displacements (n, m), zero at the unknowns ``held`` (k,); factored.

        Raises numpy.linalg.LinAlgError where it is singular.
        """
        band = -stiffness.band
        n, m = band.shape[:2]
        _add_drag(band, self.drag, e3, 1.0 / tau)
        _hold(band, np.empty((n, m)), held, np.zeros(held.size))
        if not stiffness.coupled:
            factors = banded.Factored(band)
            return LinearStep(lambda right: factors.solve(right.ravel()).reshape(n, m), self.drag, e3, held, tau)
        pairs = stiffness.pairs.held(held, n)
        return LinearStep(
            self.coupled.factored(Stiffness(band, pairs._replace(blocks=-pairs.blocks))), self.drag, e3, held, tau
        )

    def velocity_at(
        self, points: np.ndarray, r: np.ndarray, e3: np.ndarray, force: np.ndarray, time: float
    ) -> np.ndarray:
        """The background velocity (k, 3): in this theory nodes do not move the fluid elsewhere."""
        return np.zeros_like(points) if self.flow is None else self.flow(points, time)
