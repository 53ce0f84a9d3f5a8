"""Checks of rods that flows turn by their thickness: whether it is known, and what does not go with it."""

from __future__ import annotations

from collections.abc import Iterator

from ..faults import Fault, shown
from ..schema import Scene


def check_thickness(case: Scene) -> Iterator[Fault]:
    """The faults of ``fluid.thick``."""
    fluid, aspect = case.fluid, case.fluid.aspect
    if not fluid.thick:
        return
    if case.thermal is not None:
        found = "thermal forces and rods that flows turn by their thickness, whose couple has a noise of its own"
        yield Fault("fluid.thick", found, "false with [thermal]", ("thermal",))
    if aspect is not None:
        if aspect <= 1.0:
            yield Fault("fluid.thick.aspect", f"{aspect:g}", "a number > 1: rods are longer than thick")
        if fluid.model != "rft":
            found = f"an aspect ratio with fluid.model = {shown(fluid.model)}, whose drag on turning is the grid's"
            allowed = "only with rft; on a grid thick = true, with the radius of the filaments or the kernel's"
            yield Fault("fluid.thick.aspect", found, allowed, ("fluid.model",))
        return
    for name, filament in case.filaments.items():
        if fluid.model == "rft" and filament.radius is None:
            allowed = "with fluid.thick, a radius (or fluid.thick = { aspect = .. })"
            yield Fault(f"filament.{name}.radius", "nothing", allowed, ("fluid.thick", "fluid.model"))
