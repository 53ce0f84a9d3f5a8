"""The shapes of bodies in a case file."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ..table import Table
from ..values import Positive, Sizes


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
