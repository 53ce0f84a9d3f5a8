"""Cases too large for this machine, or for any: refused with their number before anything is made of that size."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator

from ..faults import Fault, shown
from ..fluid import Matched
from ..schema import Scene

# At least so much is needed, whatever the method: what is let through may still be too much, and `check` estimates it.
BYTES_A_CELL = 24  # one vector field
BYTES_A_NODE = 2000  # geometry, band matrices, the outputs that wait to be written
MOST_NODES = 100_000  # of one filament
MOST_MODES = 10_000  # of shape.noise
MOST_OUTPUTS = 10_000_000
MOST_THREADS = 1024
THINNEST = 1.5  # of the hydrodynamic radius of a line: more than h for every kernel


def check_size(case: Scene) -> Iterator[Fault]:
    """The faults of numbers that are too large."""
    memory = _memory()
    yield from _nodes(case, memory)
    yield from _cells(case, memory)
    yield from _window(case, memory)
    for name in ("every", "grid_every"):
        every = getattr(case.output, name)
        if every is not None and case.time.end / every > MOST_OUTPUTS:
            found = f"{every:g}, for {case.time.end / every:.3g} outputs until time.end = {case.time.end:g}"
            least = f"at least {case.time.end / MOST_OUTPUTS:.3g}, for {MOST_OUTPUTS:.0e} outputs"
            yield Fault(f"output.{name}", found, least, ("time.end",))
    if case.compute.threads > MOST_THREADS:
        yield Fault("compute.threads", f"{case.compute.threads}", f"at most {MOST_THREADS}")


def _memory() -> float:
    """Bytes of this machine."""
    return float(os.sysconf("SC_PHYS_PAGES")) * float(os.sysconf("SC_PAGE_SIZE"))


def _nodes(case: Scene, memory: float) -> Iterator[Fault]:
    total = 0
    for name, filament in case.filaments.items():
        if filament.nodes > MOST_NODES:
            yield Fault(f"filament.{name}.nodes", f"{filament.nodes}", f"at most {MOST_NODES} on one filament")
        noise = filament.shape.noise
        if noise is not None and noise.modes > MOST_MODES:
            yield Fault(f"filament.{name}.shape.noise.modes", f"{noise.modes}", f"at most {MOST_MODES}")
        count = 1 if filament.copies is None or filament.copies.count is None else filament.copies.count
        total += filament.nodes * count
        if count > 1 and total * BYTES_A_NODE > memory:
            found = f"{count}, for {total} nodes and {_size(total * BYTES_A_NODE)} at least"
            yield Fault(f"filament.{name}.copies.count", found, f"what fits into this machine's {_size(memory)}")


def _cells(case: Scene, memory: float) -> Iterator[Fault]:
    fluid = case.fluid
    if fluid.sides is None or (fluid.model == "rft" and not isinstance(fluid.drag, Matched)):
        return
    count, key, value = 1.0, "cells", ""
    if fluid.cells is not None:
        value = shown(list(fluid.cells))
        for n in fluid.cells:
            count *= n
    elif fluid.thickness is not None:
        key, value = "thickness", f"{fluid.thickness:g}"
        for side in fluid.sides:
            count *= side / (THINNEST * fluid.thickness)
    if count * BYTES_A_CELL > memory:
        found = f"{value}, for {count:.3g} cells and {_size(count * BYTES_A_CELL)} at least"
        yield Fault(f"fluid.{key}", found, f"what fits into this machine's {_size(memory)}", ("fluid.box",))


def _window(case: Scene, memory: float) -> Iterator[Fault]:
    fluid, window = case.fluid, case.output.window
    h = fluid.spacing or (fluid.thickness or 0.0) / THINNEST
    if window is None or not fluid.free or not h:
        return
    count = math.prod(side / h for side in window)
    if count * BYTES_A_CELL > memory:
        found = f"{shown(window)}, for {count:.3g} points and {_size(count * BYTES_A_CELL)} at least"
        reads = ("fluid.spacing", "fluid.thickness", "fluid.box")
        yield Fault("output.window", found, f"what fits into this machine's {_size(memory)}", reads)


def _size(count: float) -> str:
    return f"{count / 2**30:.3g} GiB"
