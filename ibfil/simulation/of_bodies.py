"""The bodies and motors of an output, from the rows they have in the arrays of a step (bodies/rows.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..io.snapshots import BodySnapshot, MotorSnapshot

if TYPE_CHECKING:
    from ..assembly.stacked import RodStack
    from .solved_state import SolvedState


def bodies(rods: RodStack, now: SolvedState) -> dict[str, BodySnapshot]:
    """The bodies by name."""
    rows, out = rods.with_bodies.rows, {}
    poses = rows.poses(now.state.configuration)
    for b, (name, body) in enumerate(zip(rods.bodies, rows.bodies, strict=True)):
        centre, turn = rows.n + 2 * b, rows.n + 2 * b + 1
        given = body.moves is not None
        e1, e2, e3 = (axis.copy() for axis in poses.axes[b].T)
        out[name] = BodySnapshot(
            poses.centre[b].copy(),
            e1,
            e2,
            e3,
            now.velocity[centre, :3].copy(),
            now.velocity[turn, :3] / rows.length,
            now.force[centre, :3].copy(),
            now.force[turn, :3] * rows.length,
            now.reaction[centre, :3].copy() if given else None,
            now.reaction[turn, :3] * rows.length if given else None,
            None if body.cloud is None else poses.centre[b] + body.cloud @ poses.axes[b].T,
        )
    return out


def motors(rods: RodStack, now: SolvedState) -> dict[str, MotorSnapshot]:
    """The motors by name."""
    rows, out = rods.with_bodies.rows, {}
    angles, first = rows.poses(now.state.configuration).angle, rows.n + 2 * len(rows.bodies)
    for k, (name, motor) in enumerate(zip(rods.motors, rows.motors, strict=True)):
        rate = float(now.velocity[first + k, 0]) / rows.length
        if motor.torque is not None:
            torque = motor.torque(now.state.time) - motor.drag * rate
        else:
            torque = float(now.reaction[first + k, 0]) * rows.length
        out[name] = MotorSnapshot(float(angles[k]), rate, torque, torque * rate)
    return out


def wrench(rods: RodStack, now: SolvedState) -> tuple[np.ndarray, np.ndarray]:
    """Total force and torque (3,) on the fluid, about the origin, at the geometry at which the fluid was asked."""
    rows, there, force = rods.with_bodies.rows, now.there, now.force
    n, end = rows.n, rows.n + 2 * len(rows.bodies)
    moved, turned = force[n:end:2, :3], force[n + 1 : end : 2, :3]
    torque = np.cross(there.r[:n], force[:n, :3]).sum(axis=0) + np.cross(there.r[n:end:2], moved).sum(axis=0)
    if force.shape[1] == 4:
        torque = torque + (force[:n, 3:] * there.e3[:n]).sum(axis=0)
    return force[:n, :3].sum(axis=0) + moved.sum(axis=0), torque + turned.sum(axis=0) * rows.length
