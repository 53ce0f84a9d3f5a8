"""ibfil: elastic filaments in viscous fluids.

From Python, ``ibfil.run("case.toml")`` does what ``ibfil run case.toml`` does and ``ibfil.open("case.h5")`` reads what
it wrote. The names below are looked up
when they are first used, so that ``import ibfil`` and the command line's help cost nothing.
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
