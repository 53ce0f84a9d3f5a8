"""The dimensionless groups of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import assemble_fluid, assemble_grid, timescales

if TYPE_CHECKING:
    from .case_filament import Filament
    from .simulation import Simulation


def of_filament(simulation: Simulation, filament: Filament) -> dict[str, float]:
    """The groups of one filament."""
    case, grid = simulation.case, simulation.grid
    bending, length = timescales.softest(filament), filament.length
    out: dict[str, float] = {}
    rate = max(simulation.driving_rates(), default=0.0)
    if rate:
        out["sperm number"] = length * (simulation.drag(filament) * rate / bending) ** 0.25
        if case.fluid.model == "navier-stokes":
            assert case.fluid.density is not None
            out["Re = rho omega L^2/eta"] = case.fluid.density * rate * length**2 / case.fluid.viscosity
    if simulation.cycles and case.time.tolerance is None:  # with one, steps are not known beforehand
        out["omega dt"] = max(simulation.cycles) * simulation.step_length
    stretching = float(np.min(filament.stretching.bind("s", "t")(np.linspace(0, length, 11), 0.0)))
    out["EA L^2/A"] = stretching * length**2 / bending
    if case.thermal is not None and case.thermal.energy > 0:
        out["A/(kT L)"] = bending / (case.thermal.energy * length)
    if grid is not None:
        from .kernels import KERNELS

        out["ds/h"] = length / (filament.nodes - 1) / grid.spacing
        out["a/L"] = KERNELS[case.fluid.kernel].line_radius * grid.spacing / length
        if filament.twisting is not None and case.fluid.rotation == "grid":
            out["a/L when spun"] = _spun(filament, assemble_grid.twist_radius(case)) / length
        wave = _wave(filament)
        if wave:
            out["wavelength/h"] = 2 * np.pi / wave / grid.spacing
    elif filament.radius is not None:
        out["a/L"] = float(np.max(filament.radius.bind("s", "t")(0.5 * length, 0.0))) / length
    matched = assemble_fluid.matching(case, filament)
    if matched is not None:
        out["matched zeta_perp/eta"], out["matched zeta_par/eta"] = matched.perp, matched.par
        out["zeta_perp/zeta_par"], out["matched scatter"] = matched.ratio, matched.scatter
        if matched.spin:
            out["matched zeta_r/eta"] = matched.spin
    return out


def _spun(filament: Filament, widest: float) -> float:
    """The radius a filament spins as on a grid whose twist radius is ``widest``: no more than that."""
    if filament.radius is None:
        return widest
    return min(widest, float(np.max(filament.radius.bind("s", "t")(0.5 * filament.length, 0.0))))


def _wave(filament: Filament) -> float:
    """Largest wave number of the preferred curvatures at t = 0; zero where they are constant."""
    s = np.array([0.0, filament.length])
    waves = [0.0]
    for curvature in filament.curvature:
        if "s" in curvature.variables:
            value = curvature.bind("s", "t")
            waves.append(timescales.wave_number(lambda x, v=value: v(x, 0.0), s))  # type: ignore[misc]
    return max(waves)


def groups(simulation: Simulation) -> dict[str, float]:
    """The dimensionless groups of the scene; with several filaments each name begins with the filament's."""
    filaments = simulation.case.filaments
    out: dict[str, float] = {}
    for name, filament in filaments.items():
        prefix = "" if len(filaments) == 1 else f"{name}: "
        out.update({prefix + key: value for key, value in of_filament(simulation, filament).items()})
    return out
