"""From a case to its grid: the kernel, the cells, what of a node goes through it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import CaseError
from .profiles import alone

if TYPE_CHECKING:
    from ..case.schema import Case
    from ..fluids.coupling import Coupling
    from ..fluids.spaces.free import FreeSpace
    from ..fluids.spaces.periodic import PeriodicSpace
    from ..grid.kernels import Kernel
    from ..grid.periodic_grid import Lattice
    from .stacked import RodStack


def kernel(case: Case) -> Kernel:
    """The discrete delta kernel of the case."""
    from ..grid.kernels import KERNELS

    return KERNELS[case.fluid.kernel]


def cells_of_thickness(case: Case) -> tuple[int, int, int]:
    """The cells that give ``thickness`` as the hydrodynamic line radius, or the nearest below. Raises CaseError."""
    from ..grid.periodic_grid import cells_for, smooth

    box, thickness = case.fluid.sides, case.fluid.thickness
    assert box is not None
    assert thickness is not None
    largest = thickness / kernel(case).line_radius
    found = cells_for(box, largest)
    if found is None:
        n = next(k for k in range(int(np.ceil(box[0] / largest)), 10**6) if smooth(k))
        h = box[0] / n
        fits = [h * next(k for k in range(max(1, round(side / h)), 10**6) if smooth(k)) for side in box]
        raise CaseError(
            [
                f"{case.file}: fluid.thickness: found {thickness:g}, for which no grid within 20 % has smooth numbers "
                f"of cells on all axes of box = {list(box)}; allowed: for example box = {[round(x, 10) for x in fits]}"
            ]
        )
    if min(found) < kernel(case).points:
        raise CaseError(
            [
                f"{case.file}: fluid.thickness: found {thickness:g}, for which box = {list(box)} has cells = "
                f"{list(found)}; allowed: at least {kernel(case).points} on each axis, the width of the kernel (sheets "
                "have no thickness: give cells, one of them 1)"
            ]
        )
    return found


def cells(case: Case) -> tuple[int, int, int]:
    """The cells of the case's grid. Raises CaseError where ``thickness`` has none."""
    return case.fluid.cells or cells_of_thickness(case)


def periodic_space(case: Case) -> PeriodicSpace:
    """The periodic box of the case. Raises CaseError where ``thickness`` has no cells."""
    from ..fluids.spaces.periodic import PeriodicSpace

    assert case.fluid.sides is not None
    return PeriodicSpace(case.fluid.sides, cells(case))


def free_space(case: Case) -> FreeSpace:
    """Free space with the case's spacing, or the one that ``thickness`` asks for."""
    from ..fluids.spaces.free import FreeSpace

    return FreeSpace(spacing(case))


def space(case: Case) -> PeriodicSpace | FreeSpace:
    """The space that the case's fluid fills. Raises CaseError where ``thickness`` has no cells."""
    return free_space(case) if case.fluid.free else periodic_space(case)


def spacing(case: Case) -> float:
    """The grid's h. Raises CaseError where ``thickness`` has none."""
    fluid = case.fluid
    if fluid.sides is not None:
        return fluid.sides[0] / cells(case)[0]
    if fluid.spacing is not None:
        return fluid.spacing
    assert fluid.thickness is not None
    return fluid.thickness / kernel(case).line_radius


def window(case: Case) -> Lattice | None:
    """The points of free space at which fields are written; None where the case has no window.

    The window is rounded up to numbers of cells that FFTs like, and has a point at its middle, or stands on the wall.
    """
    from ..grid.periodic_grid import Lattice, smooth

    if case.output.window is None:
        return None
    h = spacing(case)
    least = [max(1, int(np.ceil(side / h * (1 - 1e-12)))) for side in case.output.window]
    counts = np.array([next(n for n in range(k, 2 * k + 1) if smooth(n)) for k in least])
    at = case.output.window_at or (0.0, 0.0, 0.0)
    first = np.rint(np.array(at) / h).astype(int) - counts // 2
    if case.fluid.wall is not None and (case.output.window_at is None or first[2] < 0):
        first[2] = 0  # it stands on the wall
    return Lattice(counts.tolist(), h, first * h)


def twist_radius(case: Case) -> float:
    """The largest radius that a rod on the case's grid has when it spins: the kernel's, less by the slip."""
    return kernel(case).twist_radius * spacing(case) / float(np.sqrt(1.0 + case.fluid.slip))


def coupling(case: Case, stacked: RodStack) -> Coupling:
    """The coupling of nodes to the grid."""
    if not case.couples_torque:
        from ..fluids.coupling import TRANSLATION

        return TRANSLATION
    from ..fluids.torque_coupling import TorqueCoupling, spin_mobility

    volume, twists = stacked.system.volume[: stacked.count], stacked.twists[: stacked.count]
    widest = twist_radius(case)
    radius = np.full(len(volume), widest)
    for filament, where in zip(stacked.filaments, stacked.ranges, strict=True):
        if filament.radius is not None:
            radius[where] = alone(filament.radius, stacked.s[where])
    spin = spin_mobility(radius, widest, case.fluid.slip, case.fluid.viscosity, volume)
    # Where a filament does not twist its turn is held; any positive number will do for the row.
    return TorqueCoupling(np.where(twists, spin, 1.0), twists.astype(float))
