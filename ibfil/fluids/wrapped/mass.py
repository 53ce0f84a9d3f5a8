"""The inertia of rods (Eqs. 3 and 4 of the paper, left out from there on): they push the fluid by f - m dv/dt.

With v = (y - target)/tau at the end of a step, and the derivative that the step itself takes, w = dt/dt_old,

    m dv/dt = m (v - v*)/tau,     v* = ((1 + w)^2 v_n - w^2 v_{n-1})/(1 + 2 w)

(BDF2; w = 0 is Euler, v* = v_n), so that Z = m/tau and z = Z v*. The turn about the tangent has a rotary inertia
likewise; that of a cross-section about the axes across it is left out, as in any rod that is thin for its waves.

Of what oscillates at omega with a decay c, BDF2 lowers omega by (omega dt)^2/3 of it, and makes the decay
c (1 - (omega dt)^2) + (omega dt)^3/4 omega.
"""

from __future__ import annotations

import numpy as np


class _Frozen:
    def __init__(self, inertia: np.ndarray, before: np.ndarray, tau: float) -> None:
        self._over, self._before, self._tau = inertia / tau, before, tau

    def add(self, constant: np.ndarray, matrix: np.ndarray) -> None:
        """z = Z v*, Z = m/tau on the diagonal."""
        constant += self._over * self._before
        _, m, width = matrix.shape
        for a in range(m):
            matrix[:, a, (width - m) // 2 + a] += self._over[:, a] / self._tau

    def from_fluid(self, u: np.ndarray) -> None:
        """Nothing: inertia is the rod's own."""
        return


class Mass:
    """The inertia (n, m) of nodes, mass and rotary inertia times control volumes, and their last two velocities."""

    def __init__(self, inertia: np.ndarray, velocity: np.ndarray) -> None:
        """``velocity`` (n, m) is that of the start."""
        self.inertia, self.velocity, self._before = inertia, velocity, velocity

    def energy(self, velocity: np.ndarray) -> float:
        """The kinetic energy of nodes that move with ``velocity`` (n, m)."""
        return 0.5 * float(np.sum(self.inertia * velocity**2))

    def frozen(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float) -> _Frozen:
        """Over a step that looks back as the rods do."""
        ahead = ((1 + w) ** 2 * self.velocity - w * w * self._before) / (1 + 2 * w)
        return _Frozen(self.inertia, ahead, tau)

    def advance(self, velocity: np.ndarray) -> None:
        """The velocity at the end of a step."""
        self._before, self.velocity = self.velocity, velocity

    def memory(self) -> dict[str, np.ndarray | float]:
        """The last two velocities."""
        return {"rods_velocity": self.velocity, "rods_velocity_before": self._before}

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Takes them up."""
        self.velocity, self._before = (np.asarray(memory[key]) for key in ("rods_velocity", "rods_velocity_before"))
