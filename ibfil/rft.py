"""Resistive-force theory: a drag on every node, and nothing between nodes (Sec. 2 and Eq. 16-17 of the paper).

    Z_i = Lc [ zeta_perp (1 - e3 e3) + zeta_par e3 e3 ],   and Lc zeta_r for the spin:   Z (u - u0) = F

M = Z^-1, so the implicit step is multiplied by Z and stays banded: (Z/tau - K) d = Z/tau (target - y) + Z u0 + f.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from . import banded
from .fluid import Answer, Held


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
        f = (drag.par[i] - drag.perp[i]) * (u[i, 0] * e3[i, 0] + u[i, 1] * e3[i, 1] + u[i, 2] * e3[i, 2])
        for c in range(3):
            out[i, c] = drag.perp[i] * u[i, c] + f * e3[i, c]
        if m == 4:
            out[i, 3] = drag.spin[i] * u[i, 3]
    return out


@njit(cache=True)
def mobilize(drag: Drag, e3, force):
    """Z^-1 F for F (n, m)."""
    n, m = force.shape
    out = np.empty((n, m))
    for i in range(n):
        along = force[i, 0] * e3[i, 0] + force[i, 1] * e3[i, 1] + force[i, 2] * e3[i, 2]
        f = (1.0 / drag.par[i] - 1.0 / drag.perp[i]) * along
        for c in range(3):
            out[i, c] = force[i, c] / drag.perp[i] + f * e3[i, c]
        if m == 4:
            out[i, 3] = force[i, 3] / drag.spin[i]
    return out


@njit(cache=True)
def _less_drag(stiffness, drag, e3, inverse, index):
    """Turns K into K - Z/tau in place, with unit rows at the held unknowns."""
    n, m, width = stiffness.shape
    w = (width // m - 1) // 2
    for i in range(n):
        f = (drag.par[i] - drag.perp[i]) * inverse
        for a in range(3):
            for b in range(3):
                stiffness[i, a, w * m + b] -= f * e3[i, a] * e3[i, b]
            stiffness[i, a, w * m + a] -= drag.perp[i] * inverse
        if m == 4:
            stiffness[i, 3, w * m + 3] -= drag.spin[i] * inverse
    for k in range(index.size):
        i, a = index[k] // m, index[k] % m
        stiffness[i, a, :] = 0.0
        stiffness[i, a, w * m + a] = 1.0


class _Response:
    def __init__(self, drag: Drag, profile: banded.Profile, e3: np.ndarray, flow, tau: float) -> None:
        self.drag, self.profile, self.e3, self.flow, self.tau = drag, profile, e3, flow, tau

    def _velocity_target(self, target: np.ndarray) -> np.ndarray:
        if self.flow is None:
            return target
        base = target.copy()
        base[:, :3] += self.tau * self.flow
        return base

    def forced(self, force: np.ndarray, held: Held, target: np.ndarray) -> Answer:
        base = self._velocity_target(target)
        y = base + self.tau * mobilize(self.drag, self.e3, force)
        y.ravel()[held.at] = held.value
        felt = resist(self.drag, self.e3, (y - base) / self.tau)
        return Answer(y, felt, _at(held, felt - force))

    def implicit(
        self, force: np.ndarray, stiffness: np.ndarray, held: Held, y: np.ndarray, target: np.ndarray
    ) -> Answer:
        """(K - Z/tau) d = Z/tau (y - target) - Z u0 - f; uses ``stiffness`` up."""
        base = self._velocity_target(target)
        right = resist(self.drag, self.e3, (y - base) / self.tau) - force
        nodes = np.unique(held.at // force.shape[1]) if held.at.size else held.at
        rows = stiffness[nodes]
        _less_drag(stiffness, self.drag, self.e3, 1.0 / self.tau, held.at)
        right.ravel()[held.at] = held.value - y.ravel()[held.at]
        d = banded.solve(stiffness, right, self.profile)
        felt = resist(self.drag, self.e3, (y + d - base) / self.tau)
        if not nodes.size:
            return Answer(d, felt, np.zeros_like(d))
        rest = felt - force
        rest[nodes] -= _rows_times(rows, nodes, d)
        return Answer(d, felt, _at(held, rest))


def _at(held: Held, values: np.ndarray) -> np.ndarray:
    """``values`` at the held unknowns, zero elsewhere."""
    out = np.zeros_like(values)
    out.ravel()[held.at] = values.ravel()[held.at]
    return out


def _rows_times(rows: np.ndarray, nodes: np.ndarray, d: np.ndarray) -> np.ndarray:
    """(K d) at a few nodes (k, m), from their rows of the band matrix."""
    n, m = d.shape
    w = (rows.shape[2] // m - 1) // 2
    padded = np.zeros((n + 2 * w, m))
    padded[w : n + w] = d
    return np.stack([row @ padded[i : i + 2 * w + 1].ravel() for row, i in zip(rows, nodes, strict=True)])


class ResistiveForce:
    """The RFT fluid.

    ``drag`` holds the coefficients times the control volumes, ``profile`` where the rods' matrices are not zero;
    ``flow(r, t)`` the background velocity (n, 3) at the nodes, or None (Eq. 48).
    """

    def __init__(self, drag: Drag, profile: banded.Profile, flow=None) -> None:
        self.drag, self.profile, self.flow = drag, profile, flow

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float) -> _Response:
        """Drag of each node about the tangents e3, in the background flow of ``time``."""
        return _Response(self.drag, self.profile, e3, None if self.flow is None else self.flow(r, time), tau)
