"""ibfil: elastic filaments in viscous fluids.

From Python, ``ibfil.run("case.toml")`` does what ``ibfil run case.toml`` does and ``ibfil.open("case.h5")`` reads what
it wrote. The names below are looked up when they are first used, so that ``import ibfil`` and the command line's help
cost nothing.

Where to read. A run in the order of its files, each handing what it makes to the next; the step is the indented part:

    case          a TOML file -> a checked description of the scene; nothing is made yet
    assemble      -> the rods stacked, their law, ends and loads; assemble_fluid: the fluid
    simulation    the present state, and how it goes on; marching: how long the steps are
        stepping      y = target + tau (u0 + M (f(y) + R)), explicit, semi-implicit or by Newton's iteration
        mechanics     what the rods answer: the force f of a configuration, and its stiffness K
        geometry      positions, e1 -> r', r'', frame, strains, spacing
        laws          strains -> moments (Eq. 9)
        elasticity    moments -> nodal forces (Eq. 44), and their exact Jacobian
        fluid         what the fluid answers: u = u0 + M F, in rft, stokes or navier_stokes
    diagnostics   the state -> a frame (frames): what one output holds
    loop          frames -> recorder (the run file), observe (its numbers), stops

Modules by what they are about; a common first word means one subject:

    rods          mesh geometry directors laws elasticity torque_free variation ends loads contact contact_search
                  thermal mechanics
    fluids        fluid rft matched_drag immersed_boundary condensation stokes krylov pruned mobility
                  mobility_averaged torque_coupling navier_stokes past advection slab grid kernels transforms fields
                  fields_inertia
    time          stepping marching timescales
    algebra       vectors blocks banded
    scene         case case_schema case_filament case_values case_checks case_checks_filament case_checks_planar
                  case_checks_size case_faults case_listing case_overrides expressions separation shapes
                  shape_curves shape_points shape_from_run shape_placing shape_copies assemble assemble_laws
                  assemble_loads assemble_contact assemble_profiles assemble_fluid assemble_grid assemble_inertia
                  costs
    running       simulation running loop schedule progress failures errors threads
    results       frames diagnostics record recorder provenance journal checkpoint examine units observe observables
                  observables_fitted observables_place time_series stops expectations energy recorded_flow analysis
    commands      cli cli_studies check dimensionless scene_warnings budget show show_figure vtk vtk_data vtk_scene
                  render render_stage render_streamlines render_lettering render_viewpoint wrapping figure_style
                  verify shipped
    studies       study study_members study_workers study_distance sweep compare compare_quantities compare_figure
                  trade trade_reference trade_figure stability stability_figure
    speed         bench bench_many bench_threads

Equations are numbered as in Ryan & Wolgemuth, J. Comput. Phys. 466, 111375 (2022): Eq. 9 is in laws, 15 and 39 in
geometry, 16, 17 and 48 in rft, 36 and 44 in elasticity, 41 in directors, 45 in immersed_boundary, 53 in thermal; what
is misprinted stands corrected in elasticity, loads and thermal, which say so. Symbols are the paper's: r position, e1,
e2, e3 frame (e3 the tangent), O1, O2, O3 strains (its Omega), k1, k2, tau0 the preferred ones, A1, A2, C, EA moduli, M
moment, F force through a segment, f force on a node, s arclength, ds spacing, zeta drag per length, eta viscosity, rho
density, h spacing of the grid, dt step. tau is the effective length of a step, w = dt/dt_old.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .analysis import Run
    from .analysis import open_run as open
    from .case import Case, parse_case, read_case
    from .errors import CaseError, Interrupted, RunFailed
    from .running import run
    from .simulation import Simulation
    from .study_members import Member, Outcome, run_members
    from .vtk import write_vtk

__version__ = "0.1.0"

_HOME = {
    "Case": "case",
    "parse_case": "case",
    "read_case": "case",
    "CaseError": "errors",
    "Interrupted": "errors",
    "RunFailed": "errors",
    "Member": "study_members",
    "Outcome": "study_members",
    "run_members": "study_members",
    "Run": "analysis",
    "open": "analysis:open_run",
    "run": "running",
    "Simulation": "simulation",
    "write_vtk": "vtk",
}

__all__ = [
    "Case",
    "CaseError",
    "Interrupted",
    "Member",
    "Outcome",
    "Run",
    "RunFailed",
    "Simulation",
    "__version__",
    "open",
    "parse_case",
    "read_case",
    "run",
    "run_members",
    "write_vtk",
]


def __getattr__(name: str) -> Any:
    """Import the module of a public name when the name is first used."""
    if name not in _HOME:
        raise AttributeError(f"module 'ibfil' has no attribute '{name}'")
    module, _, attribute = _HOME[name].partition(":")
    value = getattr(importlib.import_module(f"ibfil.{module}"), attribute or name)
    globals()[name] = value
    return value
