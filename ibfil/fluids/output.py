"""The outputs of a fluid besides the motion of nodes: the heat it makes, and fields where it has a grid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from ..rods.geometry import Configuration
from .coupling import Nodes
from .fields import GridFields
from .immersed_boundary import Immersed
from .resistive_force import ResistiveForce


class FluidOutput(Protocol):
    """The outputs of a fluid when nodes of a configuration move with ``velocity`` and push with ``force`` (n, m)."""

    def dissipation(
        self, configuration: Configuration, velocity: np.ndarray, force: np.ndarray, time: float
    ) -> dict[str, float | np.ndarray]:
        """The power that it turns into heat, and what else is known of power, by name."""

    def evaluate(
        self, configuration: Configuration, force: np.ndarray, time: float, names: Sequence[str]
    ) -> dict[str, np.ndarray] | None:
        """The fields in ``names`` on the grid, each (nx, ny, nz[, 3]); None where there is no grid."""


class DragOutput:
    """Of resistive-force theory: the heat of drag."""

    def __init__(self, fluid: ResistiveForce) -> None:
        self._fluid = fluid

    def dissipation(
        self, configuration: Configuration, velocity: np.ndarray, force: np.ndarray, time: float
    ) -> dict[str, float | np.ndarray]:
        """F.(u - u0): what the rods do, less what they only hand on from the background flow."""
        carried = self._fluid.advected(configuration.r, configuration.e3, time)
        handed_on = 0.0 if carried is None else float(np.sum(force * carried))
        return {"dissipation": float(np.sum(velocity * force)) - handed_on}

    def evaluate(
        self, configuration: Configuration, force: np.ndarray, time: float, names: Sequence[str]
    ) -> dict[str, np.ndarray] | None:
        """None: there is no flow between nodes."""
        return None


class GridOutput:
    """Of a fluid on a grid: eta int |grad u|^2, the nodes' side of it, and fields. Each costs an evaluation."""

    def __init__(self, immersed: Immersed, fields: GridFields) -> None:
        self._immersed, self._fields = immersed, fields

    def _pushes(self, configuration: Configuration, force: np.ndarray) -> tuple[Nodes, np.ndarray]:
        """The nodes, and the vectors that they put onto the grid."""
        nodes = self._immersed.nodes(configuration.r, configuration.e3)
        return nodes, self._immersed.coupling.to_grid(nodes.axes, force)

    def dissipation(
        self, configuration: Configuration, velocity: np.ndarray, force: np.ndarray, time: float
    ) -> dict[str, float | np.ndarray]:
        """The fluid's heat, the power of the nodes upon the grid, and what slip takes between the two."""
        nodes, vectors = self._pushes(configuration, force)
        heat, power = self._fields.dissipation(*nodes.stencil, vectors)
        own = self._immersed.own
        return {
            "dissipation": heat,
            "grid_power": power,
            "slip_power": float(np.sum(own * force[:, : own.shape[1]] ** 2)),
        }

    def evaluate(
        self, configuration: Configuration, force: np.ndarray, time: float, names: Sequence[str]
    ) -> dict[str, np.ndarray] | None:
        """Fields on the grid: one evaluation of the fluid."""
        nodes, vectors = self._pushes(configuration, force)
        return self._fields.evaluate(*nodes.stencil, vectors, time, names)
