"""The rods of a scene put together: how they move, the forces they give, and how those change.

Everything a stepper asks of the rods is here, and nothing of the fluid.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..linalg.constraints import Prescribed
from ..linalg.stiffness import Stiffness
from . import elastic_force, elastic_jacobian
from . import mesh as rods_mesh
from .base import REVERSED, Ends, Law, Load, TangentReversed
from .elastic_force import Moment
from .geometry import Configuration, measure, moved, tangents, turned
from .linearization import Linearization
from .mesh import Mesh
from .rates import Accepted, Memory, Remembering


class RodSystem:
    """n nodes with m unknowns each: 3, or 4 where a filament twists.

    ``free`` (n,) is True at ends that carry no moment; there M, and so Q, M3, P and the twist source, are zero.
    ``stretching`` (n,) is EA at half nodes, ``length`` the shortest filament's, ``law``, ``loads`` and ``ends`` the
    swappable parts.
    """

    def __init__(
        self,
        mesh: Mesh,
        law: Law,
        stretching: np.ndarray,
        free: np.ndarray,
        ends: Ends,
        loads: Sequence[Load],
        unknowns: int,
        length: float,
    ) -> None:
        self.mesh, self.law, self.stretching, self.length = mesh, law, stretching, length
        self.ends, self.loads, self.unknowns = ends, loads, unknowns
        self._free = np.nonzero(free)[0]
        self.profile = rods_mesh.profile(mesh, 1 if law.nonlocal_twist is None else 2)
        self._matrix_shape = (len(free), unknowns, (2 * self.profile.width + 1) * unknowns)
        self._stencils = elastic_jacobian.stencils(mesh)
        self._zero = np.zeros(len(free))
        self._held = np.zeros(len(free), bool)
        self._held[ends.index[ends.index % unknowns < 3] // unknowns] = True
        self.closures: tuple[tuple[int, int], ...] = ()  # the first and last node of closed rods (closed.py)
        self.copies = np.zeros(0, np.int64)  # nodes that are others again: those of closed rods
        self.remembering = tuple(part for part in (law, *loads) if isinstance(part, Remembering))

    @property
    def volume(self) -> np.ndarray:
        """The control volume (n,) of each node in the fluid."""
        return self.mesh.volume

    def complete(self, y: np.ndarray) -> np.ndarray:
        """y (n, m) with what the fluid does not know of: nothing but in closed rods."""
        return y

    def start(self, r: np.ndarray, e1: np.ndarray) -> Configuration:
        """The configuration r (n, 3) with e1 (n, 3) made normal to the stencils' tangents."""
        e3 = tangents(self.mesh, r)
        normal = e1 - np.sum(e1 * e3, axis=1)[:, None] * e3
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        return measure(self.mesh, np.ascontiguousarray(r), normal)

    def move(self, start: Configuration, y: np.ndarray) -> Configuration:
        """The configuration displaced by y (n, m) from ``start``, e1 carried along and turned."""
        configuration, least, where = moved(self.mesh, start, y)
        if not least > REVERSED:
            raise TangentReversed(where, least)
        return configuration

    def turned(self, start: Configuration, y: np.ndarray) -> np.ndarray:
        """Displacements (n, m) that turn every segment as y does and do not stretch it."""
        return turned(self.mesh, start, self._held, y)

    def moment(self, configuration: Configuration, time: float) -> Moment:
        """The law's moments, zero at free ends."""
        bend, bend_slope = self.law.bending(configuration.bend, time)
        elastic_force.release(self._free, bend, bend_slope)
        if self.unknowns == 3:
            return Moment(bend, bend_slope, self._zero, self._zero)
        return Moment(bend, bend_slope, *self.law.twisting(configuration.twist, time))

    def forces(self, configuration: Configuration, time: float) -> tuple[np.ndarray, Moment]:
        """Eq. 44 and the loads on each node, (n, m), and the moments they come from."""
        moment = self.moment(configuration, time)
        force = self.elastic(configuration, moment, self.stretching)
        for load in self.loads:
            load.add_force(configuration, time, force)
        return force, moment

    def elastic(self, configuration: Configuration, moment: Moment, stretching: np.ndarray) -> np.ndarray:
        """Eq. 44 (n, m) for given moments and axial stiffness (n,)."""
        force = np.zeros((len(configuration.table), self.unknowns))
        elastic_force.nodal_force(self.mesh, configuration, moment, stretching, force)
        return force

    def _unit_responses(self, configuration: Configuration) -> np.ndarray:
        """The forces (n, 2, m) that a unit M3 at each half node gives the nodes before and after it.

        The force is linear in M3, and each M3 acts on the two nodes beside its half node only: so a unit M3 on every
        other half node, and then on the rest, gives them all.
        """
        n = len(configuration.r)
        none = Moment(np.zeros((n, 2)), np.zeros((n, 2, 2)), np.zeros(n), np.zeros(n))
        out = np.zeros((n, 2, self.unknowns))
        for first in (0, 1):
            unit = np.where((np.arange(n) % 2 == first) & self.mesh.joined, 1.0, 0.0)
            force = self.elastic(configuration, none._replace(twist=unit), self._zero)
            half = np.nonzero(unit)[0]
            out[half] = np.stack([force[half], force[half + 1]], axis=1)
        return out

    def stiffness(self, configuration: Configuration, start: Configuration, moment: Moment, time: float) -> Stiffness:
        """The exact Jacobian of ``forces`` with respect to the displacements from ``start``."""
        return self._stiffness(configuration, start, moment, time, -np.inf)

    def definite_stiffness(
        self, configuration: Configuration, start: Configuration, moment: Moment, time: float
    ) -> Stiffness:
        """The same but for compression, which is left out of the geometric stiffness: one linear solve is robust."""
        return self._stiffness(configuration, start, moment, time, 0.0)

    def _stiffness(
        self, configuration: Configuration, start: Configuration, moment: Moment, time: float, least: float
    ) -> Stiffness:
        """The Jacobian with tensions not below ``least`` (elastic_jacobian.py)."""
        matrix = np.zeros(self._matrix_shape)
        elastic_jacobian.stiffness(
            self.mesh, self._stencils, configuration, start, moment, self.stretching, least, matrix
        )
        linearization = Linearization(self.mesh, configuration, start, matrix, least == 0.0)
        return self._loaded(linearization, time)

    def _loaded(self, linearization: Linearization, time: float) -> Stiffness:
        """The stiffness with the terms that the kernels leave out: nonlocal twist, and the loads."""
        self.add_nonlocal_twist(linearization)
        for load in self.loads:
            load.add_stiffness(time, linearization)
        return linearization.stiffness

    def add_nonlocal_twist(self, linearization: Linearization) -> None:
        """Adds the term of the law that the kernels leave out."""
        if self.law.nonlocal_twist is not None:
            linearization.nonlocal_twist(self._unit_responses(linearization.configuration), self.law.nonlocal_twist)

    def of_loads(self, loads: Sequence[Load], configuration: Configuration, time: float) -> np.ndarray:
        """The forces (n, m) of some of the loads."""
        force = np.zeros((len(configuration.table), self.unknowns))
        for load in loads:
            load.add_force(configuration, time, force)
        return force

    def stiffness_of_loads(
        self, loads: Sequence[Load], configuration: Configuration, start: Configuration, time: float
    ) -> Stiffness:
        """The Jacobian of ``of_loads``."""
        linearization = Linearization(self.mesh, configuration, start, np.zeros(self._matrix_shape))
        for load in loads:
            load.add_stiffness(time, linearization)
        return linearization.stiffness

    def begin(self, tau: float, w: float) -> None:
        """A step of effective length tau begins, w = dt/dt_old, zero where it does not look back (rates.py)."""
        for part in self.remembering:
            part.begin(tau, w)

    def advance(self, step: Accepted) -> None:
        """The step that began last is taken."""
        for part in self.remembering:
            part.advance(step)

    def memory(self) -> Memory:
        """The state that laws and loads carry from step to step, by name; part of a run's state."""
        return {f"{part.key}_{name}": value for part in self.remembering for name, value in part.memory().items()}

    def recall(self, memory: Mapping[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""
        for part in self.remembering:
            start = f"{part.key}_"
            part.recall({name.removeprefix(start): value for name, value in memory.items() if name.startswith(start)})

    def held(self, before: float, after: float) -> Prescribed:
        """The prescribed displacements between two times."""
        return Prescribed(self.ends.index, self.ends.motion(before, after))

    def bodies(self, there: Configuration) -> Any:
        """None: there are none."""
        return None
