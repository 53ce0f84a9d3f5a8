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

Powers = dict[str, float | np.ndarray]


class FluidOutput(Protocol):
    """The outputs of a fluid when nodes of a configuration move with ``velocity`` and push with ``force`` (n, m).

    Without inertia of the fluid the nodes' power F.u + T.w is flow + slip + spin + background (names of `powers`); with
    it, power upon the grid takes the place of the flow's heat, and the rest of it sets the fluid in motion.
    """

    def dissipation(self, configuration: Configuration, velocity: np.ndarray, force: np.ndarray, time: float) -> Powers:
        """The power that it turns into heat, its parts, and what else is known of power, by name (`powers`)."""

    def evaluate(
        self, configuration: Configuration, force: np.ndarray, time: float, names: Sequence[str]
    ) -> dict[str, np.ndarray] | None:
        """The fields in ``names`` on the grid, each (nx, ny, nz[, 3]); None where there is no grid."""


class Applies(Protocol):
    """A response that tells what forces alone do."""

    def apply(self, force: np.ndarray) -> np.ndarray:
        """Velocities of forces on all nodes that push (flat), without the background flow."""


def powers(flow: float, slip: float, spin: float, background: float) -> Powers:
    """Powers by the name of their series: what is turned into heat and its parts, and F.u0 of a background flow u0.

    ``flow`` is the heat of the flow that forces drive, or of drag; ``slip`` that between nodes and grid; ``spin`` that
    of spins which the flow does not take part in.
    """
    return {
        "dissipation": flow + slip + spin,
        "flow_dissipation": flow,
        "slip_dissipation": slip,
        "spin_dissipation": spin,
        "background_power": background,
    }


def _by_background(force: np.ndarray, carried: np.ndarray | None) -> float:
    """The power of forces (n, m) upon a flow that carries nodes with (n, k), k <= m: negative where it drives them."""
    return 0.0 if carried is None else float(np.sum(force[:, : carried.shape[1]] * carried))


class DragOutput:
    """Of resistive-force theory: the heat of drag."""

    def __init__(self, fluid: ResistiveForce) -> None:
        self._fluid = fluid

    def dissipation(self, configuration: Configuration, velocity: np.ndarray, force: np.ndarray, time: float) -> Powers:
        """F.(u - u0) of forces and of torques: what the rods do, less what they hand on from the background flow."""
        carried = self._fluid.advected(configuration.r, configuration.e3, time)
        work = np.sum(force * velocity, axis=0)
        if carried is not None:
            work[: carried.shape[1]] -= np.sum(force[:, : carried.shape[1]] * carried, axis=0)
        return powers(float(work[:3].sum()), 0.0, float(work[3:].sum()), _by_background(force, carried))

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


class _ImmersedOutput:
    """The share of an immersed-boundary fluid's heat that its grid, or space, does not see."""

    def __init__(self, immersed: Immersed) -> None:
        self._immersed = immersed

    def _powers(self, configuration: Configuration, flow: float, force: np.ndarray, time: float) -> Powers:
        """With the slip s F^2 and the spins: c T^2 where torques go through the grid, T^2/Zr where they do not."""
        immersed = self._immersed
        own = immersed.own
        heat = np.sum(own * force[:, : own.shape[1]] ** 2, axis=0)
        spin = float(heat[3:].sum())
        if immersed.spin_drag is not None:
            spin += float(np.sum(force[: len(immersed.spin_drag), 3] ** 2 / immersed.spin_drag))
        carried = immersed.carried(configuration.r, configuration.e3, time)
        return powers(flow, float(heat[:3].sum()), spin, _by_background(force, carried))


class GridOutput(_ImmersedOutput):
    """Of a fluid on a grid: eta int |grad u|^2, the nodes' side of it, and fields. Each costs an evaluation."""

    def __init__(self, immersed: Immersed, fields: GridFields) -> None:
        super().__init__(immersed)
        self._fields = fields

    def dissipation(self, configuration: Configuration, velocity: np.ndarray, force: np.ndarray, time: float) -> Powers:
        """Heat with its parts, and the power of the nodes upon the grid."""
        nodes, force, vectors = _pushing(self._immersed, configuration, force, time)
        heat, power = self._fields.dissipation(*nodes.stencil, vectors)
        return {**self._powers(configuration, heat, force, time), "grid_power": power}

    def evaluate(
        self, configuration: Configuration, force: np.ndarray, time: float, names: Sequence[str]
    ) -> dict[str, np.ndarray] | None:
        """Fields on the grid: one evaluation of the fluid."""
        nodes, _, vectors = _pushing(self._immersed, configuration, force, time)
        return self._fields.evaluate(*nodes.stencil, vectors, time, names)


class SpaceOutput(_ImmersedOutput):
    """Of Stokes flow in a space without end: all that nodes do is heat; fields in a window, where there is one."""

    def __init__(self, immersed: Immersed, fluid: Fluid, fields: FieldSource | None) -> None:
        super().__init__(immersed)
        self._fluid, self._fields = fluid, fields

    def dissipation(self, configuration: Configuration, velocity: np.ndarray, force: np.ndarray, time: float) -> Powers:
        """F.M F is the flow's heat and the power of the nodes upon it in one; and what is beside it."""
        own, c = self._immersed.own, self._immersed.coupling.components
        response = self._fluid.response(configuration.r, configuration.e3, time, 1.0)
        force = self._immersed.pushed(configuration.r, configuration.e3, force, time)[1]
        pushed = np.ascontiguousarray(force[:, :c])
        power = float(pushed.ravel() @ cast("Applies", response).apply(pushed.ravel())) - float(np.sum(own * pushed**2))
        return {**self._powers(configuration, power, force, time), "grid_power": power}

    def evaluate(
        self, configuration: Configuration, force: np.ndarray, time: float, names: Sequence[str]
    ) -> dict[str, np.ndarray] | None:
        """Fields in the window."""
        if self._fields is None:
            return None
        nodes, _, vectors = _pushing(self._immersed, configuration, force, time)
        return self._fields.evaluate(*nodes.stencil, vectors, time, names)
