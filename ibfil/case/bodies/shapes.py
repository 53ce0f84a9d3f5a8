"""The shapes of bodies in a case file."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ..table import Table
from ..values import Positive, Sizes


class Shape(Table):
    """A shape of a body: its three semi-axes, zero where it has none, or the file of its markers."""

    @property
    def file(self) -> str | None:
        """None: its markers are made."""
        return None

    @property
    def semi_axes(self) -> tuple[float, float, float]:
        """None."""
        return 0.0, 0.0, 0.0


class Sphere(Shape):
    """A sphere."""

    kind: Literal["sphere"] = Field(
        "sphere", description="a sphere, of hydrodynamic radius a: drags 6 pi eta a, 8 pi eta a^3"
    )
    radius: Positive = Field(description="its radius", examples=[0.1])

    @property
    def semi_axes(self) -> tuple[float, float, float]:
        """Its three semi-axes."""
        return self.radius, self.radius, self.radius


class Ellipsoid(Shape):
    """An ellipsoid."""

    kind: Literal["ellipsoid"] = Field("ellipsoid", description="an ellipsoid, with the drags of its three semi-axes")
    axes: Sizes = Field(description="its semi-axes, along the body's axes", examples=[[0.2, 0.1, 0.1]])

    @property
    def semi_axes(self) -> tuple[float, float, float]:
        """Its three semi-axes."""
        return self.axes


class Joint(Shape):
    """A point without size or drag in which rods meet."""

    kind: Literal["joint"] = Field("joint", description="a point without size or drag, in which rods meet")


class Cloud(Shape):
    """Markers from a file."""

    kind: Literal["file"] = Field(
        "file", description="markers read from a file, in the body's axes and from its centre, as they are"
    )
    path: str = Field(description="csv or npy: x, y, z, relative to the case", examples=["markers.csv"])

    @property
    def file(self) -> str:
        """Where they are."""
        return self.path
