"""The counter-example of Sec. 7.1: the swimmer by finite differences of Eq. 42. It turns, and swims the wrong way.

    Z (r^{n+1} - r^n)/dt = -L4 r^{n+1} - L2 (kappa1 e2)^n + e3 dF'3/ds         (Eq. 43)
    L2 r = -kappa1 e2,   L3 r = -L1 (kappa1 e2)   at both ends, for the four outermost nodes, right sides at t_n

The stencils are those of the paper (seven points; L3 and L4 are of fourth order, not sixth), one-sided near the ends.
The tension is that of Sec. 3 along the nodes' own e3, as printed, and linearised, without which no step the paper
names is stable. Nothing in this makes the forces sum to zero. What the paper does not say: stencils next to the ends
(five points here), and that no tension pulls where the force balance ends (else the rod is torn at once).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ibfil.linalg.banded import Profile, solve

from .old_schemes import (
    REACH,
    Swimmer,
    add_drag,
    derivative,
    drag_times,
    put_rows,
    snapshot,
    stencils,
    tension,
)

ENDS = 5  # points of the one-sided stencils at the last node


def swim(swimmer: Swimmer, step: float, end: float, every: float) -> tuple[np.ndarray, np.ndarray]:
    """Times (T,) and positions (T, n, 3), ``every`` so often. Ends early where the rod is torn."""
    s, n = swimmer.s, swimmer.nodes
    l1, l2, l3, l4 = (stencils(s, order, ENDS) for order in (1, 2, 3, 4))
    ends = np.array([0, 1, n - 2, n - 1])
    fixed = np.zeros((n, 3, (2 * REACH + 1) * 3))
    inside = np.arange(2, n - 2)
    put_rows(fixed, l4, inside, inside)
    put_rows(fixed, l2, ends[[0, 3]], ends[[0, 3]])
    put_rows(fixed, l3, ends[[1, 2]], ends[[0, 3]])
    where = _profile(n)
    volume, ds = np.where(np.isin(np.arange(n), ends), 0.0, 1.0), s[1]
    inner = np.ones(n - 1)
    inner[[0, 1, -2, -1]] = 0.0  # beyond the last nodes with a force balance the tension is that of a free end
    r, times, shapes = swimmer.start(), [0.0], [swimmer.start()]
    stride = round(every / step)
    for k in range(round(end / step)):
        r1 = derivative(*l1, r)
        e3, e2 = snapshot(r1)
        preferred = swimmer.curvature(k * step)
        pushed = preferred[:, None] * e2
        bent = -np.sum(e2 * derivative(*l2, r), axis=1)
        force, gap = tension(swimmer, r, bent, preferred) * inner, np.diff(r, axis=0)
        right = drag_times(e3, swimmer.perp / step, volume, r) - derivative(*l2, pushed) * volume[:, None]
        matrix = fixed.copy()
        add_drag(matrix, e3, swimmer.perp / step, volume)
        add_tension(matrix, right, e3, gap, force, inner * swimmer.stretching, volume, ds)
        first, last = derivative(*l1, pushed)[[0, -1]]
        right[ends] = -np.array([pushed[0], first, last, pushed[-1]])
        r = solve(matrix, right, where)
        if not np.isfinite(r).all() or np.abs(r).max() > 1e3:
            break
        if (k + 1) % stride == 0:
            times.append((k + 1) * step)
            shapes.append(r)
    return np.array(times), np.array(shapes)


@njit(cache=True)
def add_tension(matrix, right, e3, gap, force, stretching, volume, ds):
    """Adds e3_i (F'_{i+1/2} - F'_{i-1/2})/ds, F' at the new time: F'^n + EA ds/|d|^3 d.(d^{n+1} - d).

    ``force`` F'^n, ``stretching`` EA and ``gap`` d of the segments (n - 1); e3 and ``volume`` of the nodes (n).
    """
    for i in range(force.size):
        length2 = gap[i, 0] ** 2 + gap[i, 1] ** 2 + gap[i, 2] ** 2
        slope = stretching[i] * ds / length2**1.5
        old = force[i] - slope * length2
        for node, sign in ((i, 1.0), (i + 1, -1.0)):
            for a in range(3):
                f = sign * volume[node] * e3[node, a] / ds
                right[node, a] += f * old
                for b in range(3):
                    for other, side in ((i, -1.0), (i + 1, 1.0)):
                        matrix[node, a, 3 * (other - node + REACH) + b] -= f * slope * side * gap[i, b]


def _profile(n: int) -> Profile:
    """Every row may reach as far as the band does."""
    rows = np.arange(n)
    return Profile(np.maximum(rows - REACH, 0), np.minimum(rows + REACH, n - 1), REACH)
