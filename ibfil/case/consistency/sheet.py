"""Checks of a grid that is one cell deep along an axis: a plane flow, in which filaments are sheets."""

from __future__ import annotations

from collections.abc import Iterator

from ..faults import Fault, shown
from ..schema import Scene


def check_sheet(case: Scene) -> Iterator[Fault]:
    """The faults of what a sheet has not: a second thin axis, a twist, a thickness, the drag of a rod."""
    fluid = case.fluid
    if fluid.cells is None or not (fluid.on_grid or fluid.drag_matched):
        return
    if fluid.cells.count(1) > 1:
        yield Fault("fluid.cells", shown(fluid.cells), "one cell along one axis at most, for a plane flow")
    if 1 not in fluid.cells:
        return
    where = f"one cell along {'xyz'[fluid.cells.index(1)]}, where filaments are sheets"
    if not fluid.on_grid:
        allowed = "cells as wide as the kernel on each axis: drag is that of a rod"
        yield Fault("fluid.drag", f"drag matched to a grid with {where}", allowed, ("fluid.cells", "fluid.model"))
    if fluid.thick:
        allowed = "false: the couple is that across a rod"
        yield Fault("fluid.thick", f"rods with a thickness, and {where}", allowed, ("fluid.cells",))
    for name, filament in case.filaments.items():
        if filament.twisting is not None:
            key = f"filament.{name}.twisting"
            yield Fault(key, f"a twist modulus, and {where}", "no twisting: a sheet does not twist", ("fluid.cells",))
