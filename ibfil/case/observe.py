"""The tables of what is observed of a run: observables, rules that end it, numbers that are expected of it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from .table import Table
from .values import NotNegative, Place, Positive, Range, Real, Vector


class Steady(Table):
    """A value that has settled."""

    over: Positive = Field(description="length of the time window", examples=[1.0])
    change: Positive = Field(description="relative change within it", examples=[1e-3])


class Stop(Table):
    """A reason to end the run before its time; the first true one ends it."""

    observe: str = Field(description="name of an [observe.NAME]", examples=["name"])
    below: Real | None = Field(None, description="true below this value")
    above: Real | None = Field(None, description="true above this value")
    steady: Steady | None = Field(None, description="true when the value has settled")
    after: NotNegative = Field(0.0, description="not before this time")
    hold: NotNegative = Field(0.0, description="must hold so long")


# Kinds whose number is fitted to a series, and the name of that.
_FITTED_TO = {
    "drift": "position",
    "body_drift": "position",
    "growth": "amplitude",
    "circularity": "position",
    "frequency": "position_seen",
}


class Observe(Table):
    """A number (or vector) taken at every output."""

    kind: Literal[
        "position",
        "velocity",
        "speed",
        "displacement",
        "drift",
        "end_to_end",
        "amplitude",
        "radius",
        "turn_angle",
        "circularity",
        "growth",
        "frequency",
        "diffusion",
        "diffusion_along",
        "diffusion_across",
        "diffusion_ratio",
        "stretch",
        "twist",
        "force",
        "torque",
        "power",
        "dissipation",
        "flux",
        "efficiency",
        "linking",
        "writhe",
        "total_twist",
        "link_tension",
        "link_slide",
        "link_shear",
        "body_position",
        "body_velocity",
        "body_spin",
        "body_axis",
        "body_drift",
        "body_force",
        "body_torque",
        "motor_angle",
        "motor_rate",
        "motor_torque",
        "motor_power",
    ] = Field(description="what is taken; each is explained at the end of `ibfil schema`", examples=["speed"])
    filament: str = Field(
        "", description="name of a filament; where there are several, needed but for dissipation and flux"
    )
    copies: Literal["none", "mean", "spread", "all"] = Field(
        "none",
        description="filament with copies: the mean over them, their standard deviation, or a number for each; none: "
        "of one copy, by its name NAME_003",
    )
    link: str = Field("", description="name of a link, where the kind looks at one")
    body: str = Field("", description="name of a body, where the kind looks at one")
    motor: str = Field(
        "",
        description="of a motor, where the kind looks at one: FILAMENT_start or FILAMENT_finish, by the end it turns",
    )
    at: Annotated[
        float | tuple[float, float] | Literal["start", "finish", "middle", "centroid"],
        Place(("start", "finish", "middle", "centroid")),
    ] = Field(
        "finish",
        description="where: a point, an arclength, or a window [s1, s2]; by default the centroid for position, "
        "velocity, displacement, speed, drift and diffusion_ratio, the whole filament for radius, force, torque and "
        "power",
    )
    along: Vector | None = Field(None, description="component or axis, where the kind has one")
    space: Literal["none", "mean", "max", "min"] = Field("none", description="over the window")
    over: Range | None = Field(None, description="time window; absent: the whole run")
    interval: NotNegative = Field(0.0, description="diffusion: the lag")
    summary: Literal["last", "mean", "max", "min", "median"] = Field(
        "last", description="over `over`: the number in the summary and in [expect]"
    )

    @property
    def together(self) -> bool:
        """Whether it is of all filaments together."""
        return self.kind in ("dissipation", "flux")

    @property
    def over_copies(self) -> bool:
        """Whether it is of all copies of a filament."""
        return self.copies != "none"

    @property
    def of_each(self) -> bool:
        """Whether it is a number for each copy."""
        return self.copies == "all"

    @property
    def pumps(self) -> bool:
        """Whether it is a flux along a wall."""
        return self.kind == "flux"

    @property
    def looks_at(self) -> str:
        """The key of what it looks at: filament, link, body or motor."""
        first = self.kind.partition("_")[0]
        return first if first in ("link", "body", "motor") else "filament"

    @property
    def series(self) -> str:
        """The quantity whose series is kept, where the observable itself is a number fitted to that; "" else."""
        return _FITTED_TO.get(self.kind, "")

    def recorded(self, name: str) -> str:
        """The name of the series of an observable called ``name``: of a drift U it is U.position."""
        return f"{name}.{self.series}" if self.series else name

    @property
    def reduces(self) -> bool:
        """Whether it says what is to be taken over the points of a window."""
        return self.space != "none"


class Expect(Table):
    """A number the result is held against by `ibfil verify`."""

    observe: str = Field(description="name of an [observe.NAME]", examples=["name"])
    value: Real | None = Field(None, description="the expected number")
    range: Range | None = Field(None, description="or the range [lo, hi] it must lie in")
    tolerance: NotNegative | None = Field(None, description="relative error allowed; 0.01 by default with value")
    absolute: NotNegative | None = Field(None, description="or the absolute error allowed")
    standard_errors: Positive | None = Field(
        None, description="or how many standard errors, of a mean of a thermal run; a tolerance then bounds these"
    )
    source: str = Field("", description="where the number comes from")
    quick: dict[str, object] = Field(
        {},
        description="overrides of the quick form; value, range, tolerance, absolute replace those above",
    )
