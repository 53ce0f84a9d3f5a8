"""How fast what pushes or turns bodies moves them: forces, torques, and motors whose torque is given."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..assembly.bodies.clouds import size

if TYPE_CHECKING:
    from ..bodies.body import Poses
    from .model import Model

_THIN = 0.01  # of the length: rods turn about themselves as if nodes were so far away


def body_rate(model: Model, time: float) -> float:
    """The rate, radians a time, at a time: turning by an angle, or, a turn a rod's length, moving along.

    Drags are those of spheres of the bodies' mean size and of the rods about them, flow between them left out.
    """
    system = model.rods.with_bodies
    poses, length = system.rows.start(), system.length
    found = [0.0]
    sizes = [float(np.mean(size(model.case, name, body))) for name, body in model.case.each_body.items()]
    for b, body in enumerate(system.rows.bodies):
        force, torque = body.pushed(poses.axes[b], time)
        moved, turned = _drags(model, system.nodes[b], poses.centre[b])
        moved += 6 * np.pi * model.case.fluid.viscosity * sizes[b]
        turned += 8 * np.pi * model.case.fluid.viscosity * sizes[b] ** 3 * np.eye(3)
        if body.moves is None:
            found.append(2 * np.pi * float(np.linalg.norm(force)) / (moved * length))
        if body.turns is None:
            found.append(float(np.linalg.norm(np.linalg.solve(turned, torque))))
    for k, motor in enumerate(system.motors):
        if motor.torque is not None:
            rod = _about_axis(model, k, poses)
            head = 8 * np.pi * model.case.fluid.viscosity * sizes[motor.body] ** 3
            drag = rod if system.rows.bodies[motor.body].turns is not None else rod * head / (rod + head)
            found.append(abs(motor.torque(time)) / (drag + motor.drag))
    return max(found)


def _of_nodes(model: Model, nodes: np.ndarray) -> np.ndarray:
    """The drag across (k,) of nodes."""
    out = np.zeros(model.rods.count)
    for filament, where in zip(model.rods.filaments, model.rods.nodes, strict=True):
        out[where] = model.fluid_model.drag(filament) * model.rods.system.volume[where]
    found: np.ndarray = out[nodes]
    return found


def _drags(model: Model, nodes: np.ndarray, centre: np.ndarray) -> tuple[float, np.ndarray]:
    """The drag of nodes against moving, and against turning about a point (3, 3)."""
    drag, away = _of_nodes(model, nodes), model.rods.start.r[nodes] - centre
    least = _THIN * model.rods.system.length
    square = np.sum(away**2, axis=1) + least**2
    turned: np.ndarray = (drag @ square) * np.eye(3) - np.einsum("i,ia,ib->ab", drag, away, away)
    return float(drag.sum()), turned


def _about_axis(model: Model, k: int, poses: Poses) -> float:
    """The drag of the rod of the k-th motor against turning about its axis, at least as if a hundredth of it away."""
    system = model.rods.with_bodies
    motor, nodes = system.motors[k], system.driven[k]
    axis = poses.axes[motor.body] @ motor.axis
    away = model.rods.start.r[nodes] - poses.centre[motor.body] - poses.axes[motor.body] @ motor.point
    across = np.sum(away**2, axis=1) - (away @ axis) ** 2
    return float(_of_nodes(model, nodes) @ np.maximum(across, (_THIN * system.length) ** 2))
