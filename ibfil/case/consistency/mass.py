"""Checks of the inertia of a filament: what needs a mass, and what does not go with one."""

from __future__ import annotations

from collections.abc import Iterator

from ..faults import Fault
from ..filament import Filament
from ..schema import Scene


def check_mass(key: str, filament: Filament, case: Scene) -> Iterator[Fault]:
    """The faults of ``mass``, ``rotary_inertia`` and ``velocity`` of one filament."""
    if filament.mass is None:
        for name in ("rotary_inertia", "velocity"):
            if getattr(filament, name) is not None:
                yield Fault(f"{key}.{name}", "no mass", "only with mass", (f"{key}.mass",))
        return
    if filament.rotary_inertia is not None and filament.twisting is None:
        yield Fault(
            f"{key}.rotary_inertia", "no twisting", "only with twisting, the twist modulus C", (f"{key}.twisting",)
        )
    if case.thermal is not None:
        found = "a mass and thermal forces, whose scheme has no inertia"
        yield Fault(f"{key}.mass", found, "no mass with [thermal]", ("thermal",))
    elif case.time.explicit:
        found = 'a mass with scheme = "explicit", which knows no inertia'
        yield Fault(f"{key}.mass", found, '"implicit" or "semi-implicit"', ("time.scheme",))
