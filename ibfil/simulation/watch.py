"""A run looked at while it goes on: what is told of it without ending it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import steps

if TYPE_CHECKING:
    from ..timestepping.base import State
    from .model import Model


class Watch:
    """Looks at each step, and tells once of a fluid, and of disturbances, that are too fast for a given step."""

    def __init__(self, model: Model, limits: steps.StepLimits) -> None:
        self._model, self._limits = model, limits
        self._crossed = self._grown = False

    def step(self, time: float, dt: float) -> list[str]:
        """The lines to be told of a step of length dt that led to ``time``."""
        return self._crossing(time, dt) + self._growth(time, dt)

    def contact(self, before: State, now: State) -> list[str]:
        """The line on the first contact since ``before``. Raises Stopped where it ends a run."""
        contact = self._model.rods.contact
        told = contact.watch(before.configuration.r, now.configuration.r, before.time, now.time)
        return [told] if told else []

    def _crossing(self, time: float, dt: float) -> list[str]:
        """On a given step in which the fluid moves too far for its extrapolated advection."""
        longest = self._model.fluid.longest_step()
        if dt <= longest or self._crossed or self._limits.follows:
            return []
        self._crossed = True
        return [
            f"time.step: at t = {time:.4g} the fluid crosses {dt / longest:.2g} cells in a step; advection "
            f"is extrapolated, stable up to about one: take a step below {longest:.3g}"
        ]

    def _growth(self, time: float, dt: float) -> list[str]:
        """On a given step too long for disturbances that have begun to grow since the start."""
        rate = self._limits.begun
        if not rate or self._grown or not steps.is_long(dt, rate):
            return []
        self._grown = True
        return [f"at t = {time:.4g}: {steps.too_long(dt, steps.OWN, rate)}"]
