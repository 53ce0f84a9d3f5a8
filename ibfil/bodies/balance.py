"""The balance of bodies: what bodies and their rods do to the fluid together is what pushes them from outside.

    body b    sum over the nodes of its rods of (F - ext),  (r* - X*) x (F - ext) + tau e3*,  and its own drag, = W_b
    motor k   Qa* . sum over the nodes of its rod of [ (r* - P*) x (F - ext) + tau e3* ] = torque on the rod

F is what a node does to the fluid, ext the loads on it, * the geometry at which the fluid was asked. Eq. 44 itself has
a net torque of second order; asked of the whole, the balance holds to round-off whatever the rods' forces are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..rods.geometry import Configuration
from .attached import Unknowns
from .body import Motor, Poses


def balance(
    there: Configuration,
    poses: Poses,
    nodes: Sequence[np.ndarray],
    turned: Sequence[np.ndarray],
    motors: Sequence[Motor],
    q: Unknowns,
    m: int,
) -> np.ndarray:
    """The matrix (p, n, m) that takes forces (n, m) to what the balances add up, at the configuration ``there``.

    ``nodes`` are those of each body's rods, ``turned`` those of each motor's rod.
    """
    n = len(there.r)
    out = np.zeros((q.size, n, m))
    for b, (centre, at) in enumerate(zip(poses.centre, nodes, strict=True)):
        for c in range(3):
            out[6 * b + c, at, c] = 1.0
        out[q.turns(b), at] = torques(there, at, centre, m) / q.length
    for k, (motor, at) in enumerate(zip(motors, turned, strict=True)):
        axes = poses.axes[motor.body]
        point = poses.centre[motor.body] + axes @ motor.point
        about = np.tensordot(axes @ motor.axis, torques(there, at, point, m), 1)
        out[q.motor(k), at] = about / q.length
    return out


def torques(there: Configuration, at: np.ndarray, centre: np.ndarray, m: int) -> np.ndarray:
    """The matrices (3, k, m) that take forces on the nodes ``at`` (k,) to their torque about a point."""
    x, y, z = (there.r[at] - centre).T
    out = np.zeros((3, len(at), m))
    out[0, :, 1], out[0, :, 2] = -z, y
    out[1, :, 0], out[1, :, 2] = z, -x
    out[2, :, 0], out[2, :, 1] = -y, x
    if m == 4:
        out[:, :, 3] = there.e3[at].T
    return out
