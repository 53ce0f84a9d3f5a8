"""The paper's scheme as it is printed (Eq. 21-33): finite volumes, frame and tension taken at the old time.

    (Z Lc/dt + A O2 W2 - F3hat^n) r^{n+1} = Z Lc/dt r^n - O2 (kappa1 e2)^n,      F3hat^n r = differences of F'3^n d/ds

Stretching is explicit in it: it stands steps up to about zeta_par ds^2/(2 EA) only, 1e-8 for the paper's numbers.
ibfil takes the tension's own derivative into the matrix, and has no such limit.
"""

from __future__ import annotations

import numpy as np

from ibfil.linalg.banded import Profile, solve

from .old_schemes import (
    REACH,
    Stencils,
    Swimmer,
    add_drag,
    add_segments,
    derivative,
    drag_times,
    snapshot,
    stencils,
    tension,
)


def limit(swimmer: Swimmer) -> float:
    """zeta_par ds^2/(2 EA), about which it should tear."""
    return 0.5 * swimmer.perp / (swimmer.nodes - 1) ** 2 / (2 * swimmer.stretching)


def swim(swimmer: Swimmer, step: float, steps: int) -> tuple[np.ndarray, bool]:
    """Positions (n, 3) after that many steps, and whether the rod has kept its length to a tenth."""
    s, n = swimmer.s, swimmer.nodes
    ds = s[1]
    l1, l2 = stencils(s, 1), stencils(s, 2)
    volume = np.full(n, ds)
    volume[[0, -1]] *= 0.5
    flux = _second_difference(n, ds)
    bending = _bending(flux, l2)
    rows = np.arange(n)
    where = Profile(np.maximum(rows - REACH, 0), np.minimum(rows + REACH, n - 1), REACH)
    r = swimmer.start()
    for k in range(steps):
        e3, e2 = snapshot(derivative(*l1, r))
        preferred = swimmer.curvature(k * step)
        preferred[[0, -1]] = 0.0  # no moment at the ends
        bent = -np.sum(e2 * derivative(*l2, r), axis=1)
        force = tension(swimmer, r, bent, preferred)
        matrix = bending.copy()
        add_drag(matrix, e3, swimmer.perp / step, volume)
        add_segments(matrix, force / ds, np.zeros(n - 1), np.zeros((n - 1, 3)), np.ones(n))
        right = drag_times(e3, swimmer.perp / step, volume, r) - flux @ (preferred[:, None] * e2)
        r = solve(matrix, right, where)
        length = np.linalg.norm(np.diff(r, axis=0), axis=1) / ds
        if not (np.isfinite(length).all() and np.abs(length - 1).max() < 0.1):
            return r, False
    return r, True


def _second_difference(n: int, ds: float) -> np.ndarray:
    """O2 (n, n), Eq. 25: differences of fluxes, the columns of the free ends zero."""
    o2 = (np.diag(np.full(n - 1, 1.0), -1) + np.diag(np.full(n - 1, 1.0), 1) - 2 * np.eye(n)) / ds
    o2[0, 0] = o2[-1, -1] = -1 / ds
    o2[:, [0, -1]] = 0.0
    return o2


def _bending(flux: np.ndarray, l2: Stencils) -> np.ndarray:
    """O2 W2, A = 1, by bands."""
    n = len(flux)
    w2 = np.zeros((n, n))
    for i in range(n):
        w2[i, l2.first[i] : l2.first[i] + l2.weight.shape[1]] = l2.weight[i]
    dense = flux @ w2
    matrix = np.zeros((n, 3, (2 * REACH + 1) * 3))
    for i in range(n):
        for j in range(max(0, i - REACH), min(n, i + REACH + 1)):
            for c in range(3):
                matrix[i, c, 3 * (j - i + REACH) + c] = dense[i, j]
    return matrix
