"""The material frame: how e1 is carried along when the tangent turns, and turned about it (Sec. 5 of the paper)."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def carry(e1, old, new, angle):
    """Eq. 41: e1 (n, 3) carried from the unit tangents ``old`` to ``new``, then turned about ``new`` by ``angle`` (n,).

    Turning by the angle, rather than adding and renormalising, keeps second order in time. Returns the new e1 and
    the smallest 1 + old.new met: near zero a tangent has all but reversed, and Eq. 41 has no answer.
    """
    n = e1.shape[0]
    out = np.empty((n, 3))
    least = 2.0
    for i in range(n):
        a0, a1, a2 = old[i, 0], old[i, 1], old[i, 2]
        b0, b1, b2 = new[i, 0], new[i, 1], new[i, 2]
        v0, v1, v2 = e1[i, 0], e1[i, 1], e1[i, 2]
        one = 1.0 + a0 * b0 + a1 * b1 + a2 * b2
        least = min(least, one)
        f = (v0 * b0 + v1 * b1 + v2 * b2) / max(one, 1e-12)
        v0 -= f * (a0 + b0)
        v1 -= f * (a1 + b1)
        v2 -= f * (a2 + b2)
        # Round-off must not build up over a million steps: normal to the tangent, and of length one.
        f = v0 * b0 + v1 * b1 + v2 * b2
        v0 -= f * b0
        v1 -= f * b1
        v2 -= f * b2
        f = 1.0 / np.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
        c, s = f * np.cos(angle[i]), f * np.sin(angle[i])
        out[i, 0] = c * v0 + s * (b1 * v2 - b2 * v1)
        out[i, 1] = c * v1 + s * (b2 * v0 - b0 * v2)
        out[i, 2] = c * v2 + s * (b0 * v1 - b1 * v0)
    return out, least
