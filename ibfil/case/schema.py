"""Every table and key of a case file, as frozen descriptions: each key with its default and its meaning.

The tables of a filament are in filament.py and shape.py, kinds of value in values.py, checks between keys in
consistency/. Some defaults depend on other tables: defaults.py fills those in
before a case is read, and the text here says so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field

from .bodies.body import Body
from .copies import copy_names
from .filament import Filament
from .fluid import Contact, Fluid
from .link import Link
from .observe import Expect, Observe, Stop
from .table import Table
from .values import Count, Listed, NotNegative, Number, Positive, Real, Seed, Sizes, Vector, Whole

_Overrides = Sequence[str] | Mapping[str, Any]  # of overrides.py

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
    solver_error: Positive | None = Field(
        None, description="of implicit steps, over what extrapolation was off by; absent: 1e-8 of the length"
    )
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


class Output(Table):
    """Outputs: their times and their content."""

    every: Positive | None = Field(None, description="time between outputs, hit exactly; this or times is required")
    times: Annotated[tuple[NotNegative, ...], Listed()] | None = Field(None, description="the times, instead of every")
    grid_every: Positive | None = Field(None, description="time between fields; absent: none written")
    fields: Annotated[tuple[Literal["velocity", "vorticity", "pressure"], ...], Listed()] = Field(
        ("velocity",), description="which fields"
    )
    grid_stride: Count = Field(1, description="every so many cells of a field")
    copies_every: Count = Field(
        1, description="every so many-th copy of a filament is written, and observed; all are computed"
    )
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
    bodies: dict[str, Body] = Field({}, alias="body", description="one table a body, which ends of filaments are in")
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
    def joined(self) -> dict[str, tuple[str, ...]]:
        """The names of links, bodies and motors; a motor is called by the end it turns, FILAMENT_start."""
        motors = [
            f"{copy}_{side}"
            for name, filament in self.filaments.items()
            for copy in copy_names(name, filament.copies)
            for side in ("start", "finish")
            if getattr(filament, side).motor is not None
        ]
        return {"link": tuple(self.links), "body": tuple(self.each_body), "motor": tuple(motors)}

    @property
    def each_body(self) -> dict[str, Body]:
        """All bodies by name: of those with ends of copies in them one for each, NAME_000, NAME_001 ..."""
        copies = {end.body: f.copies for f in self.filaments.values() for end in (f.start, f.finish) if end.attached}
        return {own: body for name, body in self.bodies.items() for own in copy_names(name, copies.get(name))}

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

    reader: ClassVar[Callable[[str, str, _Overrides], Case]]  # reading.parse_case, which knows this module

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

    def with_(self, overrides: _Overrides) -> Case:
        """The case with other values, {"time.end": 2.0, ...}, in its text too, which is what a run records.

        None takes a key out; words "KEY=VALUE" are as on the command line. Raises CaseError, one line a fault.

        >>> case = ibfil.read_case("swimmer_rft")
        >>> case.with_({"time.end": 0.5, "fluid.viscosity": 2.0}).time.end
        0.5
        """
        return Case.reader(self.text, self.file, overrides)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy. Raises TypeError with ``update``: it would not be checked, nor be in the text that is recorded."""
        if update:
            keys = ", ".join(f'"{key}": ...' for key in update)
            raise TypeError(f"a case with other values is case.with_({{{keys}}})")
        return super().model_copy(deep=deep)

    def copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False, **_: Any) -> Self:
        """The older word for `model_copy`, which it is."""
        return self.model_copy(update=update, deep=deep)
