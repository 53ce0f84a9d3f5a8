"""The faults of thermal forces: with a fluid or a scheme that they do not go with."""

from __future__ import annotations

from collections.abc import Iterator

from ..faults import Fault, shown
from ..schema import Scene


def check_thermal(case: Scene) -> Iterator[Fault]:
    """All of them."""
    thermal, time = case.thermal, case.time
    if thermal is None:
        return
    yield from _in_fluid(case)
    if thermal.twist and all(filament.twisting is None for filament in case.filaments.values()):
        yield Fault("thermal.twist", "true", "false where no filament has twisting", ("filament",))
    if time.scheme != "semi-implicit":
        allowed = '"semi-implicit", the only one with [thermal]'
        yield Fault("time.scheme", shown(time.scheme), allowed, ("thermal",))
    if time.tolerance is not None:
        found = "a tolerance with [thermal], whose kicks no shorter step follows more closely"
        yield Fault("time.tolerance", found, "time.step", ("thermal",))


def _in_fluid(case: Scene) -> Iterator[Fault]:
    """Those of a fluid whose mobility has no root, or whose own motion would be thermal too."""
    assert case.thermal is not None
    fluid = case.fluid
    if fluid.inertial:
        found = "thermal forces in a fluid with inertia, whose own velocity must fluctuate too"
        yield Fault("thermal", found, 'fluid.model = "stokes" or "rft"', ("fluid.model",))
    elif fluid.on_grid and fluid.slip == 0:
        found = "0 with [thermal]: the kicks of nodes closer than the grid can move them apart have no root"
        yield Fault("fluid.slip", found, "above 0, such as 0.01", ("thermal",))
    if fluid.on_grid and fluid.free and fluid.method == "krylov":
        found = f"{shown(fluid.method)} with [thermal] in free space, where random motions come from the exact matrix"
        yield Fault("fluid.method", found, '"auto", "table" or "fft"', ("thermal", "fluid.box"))
    if not case.thermal.twist and case.couples_torque:
        found = 'false with fluid.rotation = "grid", whose fluctuating vorticity turns rods anyhow'
        yield Fault("thermal.twist", found, 'true, or fluid.rotation = "local"', ("fluid.rotation",))
