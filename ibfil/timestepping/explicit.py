"""Forward Euler."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fluids.base import Fluid
from .base import State, Step, System, _finish, require_values


@dataclass(frozen=True)
class Explicit:
    """Forward Euler: y = dt (u0 + M f(t)). Stable for dt < 2/rho(M K) only."""

    order: int = 1

    def step(self, system: System, fluid: Fluid, state: State, dt: float) -> Step:
        """One evaluation of the force, one answer of the fluid. Raises NotConverged where these have no value."""
        force, _ = system.forces(state.configuration, state.time)
        target = np.zeros(force.shape)
        response = fluid.response(state.configuration.r, state.configuration.e3, state.time, dt)
        held = system.held(state.time, state.time + dt)
        answer = response.forced(force, held, target)
        require_values(answer.move, force, response, held)
        return _finish(system, state, dt, answer.move, answer.move / dt, answer, 0, response)

    def amplification(self, z: np.ndarray) -> np.ndarray:
        """The factor by which a step takes a mode exp(lam t), z = lam dt: 1 + z."""
        return 1.0 + z
