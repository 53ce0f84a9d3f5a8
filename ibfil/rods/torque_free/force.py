"""The nodal force that has no net torque, at any spacing, to round-off; a variant of Eq. 44 of the paper.

With the tangents of bisectors.py, and fluxes that hold the true distances,

    F_{i+1/2} = [Q_{i+1} - Q_i + M3_{i+1/2} u x (s_{i+1} - s_i)]/|d| + F'3 d/ds,     Q = M1 e2 - M2 e1
    tau_i     = |s_i| (M3_{i+1/2} - M3_{i-1/2}) - (u_{i+1/2} - u_{i-1/2}).M_i

the sum of r x f and of tau e3 vanishes term by term. It differs from Eq. 44 at second order.
"""

from __future__ import annotations

import numpy as np

from ..elastic_force import Moment
from ..geometry import Configuration
from ..mesh import Mesh
from .bisectors import after, before, dot


def nodal_force(mesh: Mesh, g: Configuration, moment: Moment, stretching: np.ndarray, unknowns: int) -> np.ndarray:
    """Nodal forces (n, 3), or with the twist torque (n, 4), for given moments and axial stiffness (n,)."""
    force = np.zeros((len(g.r), unknowns))
    flux = bending_flux(g, moment)
    flux += (tension(mesh, g, moment, stretching) / mesh.ds)[:, None] * g.edge
    flux[~mesh.joined] = 0.0
    force[:, :3] = flux - before(flux)
    if unknowns == 4:
        u = g.edge / g.length[:, None]
        force[:, 3] = g.metric * (moment.twist - before(moment.twist)) - dot(kink(mesh, u), _vector(g, moment))
    return force


def bending_flux(g: Configuration, moment: Moment) -> np.ndarray:
    """[Q_{i+1} - Q_i + M3 u x (s_{i+1} - s_i)]/|d| (n, 3)."""
    q = moment.bend[:, :1] * g.e2 - moment.bend[:, 1:] * g.e1
    turn = np.cross(g.edge, after(g.r_s) - g.r_s) * (moment.twist / g.length)[:, None]
    return (after(q) - q + turn) / g.length[:, None]


def tension(mesh: Mesh, g: Configuration, moment: Moment, stretching: np.ndarray) -> np.ndarray:
    """F'3 (n,) at half nodes."""
    p = dot(moment.bend, g.bend)
    return stretching * (1 - mesh.ds / g.length) - 0.5 * (p + after(p))


def kink(mesh: Mesh, u: np.ndarray) -> np.ndarray:
    """u_{i+1/2} - u_{i-1/2}, with the tangent of a clamp in place of the segment that is not there."""
    return u - before(u) + np.where(mesh.joined, -1.0, 1.0)[:, None] * mesh.c1


def _vector(g: Configuration, moment: Moment) -> np.ndarray:
    """M1 e1 + M2 e2 (n, 3)."""
    return moment.bend[:, :1] * g.e1 + moment.bend[:, 1:] * g.e2
