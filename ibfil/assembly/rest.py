"""A start shape without moment, made one without forces: the nodes of a curve are not at rest where the curve is.

A relaxed shape has the preferred strains everywhere, but its stencils do not quite measure them: strains are off by the
error of the stencils, and EA times that is a force. The nodes that are at rest are found by backward Euler steps
longer than any relaxation, Newton on Eq. 44 from the nodes of the curve.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..fluids.resistive_force import Drag, ResistiveForce
from ..rods.mesh import Segmented, stack
from ..timestepping.base import FAILURES, State
from ..timestepping.implicit import Implicit
from . import laws
from .ends import prescribed_ends
from .kinds import rod_system
from .profiles import along, half

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..rods.boundary_conditions import PrescribedEnds
    from ..rods.system import RodSystem

LONG = 1.0  # of zeta L^4/A, some 500 times the slowest bending time: longer, rounding turns the rod
STEPS = 4  # each leaves a five-hundredth of what was out of rest
CLOSE = 1e-11  # of the length: the last correction
NEAR = 0.05  # of the length: nodes that would have to move further do not resolve the curve


class _Still:
    """The held unknowns of ends that do not move."""

    def __init__(self, ends: PrescribedEnds) -> None:
        self.index = ends.index

    def motion(self, before: float, after: float) -> np.ndarray:
        """None."""
        return np.zeros(self.index.size)


def settled(filament: Filament, segmented: Segmented, r: np.ndarray, e1: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes r and directors e1 (N, 3) at rest, from those of a curve that has the preferred strains at t = 0.

    Nodes that do not resolve the curve stay as they are (`ibfil check` warns of them).
    """
    system, fluid = _alone(filament, segmented)
    softest = along([filament], [slice(0, len(r))], segmented.s, lambda f: f.bending[0])
    start, dt = system.start(r, e1), LONG * filament.length**4 / float(np.min(softest))
    there, zero = start, np.zeros((len(r), system.unknowns))
    try:
        for _ in range(STEPS):
            there = Implicit(1, CLOSE).step(system, fluid, State(-dt, there, zero, 0.0), dt).state.configuration
    except FAILURES:
        return r, e1
    moved = float(np.max(np.linalg.norm(there.r - start.r, axis=1)))
    return (there.r.copy(), there.e1.copy()) if moved < NEAR * filament.length else (r, e1)


def _alone(filament: Filament, segmented: Segmented) -> tuple[RodSystem, ResistiveForce]:
    """The filament as a system of its own, its ends still and nothing on it, and drag of size one to go to rest in."""
    filaments, s = [filament], segmented.s
    nodes, unknowns = [slice(0, len(s))], 3 if filament.twisting is None else 4
    mesh = stack([segmented])
    ends, free = prescribed_ends(filaments, nodes, nodes, unknowns, bodies_still=True)
    stretching = half(along(filaments, nodes, s, lambda f: f.stretching))
    law = laws.linear(filaments, nodes, s)
    system = rod_system(filament)(mesh, law, stretching, free, _Still(ends), [], unknowns, filament.length)
    drag = Drag(mesh.volume, mesh.volume, 1e-3 * filament.length**2 * mesh.volume)
    fluid = ResistiveForce(drag, system.profile)
    fluid.compiled = False
    return system, fluid
