"""From the ends of filaments to prescribed unknowns, and to the end nodes that carry no moment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..rods.boundary_conditions import PrescribedEnd, PrescribedEnds, Turn, spinning, steady, turned
from .loads import number, triple

if TYPE_CHECKING:
    from ..case.filament import Filament


def _turn(end) -> Turn | None:
    """How e1 turns at a held end; None where it is free."""
    if not end.turn_held:
        return None
    if end.angle is not None:
        return turned(number(end.angle))
    if end.spin is None:
        return steady(0.0)
    if end.spin.constant is not None:
        return steady(end.spin.constant)
    return spinning(number(end.spin))


def prescribed_ends(
    filaments: Sequence[Filament],
    nodes: Sequence[slice],
    ranges: Sequence[slice],
    unknowns: int,
    bodies_still: bool = False,
) -> tuple[PrescribedEnds, np.ndarray]:
    """The held unknowns, and the mask (n,) of end nodes that carry no moment; ``ranges`` have phantom nodes too.

    Ends in bodies are held among them only where ``bodies_still``: bodies carry them otherwise.
    """
    held, free = [], np.zeros(ranges[-1].stop, bool)
    idle: list[int] = []
    for filament, where, every in zip(filaments, nodes, ranges, strict=True):
        for end, node in ((filament.start, where.start), (filament.finish, where.stop - 1)):
            free[node] = not end.clamped and not filament.closed
            if end.held and (bodies_still or not end.attached):
                moves = None if end.moves is None else triple(end.moves, "t")
                held.append(PrescribedEnd(node, _turn(end), moves))
        if unknowns == 4 and filament.twisting is None:
            idle += range(every.start, every.stop)
    return PrescribedEnds(held, unknowns, np.array(idle, np.int64)), free
