"""The tables of links between filaments in a case file: each key with its default and its meaning."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from .expressions import Expression
from .table import ZERO, Table
from .values import (
    Formula,
    Listed,
    NotNegative,
    Number,
    Place,
    Positive,
    Range,
    Real,
    Vector,
    by_kind,
    tagged,
)

_OfS = Annotated[Expression, Formula(variables=("s",))]  # of links, which have no copies of their own
_OfST = Annotated[Expression, Formula(variables=("s", "t"))]


class Site(Table):
    """A place that a link holds on to: a point of a filament, or of the lab."""

    filament: str | None = Field(None, description="name of a filament, or of one of its copies")
    at: Annotated[float | Literal["start", "middle", "finish"], Place(("start", "middle", "finish"), window=False)] = (
        Field("middle", description="where on it: a point, or an arclength")
    )
    point: Vector | None = Field(None, description="instead of a filament a place in the lab (spring only)")


class AnyLink(Table):
    """The base of the kinds of link."""

    kind: str
    parts: ClassVar[tuple[str, ...]]  # numbers that an output has of each element (io/snapshots.py)
    per_length: ClassVar[bool] = False  # whether its forces are

    @property
    def names(self) -> tuple[str, ...]:
        """The filaments that it joins, by the names that the case gives."""
        raise NotImplementedError

    @property
    def words(self) -> str:
        """The link, for `ibfil check`."""
        raise NotImplementedError

    @property
    def response_time(self) -> float:
        """A time in which it answers by itself; infinite where it has none."""
        return math.inf

    @property
    def resists_rates(self) -> bool:
        """Whether it answers to how fast it is strained."""
        return False


_SITES = Field(
    description="two places, each { filament = NAME, at = ... }, or { point = [x, y, z] } in the lab",
    examples=[[{"filament": "name", "at": "start"}, {"point": [0.0, 0.0, 0.0]}]],
)
Sites = Annotated[tuple[Site, Site], Listed(2)]


def _places(sites: tuple[Site, Site]) -> str:
    one, other = (f"{site.filament} at {site.at}" if site.point is None else f"{list(site.point)}" for site in sites)
    return f"{one} and {other}"


class Spring(AnyLink):
    """A spring between two points."""

    parts = "length", "tension"
    kind: Literal["spring"] = Field("spring", description="a spring between two points; unwrapped positions count")
    between: Sites = _SITES
    stiffness: NotNegative = Field(description="force per length it is stretched by", examples=[1.0])
    rest: Annotated[float | Literal["initial"], Number(("initial",), low=0, open=False)] = Field(
        "initial", description="length at rest"
    )
    damping: NotNegative = Field(0.0, description="force per rate of its length")

    @property
    def names(self) -> tuple[str, ...]:
        """The filaments of its sites."""
        return tuple(site.filament for site in self.between if site.filament is not None)

    @property
    def words(self) -> str:
        """The link, for `ibfil check`."""
        damped = f", damping {self.damping:g}" if self.damping else ""
        rest = "its length at the start" if isinstance(self.rest, str) else f"{self.rest:g}"
        return f"spring between {_places(self.between)}, stiffness {self.stiffness:g}, at rest {rest}{damped}"

    @property
    def resists_rates(self) -> bool:
        """Where it is damped."""
        return self.damping > 0.0


class Hinge(AnyLink):
    """A moment that turns two segments into line."""

    parts = "angle", "moment"
    kind: Literal["hinge"] = Field("hinge", description="a moment that turns two segments into line")
    between: Sites = Field(
        description="two places, each { filament = NAME, at = ... }: the segments there",
        examples=[[{"filament": "name", "at": "start"}, {"filament": "name", "at": "finish"}]],
    )
    stiffness: NotNegative = Field(description="moment per sine of the angle between the segments", examples=[1.0])

    @property
    def names(self) -> tuple[str, ...]:
        """The filaments of its sites."""
        return tuple(site.filament for site in self.between if site.filament is not None)

    @property
    def words(self) -> str:
        """The link, for `ibfil check`."""
        return f"hinge between {_places(self.between)}, stiffness {self.stiffness:g}"


class Motor(Table):
    """Molecular motors of a bound pair, which push along the motion with a lag: T df/dt + f = F(rate of slide)."""

    friction: Real = Field(
        description="gamma in F = gamma rate: per length, > 0 pushes along the motion, < 0 resists it", examples=[1.0]
    )
    lag: NotNegative = Field(description="T, the time by which f follows; > 0 where friction is", examples=[1.0])
    stall: Positive | None = Field(
        None, description="the largest force per length, F = stall tanh(gamma rate/stall); absent: none"
    )


class Bind(AnyLink):
    """Two filaments bound along their length."""

    parts, per_length = ("slide", "shear", "active", "tension"), True
    kind: Literal["bind"] = Field(
        "bind", description="two filaments bound side by side, which slide against shear at a distance"
    )
    filaments: Annotated[tuple[str, str], Listed(2)] = Field(
        description="the names of the two filaments, a and b", examples=[["name", "other"]]
    )
    range: Range | None = Field(None, description="arclengths [s1, s2] of a that are bound; absent: all")
    offset: Real = Field(0.0, description="s of b beside s = 0 of a")
    shear: _OfS = Field(ZERO, description="shear stiffness kt: force per length and length of slide, of s on a")
    normal: _OfS = Field(description="stiffness kn against a change of distance, likewise", examples=[1e4])
    slide: _OfST = Field(ZERO, description="preferred slide of b along a, by s on a")
    force: _OfST = Field(ZERO, description="active shear force per length: > 0 pulls b towards finish, a towards start")
    distance: Annotated[float | Literal["initial"], Number(("initial",), low=0)] = Field(
        "initial", description="of the axes; initial: at each s that of the start"
    )
    motor: Motor | None = Field(None, description="motors that answer to the rate of slide")

    @property
    def names(self) -> tuple[str, ...]:
        """The two filaments."""
        return self.filaments

    @property
    def words(self) -> str:
        """The link, for `ibfil check`."""
        more = [] if self.force.constant == 0.0 else ["active shear"]
        if self.motor is not None:
            more.append(f"motors with friction {self.motor.friction:g}, lag {self.motor.lag:g}")
        return f"{self.filaments[0]} and {self.filaments[1]} bound side by side" + "".join(f", {word}" for word in more)

    @property
    def response_time(self) -> float:
        """The lag of its motors."""
        return math.inf if self.motor is None or self.motor.lag == 0.0 else self.motor.lag

    @property
    def resists_rates(self) -> bool:
        """Where it has motors."""
        return self.motor is not None


Link = Annotated[
    Annotated[Spring, tagged("spring")] | Annotated[Hinge, tagged("hinge")] | Annotated[Bind, tagged("bind")],
    by_kind("spring", "spring", "hinge", "bind"),
]
