"""Which bodies have rods with other supports too: another body, or the lab."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...bodies.supports import Component, Support, Supports

if TYPE_CHECKING:
    from ..stacked import RodStack
    from .attached import InBody


def supports(rods: RodStack, ends: Sequence[InBody], names: Sequence[str]) -> Supports | None:
    """The supports of all bodies that have such rods; None where there are none."""
    found = _all(rods, ends, names)
    rods_of: dict[int, list[int]] = {}
    for k, (_, rod) in enumerate(found):
        rods_of.setdefault(rod, []).append(k)
    group = list(range(len(names)))
    for numbers in rods_of.values():
        bodies = [found[k][0].body for k in numbers if found[k][0].body >= 0]
        for other in bodies[1:]:
            group = [group[bodies[0]] if g == group[other] else g for g in group]
    together: dict[int, tuple[list[int], list[list[int]]]] = {}  # bodies, and the supports of each of their rods
    for b, g in enumerate(group):
        together.setdefault(g, ([], []))[0].append(b)
    for numbers in rods_of.values():
        body = max(found[k][0].body for k in numbers)  # one at least: all of them are in one group
        together[group[body]][1].append(numbers)
    components: list[tuple[tuple[int, ...], tuple[int, ...], np.ndarray]] = []
    for of_group, own in together.values():
        mine = tuple(k for numbers in own for k in numbers)
        if len(of_group) > 1 or any(found[k][0].body < 0 for k in mine):
            where = [rods.nodes[found[numbers[0]][1]] for numbers in own]
            components.append((tuple(of_group), mine, np.concatenate([np.arange(w.start, w.stop) for w in where])))
    used = [k for _, mine, _ in components for k in mine]
    if not used:
        return None
    new = {k: i for i, k in enumerate(used)}
    parts = [Component(some, tuple(new[k] for k in mine), nodes) for some, mine, nodes in components]
    return Supports(rods.system, [found[k][0] for k in used], parts)


def _all(rods: RodStack, ends: Sequence[InBody], names: Sequence[str]) -> list[tuple[Support, int]]:
    """All supports of rods that are in a body, and the number of the rod of each."""
    motors = clamps = 0
    inside: dict[int, Support] = {}
    for at in ends:
        motor = clamp = -1
        if at.end.motor is not None:
            motor, motors = motors, motors + 1
        if at.end.clamped:
            clamp, clamps = clamps, clamps + 1
        inside[at.node] = Support(at.node, at.finish, at.end.clamped, names.index(at.end.body), motor, clamp)
    out = []
    for rod, (filament, where) in enumerate(zip(rods.filaments, rods.nodes, strict=True)):
        both = ((filament.start, where.start, False), (filament.finish, where.stop - 1, True))
        if any(end.attached for end, _, _ in both):
            for end, node, finish in both:
                if end.held:
                    out.append((inside.get(node, Support(node, finish, end.clamped, -1, -1, -1)), rod))
    return out
