"""How far a flow draws a clamped helix out: the rod's own equations at rest, integrated by a second path.

    F' + zeta_perp u + (zeta_par - zeta_perp) (e3.u) e3 = 0,     M' + e3 x F = 0          (Eq. 3, 5, 48 at rest)
    e_k' = O x e_k,  r' = e3,  M1 = A (O1 - kappa), M2 = A O2, M3 = C (O3 - tau);   F = M = 0 at the free end

A boundary-value problem by collocation: an inextensible rod, no time; nothing is shared with ibfil.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_bvp, solve_ivp


@dataclass(frozen=True)
class Helix:
    """A clamped helix along x: length, curvature, torsion, moduli, and drag per length across and along."""

    length: float
    kappa: float
    tau: float
    bending: float
    twisting: float
    perp: float
    par: float

    def snapshot(self) -> np.ndarray:
        """Directors (columns) at the clamp, for an axis along x: kappa e1 + tau e3 is along it."""
        size = np.hypot(self.kappa, self.tau)
        axis, _, up = np.eye(3)
        e1 = (self.kappa * axis + self.tau * up) / size
        e3 = (self.tau * axis - self.kappa * up) / size
        return np.column_stack([e1, np.cross(e3, e1), e3])

    def derivative(self, y: np.ndarray, u: float) -> np.ndarray:
        """d/ds of r, e1, e2, e3, F, M (18, k) in a flow u along x."""
        e1, e2, e3, force, moment = y[3:].reshape(5, 3, -1)
        o1 = self.kappa + np.sum(moment * e1, axis=0) / self.bending
        o2 = np.sum(moment * e2, axis=0) / self.bending
        o3 = self.tau + np.sum(moment * e3, axis=0) / self.twisting
        strain = o1 * e1 + o2 * e2 + o3 * e3
        drag = (self.perp - self.par) * u * e3[0] * e3
        drag[0] -= self.perp * u
        turned = [np.cross(strain, e, axis=0) for e in (e1, e2, e3)]
        return np.concatenate([e3, *turned, drag, -np.cross(e3, force, axis=0)])

    def extensions(self, speeds: Sequence[float]) -> list[float]:
        """How far the tip has gone along x in flows of these speeds, which grow from zero. Raises RuntimeError."""
        clamp = np.concatenate([np.zeros(3), *self.snapshot().T])
        start = np.concatenate([clamp, np.zeros(6)])
        s = np.linspace(0.0, self.length, 201)
        free = solve_ivp(lambda x, y: self.derivative(y[:, None], 0.0)[:, 0], (0, self.length), start, "DOP853", s)
        y, rest, found, last = free.y, free.y[0, -1], [], 0.0
        for speed in speeds:
            for u in np.linspace(last, speed, max(2, int(np.ceil((speed - last) / 0.1)) + 1))[1:]:
                answer = solve_bvp(
                    lambda x, y, u=u: self.derivative(y, u),
                    lambda a, b: np.concatenate([a[:12] - clamp, b[12:]]),
                    *(s, y),
                    tol=1e-4,
                    max_nodes=20000,
                )
                if not answer.success:
                    raise RuntimeError(f"no state of rest found at u = {u:g}: {answer.message}")
                s, y = answer.x, answer.y
            found.append(float(y[0, -1] - rest))
            last = speed
        return found
