"""The nodal force of a Kirchhoff rod: Eq. 44 of the paper, corrected.

The force through the face between nodes i and i + 1, with M3 at the half node:

    F_{i+1/2} = (Q_{i+1} - Q_i)/ds + M3_{i+1/2} (X_i + X_{i+1})/2 + F'3 d/ds
    Q = e3 x M = M1 e2 - M2 e1,     X = r' x r''
    F'3 = EA (1 - ds/|d|) - (P_i + P_{i+1})/2,     P = M1 O1 + M2 O2

    nodal force   f_i   = F_{i+1/2} - F_{i-1/2}                                    (Eq. 44)
    twist torque  tau_i = M3_{i+1/2} - M3_{i-1/2} + Lc (O1 M2 - O2 M1)_i           (Eq. 36, corrected)

Misprints of the paper that stand corrected here: the sign of the twist term (Eq. 18, 21-24, 29, 30, 33, 44: printed
``- O1``), the tension (Eq. 20: ``EA (1 - ds/|d|)``, no factor ds) and the source of Eq. 36-38 (``O1 M2 - O2 M1``, which
holds for every law and for moduli that vary along s). Both are differences of fluxes, so the forces sum to zero to
round-off for any moment whatever. M comes from constitutive.py, the strains O, r', r'' and d from geometry.py.

In the names below ``edge`` is d, ``length`` |d|, ``metric`` |r'|, ``r_s`` r', ``r_ss`` r'' and ``stretching`` EA.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..linalg.compiled import njit
from ..linalg.vectors import at, cross, mix, plus, put
from .geometry import E1, E2, EDGE, LENGTH, O1, O2, R_S, R_SS, Configuration
from .mesh import Mesh


class Moment(NamedTuple):
    """Moments of a constitutive law, and their derivatives. Zero, both, at ends that carry none."""

    bend: np.ndarray  # (n, 2) M1, M2 at nodes
    bend_slope: np.ndarray  # (n, 2, 2) dM_a/dO_b
    twist: np.ndarray  # (n,) M3 at half nodes
    twist_slope: np.ndarray  # (n,) dM3/dO3


@njit(cache=True)
def release(nodes, bend, bend_slope):
    """Zeroes M1, M2 (n, 2) and their slopes (n, 2, 2) at the ``nodes`` (k,), ends that carry no moment."""
    for k in range(nodes.size):
        bend[nodes[k]] = 0.0
        bend_slope[nodes[k]] = 0.0


def nodal_force(mesh: Mesh, g: Configuration, moment: Moment, stretching: np.ndarray, force: np.ndarray) -> None:
    """Eq. 44: adds the elastic force on each node, (n, 3), and where ``force`` is (n, 4) the twist torque.

    ``stretching`` (n,) is EA at half nodes. The force is the rod's on the fluid.
    """
    _nodal_force(mesh.joined, mesh.ds, mesh.volume, g.table, moment.bend, moment.twist, stretching, force)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _nodal_force(joined, rest, volume, g, bend, twist, stretching, force):
    n, m = force.shape
    for i in range(n - 1):
        if not joined[i]:
            continue
        j, ds, m3 = i + 1, rest[i], twist[i]
        p = bend[i, 0] * g[i, O1] + bend[i, 1] * g[i, O2] + bend[j, 0] * g[j, O1] + bend[j, 1] * g[j, O2]
        tension = stretching[i] * (1.0 - ds / g[i, LENGTH]) - 0.5 * p
        before = mix(bend[i, 0], at(g, i, E2), -bend[i, 1], at(g, i, E1))
        after = mix(bend[j, 0], at(g, j, E2), -bend[j, 1], at(g, j, E1))
        flux = mix(1.0 / ds, plus(after, -1.0, before), tension / ds, at(g, i, EDGE))
        if m3 != 0.0:
            flux = plus(flux, 0.5 * m3, cross(at(g, i, R_S), at(g, i, R_SS)))
            flux = plus(flux, 0.5 * m3, cross(at(g, j, R_S), at(g, j, R_SS)))
        put(force, i, 0, plus(at(force, i, 0), 1.0, flux))
        put(force, j, 0, plus(at(force, j, 0), -1.0, flux))
        if m == 4:
            force[i, 3] += m3
            force[j, 3] -= m3
    if m == 4:
        for i in range(n):
            force[i, 3] += volume[i] * (g[i, O1] * bend[i, 1] - g[i, O2] * bend[i, 0])
