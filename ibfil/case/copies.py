"""The table of a filament's copies, and their names."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from .table import Table
from .values import Count, Formula, Listed, OfIXYZ, Positive, Seed, TripleI, Vector


class Copies(Table):
    """The same filament in many places."""

    count: Count | None = Field(None, description="how many, at random in region or where at says")
    seed: Seed = Field(1, description="seed of the random places, turns and phases")
    region: Annotated[tuple[Vector, Vector], Listed(2)] | None = Field(
        None, description="two corners of the box they are placed in"
    )
    at: TripleI | None = Field(
        None, description="where copy i = 0, 1 ... goes, instead of region: three expressions, a row or a ring"
    )
    orientation: Literal["random", "same"] = Field(
        "random",
        description="how they are turned: each by a random rotation, or not at all; same by default with at or file",
    )
    phase: Annotated[OfIXYZ | Literal["random"], Formula(("random",), ("i", "x", "y", "z"))] | None = Field(
        None, description="the phase of each, by its number and place; random: from 0 to 2 pi. Formulas name it phase"
    )
    apart: Positive | None = Field(
        None, description="least distance of their axes: random places are drawn again until it is kept, others refused"
    )
    file: str | None = Field(
        None,
        description="csv of the places, instead of count and region: a row x, y, z a copy, or x, y, z and a quaternion "
        "qx, qy, qz, qw that turns it",
    )

    @property
    def turned_alike(self) -> bool:
        """Whether copies are not turned."""
        return self.orientation == "same"

    @property
    def phases_drawn(self) -> bool:
        """Whether phases are random."""
        return isinstance(self.phase, str)


def number_of(copy: str) -> int:
    """The number of a copy from its name."""
    return int(copy.rpartition("_")[2])


def copy_names(name: str, copies: Copies | None) -> list[str]:
    """The names of all copies, as far as their number stands in the case: the name itself where there are none."""
    if copies is None or copies.count is None:
        return [name]
    return [copy_name(name, number) for number in range(copies.count)]


def copy_name(name: str, number: int) -> str:
    """The name of copy ``number``, from 0 on, of a filament: NAME_003."""
    return f"{name}_{number:03d}"
