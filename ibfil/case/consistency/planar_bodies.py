"""Bodies of filaments without ``twisting``: the plane of the rod is that of the body's motion."""

from __future__ import annotations

from collections.abc import Iterator

from ..bodies.body import Body
from ..filament import Filament
from ..schema import Scene
from .vectors import Vector, across, along, cross, minus, parallel


def bodies_leaving(filament: Filament, normal: Vector, case: Scene) -> list[str]:
    """The keys of bodies, and of other filaments in them, that lead out of the plane of a filament."""
    names = {end.body for end in (filament.start, filament.finish) if end.attached and end.body in case.bodies}
    out = [key for name in sorted(names) for key in _leaving(f"body.{name}", case.bodies[name], filament, normal)]
    for name, other in case.filaments.items():
        for side, end in (("start", other.start), ("finish", other.finish)):
            if other is not filament and end.attached and end.body in names and _elsewhere(other, filament, normal):
                out.append(f"filament.{name}.{side}.body")
    return out


def _leaving(key: str, body: Body, filament: Filament, normal: Vector) -> Iterator[str]:
    if body.position is not None and along(minus(body.position, filament.position), normal, filament):
        yield f"{key}.position"
    if body.shape.file is not None:  # nothing tells whether its markers are even about the plane
        yield f"{key}.shape"
    first, second = body.axes
    if len(set(body.shape.semi_axes)) > 1 and not any(
        parallel(axis, normal) for axis in (first, cross(first, second), cross(cross(first, second), first))
    ):
        yield f"{key}.axes"
    basis = (first, cross(cross(first, second), first), cross(first, second)) if body.own_axes else None
    for name, given, turns in (("force", body.force, False), ("torque", body.torque, True)):
        wanted = across(normal) if turns else [normal]
        if basis is not None:  # components along the body's axes: those of the directions, seen from it
            wanted = [_seen(direction, basis) for direction in wanted]
        if given is not None and any(along(given, direction, filament) for direction in wanted):
            yield f"{key}.{name}"
    motion = body.given_motion
    if motion is not None:
        if along(motion.moves, normal, filament):
            yield f"{key}.motion.moves"
        if any(along(motion.turns, direction, filament) for direction in across(normal)):
            yield f"{key}.motion.turns"


def _seen(direction: Vector, basis: tuple[Vector, Vector, Vector]) -> Vector:
    """A direction in axes that need not be of length one."""
    x, y, z = (sum(a * b for a, b in zip(direction, axis, strict=True)) for axis in basis)
    sizes = [sum(a * a for a in axis) ** 0.5 for axis in basis]
    return x / sizes[0], y / sizes[1], z / sizes[2]


def _elsewhere(other: Filament, filament: Filament, normal: Vector) -> bool:
    """Whether another filament of the body is not in the plane, or twists."""
    away = minus(other.position, filament.position)
    return other.twisting is not None or along(away, normal, filament) or along(other.direction, normal, filament)
