"""Inconsistencies of closed filaments: what has no meaning without ends, and what is not modelled for them."""

from __future__ import annotations

from collections.abc import Iterator

from ..bodies.end import End
from ..faults import Fault, shown
from ..filament import Filament, TwoWell
from ..schema import Scene
from ..shape import RunShape


def check_closed(case: Scene) -> Iterator[Fault]:
    """All faults of what does not go together in closed filaments."""
    for name, filament in case.filaments.items():
        key = f"filament.{name}"
        yield from _linking(f"{key}.linking", filament)
        if filament.closed:
            yield from _itself(key, filament)
            yield from _scene(key, filament, case)


def _linking(key: str, filament: Filament) -> Iterator[Fault]:
    if filament.linking is None:
        return
    if not filament.closed or filament.twisting is None:
        found = f"{filament.linking} without " + ("twisting" if filament.closed else "closed = true")
        yield Fault(key, found, "with closed = true and twisting")
    elif isinstance(filament.shape, RunShape):
        yield Fault(key, f'{filament.linking} with shape.kind = "run"', "nothing: it is that of the run")


def _itself(key: str, filament: Filament) -> Iterator[Fault]:
    closed = (f"{key}.closed",)
    for side, end in (("start", filament.start), ("finish", filament.finish)):
        if end != End():
            yield Fault(f"{key}.{side}", "an end of a closed filament", "nothing: it has no ends", closed)
    least = 10 if filament.derivative == 6 else 7
    if filament.nodes < least:
        allowed = f"at least {least} with closed = true and derivative = {filament.derivative}"
        yield Fault(f"{key}.nodes", f"{filament.nodes}", allowed, (*closed, f"{key}.derivative"))
    if not isinstance(filament.spacing, str):
        yield Fault(f"{key}.spacing", shown(filament.spacing.text), '"even" with closed = true', closed)
    if filament.force == "torque-free":
        yield Fault(f"{key}.force", '"torque-free" with closed = true', '"eq44"', closed)
    if filament.mass is not None:
        yield Fault(f"{key}.mass", "mass of a closed filament", "no inertia of closed filaments", closed)
    if filament.shape.noise is not None:
        yield Fault(f"{key}.shape.noise", "noise of a closed filament", "shape.perturb, which closes", closed)
    if isinstance(filament.law, TwoWell) and filament.law.gradient:
        yield Fault(f"{key}.law.gradient", f"{filament.law.gradient:g} with closed = true", "0", closed)


def _scene(key: str, filament: Filament, case: Scene) -> Iterator[Fault]:
    if case.fluid.thick:
        yield Fault(f"{key}.closed", "true with fluid.thick", "flows act on their axis only", ("fluid.thick",))
