"""The budget of a run: bytes of memory and disk, and the share of each modelled term in a step. Counted, not measured.

Only what a case names is counted, because only that is built. Shares of time are of one step, outputs spread over the
steps between them; that of the rods and of the fluid are those by which the method is chosen (assembly/costs.py), the
rest was measured against them: twisting 0.7 of what bending and stretching take, contact 1.5, noise 0.1, the couple
across the thickness 0.5, mass 0.3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..assembly import costs
from ..assembly.fluids.base import Term
from ..assembly.fluids.immersed import BAND
from ..simulation.schedule import due_times

if TYPE_CHECKING:
    from ..simulation.simulation import Simulation

_TWISTING = 0.7  # of the step of bending and stretching
_CONTACT, _NOISE, _COUPLE, _MASS = 1.5, 0.1, 0.5, 0.3  # the same of an implicit one
OWN = "forces by velocity"
_BODY = 5.0  # a body with a motor or without: the same, of an implicit step


def terms(simulation: Simulation, memory: dict[str, float]) -> list[Term]:
    """Return every term that the case names; ``memory`` are bytes of large arrays by what they are for."""
    case, n = simulation.case, simulation.rods.count
    unknowns, band = simulation.system.unknowns, memory[BAND]
    rods, implicit = costs.of_rods(case, n), costs.of_rods(case, n, "implicit")
    out = [Term("bending and stretching", rods, band * 9 / unknowns**2)]
    if unknowns == 4:
        out.append(Term("twisting", _TWISTING * rods, band * 7 / 16))
    elements = sum(len(link.elements.nodes) for link in simulation.rods.links)
    if elements:
        out.append(Term("links", costs.of_links(case, elements), elements * 16 * 8.0 * unknowns**2))
    if case.contact is not None:
        out.append(Term("contact", _CONTACT * implicit, 8.0 * 30 * n))
    if case.thermal is not None:
        out.append(Term("thermal noise", _NOISE * implicit, 8.0 * unknowns * n))
    if simulation.model.thickness is not None:
        out.append(Term("couple across the thickness", _COUPLE * implicit, memory[OWN]))
    if simulation.model.mass is not None:
        out.append(Term("mass", _MASS * implicit, 0.0 if simulation.model.thickness is not None else memory[OWN]))
    if case.bodies:
        count = len(simulation.rods.bodies) + len(simulation.rods.motors) / 6
        out.append(Term("bodies and motors", _BODY * count * implicit, 8.0 * 6 * count * 3 * unknowns * n))
    rest = {name: size for name, size in memory.items() if name != OWN}
    return out + simulation.model.fluid_model.terms(simulation.rods, rest, simulation.step_length)


def shares(found: list[Term]) -> list[tuple[str, float, float]]:
    """Return (name, share of time, share of memory) of each term."""
    time, size = sum(term.seconds for term in found), sum(term.bytes for term in found)
    return [(term.name, term.seconds / time, term.bytes / size) for term in found]


def memory(simulation: Simulation) -> dict[str, float]:
    """Bytes of the large arrays, by what they are for."""
    n, m = simulation.rods.count, simulation.system.unknowns
    band = 8.0 * n * m * m * (2 * simulation.system.profile.width + 1)
    own = {} if simulation.model.fluid is simulation.model.inner else {OWN: 2 * band}
    return {BAND: band, **simulation.model.fluid_model.memory(simulation.rods), **own}


def disk(simulation: Simulation) -> float:
    """Bytes of the run file, at most: fields are compressed."""
    case, rods = simulation.case, simulation.rods
    n = sum(rods.nodes[k].stop - rods.nodes[k].start for k in rods.written(case.output.copies_every))
    dues = due_times(case, simulation.grid is not None)
    size = sum(due.output for due in dues) * n * 8.0 * (20 if simulation.system.unknowns == 3 else 26)
    if simulation.grid is not None and case.output.grid_every is not None:
        points = float(np.prod(np.ceil(simulation.grid.cells / case.output.grid_stride)))
        size += sum(due.fields for due in dues) * points * 12.0 * len(case.output.fields)
    return size
