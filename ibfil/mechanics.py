"""The rods of a scene put together: how they move, the forces they give, and how those change.

Everything a stepper asks of the rods is here, and nothing of the fluid.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from . import banded, elasticity, frame
from .elasticity import Moment
from .fluid import Held
from .geometry import Geometry, measure, tangents
from .rods import Mesh
from .variation import Variation


class Law(Protocol):
    """A constitutive law of all n nodes: strains in, moments out, with their derivatives.

    The caller puts zeros into what is returned at ends that carry no moment.
    """

    def bending(self, bend: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M1, M2 (n, 2) and dM_a/dO_b (n, 2, 2) of the curvatures (n, 2)."""

    def twisting(self, twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 (n,) and dM3/dO3 (n,) of the twist at half nodes (n,)."""


class Load(Protocol):
    """An external force: one verb for what it is, one for how it changes."""

    def add_force(self, shape: Geometry, time: float, force: np.ndarray) -> None:
        """Adds the force on each node, (n, m)."""

    def add_stiffness(self, time: float, variation: Variation) -> None:
        """Adds its derivative to the band matrix being filled."""


class Ends(Protocol):
    """The prescribed motion of held ends."""

    index: np.ndarray

    def motion(self, before: float, after: float) -> np.ndarray:
        """Displacements (k,) of the held unknowns between two times."""


class TangentReversed(Exception):
    """A tangent turned by nearly 180 degrees within one step; ``node`` says which."""

    def __init__(self, node: int) -> None:
        super().__init__(f"tangent reversed at node {node}")
        self.node = node


class Mechanics:
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
        self.profile = banded.profile(mesh)
        self._matrix_shape = (len(free), unknowns, (2 * self.profile.width + 1) * unknowns)
        self._lengths = (0,) * unknowns, (0,) * (unknowns * mesh.w1.shape[1])
        self._zero = np.zeros(len(free))

    def start(self, r: np.ndarray, e1: np.ndarray) -> Geometry:
        """The configuration r (n, 3) with e1 (n, 3) made normal to the stencils' tangents."""
        e3 = tangents(self.mesh, r)
        normal = e1 - np.sum(e1 * e3, axis=1)[:, None] * e3
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        return measure(self.mesh, np.ascontiguousarray(r), normal)

    def measure(self, r: np.ndarray, e1: np.ndarray) -> Geometry:
        """Strains and spacing of r and e1 (n, 3), e1 as it is."""
        return measure(self.mesh, r, e1)

    def move(self, start: Geometry, y: np.ndarray) -> Geometry:
        """The configuration displaced by y (n, m) from ``start``, e1 carried along and turned."""
        r = start.r + y[:, :3]
        e3 = tangents(self.mesh, r)
        e1, least = frame.carry(start.e1, start.e3, e3, y[:, 3] if self.unknowns == 4 else self._zero)
        if not least > 0.02:
            raise TangentReversed(int(np.argmin(np.sum(start.e3 * e3, axis=1))))
        return measure(self.mesh, r, e1)

    def moment(self, shape: Geometry, time: float) -> Moment:
        """The law's moments, zero at free ends."""
        bend, bend_slope = self.law.bending(shape.bend, time)
        if self._free.size:
            bend[self._free] = 0.0
            bend_slope[self._free] = 0.0
        if self.unknowns == 3:
            return Moment(bend, bend_slope, self._zero, self._zero)
        return Moment(bend, bend_slope, *self.law.twisting(shape.twist, time))

    def forces(self, shape: Geometry, time: float) -> tuple[np.ndarray, Moment]:
        """Eq. 44 and the loads on each node, (n, m), and the moments they come from."""
        moment = self.moment(shape, time)
        force = np.zeros((len(shape.r), self.unknowns))
        elasticity.nodal_force(self.mesh, shape, moment, self.stretching, force)
        for load in self.loads:
            load.add_force(shape, time, force)
        return force, moment

    def stiffness(
        self, shape: Geometry, start: Geometry, moment: Moment, time: float, clip: bool
    ) -> np.ndarray:
        """The exact Jacobian of ``forces`` with respect to the displacements from ``start``, by bands."""
        matrix = np.zeros(self._matrix_shape)
        elasticity.stiffness(
            self.mesh, shape, moment, self.stretching, start.e3, clip, *self._lengths, matrix
        )
        if self.loads:
            variation = Variation(self.mesh, shape, start, matrix)
            for load in self.loads:
                load.add_stiffness(time, variation)
        return matrix

    def held(self, before: float, after: float) -> Held:
        """The prescribed displacements between two times."""
        return Held(self.ends.index, self.ends.motion(before, after))
