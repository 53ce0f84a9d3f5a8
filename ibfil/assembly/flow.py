"""From a case to its background flow."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..fluids.base import Part
from .loads import number, triple
from .separation import products

if TYPE_CHECKING:
    from ..case.schema import Case
    from ..fluids.base import Flow
    from .separation import Product


def flow(case: Case) -> Flow | None:
    """The background velocity (k, 3) at places r (k, 3) and a time; None where the case has none."""
    if case.fluid.flow is None:
        return None
    velocity = triple(case.fluid.flow, "x", "y", "z", "t")
    return lambda r, t: velocity(*r.T, t)


def flow_parts(case: Case) -> list[Part] | None:
    """The background flow as a sum of fixed fields times factors in time; None where it is no such sum."""
    found = products(case.fluid.flow or ())
    return None if found is None else [_part(one) for one in found]


def _part(one: Product) -> Part:
    place = triple(one.place, "x", "y", "z")
    return Part(None if one.factor.constant else number(one.factor), lambda r: place(*r.T))
