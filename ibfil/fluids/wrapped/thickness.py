"""The couple of a background flow across the thickness of a rod, which makes it tumble in a shear (Jeffery 1922).

Nodes on a line turn with the flow as an infinitely thin rod does, e3' = (1 - e3 e3) A e3, A_ij = d_j u_i. On the
surface of a rod of radius a that turns with omega, at rho from its axis, the flow along it relative to it is rho.g,

    g = e3 x omega - (1 - e3 e3) A^T e3

Around the rod it is (a^2/rho^2) rho.g, which is harmonic and needs no pressure, and the traction -eta rho.g/a leaves a
couple per length

    m = -kappa eta a^2 [ omega_perp - (A^T e3) x e3 ],     kappa = pi

Line and couple together turn a straight rod as a spheroid of aspect ratio r_e = sqrt(K1/K2): K1 the drag on its turning
as a line, zeta_perp L^3/12 where that is uniform, K2 = kappa eta a^2 L. Its period in a shear gamma is
2 pi (r_e + 1/r_e)/gamma.

On the segment d = r_{i+1} - r_i, l = abs(d), t = d/l, the couple is a pair of forces, q on i + 1 and -q on i,

    q = -(kappa eta a^2/l) (1 - t t) [ u_{i+1} - u_i + l A^T t ]

so there is no net force. Left out are the couple that the rods' own flow makes, and the ends of a rod: measured periods
of blunt cylinders are those of K2 5.45/(2 pi) as large, of an r_e 7 % larger (Cox, J. Fluid Mech. 45, 1971).
"""

from __future__ import annotations

import numpy as np

from ...linalg.compiled import njit
from ..base import Flow
from ..velocity_gradient import gradient

KAPPA = np.pi  # of a long cylinder


@njit(cache=True)
def _add(stiff, edge, strained, inverse, constant, matrix):
    """Adds z to ``constant``, Z times ``inverse`` to ``matrix``; stiff (n,) is kappa eta a^2, 0 where no segment is."""
    n, m, width = matrix.shape
    here = (width - m) // 2
    for i in range(n - 1):
        if stiff[i] == 0.0:
            continue
        length = np.sqrt(edge[i, 0] ** 2 + edge[i, 1] ** 2 + edge[i, 2] ** 2)
        along = (strained[i, 0] * edge[i, 0] + strained[i, 1] * edge[i, 1] + strained[i, 2] * edge[i, 2]) / length**2
        for a in range(3):
            push = stiff[i] * (strained[i, a] - along * edge[i, a])
            constant[i, a] += push
            constant[i + 1, a] -= push
            for b in range(3):
                across = (1.0 if a == b else 0.0) - edge[i, a] * edge[i, b] / length**2
                block = stiff[i] * across / length * inverse
                matrix[i, a, here + b] += block
                matrix[i, a, here + m + b] -= block
                matrix[i + 1, a, here + b] += block
                matrix[i + 1, a, here - m + b] -= block


@njit(cache=True)
def _pairs(stiff, edge, strained, u):
    """q (n, 3) of each segment for velocities u (n, m)."""
    out = np.zeros((len(u), 3))
    for i in range(len(u) - 1):
        if stiff[i] == 0.0:
            continue
        length = np.sqrt(edge[i, 0] ** 2 + edge[i, 1] ** 2 + edge[i, 2] ** 2)
        along = 0.0
        for a in range(3):
            out[i, a] = -stiff[i] * ((u[i + 1, a] - u[i, a]) / length + strained[i, a])
            along += out[i, a] * edge[i, a] / length**2
        for a in range(3):
            out[i, a] -= along * edge[i, a]
    return out


@njit(cache=True)
def _forces(stiff, edge, strained, u):
    """The forces (n, m) of the pairs: q on the node behind a segment, -q on the one before."""
    pairs, out = _pairs(stiff, edge, strained, u), np.zeros(u.shape)
    for i in range(len(u) - 1):
        for a in range(3):
            out[i, a] -= pairs[i, a]
            out[i + 1, a] += pairs[i, a]
    return out


class Couple:
    """The couple at frozen positions: kappa eta a^2 (n,), edges and A^T t (n, 3) of the segments."""

    def __init__(self, stiff: np.ndarray, edge: np.ndarray, strained: np.ndarray, tau: float) -> None:
        self.stiff, self.edge, self.strained, self._inverse = stiff, edge, strained, 1.0 / tau

    def add(self, constant: np.ndarray, matrix: np.ndarray) -> None:
        """z = -B^T [kappa eta a^2 (1 - t t) A^T t], Z = B^T [kappa eta a^2 (1 - t t)/l] B, with B u = u_{i+1} - u_i."""
        _add(self.stiff, self.edge, self.strained, self._inverse, constant, matrix)

    def from_fluid(self, u: np.ndarray) -> np.ndarray:
        """All of it."""
        out: np.ndarray = _forces(self.stiff, self.edge, self.strained, u)
        return out

    def dissipation(self, u: np.ndarray) -> float:
        """The heat of the flow along the surface, sum of l q^2/(kappa eta a^2)."""
        there = self.stiff > 0.0
        pairs, length = _pairs(self.stiff, self.edge, self.strained, u)[there], np.linalg.norm(self.edge[there], axis=1)
        return float(np.sum(length / self.stiff[there] * np.sum(pairs**2, axis=1)))


class Thickness:
    """The couple on rods in a background flow: a VelocityForce without memory.

    ``stiff`` (n,) is kappa eta a^2 of the segment after each node, zero where there is none; ``spacing`` that of nodes.
    """

    def __init__(self, stiff: np.ndarray, flow: Flow | None, spacing: float) -> None:
        self.stiff, self._flow, self._spacing = stiff, flow, spacing

    def frozen(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float) -> Couple:
        """Over a step."""
        return self.at(r, time, tau)

    def at(self, r: np.ndarray, time: float, tau: float = 1.0) -> Couple:
        """At nodes r (n, 3), in the flow of ``time``; ``tau`` is for its part in a step only."""
        edge, strained = np.zeros_like(r), np.zeros_like(r)
        edge[:-1] = np.diff(r, axis=0)
        there = self.stiff > 0.0
        if self._flow is not None:
            middle = (r + 0.5 * edge)[there]
            tangent = edge[there] / np.linalg.norm(edge[there], axis=1)[:, None]
            strained[there] = np.einsum("nji,nj->ni", gradient(self._flow, middle, time, self._spacing), tangent)
        return Couple(self.stiff, edge, strained, tau)

    def advance(self, velocity: np.ndarray) -> None:
        """Nothing."""

    def memory(self) -> dict[str, np.ndarray | float]:
        """Nothing."""
        return {}

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Nothing."""
