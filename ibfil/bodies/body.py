"""A body, and a motor that turns a rod in it: how they begin, what moves them, what pushes them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .rotation import rotation, vector_of

OfTime = Callable[[float], np.ndarray]
NOTHING = np.zeros(3)


@dataclass(frozen=True)
class Body:
    """A rigid body: its centre (3,) and axes (3, 3), columns, at the start, and what is known of its motion.

    ``moves`` and ``turns`` give its displacement and its rotation vector since t = 0, in the lab; None where it is free
    to move, or to turn. ``force`` and ``torque`` are external, along its axes where ``own_axes``.
    ``cloud`` (k, 3) are its markers in its axes, where these are given.
    """

    centre: np.ndarray
    axes: np.ndarray
    moves: OfTime | None = None
    turns: OfTime | None = None
    force: OfTime | None = None
    torque: OfTime | None = None
    own_axes: bool = False
    cloud: np.ndarray | None = None

    def moved(self, before: float, after: float) -> np.ndarray:
        """The displacement (3,) between two times, where that is given."""
        assert self.moves is not None
        return self.moves(after) - self.moves(before)

    def turned(self, before: float, after: float) -> np.ndarray:
        """The rotation vector (3,) between two times, where that is given."""
        assert self.turns is not None
        return vector_of(rotation(self.turns(after)) @ rotation(self.turns(before)).T)

    def pushed(self, axes: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """External force and torque (3,) in the lab, where its axes are ``axes``."""
        force = NOTHING if self.force is None else self.force(time)
        torque = NOTHING if self.torque is None else self.torque(time)
        return (axes @ force, axes @ torque) if self.own_axes else (force, torque)


@dataclass(frozen=True)
class Motor:
    """A motor in ``body`` (its number) that turns a rod about ``axis`` (3,) through ``point`` (3,), in body axes.

    ``angle`` gives the angle turned between two times; without, ``torque`` is that on the rod at rest, less ``drag``
    times the rate: a line of torque against speed.
    """

    body: int
    axis: np.ndarray
    point: np.ndarray
    angle: Callable[[float, float], float] | None = None
    torque: Callable[[float], float] | None = None
    drag: float = 0.0


class Attachment(NamedTuple):
    """An end of a rod in a body: its place, tangent and e1 (3,) in body axes at the start of the run.

    ``motor`` is the number of the motor that turns it, or -1. ``tangent`` is None where it is hinged, ``director``
    where its e1 is not held.
    """

    node: int
    body: int
    motor: int
    place: np.ndarray
    tangent: np.ndarray | None
    director: np.ndarray | None


class Poses(NamedTuple):
    """Where bodies and motors are: centres (b, 3), axes (b, 3, 3) in columns, angles (k,) of motors."""

    centre: np.ndarray
    axes: np.ndarray
    angle: np.ndarray
