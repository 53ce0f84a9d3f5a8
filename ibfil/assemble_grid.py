"""From a case to its grid: the kernel, the cells, what of a node goes through it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .assemble_profiles import alone
from .errors import CaseError

if TYPE_CHECKING:
    from .assemble import Stacked
    from .case_schema import Case
    from .grid import Grid
    from .immersed_boundary import Coupling
    from .kernels import Kernel


def kernel(case: Case) -> Kernel:
    """The discrete delta kernel of the case."""
    from .kernels import KERNELS

    return KERNELS[case.fluid.kernel]


def cells_of_thickness(case: Case) -> tuple[int, int, int]:
    """The cells that give ``thickness`` as the hydrodynamic line radius, or the nearest below. Raises CaseError."""
    from .grid import cells_for, smooth

    box, thickness = case.fluid.box, case.fluid.thickness
    assert box is not None
    assert thickness is not None
    largest = thickness / kernel(case).line_radius
    cells = cells_for(box, largest)
    if cells is None:
        n = next(k for k in range(int(np.ceil(box[0] / largest)), 10**6) if smooth(k))
        h = box[0] / n
        fits = [h * next(k for k in range(max(1, round(side / h)), 10**6) if smooth(k)) for side in box]
        raise CaseError(
            [
                f"{case.file}: fluid.thickness: found {thickness:g}, for which no grid within 20 % has smooth numbers "
                f"of cells on all axes of box = {list(box)}; allowed: for example box = {[round(x, 10) for x in fits]}"
            ]
        )
    return cells


def spacing(case: Case) -> float:
    """The grid's h. Raises CaseError where ``thickness`` has none."""
    assert case.fluid.box is not None
    return case.fluid.box[0] / (case.fluid.cells or cells_of_thickness(case))[0]


def twist_radius(case: Case) -> float:
    """The largest radius that a rod on the case's grid has when it spins: the kernel's, less by the slip."""
    return kernel(case).twist_radius * spacing(case) / float(np.sqrt(1.0 + case.fluid.slip))


def couples_torque(case: Case) -> bool:
    """Whether twist torques go onto the grid."""
    twisting = any(f.twisting is not None for f in case.filaments.values())
    return case.fluid.model != "rft" and case.fluid.rotation == "grid" and twisting


def parts(case: Case) -> int:
    """How many numbers of a node go through the grid (immersed_boundary.Coupling): 3, or 4 with its twist torque."""
    return 4 if couples_torque(case) else 3


def coupling(case: Case, stacked: Stacked) -> Coupling:
    """What of a node goes through the grid."""
    if not couples_torque(case):
        from .mobility import TRANSLATION

        return TRANSLATION
    from .torque_coupling import TorqueCoupling, spin_mobility

    n, volume = len(stacked.s), stacked.mechanics.mesh.volume
    widest = twist_radius(case)
    radius, twists = np.full(n, widest), np.zeros(n)
    for filament, where in zip(stacked.filaments, stacked.nodes, strict=True):
        twists[where] = filament.twisting is not None
        if filament.radius is not None:
            radius[where] = alone(filament.radius, stacked.s[where])
    spin = spin_mobility(radius, widest, case.fluid.slip, case.fluid.viscosity, volume)
    # Where a filament does not twist its turn is held; any positive number will do for the row.
    return TorqueCoupling(np.where(twists > 0, spin, 1.0), twists)


def own_mobility(case: Case, stacked: Stacked, grid: Grid) -> np.ndarray:
    """What each node moves by its own force or torque beyond the grid's answer, (n, c): slip, and spin below h."""
    from . import immersed_boundary

    volume = stacked.mechanics.mesh.volume
    slip = immersed_boundary.slip_mobility(case.fluid.slip, kernel(case), grid, case.fluid.viscosity, volume)
    return coupling(case, stacked).own(slip)
