"""What the schema has and this version does not build: politely refused. A row goes when its time comes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from .case_faults import Fault
from .case_filament import Filament
from .case_schema import Fluid, Scene

Keys = Callable[[Scene], list[str]]


class Row(NamedTuple):
    """The keys of a case that ask for something not built, what it is, and what may stand there instead."""

    keys: Keys
    what: str
    instead: str


def _scene(key: str, asks: Callable[[Scene], bool]) -> Keys:
    return lambda case: [key] if asks(case) else []


def _fluid(key: str, asks: Callable[[Fluid], bool]) -> Keys:
    return _scene(f"fluid.{key}", lambda case: asks(case.fluid))


def _filaments(key: str, asks: Callable[[Filament], bool]) -> Keys:
    return lambda case: [f"filament.{name}.{key}" for name, f in case.filaments.items() if asks(f)]


def _ends(key: str) -> Keys:
    """The ``key`` of the ends at which it is given."""
    return lambda case: [
        f"filament.{name}.{side}.{key}"
        for name, f in case.filaments.items()
        for side, end in (("start", f.start), ("finish", f.finish))
        if getattr(end, key) is not None
    ]


NOT_BUILT: list[Row] = [
    Row(
        _filaments("shape.kind", lambda f: f.shape.kind == "run"),
        "the shape of another run",
        "the other kinds",
    ),
    Row(_fluid("model", lambda f: f.model == "navier-stokes"), "the Navier-Stokes fluid", '"rft" or "stokes"'),
]


def faults(case: Scene) -> list[Fault]:
    """One fault for each key that asks for something this version does not build."""
    return [
        Fault(key, f"{row.what}, which this version does not build yet", row.instead)
        for row in NOT_BUILT
        for key in row.keys(case)
    ]
