"""The table of a motor in a case file: each key with its default and its meaning."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field

from ..table import Table
from ..values import OfT, Positive, Vector, tagged


class Motor(Table):
    """A motor in a body, which turns the rod attached there."""

    spin: OfT | None = Field(None, description="rate at which it turns the rod against the body, rad/time")
    angle: OfT | None = Field(None, description="the same as an angle, rad, instead of spin")
    torque: OfT | None = Field(None, description="torque on the rod instead, about the axis")
    stall: Positive | None = Field(None, description="torque at rate 0, instead; falls to none at the rate `free`")
    free: Positive | None = Field(None, description="with stall: the rate without load, rad/time")
    axis: Annotated[
        Annotated[Literal["tangent"], tagged("word")] | Annotated[Vector, tagged("list")],
        Discriminator(lambda value: "<list>" if isinstance(value, list | tuple) else "<word>"),
    ] = Field("tangent", description="its axis: the rod's tangent, or a direction in the body's axes")
    through: Vector | None = Field(
        None,
        description="a point on a given axis, from the body's centre in its axes; absent: the centre",
    )
