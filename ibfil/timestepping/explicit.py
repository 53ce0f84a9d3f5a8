"""Forward Euler."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fluids.base import Fluid
from .base import Rods, State, Step, _finish


@dataclass(frozen=True)
class Explicit:
    """Forward Euler: y = dt (u0 + M f(t)). Stable for dt < 2/rho(M K) only."""

    order: int = 1

    def step(self, rods: Rods, fluid: Fluid, state: State, dt: float) -> Step:
        """One evaluation of the force, one answer of the fluid."""
        force, _ = rods.forces(state.shape, state.time)
        target = np.zeros(force.shape)
        response = fluid.response(state.shape.r, state.shape.e3, state.time, dt)
        answer = response.forced(force, rods.held(state.time, state.time + dt), target)
        return _finish(rods, state, dt, answer.move, answer.move / dt, answer, 0, response)
