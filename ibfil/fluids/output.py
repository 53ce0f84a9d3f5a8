"""The outputs of a fluid besides the motion of nodes: the heat it makes, and fields where it has a grid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol, cast

import numpy as np

from ..rods.geometry import Configuration
from .base import Fluid
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


class Applies(Protocol):
    """A response that tells what forces alone do."""

    def apply(self, force: np.ndarray) -> np.ndarray:
        """Velocities of forces on all nodes that push (flat), without the background flow."""


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


class FieldSource(Protocol):
    """A source of fields at the points where they are written."""

    def evaluate(
        self, base: np.ndarray, weights: np.ndarray, force: np.ndarray, time: float, names: Sequence[str]
    ) -> dict[str, np.ndarray]:
        """The fields in ``names`` that forces (n, 3), or forces and torques (n, 6), drive; of nodes with stencils."""


class Pushing(NamedTuple):
    """The nodes that push, those of bodies among them, the force of each (n, m), and the vectors put onto the grid."""

    nodes: Nodes
    force: np.ndarray
    vectors: np.ndarray


def _pushing(immersed: Immersed, configuration: Configuration, force: np.ndarray, time: float) -> Pushing:
    nodes, pushed = immersed.pushed(configuration.r, configuration.e3, force, time)
    return Pushing(nodes, pushed, immersed.coupling.to_grid(nodes.axes, pushed))


class GridOutput:
    """Of a fluid on a grid: eta int |grad u|^2, the nodes' side of it, and fields. Each costs an evaluation."""

    def __init__(self, immersed: Immersed, fields: GridFields) -> None:
        self._immersed, self._fields = immersed, fields

    def dissipation(
        self, configuration: Configuration, velocity: np.ndarray, force: np.ndarray, time: float
    ) -> dict[str, float | np.ndarray]:
        """The fluid's heat, the power of the nodes upon the grid, and what slip takes between the two."""
        nodes, force, vectors = _pushing(self._immersed, configuration, force, time)
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
        nodes, _, vectors = _pushing(self._immersed, configuration, force, time)
        return self._fields.evaluate(*nodes.stencil, vectors, time, names)


class SpaceOutput:
    """Of Stokes flow in a space without end: all that nodes do is heat; fields in a window, where there is one."""

    def __init__(self, immersed: Immersed, fluid: Fluid, fields: FieldSource | None) -> None:
        self._immersed, self._fluid, self._fields = immersed, fluid, fields

    def dissipation(
        self, configuration: Configuration, velocity: np.ndarray, force: np.ndarray, time: float
    ) -> dict[str, float | np.ndarray]:
        """F.M F, the fluid's heat and the power of the nodes upon it in one, and what slip takes besides."""
        own, c = self._immersed.own, self._immersed.coupling.components
        response = self._fluid.response(configuration.r, configuration.e3, time, 1.0)
        force = self._immersed.pushed(configuration.r, configuration.e3, force, time)[1]
        pushed = np.ascontiguousarray(force[:, :c])
        slip = float(np.sum(own * pushed**2))
        power = float(pushed.ravel() @ cast("Applies", response).apply(pushed.ravel())) - slip
        return {"dissipation": power, "grid_power": power, "slip_power": slip}

    def evaluate(
        self, configuration: Configuration, force: np.ndarray, time: float, names: Sequence[str]
    ) -> dict[str, np.ndarray] | None:
        """Fields in the window."""
        if self._fields is None:
            return None
        nodes, _, vectors = _pushing(self._immersed, configuration, force, time)
        return self._fields.evaluate(*nodes.stencil, vectors, time, names)
