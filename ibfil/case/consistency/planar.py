"""A filament without ``twisting``: its e1 is carried along and never turned, so nothing may ask for a twist.

A round, naturally straight rod does not know where its e1 points, and may do anything. A rod with preferred
curvature or A1 != A2 does: it twists when it leaves the plane normal to e1 or to e2, and is then refused.
Shapes given by points or formulas are not looked at here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..bodies.end import End
from ..expressions import Expression, ExpressionError
from ..faults import Fault
from ..filament import Filament, Loads
from ..fluid import Fluid
from ..schema import Scene
from ..shape import Circle, ExpressionShape, Helix, Straight
from .planar_bodies import bodies_leaving
from .vectors import Vector, across, along, component, cross, minus, unit, value


def check_planar(key: str, filament: Filament, case: Scene) -> Iterator[Fault]:
    """The faults of a filament without ``twisting`` that needs it."""
    reads = tuple(f"{key}.{name}" for name in ("twisting", "curvature", "bending", "direction", "normal", "position"))
    for name in _twists(filament):
        yield Fault(f"{key}.{name}", "a twist and no twisting", "only with twisting, the twist modulus C", reads[:1])
    bent = [not _zero(kappa) for kappa in filament.curvature]
    ribbon = filament.bending[0] != filament.bending[1]
    if all(bent):
        allowed = "3-D curvature only with twisting; if it is planar, turn normal so that one component is 0"
        yield Fault(f"{key}.curvature", "two components and no twisting", allowed, reads)
    elif ribbon or any(bent):
        # kappa1 bends the rod in the plane normal to e1, kappa2 in that normal to e2; 0 leaves both.
        leaving = [_leaving(key, filament, case, axis) for axis in (0, 1) if not bent[1 - axis]]
        if all(leaving):
            what = "A1 != A2" if ribbon else "preferred curvature"
            found = f"what leads out of the plane of a rod with {what} and no twisting"
            allowed = "a planar scene, or twisting, the twist modulus C"
            yield from (Fault(name, found, allowed, reads) for name in leaving[0])


def _zero(expression: Expression) -> bool:
    return expression.constant == 0.0


def _twists(filament: Filament) -> Iterator[str]:
    """The keys that mean a twist."""
    if not _zero(filament.twist_rate):
        yield "twist_rate"
    if not _zero(filament.shape.twist):
        yield "shape.twist"
    for side, end in (("start", filament.start), ("finish", filament.finish)):
        for name in ("spin", "angle"):
            if getattr(end, name) is not None:
                yield f"{side}.{name}"
        if end.end == "clamped" and end.twist == "free":
            yield f"{side}.twist"
        if end.moment is not None and _about_the_rod(end, filament):
            yield f"{side}.moment"
    loads = filament.loads
    if loads is not None and loads.moment is not None and not _zero(loads.moment[2]):
        yield "loads.moment.2"


def _about_the_rod(end: End, filament: Filament) -> bool:
    """Whether the moment at an end has a part along the rod there, as far as a case tells where that points."""
    assert end.moment is not None
    if end.frame == "body":
        return not _zero(end.moment[2])
    directors = _directors(filament)
    shape = filament.shape
    if directors is None or not isinstance(shape, Straight | Circle):
        return isinstance(shape, Helix)  # which points everywhere
    bent = isinstance(shape, Circle) and shape.curvature != 0.0
    rod = directors[1:] if bent else directors[2:]  # an arc turns e3 towards e2
    return any(along(end.moment, axis, filament) for axis in rod)


def _leaving(key: str, filament: Filament, case: Scene, axis: int) -> list[str]:
    """The keys that lead out of the plane normal to e1 (axis 0) or e2 (axis 1) at s = 0."""
    directors = _directors(filament)
    if directors is None:
        return []  # told elsewhere: normal or direction
    normal = directors[axis]
    names = [f"{key}.{name}" for name in _own_leaving(filament, normal, axis)]
    names += bodies_leaving(filament, normal, case)
    if case.fluid.flow is not None and _flow_leaves(case.fluid, filament, directors, axis):
        names.append("fluid.flow")
    if case.thermal is not None and (case.thermal.directions == "xyz" or math.hypot(*normal[:2]) > 1e-9):
        names.append("thermal.directions")
    return names


def _own_leaving(filament: Filament, normal: Vector, axis: int) -> Iterator[str]:
    """Those of the filament's own keys, as paths in its table."""
    shape = filament.shape
    if isinstance(shape, Helix) or (isinstance(shape, Circle) and shape.curvature != 0.0 and axis == 1):
        yield "shape.kind"
    if along(shape.perturb, normal, filament):
        yield "shape.perturb"
    if filament.velocity is not None and along(filament.velocity, normal, filament):
        yield "velocity"
    for side, end in (("start", filament.start), ("finish", filament.finish)):
        yield from (f"{side}.{name}" for name in _end_leaving(end, filament, normal, axis))
    if filament.loads is not None:
        yield from (f"loads.{name}" for name in _loads_leaving(filament.loads, filament, normal, axis))


