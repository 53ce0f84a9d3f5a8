"""Which filaments and bodies of a case are one swimmer: those that ends in bodies or links join."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

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
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    from ...fluids.shells.swimmer import Swimmer

    filaments, ends = len(rods.nodes), attached_ends(rods)
    rod = {where.start: number for number, where in enumerate(rods.nodes)}
    body = {name: filaments + number for number, name in enumerate(case.each_body)}
    joined = [(rod[at.where.start], body[at.end.body]) for at in ends]
    joined += [(link.filaments[0], link.filaments[-1]) for link in rods.links]
    one, other = np.array(joined, np.int64).reshape(-1, 2).T
    count = filaments + len(body)
    group = connected_components(coo_array((np.ones(len(one)), (one, other)), (count, count)), directed=False)[1]
    driven = [group[rod[at.where.start]] for at in ends if at.end.motor is not None]
    parts: dict[int, tuple[list[slice], list[int], list[int]]] = {own: ([], [], []) for own in group}
    for own, where in zip(group, rods.ranges, strict=False):  # filaments come first
        parts[own][0].append(where)
    for number, own in enumerate(group[filaments:]):
        parts[own][1].append(number)
    for number, own in enumerate(driven):
        parts[own][2].append(number)
    return tuple(Swimmer(tuple(ranges), tuple(bodies), tuple(motors)) for ranges, bodies, motors in parts.values())
