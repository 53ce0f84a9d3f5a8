"""What the schema has and this version does not build: politely refused. A row goes when its time comes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from .case_faults import Fault
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


NOT_BUILT: list[Row] = [
    Row(_fluid("model", lambda f: f.model == "navier-stokes"), "the Navier-Stokes fluid", '"rft" or "stokes"'),
]


def faults(case: Scene) -> list[Fault]:
    """One fault for each key that asks for something this version does not build."""
    return [
        Fault(key, f"{row.what}, which this version does not build yet", row.instead)
        for row in NOT_BUILT
        for key in row.keys(case)
    ]
