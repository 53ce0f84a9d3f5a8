"""The table of a body in a case file: each key with its default and its meaning."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field

from ..table import ZERO, Table
from ..values import Listed, Sizes, TripleT, Vector, by_kind, tagged
from .shapes import Cloud, Ellipsoid, Joint, Sphere

STILL = (ZERO, ZERO, ZERO)


class Motion(Table):
    """A motion that is given."""

    moves: TripleT = Field(STILL, description="displacement of the centre; what counts is its change since t = 0")
    turns: TripleT = Field(STILL, description="rotation vector, axis times angle, in the lab; likewise")


class Resistance(Table):
    """The resistance of a body along and about its axes."""

    translation: Sizes = Field(description="force per velocity along its three axes", examples=[[1.0, 1.0, 1.0]])
    rotation: Sizes = Field(description="torque per rate about its three axes", examples=[[1.0, 1.0, 1.0]])


class Body(Table):
    """A rigid body, which ends of filaments may be attached to."""

    shape: Annotated[
        Annotated[Sphere, tagged("sphere")]
        | Annotated[Ellipsoid, tagged("ellipsoid")]
        | Annotated[Cloud, tagged("file")]
        | Annotated[Joint, tagged("joint")],
        by_kind("sphere", "sphere", "ellipsoid", "file", "joint"),
    ] = Field(description="its shape", examples=[{"kind": "sphere", "radius": 0.1}])
    resistance: Resistance | None = Field(
        None, description="rft: its own, instead of that of its shape; a file of markers needs it"
    )
    position: Vector | None = Field(
        None,
        description="of its centre at t = 0; absent: the first end attached to it lies on its surface, along the rod; "
        "of a file of markers: the origin; a copy of it goes with the copy of its filament",
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

    fit: Literal["translation", "rotation"] = Field(
        "translation", description="on a grid: which drag its markers have, those of moving or of turning"
    )

    @property
    def meets_rotation(self) -> bool:
        """Whether its markers on a grid have its drag against turning, rather than against moving."""
        return self.fit == "rotation"

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
