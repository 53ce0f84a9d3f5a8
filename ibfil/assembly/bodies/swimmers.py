"""Which filaments and bodies of a case are one swimmer: those that ends in bodies or links join."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .attached import attached_ends

if TYPE_CHECKING:
    from ...case.schema import Case
    from ...fluids.shells.swimmer import Swimmer
    from ..stacked import RodStack


def whole(case: Case, rods: RodStack) -> Swimmer:
    """All of a scene as one."""
    from ...fluids.shells.swimmer import Swimmer

    return Swimmer(rods.ranges, tuple(range(len(case.each_body))), tuple(range(len(rods.motors))))


def apart(case: Case, rods: RodStack) -> tuple[Swimmer, ...]:
    """Each swimmer of a scene; a filament or a body that nothing is joined to is one by itself."""
    from ...fluids.shells.swimmer import Swimmer

    names, first = list(case.each_body), [where.start for where in rods.nodes]
    filaments = len(first)
    group = list(range(filaments + len(names)))
    ends = attached_ends(rods)
    joined = [(first.index(at.where.start), filaments + names.index(at.end.body)) for at in ends]
    joined += [(link.filaments[0], link.filaments[-1]) for link in rods.links]
    for one, other in joined:
        group = [group[one] if number == group[other] else number for number in group]
    motors = [group[first.index(at.where.start)] for at in ends if at.end.motor is not None]
    return tuple(
        Swimmer(
            tuple(where for k, where in enumerate(rods.ranges) if group[k] == own),
            tuple(b for b in range(len(names)) if group[filaments + b] == own),
            tuple(k for k, number in enumerate(motors) if number == own),
        )
        for own in dict.fromkeys(group)
    )
