"""Linearly implicit Euler: one linear solve a step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fluids.base import Fluid
from .base import State, Step, System, _finish, require_values


@dataclass(frozen=True)
class SemiImplicit:
    """Linearly implicit Euler: one linear solve a step, compressive geometric stiffness left out of the matrix.

    (1 - dt M K) y = dt (u0 + M f(r_n, t + dt)), the paper's Eq. 31 with the tension linearised and K exact.
    """

    order: int = 1

    def step(self, system: System, fluid: Fluid, state: State, dt: float) -> Step:
        """One force, one stiffness, one linear solve. Raises NotConverged where these have no value."""
        after = state.time + dt
        system.begin(dt, 0.0)
        force, inner = system.forces(state.configuration, after)
        matrix = system.definite_stiffness(state.configuration, state.configuration, inner, after)
        zero, held = np.zeros(force.shape), system.held(state.time, after)
        response = fluid.response(state.configuration.r, state.configuration.e3, after, dt)
        answer = response.implicit(force, matrix, held, zero, zero)
        require_values(answer.move, force, response, held)
        return _finish(system, state, dt, answer.move, answer.move / dt, answer, 1, response)

    def amplification(self, z: np.ndarray) -> np.ndarray:
        """No number: what is left out of the matrix under compression is not told by the eigenvalue alone."""
        return np.full(np.shape(z), np.nan + 0j)
