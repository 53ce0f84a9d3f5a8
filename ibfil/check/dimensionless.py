"""The dimensionless groups of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..case.spacing import node_arclength
from ..case.table import expressions
from ..simulation import timescales

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..simulation.simulation import Simulation


_BENDS = ("curvature.", "twist_rate", "loads.", "shape.")  # keys of what varies along a rod and moves or bends it


def of_filament(simulation: Simulation, filament: Filament) -> dict[str, float]:
    """The groups of one filament."""
    case = simulation.case
    bending, length = timescales.softest(filament), filament.length
    out: dict[str, float] = {}
    rate = simulation.drivers.beat or max(simulation.drivers.fastest, simulation.load_rate)
    if rate:
        out["sperm number"] = length * (simulation.drag(filament) * rate / bending) ** 0.25
    if simulation.drivers.fastest and case.time.tolerance is None:  # with one, steps are not known beforehand
        fastest = simulation.drivers.repeating if case.time.automatic else simulation.drivers.fastest
        out["omega dt"] = fastest * simulation.step_length
    stretching = float(np.min(filament.stretching.bind("s", "t")(np.linspace(0, length, 11), 0.0)))
    out["EA L^2/A"] = stretching * length**2 / bending
    if case.thermal is not None and case.thermal.energy > 0:
        out["A/(kT L)"] = bending / (case.thermal.energy * length)
    wave, ds = shortest_wave(filament, case.time.end), np.max(np.diff(node_arclength(filament)))
    if wave < np.inf:
        out["wavelength/ds"] = float(wave / ds)
    if filament.mass is not None:
        drag = simulation.drag(filament)
        time = 1 / rate if rate else timescales.slowest_bending(simulation.model)
        out["m/(zeta T), inertia of the rod"] = timescales.mean_mass(filament) / (drag * time)
    return out | simulation.model.fluid_model.groups(filament, rate)


def shortest_wave(filament: Filament, end: float) -> float:
    """The shortest wave along the rod of what bends, twists, loads or shapes it; infinite where nothing does in s.

    The least distance between places where a formula passes its mean the same way, at the start, the middle and the
    end of the run: that of a sinusoid exactly; of a load on a part of the rod twice its width.
    """
    s, found = np.linspace(0.0, filament.length, 2001), np.inf
    for path, expression in expressions(filament):
        if "s" not in expression.variables or expression.variables - {"s", "t"} or not path.startswith(_BENDS):
            continue
        for time in (0.0, 0.5 * end, end):
            values = np.broadcast_to(expression.bind("s", "t")(s, time), s.shape)
            if not np.isfinite(values).all():
                continue  # told where a run meets it
            above = values - np.mean(values)
            above = np.sign(np.where(np.abs(above) > 1e-9 * np.max(np.abs(values)), above, 0.0))
            seen = np.flatnonzero(above)
            crossings = s[seen[1:]][np.diff(above[seen]) != 0]
            if len(crossings) > 1:
                waves = crossings[2:] - crossings[:-2] if len(crossings) > 2 else 2 * np.diff(crossings)
                found = min(found, float(np.min(waves)))
    return found


class Oscillation(NamedTuple):
    """The slowest bending of a rod with mass, where it oscillates: omega and decay, and what the step makes of them."""

    omega: float
    decay: float
    seen_omega: float
    seen_decay: float


def oscillations(simulation: Simulation) -> dict[str, Oscillation]:
    """Those of the scene by filament; in a fluid with inertia, or of several rods, only about those of each alone."""
    out = {}
    for name in simulation.case.filaments:
        filament = simulation.rods.own(name)
        if filament.mass is None:
            continue
        root = timescales.bending_roots(filament, simulation.drag(filament))[0]
        if root.imag:
            root = complex(root.real, abs(root.imag))
            seen = timescales.seen(root, simulation.step_length, simulation.case.time.order)
            out[name] = Oscillation(root.imag, -root.real, seen.imag, -seen.real)
    return out


def _in_shear(simulation: Simulation, name: str) -> dict[str, float]:
    """The effective aspect ratio of a straight filament that is thick, and its period in a shear."""
    ratio = simulation.model.aspect_ratios.get(name)
    if ratio is None:
        return {}
    return {"r_e, effective aspect ratio": ratio, "shear x period of a turn": 2 * np.pi * (ratio + 1 / ratio)}


def groups(simulation: Simulation) -> dict[str, float]:
    """The dimensionless groups of the scene; with several filaments each name begins with the filament's."""
    filaments = simulation.case.filaments
    out: dict[str, float] = {}
    for name in filaments:
        filament = simulation.rods.own(name)
        prefix = "" if len(filaments) == 1 else f"{name}: "
        found = of_filament(simulation, filament) | _in_shear(simulation, name)
        out.update({prefix + key: value for key, value in found.items()})
    return out
