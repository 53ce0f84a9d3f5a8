"""The ends of rods in bodies: where these have them, and how that changes as bodies and motors turn.

With the place d, the tangent T0 and e1 E0 of an end in body axes, and a motor of axis a through p at the angle alpha,

    A = exp(alpha a),  P = X + Q (p + A (d - p)),  T = Q A T0,  E1 = Q A E0
    phi = atan2((v x E1).T, v.E1),   v = E1_old - (E1_old.T)/(1 + e3_old.T) (e3_old + T)      the turn of Eq. 41's frame
    dr = dX + dw_b x (P - X) + dalpha Qa x (P - X - Q p),   dT = dw x T,   dw = dw_b + dalpha Qa
    dphi = T.dw - turn.(dw x T),   turn = (T x e3_old)/(1 + e3_old.T)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..rods.geometry import Configuration
from ..rods.linearization import cross
from ..rods.loads import cross_matrix
from .body import Attachment, Motor, Poses
from .rotation import rotation, turning


class Place(NamedTuple):
    """Where a body has an end: its place, tangent and e1 (3,), None as in the attachment."""

    r: np.ndarray
    tangent: np.ndarray | None
    e1: np.ndarray | None


def place(end: Attachment, motors: Sequence[Motor], poses: Poses) -> Place:
    """Where the bodies have the end."""
    turn, d = poses.axes[end.body], end.place
    if end.motor >= 0:
        motor = motors[end.motor]
        spun = rotation(poses.angle[end.motor] * motor.axis)
        d = motor.point + spun @ (d - motor.point)
        turned = turn @ spun
    else:
        turned = turn
    tangent = None if end.tangent is None else turned @ end.tangent
    e1 = None if end.director is None else turned @ end.director
    return Place(poses.centre[end.body] + turn @ d, tangent, e1)


def turn_of(start: Configuration, node: int, to: Place) -> float:
    """phi: the angle by which e1 is turned about the tangent after it was carried (Eq. 41) from ``start``."""
    assert to.tangent is not None
    assert to.e1 is not None
    e1, e3, t = start.e1[node], start.e3[node], to.tangent
    v = e1 - (e1 @ t) / (1.0 + e3 @ t) * (e3 + t)
    return float(np.arctan2(cross(v, to.e1) @ t, v @ to.e1))


class Levers(NamedTuple):
    """How an end follows q (p,): its place and tangent (3, p), and the turn of its frame (p,)."""

    r: np.ndarray
    tangent: np.ndarray
    turn: np.ndarray


class Unknowns(NamedTuple):
    """Where the unknowns of bodies and motors stand in q: bodies six each, then motors; turns times ``length``."""

    bodies: int
    motors: int
    length: float

    @property
    def size(self) -> int:
        """p."""
        return 6 * self.bodies + self.motors

    def moves(self, body: int) -> slice:
        """The displacement of a body's centre."""
        return slice(6 * body, 6 * body + 3)

    def turns(self, body: int) -> slice:
        """Its rotation vector over the step, times the length."""
        return slice(6 * body + 3, 6 * body + 6)

    def motor(self, motor: int) -> int:
        """The angle of a motor over the step, times the length."""
        return 6 * self.bodies + motor


def levers(
    end: Attachment, motors: Sequence[Motor], poses: Poses, turns: np.ndarray, start: Configuration, q: Unknowns
) -> Levers:
    """The levers of an end; ``turns`` (b, 3) are the bodies' rotation vectors over the step."""
    at = place(end, motors, poses)
    b, dw = end.body, np.zeros((3, q.size))
    r, centre = np.zeros((3, q.size)), poses.centre[end.body]
    dw[:, q.turns(b)] = turning(turns[b]) / q.length
    r[:, q.moves(b)] = np.eye(3)
    r[:, q.turns(b)] = -cross_matrix(at.r - centre) @ dw[:, q.turns(b)]
    if end.motor >= 0:
        motor, k = motors[end.motor], q.motor(end.motor)
        dw[:, k] = poses.axes[b] @ motor.axis / q.length
        r[:, k] = cross(dw[:, k], at.r - centre - poses.axes[b] @ motor.point)
    if at.tangent is None:
        return Levers(r, np.zeros_like(r), np.zeros(q.size))
    t, old = at.tangent, start.e3[end.node]
    turn = cross(t, old) / (1.0 + old @ t)
    return Levers(r, -cross_matrix(t) @ dw, (t - cross(t, turn)) @ dw)