def _end_leaving(end: End, filament: Filament, normal: Vector, axis: int) -> Iterator[str]:
    for name in ("force", "moves", "tangent"):
        value = getattr(end, name)
        if value is not None and along(value, normal, filament):
            yield name
    if end.spring is not None and along(minus(end.spring.to, filament.position), normal, filament):
        yield "spring.to"
    if end.moment is not None:  # in the plane bends a moment along its normal
        if end.frame == "body":
            bends = not (_zero(end.moment[1 - axis]) and _zero(end.moment[2]))
        else:
            bends = any(along(end.moment, other, filament) for other in across(normal))
        if bends:
            yield "moment"


def _loads_leaving(loads: Loads, filament: Filament, normal: Vector, axis: int) -> Iterator[str]:
    for name in ("force", "weight"):
        value = getattr(loads, name)
        if value is not None and along(value, normal, filament):
            yield name
    if loads.body_force is not None and not _zero(loads.body_force[axis]):
        yield "body_force"
    for name in ("moment", "internal_moment"):
        value = getattr(loads, name)
        if value is not None and not _zero(value[1 - axis]):
            yield name


def _directors(filament: Filament) -> tuple[Vector, Vector, Vector] | None:
    """e1, e2, e3 where the filament stands; None where direction and normal do not give them."""
    e3 = unit(_begins(filament))
    upright = filament.own_normal and e3 is not None and math.hypot(*e3[:2]) < 1e-9
    e2 = unit(cross(e3, (1.0, 0.0, 0.0) if upright else filament.normal)) if e3 else None
    return (cross(e2, e3), e2, e3) if e2 and e3 else None


def _begins(filament: Filament) -> Vector:
    """Along the tangent at s = 0, as far as a case tells it: points of a file that are not turned are not read here."""
    shape, small = filament.shape, 1e-6 * filament.length
    if filament.turned or not isinstance(shape, ExpressionShape):
        return filament.direction
    try:
        x, y, z = (part.at(s=small) - part.at(s=0.0) for part in shape.r)
        return x, y, z
    except ExpressionError:
        return filament.direction


def _flow_leaves(fluid: Fluid, filament: Filament, directors: tuple[Vector, Vector, Vector], axis: int) -> bool:
    """Whether the flow, at some points of the plane and some times, leads out of it.

    One that is the same everywhere carries a free filament along as it is, and its plane with it.
    """
    assert fluid.flow is not None
    basis = (directors[1 - axis], directors[2], directors[axis])
    held = any(end.held or end.spring is not None for end in (filament.start, filament.finish))
    for t in (0.0, 0.17, 0.53, 1.3):
        places = []
        for a, b, c in ((0.0, 0.0, 0.1), (0.3, 0.1, -0.2), (-0.2, 0.4, 0.3), (-0.4, -0.3, 0.5)):
            for parts in ((a, b, 0.0), (a, b, c)):
                away = [sum(q * u[k] for q, u in zip(parts, basis, strict=True)) for k in range(3)]
                where = [p + filament.length * d for p, d in zip(filament.position, away, strict=True)]
                places.append(dict(zip("xyz", where, strict=True), t=t))
        if not any(component(fluid.flow, directors[axis], place) for place in places[::2]):
            continue
        try:
            found = [value(fluid.flow, directors[axis], place) for place in places]
        except ExpressionError:
            return True
        if held or max(found) - min(found) > 1e-9 * max(map(abs, found)):
            return True
    return False
