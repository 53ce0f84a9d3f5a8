"""The resistance of an ellipsoid in unbounded Stokes flow, of any three semi-axes by one formula (Jeffery 1922).

With Carlson's integrals, a2 = a^2 and so on,

    chi = 2 R_F(a2, b2, c2),   alpha_1 = 2/3 R_D(b2, c2, a2) and cyclic
    force of translation along axis 1:    R_T,1 = 16 pi eta/(chi + a2 alpha_1)
    torque of rotation about axis 1:      R_R,1 = 16 pi eta (b2 + c2)/(3 (b2 alpha_2 + c2 alpha_3))

For a sphere these are 6 pi eta a and 8 pi eta a^3. In a flow u the force is R_T (u + (a2 d1^2 + b2 d2^2 + c2 d3^2) u/6
- U) at the centre, and the torque about axis 1 is

    16 pi eta/(3 (b2 alpha_2 + c2 alpha_3)) [ (b2 - c2) E_23 + (b2 + c2) (curl u/2 - Omega)_1 ]

so a body that nothing turns does so at Omega_1 = curl_1/2 + (b2 - c2)/(b2 + c2) E_23 (Jeffery's orbits).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Resistance(NamedTuple):
    """Force per velocity and torque per rate along a body's three axes (3,), and its semi-axes (3,) for flows."""

    translation: np.ndarray
    rotation: np.ndarray
    axes: np.ndarray


def ellipsoid(axes: np.ndarray, viscosity: float) -> Resistance:
    """The resistance of an ellipsoid of semi-axes (3,)."""
    from scipy.special import elliprd, elliprf

    square = np.asarray(axes, float) ** 2
    cyclic = [square[[k, (k + 1) % 3, (k + 2) % 3]] for k in range(3)]
    alpha = np.array([2 / 3 * elliprd(b, c, a) for a, b, c in cyclic])
    translation = 16 * np.pi * viscosity / (2 * elliprf(*square) + square * alpha)
    around = np.array(
        [(s[1] + s[2]) / (s[1] * x[1] + s[2] * x[2]) for s, x in zip(cyclic, _cyclic(alpha), strict=True)]
    )
    return Resistance(translation, 16 * np.pi * viscosity / 3 * around, np.asarray(axes, float))


def _cyclic(x: np.ndarray) -> list[np.ndarray]:
    return [x[[k, (k + 1) % 3, (k + 2) % 3]] for k in range(3)]


def carried(flow_at: np.ndarray, gradient: np.ndarray, curving: np.ndarray, axes: np.ndarray) -> tuple:
    """Velocity and rate (3,), in the body's axes, of a body of semi-axes (3,) that nothing pushes or turns.

    ``flow_at`` (3,) is the flow at its centre, ``gradient`` (3, 3) its d_j u_i and ``curving`` (3, 3) its d_j d_j u_i,
    column j along axis j, all in the body's axes. A joint, which has no size, goes along as a point does.
    """
    square, strain = axes**2, 0.5 * (gradient + gradient.T)
    spin = 0.5 * np.array(
        [gradient[2, 1] - gradient[1, 2], gradient[0, 2] - gradient[2, 0], gradient[1, 0] - gradient[0, 1]]
    )
    pairs = ((1, 2), (2, 0), (0, 1))
    aspect = np.array([(square[j] - square[k]) / ((square[j] + square[k]) or 1.0) for j, k in pairs])
    across = np.array([strain[1, 2], strain[2, 0], strain[0, 1]])
    return flow_at + curving @ square / 6.0, spin + aspect * across
