"""The material frame: the director e1, carried along as the tangent turns, and turned about it (the paper, Sec. 5)."""

from __future__ import annotations

import numpy as np

from ..linalg.compiled import njit
from ..linalg.vectors import at, cross, dot, mix, plus, put


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def transported(e1, old, new, angle):
    """Eq. 41: the vector e1 carried from the unit tangent ``old`` to ``new``, then turned about it by ``angle``.

    Turning by the angle, rather than adding and renormalising, keeps second order in time. Returns the new e1 and
    1 + old.new: near zero the tangent has all but reversed, and Eq. 41 has no answer.
    """
    one = 1.0 + dot(old, new)
    v = plus(e1, -dot(e1, new) / max(one, 1e-12), plus(old, 1.0, new))
    # Round-off must not build up over a million steps: normal to the tangent, and of length one.
    v = plus(v, -dot(v, new), new)
    f = 1.0 / np.sqrt(dot(v, v))
    if angle == 0.0:
        return (f * v[0], f * v[1], f * v[2]), one
    return mix(f * np.cos(angle), v, f * np.sin(angle), cross(new, v)), one


@njit(cache=True)
def transport(e1, old, new, angle):
    """``transported`` of n nodes: from e1, old, new (n, 3), angle (n,) to new e1 (n, 3) and the least 1 + old.new."""
    n = e1.shape[0]
    out, least = np.empty((n, 3)), 2.0
    for i in range(n):
        v, one = transported(at(e1, i, 0), at(old, i, 0), at(new, i, 0), angle[i])
        put(out, i, 0, v)
        least = min(least, one)
    return out, least
