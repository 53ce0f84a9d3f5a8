"""From a case to the drag of its nodes in resistive-force theory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..case.fluid import Coefficients, Matched
from ..errors import CaseError
from ..fluids import resistive_force
from . import grid
from .profiles import alone

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..case.schema import Case
    from ..fluids.calibrated_drag import Match
    from ..fluids.resistive_bodies import BodyDrag
    from .stacked import RodStack


LEAST_ASPECT = 2.0  # L/2a below which the formulas of a cylinder do not hold


def drag_coefficients(case: Case, filament: Filament, radius: np.ndarray | None) -> tuple[float, float, np.ndarray]:
    """Drag per length across and along the rod, and against spin (k,). Raises CaseError for a rod that is too thick."""
    eta, drag = case.fluid.viscosity, case.fluid.drag_of(radius)
    spin = np.zeros(1) if radius is None else 4 * np.pi * eta * radius**2
    if isinstance(drag, Coefficients):
        return drag.perp, drag.par, spin if drag.spin is None else np.full(1, drag.spin)
    found = matching(case, filament)
    if found is not None:
        if radius is not None and found.spin:
            spin = eta * found.spin * (radius / np.mean(radius)) ** 2
        return eta * found.perp, eta * found.par, spin
    perp, par = (4 * np.pi, 2 * np.pi) if drag == "paper" else _by_radius(str(drag), filament, radius)
    thin = drag != "cylinder" or radius is None or filament.length > 2 * LEAST_ASPECT * float(np.mean(radius))
    if not (thin and perp > 0):
        raise CaseError(
            [f'{case.file}: filament.radius: too thick for drag = "{drag}"; give fluid.drag = {{ perp, par }}']
        )
    return eta * perp, eta * par, spin


def _by_radius(drag: str, filament: Filament, radius: np.ndarray | None) -> tuple[float, float]:
    """Drag per length and viscosity of a straight rod, across and along, by the mean radius a; p = L/2a.

    slender: 8 pi/ln(L^2/(4 a^2 e)), half of it along (Sec. 7.5).
    cylinder: 4 pi/(ln p + 0.839 + 0.185/p + 0.233/p^2), 2 pi/(ln p - 0.207 + 0.980/p - 0.133/p^2), of a whole cylinder
    dragged across and along, ends and all (Tirado & Garcia de la Torre, J. Chem. Phys. 71 (1979) 2581).
    """
    if radius is None:
        raise ValueError(f"{drag} drag needs a radius")
    p = filament.length / (2 * float(np.mean(radius)))
    if drag == "slender":
        perp = 8 * np.pi / np.log(p**2 / np.e)
        return perp, 0.5 * perp
    across = np.log(p) + 0.839 + 0.185 / p + 0.233 / p**2
    along = np.log(p) - 0.207 + 0.980 / p - 0.133 / p**2
    return 4 * np.pi / across, 2 * np.pi / along


def matching(case: Case, filament: Filament) -> Match | None:
    """The drag of a straight rod in the case's grid; None where RFT does not take its drag from there.

    Raises CaseError where the grid cannot tell it.
    """
    drag = case.fluid.drag
    if case.fluid.model != "rft" or not isinstance(drag, Matched):
        return None
    from ..fluids import calibrated_drag

    nodes, radius = 1 + round(drag.matched * (filament.nodes - 1) / filament.length), 0.0
    if case.fluid.rotation == "grid" and filament.twisting is not None and filament.radius is not None:
        radius = float(np.mean(alone(filament.radius, np.linspace(0.0, filament.length, filament.nodes))))
    rod = calibrated_drag.Rod(drag.matched, nodes, grid.space(case), case.fluid.kernel, case.fluid.slip, radius)
    try:
        return calibrated_drag.match(rod)
    except ValueError as error:
        allowed = f"slip = 0.01, fewer nodes or {'a smaller spacing' if case.fluid.free else 'more cells'}"
        raise CaseError([f"{case.file}: fluid.drag: {error}; allowed: {allowed}"]) from None


def drag(case: Case, stacked: RodStack) -> resistive_force.Drag:
    """The drag of every node: coefficients times control volumes."""
    volume = stacked.system.volume
    out = resistive_force.Drag(*(np.zeros(len(volume)) for _ in range(3)))
    for filament, where in zip(stacked.filaments, stacked.ranges, strict=True):
        s = stacked.s[where]
        radius = None
        if filament.radius is not None:
            radius = alone(filament.radius, s)
        for field, value in zip(out, drag_coefficients(case, filament, radius), strict=True):
            field[where] = value * volume[where]
    # A filament that does not twist has its turn held; any positive drag will do for the row.
    out.spin[out.spin == 0] = 1.0
    return out


def body_drag(case: Case, stacked: RodStack) -> BodyDrag:
    """The resistances of the bodies of a case, in their axes; none of a joint."""
    from ..bodies.resistance import Resistance, ellipsoid
    from ..fluids.resistive_bodies import BodyDrag

    found = []
    for body in case.each_body.values():  # a cloud has the resistance that is given, and in flows no size
        size, given = np.array(body.shape.semi_axes), body.resistance
        if given is not None:
            found.append(Resistance(np.array(given.translation), np.array(given.rotation), size))
        elif size.any():
            found.append(ellipsoid(size, case.fluid.viscosity))
        else:
            found.append(Resistance(np.zeros(3), np.zeros(3), size))
    moved, turned, axes = (np.array(column) for column in zip(*found, strict=True))
    return BodyDrag(moved, turned, axes, stacked.system.length)
