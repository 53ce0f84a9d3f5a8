"""From a case to its grid: the kernel, the cells, what of a node goes through it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import CaseError
from .profiles import alone

if TYPE_CHECKING:
    from ..case.schema import Case
    from ..fluids.coupling import Coupling
    from ..fluids.spaces.periodic import PeriodicSpace
    from ..grid.kernels import Kernel
    from .stacked import RodStack


def kernel(case: Case) -> Kernel:
    """The discrete delta kernel of the case."""
    from ..grid.kernels import KERNELS

    return KERNELS[case.fluid.kernel]


def cells_of_thickness(case: Case) -> tuple[int, int, int]:
    """The cells that give ``thickness`` as the hydrodynamic line radius, or the nearest below. Raises CaseError."""
    from ..grid.periodic_grid import cells_for, smooth

    box, thickness = case.fluid.box, case.fluid.thickness
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
    return found


def cells(case: Case) -> tuple[int, int, int]:
    """The cells of the case's grid. Raises CaseError where ``thickness`` has none."""
    return case.fluid.cells or cells_of_thickness(case)


def periodic_space(case: Case) -> PeriodicSpace:
    """The periodic box of the case. Raises CaseError where ``thickness`` has no cells."""
    from ..fluids.spaces.periodic import PeriodicSpace

    assert case.fluid.box is not None
    return PeriodicSpace(case.fluid.box, cells(case))


def spacing(case: Case) -> float:
    """The grid's h. Raises CaseError where ``thickness`` has none."""
    assert case.fluid.box is not None
    return case.fluid.box[0] / cells(case)[0]


def twist_radius(case: Case) -> float:
    """The largest radius that a rod on the case's grid has when it spins: the kernel's, less by the slip."""
    return kernel(case).twist_radius * spacing(case) / float(np.sqrt(1.0 + case.fluid.slip))


def coupling(case: Case, stacked: RodStack) -> Coupling:
    """The coupling of nodes to the grid."""
    if not case.couples_torque:
        from ..fluids.coupling import TRANSLATION

        return TRANSLATION
    from ..fluids.torque_coupling import TorqueCoupling, spin_mobility

    volume, twists = stacked.system.mesh.volume, stacked.twists
    widest = twist_radius(case)
    radius = np.full(len(volume), widest)
    for filament, where in zip(stacked.filaments, stacked.nodes, strict=True):
        if filament.radius is not None:
            radius[where] = alone(filament.radius, stacked.s[where])
    spin = spin_mobility(radius, widest, case.fluid.slip, case.fluid.viscosity, volume)
    # Where a filament does not twist its turn is held; any positive number will do for the row.
    return TorqueCoupling(np.where(twists, spin, 1.0), twists.astype(float))
