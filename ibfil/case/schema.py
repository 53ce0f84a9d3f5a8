"""Every table and key of a case file, as frozen descriptions: each key with its default and its meaning.

The tables of a filament are in filament.py and shape.py, kinds of value in values.py, checks between keys in
consistency/. Some defaults depend on other tables: defaults.py fills those in
before a case is read, and the text here says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field

from .filament import Filament
from .fluid import Contact, Fluid
from .link import Link
from .table import Table
from .values import (
    Count,
    Listed,
    NotNegative,
    Number,
    Place,
    Positive,
    Range,
    Real,
    Seed,
    Sizes,
    Vector,
    Whole,
)

SHORTEST = 1e-12  # of time.end: four digits above the last one of a time


class Units(Table):
    """Labels only, stored with every dataset; nothing is converted."""

    length: str = Field("1", description="label of lengths")
    force: str = Field("1", description="label of forces")
    time: str = Field("1", description="label of times")


class Thermal(Table):
    """Thermal noise."""

    energy: NotNegative = Field(description="thermal energy kT", examples=[0.0])
    seed: Seed = Field(1, description="seed of the random numbers")
    directions: Literal["xyz", "xy"] = Field("xyz", description="xy: no lab z component")
    twist: bool = Field(True, description="thermal twist moment; false by default where nothing has twisting")

    @property
    def planar(self) -> bool:
        """Whether there are none along the lab's z."""
        return self.directions == "xy"


class Time(Table):
    """How far, by which steps."""

    end: Positive = Field(description="the run's last time", examples=[1.0])
    step: Annotated[float | Literal["auto"], Number(("auto",), low=0)] = Field("auto", description="time step")
    tolerance: Positive | None = Field(None, description="rms node error / L a unit time: adaptive steps")
    max_steps: Count = Field(1_000_000, description="the run stops with an error after so many steps")
    min_step: Positive | None = Field(None, description="the run stops with an error below it; absent: 1e-12 of end")
    scheme: Literal["explicit", "semi-implicit", "implicit"] = Field(
        "implicit", description="how a step is taken; with [thermal] semi-implicit, by default"
    )
    order: Annotated[int, Whole(choices=(1, 2))] = Field(
        2, description="order in time: 2 with implicit only; 1 by default with the others"
    )

    @property
    def shortest(self) -> float:
        """The step below which the run stops: by default as many digits of time are left to count it with."""
        return SHORTEST * self.end if self.min_step is None else self.min_step

    @property
    def automatic(self) -> bool:
        """Whether the scene chooses the step."""
        return self.step == "auto"

    @property
    def explicit(self) -> bool:
        """Whether steps have the limit of forward Euler."""
        return self.scheme == "explicit"


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
    ] = Field(description="what is taken; each is explained at the end of `ibfil schema`", examples=["speed"])
    filament: str = Field(
        "", description="name of a filament; where there are several, needed but for dissipation and flux"
    )
    link: str = Field("", description="name of a link, where the kind looks at one")
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
    def pumps(self) -> bool:
        """Whether it is a flux along a wall."""
        return self.kind == "flux"

    @property
    def of_link(self) -> bool:
        """Whether it looks at a link, and at no filament."""
        return self.kind.startswith("link_")

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


class Output(Table):
    """Outputs: their times and their content."""

    every: Positive | None = Field(None, description="time between outputs, hit exactly; this or times is required")
    times: Annotated[tuple[NotNegative, ...], Listed()] | None = Field(None, description="the times, instead of every")
    grid_every: Positive | None = Field(None, description="time between fields; absent: none written")
    fields: Annotated[tuple[Literal["velocity", "vorticity", "pressure"], ...], Listed()] = Field(
        ("velocity",), description="which fields"
    )
    grid_stride: Count = Field(1, description="every so many cells of a field")
    window: Sizes | None = Field(None, description="sides of the part of free space whose fields are written")
    window_at: Vector | None = Field(
        None, description="its middle; the origin by default, or such that it stands on the wall"
    )
    probes: Annotated[tuple[Vector, ...], Listed()] = Field((), description="points whose velocity is written")
    checkpoint_every: Positive = Field(60.0, description="wall seconds between checkpoints")


class Compute(Table):
    """How it is computed."""

    threads: Count = Field(1, description="how many threads")


class Scene(Table):
    """The whole file."""

    title: str = Field("", description="what it shows")
    source: str = Field("", description="citation")
    units: Units = Field(Units(), description="labels only")
    parameters: dict[str, Real] = Field({}, description="NAME = number or constant expression of earlier ones")
    filaments: dict[str, Filament] = Field(
        alias="filament",
        min_length=1,
        description="one table a filament",
        examples=[{"name": {"length": 1.0, "nodes": 41, "bending": 1.0, "stretching": 1e4}}],
    )
    links: dict[str, Link] = Field({}, alias="link", description="one table a link between filaments")
    contact: Contact | None = Field(None, description="absent: not looked for")
    fluid: Fluid = Field(description="the fluid", examples=[{"model": "rft", "viscosity": 1.0}])
    thermal: Thermal | None = Field(None, description="thermal noise, in rft and in stokes")
    time: Time = Field(description="how far, by which steps", examples=[{"end": 1.0}])
    stops: Annotated[tuple[Stop, ...], Listed()] = Field((), alias="stop", description="reasons to end early")
    observe: dict[str, Observe] = Field({}, description="numbers taken at every output")
    expect: dict[str, Expect] = Field({}, description="numbers to hold the result against")
    output: Output = Field(description="what is written, and when", examples=[{"every": 0.1}])
    compute: Compute = Field(Compute(), description="how it is computed")

    @property
    def twists(self) -> bool:
        """Whether any filament twists."""
        return any(filament.twisting is not None for filament in self.filaments.values())

    @property
    def heavy(self) -> bool:
        """Whether any filament has a mass."""
        return any(filament.mass is not None for filament in self.filaments.values())

    @property
    def couples_torque(self) -> bool:
        """Whether twist torques go onto the grid."""
        return self.fluid.couples_torque and self.twists

    @property
    def dissipation_observed(self) -> list[str]:
        """The observables of the heat that the fluid makes: an evaluation of it at each output."""
        return [name for name, one in self.observe.items() if one.kind == "dissipation"]


class Case(Scene):
    """A checked case. ``text`` is its resolved TOML, overrides included; ``file`` the name it goes by.

    ``deprecated`` holds a line for each word of an older version that was read as another.
    """

    text: str
    file: str
    deprecated: tuple[str, ...] = ()

    def __repr__(self) -> str:
        names = list(self.filaments)
        rods = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if names[3:] else "")
        return (
            f"<Case {self.file}: {self.title or 'untitled'}; {rods}; fluid {self.fluid.words}; t = {self.time.end:g}>"
        )

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """Its line, and its text to be opened, in a notebook."""
        from html import escape

        return f"<details><summary>{escape(repr(self)[1:-1])}</summary><pre>{escape(self.text)}</pre></details>"

    @property
    def reads(self) -> list[Path]:
        """The files that a run of it reads: its own, and those that shapes and places are in."""
        named = [getattr(f.shape, "path", None) for f in self.filaments.values()]
        named += [f.copies.file for f in self.filaments.values() if f.copies is not None]
        return [Path(self.file), *(Path(self.file).parent / name for name in named if name)]

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy. Raises TypeError with ``update``: it would not be checked, nor be in the text that is recorded."""
        if update:
            keys = ", ".join(f"{key}=..." for key in update)
            raise TypeError(f"a case is changed by overrides: ibfil.parse_case(case.text, case.file, ['{keys}'])")
        return super().model_copy(deep=deep)
