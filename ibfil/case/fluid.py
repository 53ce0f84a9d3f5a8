"""The tables [fluid] and [contact] of a case."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field, Strict

from .table import Table
from .values import (
    Cells,
    NotNegative,
    Positive,
    Sizes,
    TripleXYZT,
    tagged,
)


class Contact(Table):
    """Contact of filaments."""

    action: Literal["stop", "warn", "repel"] = Field("stop", description="what to do at contact")
    distance: Positive | None = Field(None, description="distance of the axes at contact; absent: the sum of radii")
    strength: Positive | None = Field(
        None,
        description="repel: force at contact, by default 10 A/L^2, the most of all filaments; the range is distance",
    )

    @property
    def repels(self) -> bool:
        """Whether it keeps filaments apart."""
        return self.action == "repel"


class Matched(Table):
    """Drag of a straight rod in the grid."""

    matched: Positive = Field(description="length of the straight rod drag is calibrated on", examples=[1.0])


class Coefficients(Table):
    """Drag per length, given."""

    perp: Positive = Field(description="drag per length across the rod", examples=[1.0])
    par: Positive = Field(description="drag per length along the rod", examples=[1.0])
    spin: Positive | None = Field(None, description="torque per length and rate of spin")


class Thick(Table):
    """Rods that turn in a shear as spheroids of a given aspect ratio."""

    aspect: Positive = Field(description="effective aspect ratio r_e > 1 of each rod when straight", examples=[20.0])


def _drag(value: object) -> str:
    """Which member of the union of drags a value is meant to be."""
    if isinstance(value, dict):
        return "<matched>" if "matched" in value else "<coefficients>"
    return "<word>"


def _box(value: object) -> str:
    """Which member of the union of boxes a value is meant to be."""
    return "<word>" if isinstance(value, str) else "<sides>"


class Fluid(Table):
    """The fluid, the space it fills, and the grid it is solved on."""

    model: Literal["rft", "stokes", "navier-stokes"] = Field(description="which fluid", examples=["rft"])
    viscosity: Positive = Field(description="viscosity eta", examples=[1.0])
    density: Positive | None = Field(None, description="required by navier-stokes")
    flow: TripleXYZT | None = Field(
        None, description="background velocity; navier-stokes: uniform or box-periodic, maintained"
    )
    drag: Annotated[
        Annotated[Literal["auto", "cylinder", "slender", "paper"], tagged("word")]
        | Annotated[Matched, tagged("matched")]
        | Annotated[Coefficients, tagged("coefficients")],
        Discriminator(_drag),
    ] = Field(
        "auto",
        description="rft: that of a straight cylinder of this radius | slender body, by the radius | paper: 4 pi eta, "
        "2 pi eta, whatever the radius | matched to the grid | given; auto: cylinder where there is a radius, or paper",
    )
    thick: Annotated[
        Annotated[bool, Strict(), tagged("word")] | Annotated[Thick, tagged("table")],
        Discriminator(lambda value: "<table>" if isinstance(value, dict | Thick) else "<word>"),
    ] = Field(
        False,
        description="whether flows turn rods by their thickness too (Jeffery orbits): by their radius, on a grid the "
        "kernel's where none is given; rft: or by an aspect ratio",
    )
    box: (
        Annotated[
            Annotated[Literal["free"], tagged("word")] | Annotated[Sizes, tagged("sides")],
            Discriminator(_box),
        ]
        | None
    ) = Field(None, description="periodic box, or free: no box, for stokes; required by grid fluids")
    cells: Cells | None = Field(
        None,
        description="cells along x, y, z of a box, one h on all axes; one along an axis: a plane flow. Or thickness",
    )
    thickness: Positive | None = Field(
        None, description="hydrodynamic line radius that chooses the cells, or the spacing of free space"
    )
    spacing: Positive | None = Field(None, description="h of the grid in free space; or thickness")
    wall: Literal["no-slip", "free-slip"] | None = Field(
        None, description="the plane z = 0, fluid above it; with box = free"
    )
    kernel: Literal["roma3", "peskin4", "bspline4", "bspline6", "bkp6", "es4", "es5", "es6"] = Field(
        "peskin4", description="delta function"
    )
    slip: NotNegative = Field(
        0.01,
        description="slip eps against locking: nodes ds apart slip by eps h/(2 ds) of a point's own mobility, ends by "
        "twice that; 0 = off",
    )
    method: Literal["auto", "fft", "pruned", "table", "krylov"] = Field(
        "auto", description="how velocities are found; auto decides by counts"
    )
    precision: Literal["double", "single"] = Field("double", description="of the table, and of fields with inertia")
    rotation: Literal["local", "grid"] = Field(
        "local", description="e1 turns against the rod's own drag, or by torque coupling; needs twisting"
    )

    @property
    def on_grid(self) -> bool:
        """Whether nodes move the fluid of a grid."""
        return self.model != "rft"

    @property
    def kind(self) -> str:
        """The name of its model: the word, and of Stokes flow the space that it fills."""
        if self.model != "stokes" or not self.free:
            return self.model
        return "free" if self.wall is None else "wall"

    @property
    def words(self) -> str:
        """Its name where a run is told of."""
        where = {"free": " in free space", "wall": f" above a {self.wall} wall"}
        return self.model + where.get(self.kind, "")

    @property
    def free(self) -> bool:
        """Whether its space has no bounds."""
        return self.box == "free"

    @property
    def sticks(self) -> bool:
        """Whether the fluid above the wall sticks to it."""
        return self.wall == "no-slip"

    @property
    def sides(self) -> tuple[float, float, float] | None:
        """The sides of its periodic box; None where it has none."""
        return None if isinstance(self.box, str) else self.box

    @property
    def inertial(self) -> bool:
        """Whether the fluid has inertia, and so a history."""
        return self.model == "navier-stokes"

    @property
    def thin_axis(self) -> int | None:
        """The axis along which the grid is one cell deep, so that its flow is plane; None: it has none."""
        return None if self.cells is None or 1 not in self.cells else self.cells.index(1)

    @property
    def couples_torque(self) -> bool:
        """Whether twist torques of rods that twist act on the fluid, and its vorticity turns them."""
        return self.on_grid and self.rotation == "grid"

    @property
    def aspect(self) -> float | None:
        """The effective aspect ratio of rods whose thickness is given by it; None: by their radius, or not at all."""
        return self.thick.aspect if isinstance(self.thick, Thick) else None

    @property
    def single(self) -> bool:
        """Whether tables, and fields with inertia, are of single precision."""
        return self.precision == "single"

    def drag_of(self, radius: object | None) -> str | Matched | Coefficients:
        """The drag of a rod with this radius, or None: no rod has the drag "auto"."""
        if self.drag != "auto":
            return self.drag
        return "paper" if radius is None or self.on_grid else "cylinder"

    @property
    def drag_matched(self) -> Matched | None:
        """The straight rod on whose drag in the case's grid that of resistive-force theory is calibrated, if it is."""
        return self.drag if isinstance(self.drag, Matched) else None

    @property
    def calibrated(self) -> Matched | None:
        """The same where drag is what the fluid is made of; None: it is on the grid itself."""
        return None if self.on_grid else self.drag_matched
