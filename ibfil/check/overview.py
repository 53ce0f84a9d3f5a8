"""The overview of a scene before it runs: its dimensionless groups, and warnings."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ..simulation.simulation import Simulation


class Overview(NamedTuple):
    """Dimensionless groups by name, and warnings, one sentence each."""

    groups: dict[str, float]
    warnings: list[str]


def overview_of(simulation: Simulation) -> Overview:
    """The overview of a scene that is assembled."""
    from .dimensionless import groups
    from .warnings import warnings

    return Overview(groups(simulation), warnings(simulation))
