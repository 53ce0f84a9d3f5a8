"""ibfil: elastic filaments in viscous fluids.

From Python, ``ibfil.run("case.toml")`` does what ``ibfil run case.toml`` does and ``ibfil.open("case.h5")`` reads what
it wrote. The names below are looked up when they are first used, so that ``import ibfil`` and the command line's help
cost nothing.

Where to read. The packages stand in this order from the ground up; each imports only what stands before it, and each
has a README.md with its equations, its files in reading order, and how to add another of its kind:

    linalg         band matrices by node, small blocks, GMRES
    grid           the periodic grid: kernels, spreading, transforms, the solve mode by mode
    rods           strains, laws, the force of Eq. 44 and its Jacobian, loads, contact: `system` is the whole
    bodies         rigid bodies that ends of rods are in, motors: levers, balances, rows beside the nodes
    fluids         u = u0 + M F over a step: resistive-force theory, Stokes and Navier-Stokes on the grid
    parallel       the grid of one run shared by the processes of mpiexec
    timestepping   y = target + tau (u0 + M (f(y) + R)): explicit, semi-implicit, implicit, thermal; step control

    case           what a scene may say: the TOML file, checked
    io             the run file, its checkpoint and journal
    observables    the numbers of a run
    shapes         how filaments begin
    assembly       a case -> rods, loads, laws, and its fluid (one class a model)
    simulation     the present state, and the one time loop
    check          what is told before a run: groups, costs, warnings
    running        a run from its start, or on from a checkpoint
    analysis, visualization, bench, studies, commands      what is made of runs

A step reads downwards: simulation.Simulation.advance -> timestepping (a scheme) -> rods.system (force, stiffness) and
fluids (a response, its solve) -> grid, linalg.

Equations are numbered as in Ryan & Wolgemuth, J. Comput. Phys. 466, 111375 (2022): Eq. 9 is in
rods/constitutive, 15 and 39 in rods/geometry, 41 in rods/frame, 36 and 44 in rods/elastic_force, 16, 17 and 48 in
fluids/resistive_force, 45 in fluids/immersed_boundary, 53 in timestepping/brownian; what is misprinted stands corrected
there, which say so. Symbols are the paper's: r position, e1,
e2, e3 frame (e3 the tangent), O1, O2, O3 strains (its Omega), k1, k2, tau0 the preferred ones, A1, A2, C, EA moduli, M
moment, F force through a segment, f force on a node, s arclength, ds spacing, zeta drag per length, eta viscosity, rho
density, h spacing of the grid, dt step. tau is the effective length of a step, w = dt/dt_old.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from .version import __version__

if TYPE_CHECKING:
    from .analysis.run import Run
    from .case.reading import parse_case, read_case
    from .case.schema import Case
    from .errors import CaseError, Interrupted, RunFailed
    from .running.run import run
    from .simulation.simulation import Simulation
    from .studies.member import Member, Outcome
    from .studies.members import run_members
    from .visualization.pictured_run import open_run as open
    from .visualization.vtk_files import write_vtk

_HOME = {
    "Case": "case.schema",
    "parse_case": "case.reading",
    "read_case": "case.reading",
    "CaseError": "errors",
    "Interrupted": "errors",
    "RunFailed": "errors",
    "Member": "studies.member",
    "Outcome": "studies.member",
    "run_members": "studies.members",
    "Run": "analysis.run",
    "open": "visualization.pictured_run:open_run",
    "run": "running.run",
    "Simulation": "simulation.simulation",
    "write_vtk": "visualization.vtk_files",
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


def __dir__() -> list[str]:
    """The public names."""
    return __all__


def __getattr__(name: str) -> Any:
    """Import the module of a public name when the name is first used."""
    if name not in _HOME:
        raise AttributeError(f"module 'ibfil' has no attribute '{name}'")
    module, _, attribute = _HOME[name].partition(":")
    value = getattr(importlib.import_module(f"ibfil.{module}"), attribute or name)
    globals()[name] = value
    return value
