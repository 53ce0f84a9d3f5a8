"""The scheme of thermal runs: the linearised trapezoid with one correction, which keeps Boltzmann's covariance.

    y = xi + dt (u0 + M (f + K y/2 + R)),      f, K and M at the start, loads and flow of the middle of the step

is the fluid's implicit answer over tau = dt/2 with xi/2 for a target: half of y. Held unknowns go half their way. Of
a mode of rate lam, backward Euler leaves kT/k/(1 + lam dt/2), and BDF2 less; the trapezoid kT/k at every dt. K is
exact: a part left out would make stiff what is soft, and variances too small. The correction

    y <- the same with (f(q) + f(q + y))/2 + K (y_new - y)/2 in place of f + K y_new/2

is one Newton step, with the matrix of the first, towards the nonlinear trapezoid. It is zero for linear forces, and
takes away most of what turned segments would be stretched by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fluids.base import Fluid
from .base import State, Step, System
from .brownian import Asked, Noise


@dataclass(frozen=True)
class Trapezoid:
    """The linearised trapezoid and its correction: two forces, one stiffness, two solves with one matrix."""

    noise: Noise
    order: int = 1

    def step(self, system: System, fluid: Fluid, state: State, dt: float) -> Step:
        """The force of the step is what the rods do to the fluid: elastic, loads and reactions, no random part."""
        start, middle = state.configuration, state.time + 0.5 * dt
        system.begin(0.5 * dt, 0.0)
        force, inner = system.forces(start, middle)
        matrix = system.stiffness(start, start, inner, middle)
        response = fluid.response(start.r, start.e3, middle, 0.5 * dt)
        kick = 0.5 * self.noise.motion(Asked(system, fluid, state, response, middle, 0.5 * dt), dt)
        whole = system.held(state.time, state.time + dt)
        held = whole._replace(value=0.5 * whole.value)
        half = response.implicit(
            force, matrix if response.keeps else matrix.copy(), held, np.zeros_like(force), kick
        ).move
        there, _ = system.forces(system.move(start, 2 * half), middle)
        answer = response.implicit(0.5 * (force + there), matrix, held, half, kick)
        y = system.complete(2 * (half + answer.move))
        new = State(state.time + dt, system.move(start, y), y, dt, state.steps + 1)
        return Step(new, y / dt, answer.force, answer.reaction, 1, response)

    def amplification(self, z: np.ndarray) -> np.ndarray:
        """The factor by which a step takes a mode exp(lam t), z = lam dt: that of the trapezoid."""
        return (1.0 + 0.5 * z) / (1.0 - 0.5 * z)
