"""The motion of a scene that has not been stepped yet: what its first output shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..timestepping.base import FAILURES
from ..timestepping.semi_implicit import SemiImplicit

if TYPE_CHECKING:
    from ..timestepping.base import State
    from .model import Model

Motion = tuple[np.ndarray, np.ndarray, np.ndarray]


def first_motion(model: Model, state: State, dt: float) -> Motion:
    """Velocity, force on the fluid and reaction (n, m) of a first step of length dt."""
    if model.mass is not None and not model.case.fluid.inertial:
        dt *= 1e-3  # a rod with mass has the velocity that it starts with
    stepper = model.stepper if model.noise is None else SemiImplicit()
    try:
        step = stepper.step(model.rods.system, model.fluid, state, dt)
    except FAILURES:
        return _pushed(model, state, dt)
    return step.velocity, step.force, step.reaction


def _pushed(model: Model, state: State, dt: float) -> Motion:
    """The same, of the forces of this moment alone."""
    system, now, time = model.rods.system, state.configuration, state.time
    force, moment = system.forces(now, time)
    held, zero = system.held(time, time + dt), np.zeros_like(force)
    bodies = system.bodies(now)
    if bodies is not None:
        held = bodies.carried(held, now, now, moment, time, zero)
    answer = model.fluid.response(now.r, now.e3, time, dt).forced(force, held, zero)
    return answer.move / dt, answer.force, answer.reaction
