"""The table of an end of a filament in a case file: free, held in the lab, or in a body."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ..table import ORIGIN, Table
from ..values import NotNegative, OfT, TripleT, Vector
from .motor import Motor


class Spring(Table):
    """A tether of one end."""

    stiffness: NotNegative = Field(description="force per displacement", examples=[1.0])
    to: Vector = Field(ORIGIN, description="the point it pulls to")


class End(Table):
    """One end of a filament."""

    end: Literal["free", "hinged", "clamped", "body"] = Field(
        "free", description="free (M = 0), hinged (r held, M = 0), clamped (r, e3 held) or clamped into a body"
    )
    body: str = Field("", description='the body it is attached to, with end = "body"')
    hinged: bool = Field(False, description="in a body: held there, but free to turn (M = 0)")
    motor: Motor | None = Field(None, description="turns the rod in its body; needs twisting")
    twist: Literal["held", "free"] = Field(
        "free", description="clamped only: e1 held or free; held by default at a clamped end"
    )
    spin: OfT | None = Field(None, description="clamped, twist held: rate of e1 about e3, rad/time")
    angle: OfT | None = Field(None, description="the same as an angle, rad, instead of spin")
    tangent: Vector | None = Field(None, description="clamped: e3; absent: the start shape's")
    moves: TripleT | None = Field(
        None, description="held ends: displacement of the held point; what counts is its change since t = 0"
    )
    force: TripleT | None = Field(None, description="external force on the end, lab frame")
    follower: OfT | None = Field(None, description="external force along +e3; at finish negative compresses")
    moment: TripleT | None = Field(None, description="external moment")
    frame: Literal["lab", "body"] = Field("lab", description="axes of moment: lab, or along e1, e2, e3")
    spring: Spring | None = Field(None, description="tether of this end")

    @property
    def held(self) -> bool:
        """Whether the end's position is given, or a body's."""
        return self.end != "free"

    @property
    def attached(self) -> bool:
        """Whether it is in a body."""
        return self.end == "body"

    @property
    def clamped(self) -> bool:
        """Whether the end's tangent is given, and it carries a moment."""
        return self.support == "clamped"

    @property
    def support(self) -> str:
        """How it is supported: free, hinged or clamped, by the lab or by a body."""
        if not self.attached:
            return self.end
        return "hinged" if self.hinged else "clamped"

    @property
    def turn_held(self) -> bool:
        """Whether e1 is given there, at rest or turning."""
        return self.clamped and (self.attached or self.twist != "free")

    @property
    def body_frame(self) -> bool:
        """Whether ``moment`` is given along e1, e2, e3."""
        return self.frame == "body"
