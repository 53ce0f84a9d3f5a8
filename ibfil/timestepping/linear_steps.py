"""Disturbances of a rest, small ones, in the course of time: by the motion itself, and by the steps of a scheme.

Both follow from the spectrum of the linearised motion (linear_motion.py, spectrum.py): x = sum_k c_k v_k goes to
sum_k c_k exp(lam_k t) v_k, and in n steps dt of a scheme to sum_k c_k g_k^n v_k. g_k = g(lam_k dt) is what the scheme
makes of a mode. Linearly implicit Euler leaves compression out of its matrix, so that its modes are its own: those of

    x -> x + (1 - dt A_d)^-1 dt A x,       A_d the elastic part with K without compression
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..rods.frame import transport
from ..rods.geometry import Configuration
from .base import Stepper
from .linear_motion import LinearMotion

_NOTHING = 1e-300  # of a mode that a step takes away
MOST = 800  # unknowns up to which all modes are found


class Course(NamedTuple):
    """How disturbances x (k,) go on: exponential ``rates`` (k,), a unit of time or a step, of ``vectors`` (k, k)."""

    rates: np.ndarray
    vectors: np.ndarray

    def after(self, x: np.ndarray, times: np.ndarray) -> np.ndarray:
        """x (k,) after ``times`` (t,) of these units: (t, k); no numbers where they are too large for one."""
        share = np.linalg.solve(self.vectors, x)
        with np.errstate(over="ignore", invalid="ignore"):
            power: np.ndarray = (share * np.exp(np.multiply.outer(times, self.rates))) @ self.vectors.T
        return power.real


class Spectrum:
    """All modes of a motion of at most MOST unknowns."""

    def __init__(self, motion: LinearMotion) -> None:
        from scipy.linalg import eig

        self.motion = motion
        self.values, self.vectors = eig(motion.matrix, check_finite=True)

    @property
    def leading(self) -> complex:
        """The eigenvalue of the mode that grows fastest."""
        return complex(self.values[np.argmax(self.values.real)])

    def itself(self) -> Course:
        """The motion, in time."""
        return Course(self.values, self.vectors)

    def steps(self, scheme: Stepper, dt: float) -> Course:
        """The steps of a scheme, in numbers of steps."""
        factors = scheme.amplification(self.values * dt)
        return _course(factors, self.vectors) if np.isfinite(factors).all() else self._without_compression(dt)

    def _without_compression(self, dt: float) -> Course:
        from scipy.linalg import eig

        moved = self.motion.relaxation(dt, definite=True)
        step = np.eye(len(self.values)) + dt * np.column_stack([moved(column) for column in self.motion.matrix.T])
        factors, vectors = eig(step, check_finite=True)
        return _course(factors, vectors)


def _course(factors: np.ndarray, vectors: np.ndarray) -> Course:
    return Course(np.log(np.where(factors == 0, _NOTHING, factors + 0j)), vectors)


def apart(motion: LinearMotion, there: Configuration) -> np.ndarray:
    """The displacements (k,) of the unconstrained unknowns from the configuration of ``motion`` to another one."""
    here, out = motion.configuration, np.zeros(motion.shape)
    out[:, :3] = there.r - here.r
    if motion.system.unknowns == 4:
        carried, _ = transport(here.e1, here.e3, there.e3, np.zeros(len(out)))
        across = np.cross(there.e3, carried)
        out[:, 3] = np.arctan2((there.e1 * across).sum(axis=1), (there.e1 * carried).sum(axis=1))
    flat: np.ndarray = out.ravel()[motion.free]
    return flat
