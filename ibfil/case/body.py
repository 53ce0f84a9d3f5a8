"""The tables of a body and of a motor in a case file: each key with its default and its meaning."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field

from .table import ZERO, Table
from .values import Listed, OfT, Positive, Sizes, TripleT, Vector, by_kind, tagged

STILL = (ZERO, ZERO, ZERO)


class Sphere(Table):
    """A sphere."""

    kind: Literal["sphere"] = Field(
        "sphere", description="a sphere, of hydrodynamic radius a: drags 6 pi eta a, 8 pi eta a^3"
    )
    radius: Positive = Field(description="its radius", examples=[0.1])

    @property
    def semi_axes(self) -> tuple[float, float, float]:
        """Its three semi-axes."""
        return self.radius, self.radius, self.radius


class Ellipsoid(Table):
    """An ellipsoid."""

    kind: Literal["ellipsoid"] = Field("ellipsoid", description="an ellipsoid, with the drags of its three semi-axes")
    axes: Sizes = Field(description="its semi-axes, along the body's axes", examples=[[0.2, 0.1, 0.1]])

    @property
    def semi_axes(self) -> tuple[float, float, float]:
        """Its three semi-axes."""
        return self.axes


class Joint(Table):
    """A point without size or drag in which rods meet."""

    kind: Literal["joint"] = Field("joint", description="a point without size or drag, in which rods meet")

    @property
    def semi_axes(self) -> tuple[float, float, float]:
        """None: it has no size."""
        return 0.0, 0.0, 0.0


class Motion(Table):
    """A motion that is given."""

    moves: TripleT = Field(STILL, description="displacement of the centre since t = 0")
    turns: TripleT = Field(STILL, description="rotation vector since t = 0, axis times angle, in the lab")


class Body(Table):
    """A rigid body, which ends of filaments may be attached to."""

    shape: Annotated[
        Annotated[Sphere, tagged("sphere")]
        | Annotated[Ellipsoid, tagged("ellipsoid")]
        | Annotated[Joint, tagged("joint")],
        by_kind("sphere", "sphere", "ellipsoid", "joint"),
    ] = Field(description="its shape", examples=[{"kind": "sphere", "radius": 0.1}])
    position: Vector | None = Field(
        None,
        description="of its centre at t = 0; absent: the first end attached to it lies on its surface, along the rod",
    )
    axes: Annotated[tuple[Vector, Vector], Listed(2)] = Field(
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), description="its first two axes at t = 0, in the lab"
    )
    motion: Annotated[
        Annotated[Literal["free", "held"], tagged("word")] | Annotated[Motion, tagged("table")],
        Discriminator(lambda value: "<table>" if isinstance(value, dict | Motion) else "<word>"),
    ] = Field("free", description="free: force and torque balance; held in place; or a motion that is given")
    force: TripleT | None = Field(None, description="external force on its centre")
    torque: TripleT | None = Field(None, description="external torque on it")
    frame: Literal["lab", "body"] = Field("lab", description="axes of force and torque: lab, or its own")

    @property
    def given_motion(self) -> Motion | None:
        """The motion that is given; None where it is free."""
        if isinstance(self.motion, Motion):
            return self.motion
        return Motion() if self.motion == "held" else None

    @property
    def own_axes(self) -> bool:
        """Whether force and torque are along its own axes."""
        return self.frame == "body"


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
    ] = Field(
        "tangent", description="its axis: the rod's tangent, or a direction in the body's axes, through the centre"
    )
