"""The space that the fluid fills: a periodic box and its cells, or free space; what is written of it.

Needed by fluids on a grid, and by drag matched to one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction

from ..faults import Fault, shown
from ..fluid import Fluid
from ..schema import Scene

SUPPORT = {"roma3": 3, "peskin4": 4, "bspline4": 4, "bspline6": 6, "bkp6": 6, "es4": 4, "es5": 5, "es6": 6}
_FREE = 'box = "free"'


def check_space(case: Scene) -> Iterator[Fault]:
    """The faults of the space and of the window in it."""
    fluid = case.fluid
    if (fluid.on_grid or fluid.drag_matched) and fluid.box is None:
        why = "this fluid has a grid" if fluid.on_grid else "drag is matched to a grid"
        yield Fault("fluid.box", "nothing", f'three lengths or "free": {why}', ("fluid.model", "fluid.drag"))
    yield from _free(fluid) if fluid.free else _periodic(fluid)
    if fluid.on_grid:
        yield from _window(case)
        yield from _wall(case)
    for name, entry in case.observe.items():
        if entry.pumps and not fluid.sticks:
            yield Fault(
                f"observe.{name}.kind", shown(entry.kind), 'flux only with fluid.wall = "no-slip"', ("fluid.wall",)
            )


def _free(fluid: Fluid) -> Iterator[Fault]:
    """Free space has a spacing, and no cells."""
    reads = ("fluid.box", "fluid.model", "fluid.drag")
    if fluid.cells is not None:
        yield Fault("fluid.cells", f"{shown(fluid.cells)} with {_FREE}", "thickness or spacing there", ("fluid.box",))
    if fluid.spacing is not None and fluid.thickness is not None:
        yield Fault("fluid.thickness", "thickness and spacing", "one of them", ("fluid.spacing",))
    elif (fluid.on_grid or fluid.drag_matched) and fluid.spacing is None and fluid.thickness is None:
        allowed = f"thickness or spacing with {_FREE}"
        yield Fault("fluid.spacing", "nothing, and no thickness", allowed, (*reads, "fluid.thickness"))
    if fluid.inertial:
        found, allowed = f"{shown(fluid.box)} with {fluid.model}", 'three lengths; "free" needs stokes'
        yield Fault("fluid.box", found, allowed, ("fluid.model",))
    elif fluid.on_grid and fluid.method == "pruned":
        found = f"{shown(fluid.method)} with {_FREE}, where all transforms are of the filaments' box"
        yield Fault("fluid.method", found, '"auto", "table", "fft" or "krylov"', ("fluid.box", "fluid.model"))


def _periodic(fluid: Fluid) -> Iterator[Fault]:
    """A box has cells, as long as they are wide."""
    reads = ("fluid.model", "fluid.drag")
    if fluid.spacing is not None and fluid.box is not None:
        found = f"{fluid.spacing:g} with a box of three lengths"
        yield Fault("fluid.spacing", found, f"cells or thickness; spacing only with {_FREE}", ("fluid.box",))
    if (fluid.on_grid or fluid.drag_matched) and fluid.cells is None and fluid.thickness is None:
        yield Fault(
            "fluid.cells", "nothing, and no thickness", "cells or thickness", (*reads, "fluid.box", "fluid.thickness")
        )
    if fluid.cells is not None and fluid.thickness is not None:
        yield Fault("fluid.thickness", "thickness and cells", "one of them", ("fluid.cells",))
    if fluid.sides is None or fluid.cells is None:
        return
    spacing = [size / count for size, count in zip(fluid.sides, fluid.cells, strict=True)]
    if max(spacing) - min(spacing) > 1e-9 * max(spacing):
        found = f"{shown(fluid.cells)}, which makes h = " + ", ".join(f"{h:.6g}" for h in spacing)
        such = _nearest(fluid.sides, fluid.cells)
        yield Fault("fluid.cells", found, f"one h on all axes, such as {such}", ("fluid.box",))
    elif any(1 < count < SUPPORT[fluid.kernel] for count in fluid.cells):
        allowed = f"at least {SUPPORT[fluid.kernel]} on each axis, the width of {fluid.kernel}, or 1 for a plane flow"
        yield Fault("fluid.cells", shown(fluid.cells), allowed, ("fluid.kernel",))


def _nearest(box: tuple[float, float, float], cells: tuple[int, int, int]) -> str:
    """The cells nearest to the given ones that have one h in the box; where none have, a box that does."""
    ratios = [Fraction(size / box[0]).limit_denominator(1000) for size in box]
    if all(abs(float(r) * box[0] / size - 1.0) < 1e-9 for r, size in zip(ratios, box, strict=True)):
        whole = math.lcm(*(ratio.denominator for ratio in ratios))
        parts = [int(ratio * whole) for ratio in ratios]
        parts = [part // math.gcd(*parts) for part in parts]
        times = sum(c * p for c, p in zip(cells, parts, strict=True)) / sum(p * p for p in parts)
        return f"cells = {shown([part * max(1, round(times)) for part in parts])}"
    h = box[0] / cells[0]
    return f"box = {shown([float(f'{h * count:.9g}') for count in cells])} with these cells"


def _window(case: Scene) -> Iterator[Fault]:
    """Fields of free space are written in a window of it."""
    output, reads = case.output, ("fluid.box", "fluid.model")
    if output.window is not None and not case.fluid.free:
        yield Fault("output.window", f"{shown(output.window)} with a periodic box", f"only with {_FREE}", reads)
    if output.window is None and case.fluid.free and output.grid_every is not None:
        allowed = f"three lengths with {_FREE}: fields are written in a window of it"
        yield Fault("output.window", "nothing, and grid_every", allowed, (*reads, "output.grid_every"))
    if output.window_at is not None and output.window is None:
        yield Fault("output.window_at", "window_at and no window", "only with window", ("output.window",))


def _wall(case: Scene) -> Iterator[Fault]:
    """A plane bounds free space; torques, and fields of a force but its velocity, have no image in one that sticks."""
    fluid, output = case.fluid, case.output
    if fluid.wall is None:
        return
    reads, named = ("fluid.wall", "fluid.box", "fluid.model"), f"wall = {shown(fluid.wall)}"
    if not fluid.free:
        found = f"{shown(fluid.wall)} with a periodic box"
        yield Fault("fluid.wall", found, f"only with {_FREE}", ("fluid.box", "fluid.model"))
    if case.couples_torque:
        found = f"{shown(fluid.rotation)} with {named}, in which torques have no image"
        yield Fault("fluid.rotation", found, '"local"', (*reads, "filament"))
    if fluid.sticks and output.grid_every is not None and set(output.fields) != {"velocity"}:
        yield Fault("output.fields", f"{shown(list(output.fields))} with {named}", '["velocity"]', reads)
    for i, place in enumerate(output.probes):
        if place[2] < 0:
            yield Fault(f"output.probes.{i}", f"{shown(list(place))}, below the wall", "z >= 0", reads)
    if output.window is not None and output.window_at is not None and output.window_at[2] < 0.5 * output.window[2]:
        found = f"{shown(list(output.window_at))}, with window a part of which is below the wall"
        allowed = f"z of at least {0.5 * output.window[2]:g}, half its height"
        yield Fault("output.window_at", found, allowed, (*reads, "output.window"))
