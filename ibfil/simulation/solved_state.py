"""A simulation at one instant, with what the step to it found."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from ..rods.geometry import Configuration
    from ..timestepping.base import State


class SolvedState(NamedTuple):
    """A simulation at one instant: the state, and velocity, force on the fluid, reaction (n, m) of the step to it."""

    state: State
    velocity: np.ndarray
    force: np.ndarray
    reaction: np.ndarray
    iterations: int
    shortened: int
    there: Configuration  # at which the fluid was asked for bodies
