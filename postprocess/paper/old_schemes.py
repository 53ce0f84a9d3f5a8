"""What the two schemes that ibfil does not have share: the swimmer of Sec. 7.1, its drag, its tension, its stencils.

Nodes (n, 3) in the plane z = 0, e1 = z, A = 1. Band matrices by node as in ibfil/linalg/banded.py: (n, 3, (2 w + 1) 3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from ibfil.linalg.finite_differences import weights
from ibfil.shapes.initial import initial_shape
from ibfil.studies.member import Member

REACH = 6  # nodes a row of the band matrices reaches to either side


@dataclass(frozen=True)
class Swimmer:
    """L = 1, A = 1, kappa1 = 8 sin(4 pi s - 10 t); ``stretching`` is EA, ``viscosity`` eta (zeta_perp = 4 pi eta)."""

    nodes: int = 128
    stretching: float = 1.6e4
    viscosity: float = 1.0

    @property
    def s(self) -> np.ndarray:
        """Arclength (n,)."""
        return np.linspace(0.0, 1.0, self.nodes)

    @property
    def perp(self) -> float:
        """zeta_perp."""
        return 4 * np.pi * self.viscosity

    def start(self) -> np.ndarray:
        """The relaxed shape at t = 0 (n, 3), as the shipped case has it."""
        own = (f"filament.swimmer.nodes={self.nodes}",)
        return initial_shape(Member("start", "swimmer_rft", own).resolved().filaments["swimmer"])[0]

    def curvature(self, time: float) -> np.ndarray:
        """kappa1 (n,)."""
        return 8.0 * np.sin(4 * np.pi * self.s - 10.0 * time)


class Stencils(NamedTuple):
    """First node (n,) and weights (n, 8) of a derivative: seven points inside, one-sided at the ends."""

    first: np.ndarray
    weight: np.ndarray


def stencils(s: np.ndarray, order: int, at_ends: int = 7) -> Stencils:
    """The ``order``-th derivative by seven points, five at the third node, ``at_ends`` one-sided at the outer two."""
    n = len(s)
    first = np.clip(np.arange(n) - 3, 0, n - 7)
    weight = np.zeros((n, 7))
    for i, a in enumerate(first):
        beside = min(i, n - 1 - i)
        low, high = (a, a + 7) if beside > 2 else (i - 2, i + 3) if beside == 2 else (0, at_ends)
        if beside < 2 and i > n // 2:
            low, high = n - at_ends, n
        weight[i, low - a : high - a] = weights(s[low:high], s[i], order)
    return Stencils(first, weight)


@njit(cache=True)
def derivative(first, weight, field):
    """A stencil applied to a field (n, 3)."""
    out = np.zeros_like(field)
    for i in range(first.size):
        for k in range(weight.shape[1]):
            for c in range(3):
                out[i, c] += weight[i, k] * field[first[i] + k, c]
    return out


@njit(cache=True)
def add_drag(matrix, e3, perp, volume):
    """Adds volume (n,) times Z = perp (1 - e3 e3/2), over the step if ``perp`` is, to the diagonal blocks."""
    w = REACH
    for i in range(e3.shape[0]):
        for a in range(3):
            matrix[i, a, 3 * w + a] += volume[i] * perp
            for b in range(3):
                matrix[i, a, 3 * w + b] -= 0.5 * volume[i] * perp * e3[i, a] * e3[i, b]


@njit(cache=True)
def drag_times(e3, perp, volume, r):
    """The same times r (n, 3)."""
    out = np.empty_like(r)
    for i in range(r.shape[0]):
        along = e3[i, 0] * r[i, 0] + e3[i, 1] * r[i, 1] + e3[i, 2] * r[i, 2]
        for c in range(3):
            out[i, c] = volume[i] * perp * (r[i, c] - 0.5 * along * e3[i, c])
    return out


def tension(swimmer: Swimmer, r: np.ndarray, curvature: np.ndarray, preferred: np.ndarray) -> np.ndarray:
    """F'3 (n - 1,) at half nodes: EA (1 - ds/|d|), Eq. 20 corrected, less the mean of P = (O1 - kappa1) O1."""
    length = np.linalg.norm(np.diff(r, axis=0), axis=1)
    p = (curvature - preferred) * curvature
    p[[0, -1]] = 0.0  # no moment at the ends
    ds = 1.0 / (swimmer.nodes - 1)
    return swimmer.stretching * (1 - ds / length) - 0.5 * (p[1:] + p[:-1])


@njit(cache=True)
def add_segments(matrix, stiff, axial, gap, scale):
    """Subtracts, of every segment, [stiff 1 + axial d d^T] (r_{i+1} - r_i) from the force balance of its two nodes.

    ``stiff``, ``axial`` (n - 1,), ``gap`` d (n - 1, 3); ``scale`` (n,) of each node's row.
    """
    w = REACH
    for i in range(stiff.size):
        for a in range(3):
            for b in range(3):
                k = axial[i] * gap[i, a] * gap[i, b] + (stiff[i] if a == b else 0.0)
                matrix[i, a, 3 * w + b] += scale[i] * k
                matrix[i, a, 3 * (w + 1) + b] -= scale[i] * k
                matrix[i + 1, a, 3 * w + b] += scale[i + 1] * k
                matrix[i + 1, a, 3 * (w - 1) + b] -= scale[i + 1] * k


def snapshot(r1: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """e3 and e2 = e3 x z (n, 3) from r'."""
    e3 = r1 / np.linalg.norm(r1, axis=1)[:, None]
    return e3, np.column_stack([e3[:, 1], -e3[:, 0], np.zeros(len(e3))])


def put_rows(matrix: np.ndarray, stencil: Stencils, rows: np.ndarray, at: np.ndarray) -> None:
    """Writes the stencils ``at`` those nodes into the ``rows``, the same for x, y and z."""
    for row, node in zip(rows, at, strict=True):
        for k, value in enumerate(stencil.weight[node]):
            column = 3 * (stencil.first[node] + k - row + REACH)
            for c in range(3):
                matrix[row, c, column + c] += value
