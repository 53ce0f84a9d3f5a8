"""How fast disturbances grow in a scene at present (timestepping/growth.py), and how long a step may be for that.

It is looked at at the start, after jumps of what drives, when the rods are under more tension or compression than they
were, and every so many steps; only where something may make rods unstable: loads, a flow, held ends, twist.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..timestepping.base import FAILURES, State
from ..timestepping.growth import Mode, growing
from ..timestepping.semi_implicit import SemiImplicit
from . import timescales

if TYPE_CHECKING:
    from ..rods.geometry import Configuration
    from .model import Model

EVERY = 20  # steps between two looks
MORE = 1.3  # times the tension of the last look
SPREAD = (1.0, 1e-2, 1e-4)  # of the slowest bending time: where growth is looked for at first
SETTLED = 10.0  # of the time in which tension spreads along a rod


def may_grow(model: Model) -> bool:
    """Whether anything in the scene may make its rods unstable; with noise or mass it is not looked for."""
    if model.noise is not None or model.mass is not None:
        return False
    filaments, loads = model.rods.filaments, model.rods.system.loads
    held = any(end.held for f in filaments for end in (f.start, f.finish))
    return bool(loads) or held or model.fluid_model.flow is not None or any(f.twisting is not None for f in filaments)


class GrowthWatch:
    """Looks for growth. ``rate`` is that of the leading mode, in radians a time: its growth and frequency together."""

    def __init__(self, model: Model) -> None:
        self._model, self._system = model, model.rods.system
        self._fluid = model.fluid_model.local_fluid(model.rods)
        filaments = model.rods.different
        self._slowest = timescales.slowest_bending(model)
        across = {id(f): model.fluid_model.drag(f) for f in filaments}
        stiffness = {id(f): float(np.min(f.stretching.bind("s")(np.linspace(0, f.length, 11)))) for f in filaments}
        self._tension_time = max(across[id(f)] * f.length**2 / stiffness[id(f)] for f in filaments)
        self._least = min(timescales.softest(f) / f.length**2 for f in filaments)
        self.mode: Mode | None = None
        self.rate = 0.0
        self._looked, self._tension = -1, 0.0

    @property
    def at_start(self) -> bool:
        """Whether it has looked at the start alone."""
        return self._looked <= 0

    def look(self, state: State, steps: int, dt: float) -> None:
        """Looks where it is due: ``steps`` were taken, and the next is to be some ``dt`` long."""
        tension = self._tension_of(state.configuration)
        fresh = state.dt_old == 0.0
        if steps == self._looked or not (fresh or steps - self._looked >= EVERY or tension > MORE * self._tension):
            return
        configuration = self._settled(state, dt) if fresh else state.configuration
        self._looked, self._tension = steps, max(tension, self._tension_of(configuration), self._least)
        self.mode = self._leading(
            configuration, state.time, [part * self._slowest for part in SPREAD] if fresh else [4 * dt]
        )
        self.rate = 0.0 if self.mode is None else abs(self.mode.eigenvalue)

    def _tension_of(self, configuration: Configuration) -> float:
        """The largest force along the rods, in size."""
        mesh = self._system.mesh
        strain = np.where(mesh.joined, configuration.length / mesh.ds - 1.0, 0.0)
        return float(np.max(np.abs(self._system.stretching * strain)))

    def _settled(self, state: State, dt: float) -> Configuration:
        """The configuration once tension has spread along the rods, which a start shape has none of."""
        try:
            return (
                SemiImplicit()
                .step(self._system, self._fluid, state, min(SETTLED * self._tension_time, dt))
                .state.configuration
            )
        except FAILURES:
            return state.configuration

    def _leading(self, configuration: Configuration, time: float, taus: list[float]) -> Mode | None:
        """The mode that grows fastest."""
        force, inner = self._system.forces(configuration, time)
        matrix = self._system.stiffness(configuration, configuration, inner, time)
        held = self._system.ends.index
        begin = np.random.default_rng(0).standard_normal(force.shape)
        begin.ravel()[held] = 0.0
        found = []
        for tau in taus:
            try:
                step = self._fluid.linear_step(configuration.e3, matrix, held, tau)
            except np.linalg.LinAlgError:
                continue
            found.append(growing(step, begin, tau))
        return max((mode for mode in found if mode is not None), key=lambda mode: mode.eigenvalue.real, default=None)

    def state(self) -> dict[str, float]:
        """The state of the watch, by name: part of a run's state."""
        return {"rate": self.rate, "looked": float(self._looked), "tension": self._tension}

    def restore(self, state: dict[str, float]) -> None:
        """Takes up what ``state`` gave."""
        self.rate, self._looked, self._tension = state["rate"], int(state["looked"]), state["tension"]
