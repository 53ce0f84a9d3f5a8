"""Vectors and directions in a case, some given by formulas."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..expressions import Expression, ExpressionError

if TYPE_CHECKING:
    from ..filament import Filament

Vector = tuple[float, float, float]
Components = Sequence[Expression] | Sequence[float]


def parallel(a: Vector, b: Vector) -> bool:
    """Whether two vectors have one direction, or opposite ones."""
    cross = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    return math.hypot(*cross) < 1e-9 * math.hypot(*a) * math.hypot(*b)


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """a . b."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def minus(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def unit(a: Vector) -> Vector | None:
    """a/|a|; None where a is zero."""
    size = math.hypot(*a)
    return (a[0] / size, a[1] / size, a[2] / size) if size > 0.0 else None


def across(normal: Vector) -> list[Vector]:
    """Two unit vectors normal to ``normal``."""
    start = (1.0, 0.0, 0.0) if abs(normal[0]) < 0.9 else (0.0, 1.0, 0.0)
    first = unit(cross(normal, start))
    assert first is not None
    return [first, cross(normal, first)]


def along(components: Components, normal: Vector, filament: Filament) -> bool:
    """Whether a vector, at some s and t, has a component along ``normal``."""
    for fraction, t in ((0.0, 0.0), (0.31, 0.17), (0.77, 0.53), (1.0, 1.3)):
        values = dict(zip("xyz", filament.position, strict=True), s=fraction * filament.length, t=t)
        if component(components, normal, values):
            return True
    return False


def value(components: Components, normal: Vector, values: dict[str, float]) -> float:
    """The component of a vector along ``normal``."""
    return dot([c.at(**values) if isinstance(c, Expression) else c for c in components], normal)


def component(components: Components, normal: Vector, values: dict[str, float]) -> bool:
    """Whether the vector has a component along ``normal`` that is more than round-off."""
    try:
        vector = [c.at(**values) if isinstance(c, Expression) else c for c in components]
    except ExpressionError:
        return False
    return abs(dot(vector, normal)) > 1e-9 * math.hypot(*vector)
