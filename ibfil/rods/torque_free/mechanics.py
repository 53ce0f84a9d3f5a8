"""Rods whose nodal forces and twist torques have no net torque: an option, in NumPy throughout, not the hot path.

Eq. 44 conserves force exactly and torque only to O(strain) where the rod is unevenly stretched; here both are exact.
"""

from __future__ import annotations

import numpy as np

from ...linalg.stiffness import Stiffness
from ..base import TangentReversed
from ..elastic_force import Moment
from ..frame import transport
from ..geometry import Configuration
from ..linearization import Linearization, Shift
from ..system import RodSystem
from .bisectors import Bisectors, dot, measure, outer
from .force import nodal_force
from .jacobian import Jacobian, Rods


class TorqueFree(RodSystem):
    """Mechanics with the torque-free force."""

    def start(self, r: np.ndarray, e1: np.ndarray) -> Configuration:
        """The configuration r (n, 3) with e1 (n, 3) made normal to the bisectors."""
        e3 = Bisectors(self.mesh, r).e3
        normal = e1 - dot(e1, e3)[:, None] * e3
        return measure(self.mesh, r, normal / np.sqrt(dot(normal, normal))[:, None])

    def move(self, start: Configuration, y: np.ndarray) -> Configuration:
        """The configuration displaced by y (n, m) from ``start``, e1 carried along and turned."""
        r = start.r + y[:, :3]
        b = Bisectors(self.mesh, r)
        turn = np.ascontiguousarray(y[:, 3]) if self.unknowns == 4 else np.zeros(len(r))
        e1, least = transport(start.e1, start.e3, b.e3, turn)
        if not min(least, b.least) > 0.02:
            along = 1.0 + dot(start.e3, b.e3)
            raise TangentReversed(int(np.argmin(along)), float(np.min(along)))
        return measure(self.mesh, r, e1)

    def elastic(self, configuration: Configuration, moment: Moment, stretching: np.ndarray) -> np.ndarray:
        """Nodal forces (n, 3), or with the twist torque (n, 4), for given moments and axial stiffness (n,)."""
        return nodal_force(self.mesh, configuration, moment, stretching, self.unknowns)

    def _stiffness(
        self, configuration: Configuration, start: Configuration, moment: Moment, time: float, least: float
    ) -> Stiffness:
        """The Jacobian of ``forces``, with tensions not below ``least``."""
        scene = Rods(self.mesh, self.stretching, self.unknowns, self.profile.width)
        matrix = Jacobian(scene, configuration, start, moment, least).matrix
        return self._loaded(_BisectorLinearization(self.mesh, configuration, start, matrix, least == 0.0), time)


class _BisectorLinearization(Linearization):
    """Tangents are those of bisectors: they change with the segments beside a node, not with a stencil."""

    def tangent(self, nodes: np.ndarray, rows: np.ndarray, shift: Shift = 0) -> None:
        """rows de3, de3 = (1 - e3 e3) ds/|s|."""
        b = Bisectors(self.mesh, self.configuration.r)
        on_s = rows @ self.across(nodes)
        rigid = (np.eye(3) - outer(b.u, b.u)) / b.length[:, None, None]
        shift = np.broadcast_to(shift, nodes.shape)
        for has, change, segment in ((b.has_right, b.on_right, 0), (b.has_left, b.on_left, -1)):
            ok = has[nodes]
            at, to = nodes[ok], shift[ok]
            part = on_s[ok] @ change[at] @ rigid[at + segment]
            self.position(at + segment + 1, part, to - segment - 1)
            self.position(at + segment, -part, to - segment)
