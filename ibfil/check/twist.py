"""Warnings about twist that turns e1 far from node to node: its moment is C sin(angle)/ds, not C angle/ds (Eq. 39)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..simulation.failures import LARGEST_TWIST

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..simulation.simulation import Simulation

LARGE = 0.25  # radians from node to node, where the moment is 1 % below C angle/ds
SPREADS = 6.0  # thermal standard deviations within which a quarter turn is soon met


def of_twist(simulation: Simulation, name: str, filament: Filament) -> list[str]:
    """The angle between nodes where it is large: of the start, of the preferred twist, or of ends that are turned."""
    if filament.twisting is None:
        return []
    angle = largest_angle(simulation, name, filament)
    if angle <= LARGE:
        return []
    low = 100 * (1 - np.sin(min(angle, np.pi / 2)) / min(angle, np.pi / 2))
    enough = 1 + int(np.ceil((filament.nodes - 1) * angle / LARGE))
    return [
        f"filament.{name}.nodes: twist turns e1 by {angle:.2g} rad from node to node; its moment there is C "
        f"sin(angle)/ds, {low:.2g} % below C angle/ds; take {enough} nodes{_soon(simulation, filament, angle)}"
    ]


def largest_angle(simulation: Simulation, name: str, filament: Filament) -> float:
    """The largest angle (radians) by which e1 turns about the rod from one node to the next, as far as it is known."""
    case, mesh, where = simulation.case, simulation.system.mesh, simulation.nodes(name)
    joined = mesh.joined[where]
    sines = (simulation.start.twist * mesh.ds)[where][joined]
    s, ds = simulation.arclength[where], float(np.max(mesh.ds[where][joined]))
    rate, wound = filament.twist_rate.bind("s", "t"), 0.0
    times = (0.0, 0.5 * case.time.end, case.time.end)
    preferred = max(float(np.max(np.abs(rate(s, time)))) for time in times) * ds
    for end in (filament.start, filament.finish):
        if end.angle is not None:
            turn = end.angle.bind("t")
            wound += max(abs(float(turn(time) - turn(0.0))) for time in times) / (filament.nodes - 1)
    return max(float(np.arcsin(min(1.0, np.max(np.abs(sines))))), preferred, wound)


def _soon(simulation: Simulation, filament: Filament, angle: float) -> str:
    """The end of the sentence where thermal forces are soon to stop the run."""
    thermal = simulation.case.thermal
    if thermal is None or filament.twisting is None:
        return ""
    s = np.linspace(0.0, filament.length, filament.nodes)
    softest = float(np.min(filament.twisting.bind("s", "t")(s, 0.0))) * max(np.cos(angle), 1e-3)
    spread = np.sqrt(thermal.energy * filament.length / (filament.nodes - 1) / softest)
    if np.arcsin(LARGEST_TWIST) - angle > SPREADS * spread:
        return ""
    return "; with thermal forces some are soon a quarter turn apart, which stops the run"
