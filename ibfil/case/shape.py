"""The tables of a filament's start shape."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from .table import ZERO, Table
from .values import (
    Count,
    NotNegative,
    Number,
    OfS,
    Positive,
    Real,
    Seed,
    TripleS,
    by_kind,
    tagged,
)


class Noise(Table):
    """A smooth random displacement of the start shape."""

    amplitude: Positive = Field(description="size of the displacement", examples=[1e-3])
    modes: Count = Field(8, description="number of smooth modes")
    seed: Seed = Field(1, description="seed of the random numbers")


class Shape(Table):
    """The keys that all start shapes have."""

    perturb: TripleS = Field((ZERO, ZERO, ZERO), description="added to r in the lab frame after placing")
    twist: OfS = Field(ZERO, description="Omega3 added to the shape's own, by turning e1 about e3")
    noise: Noise | None = Field(None, description="smooth random perturbation, zero at held ends")

    has_axis: ClassVar[bool] = False  # whether the shape has one by its nature, as a helix does
    in_place: ClassVar[bool] = False  # whether its points are meant where they are, in the lab frame


class Straight(Shape):
    """A straight rod."""

    kind: Literal["straight"] = Field("straight", description="a straight rod")


class Relaxed(Shape):
    """The curve of curvature and twist_rate at t = 0."""

    has_axis = True

    kind: Literal["relaxed"] = Field("relaxed", description="integrates curvature and twist_rate at t = 0")


class Helix(Shape):
    """A helix by radius and pitch, or by curvature and torsion."""

    has_axis = True

    kind: Literal["helix"] = Field("helix", description="a helix, by radius and pitch or curvature and torsion")
    radius: Positive | None = Field(None, description="radius of the helix")
    pitch: NotNegative | None = Field(None, description="advance along the axis in one turn")
    curvature: Positive | None = Field(None, description="curvature of the helix")
    torsion: NotNegative | None = Field(None, description="torsion of the helix, its size")
    hand: Literal["right", "left"] = Field("right", description="right- or left-handed")

    @property
    def right_handed(self) -> bool:
        """Whether it turns to the right as it advances."""
        return self.hand == "right"


class Circle(Shape):
    """An open arc."""

    kind: Literal["circle"] = Field("circle", description="an open arc of a circle, at most one turn")
    curvature: Real = Field(description="1/radius of the arc", examples=[0.0])


class ExpressionShape(Shape):
    """A curve given by three expressions."""

    in_place = True

    kind: Literal["expression"] = Field(
        "expression", description="a curve given by three expressions; stays where they put it, see position, direction"
    )
    r: TripleS = Field(description="position", examples=[["s", 0, 0]])


class FileShape(Shape):
    """Nodes read from a file."""

    in_place = True

    kind: Literal["file"] = Field(
        "file", description="points read from a file; they stay where they are, see position, direction"
    )
    path: str = Field(description="csv or npy: x, y, z[, e1x, e1y, e1z], relative to the case", examples=["points.csv"])


class RunShape(Shape):
    """The shape a filament had in another run."""

    kind: Literal["run"] = Field(
        "run", description="the filament of this name as it stood in another run; other nodes by splines over arclength"
    )
    path: str = Field(description="the run file, relative to the case", examples=["run.h5"])
    time: Annotated[float | Literal["last"], Number(("last",), low=0, open=False)] = Field(
        "last", description="the time of that run to start from"
    )

    @property
    def instant(self) -> float | None:
        """The time to start from; None: that of the last output."""
        return None if isinstance(self.time, str) else self.time


AnyShape = Annotated[
    Annotated[Straight, tagged("straight")]
    | Annotated[Relaxed, tagged("relaxed")]
    | Annotated[Helix, tagged("helix")]
    | Annotated[Circle, tagged("circle")]
    | Annotated[ExpressionShape, tagged("expression")]
    | Annotated[FileShape, tagged("file")]
    | Annotated[RunShape, tagged("run")],
    by_kind("straight", "straight", "relaxed", "helix", "circle", "expression", "file", "run"),
]
