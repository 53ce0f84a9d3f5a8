"""Warnings about twist that turns e1 far from node to node: few nodes a turn, and half a turn, which ends a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..assembly.profiles import alone
from ..simulation.failures import LARGEST_TWIST

if TYPE_CHECKING:
    from ..case.bodies.end import End
    from ..case.filament import Filament
    from ..simulation.simulation import Simulation

LARGE = 2 * np.pi / 8  # radians from node to node: 8 nodes a turn, as of any wave (warnings.NODES_A_WAVE)
SPREADS = 6.0  # thermal standard deviations within which half a turn is soon met
LOOKS = 201  # times at which ends that turn are looked at


def of_twist(simulation: Simulation, name: str, filament: Filament) -> list[str]:
    """The angle between nodes where it is large: of the start, of the preferred twist, or of ends that are turned."""
    if filament.twisting is None:
        return []
    angle = largest_angle(simulation, name, filament)
    if angle <= LARGE:
        return []
    enough = 1 + int(np.ceil((filament.nodes - 1) * angle / LARGE))
    stops = f", and a run ends at {LARGEST_TWIST}" if angle > 0.5 * LARGEST_TWIST else ""
    return [
        f"filament.{name}.nodes: twist turns e1 by {angle:.2g} rad from node to node{stops}; for 8 nodes a turn take "
        f"{enough}{_soon(simulation, filament, angle)}"
    ]


def largest_angle(simulation: Simulation, name: str, filament: Filament) -> float:
    """The largest angle (radians) by which e1 turns about the rod from one node to the next, as far as it is known."""
    case, mesh, where = simulation.case, simulation.system.mesh, simulation.nodes(name)
    joined = mesh.joined[where]
    start = float(np.max(np.abs(simulation.start.twist * mesh.ds)[where][joined]))
    s, ds = simulation.arclength[where], float(np.max(mesh.ds[where][joined]))
    rate = filament.twist_rate.bind("s", "t")
    times = (0.0, 0.5 * case.time.end, case.time.end)
    preferred = max(float(np.max(np.abs(rate(s, time)))) for time in times) * ds
    return max(start, preferred, _wound(simulation, filament))


def _wound(simulation: Simulation, filament: Filament) -> float:
    """The angle that ends wind up between two nodes.

    Ends that are both held share the difference of their turns out along the rod. One that spins a rod whose other end
    may turn winds up the first segment most, by spin zeta_r L ds/C once that is steady, and by no more than it turned.
    """
    times = np.linspace(0.0, simulation.case.time.end, LOOKS)
    turns = [_turns(end, times) for end in (filament.start, filament.finish)]
    segments = filament.nodes - 1
    if turns[0] is not None and turns[1] is not None:
        return float(np.max(np.abs(turns[1] - turns[0]))) / segments
    turned = turns[0] if turns[0] is not None else turns[1]
    if turned is None or filament.radius is None or filament.twisting is None:
        return 0.0
    s = np.linspace(0.0, filament.length, filament.nodes)
    zeta = 4 * np.pi * simulation.case.fluid.viscosity * float(np.max(alone(filament.radius, s))) ** 2
    modulus = float(np.min(alone(filament.twisting, s)))
    steady = float(np.max(np.abs(np.gradient(turned, times)))) * zeta * filament.length**2 / (segments * modulus)
    return min(steady, float(np.max(np.abs(turned))))


def _turns(end: End, times: np.ndarray) -> np.ndarray | None:
    """The turn (k,) of an end that is held in its turn, since the start; None where it may turn."""
    if not end.turn_held:
        return None
    if end.angle is not None:
        angle = end.angle.bind("t")
        return np.array([float(angle(time) - angle(0.0)) for time in times])
    if end.spin is None:
        return np.zeros(len(times))
    spin = end.spin.bind("t")
    rate = np.array([float(spin(time)) for time in times])
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(times))])


def _soon(simulation: Simulation, filament: Filament, angle: float) -> str:
    """The end of the sentence where thermal forces are soon to stop the run."""
    thermal = simulation.case.thermal
    if thermal is None or filament.twisting is None:
        return ""
    s = np.linspace(0.0, filament.length, filament.nodes)
    softest = float(np.min(alone(filament.twisting, s)))
    spread = np.sqrt(thermal.energy * filament.length / (filament.nodes - 1) / softest)
    if LARGEST_TWIST - angle > SPREADS * spread:
        return ""
    return "; with thermal forces some are soon half a turn apart, which stops the run"
