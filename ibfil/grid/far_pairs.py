"""Pairs of nodes too far apart for the table of free space: Oseen's tensor, with the nodes' own second moments.

A node's weights are a little cloud of forces about its place. Far away it acts as its total, its first moments and its
second ones; with m = sum w x and v_a = sum w x_a^2 - m_a^2 of each node (h = eta = 1), d = m_p - m_q, n = d/r, V =
diag(v_p + v_q), t = trace V, Q = n.V n,

    G_pq = [1 + n n]/(8 pi r) + [(3 Q - t) 1 + 2 V - 6 (V n n + n n V) + (15 Q - 3 t) n n]/(16 pi r^3)            (2)
    R_pq = [-d/r^3 + (6 V n - (15 Q - 3 t) n)/(2 r^4)]/(8 pi)             W_pq = (3 n n - 1)/(16 pi r^3)

which is Oseen's tensor and its half curls to second order in width over distance: (1 + V:grad grad/2) of each. Kernels
whose even and odd sums agree have no more to say at distances of the table's reach but 1e-8 of the self mobility.
"""

from __future__ import annotations

import numpy as np

from ..linalg.compiled import njit


@njit(cache=True)
def moments(base, weights):
    """Centres (n, 3) and variances (n, 3) of the nodes' weights along each axis, h = 1."""
    n, _, p = weights.shape
    first, second = np.empty((n, 3)), np.empty((n, 3))
    for q in range(n):
        for a in range(3):
            one = two = 0.0
            for i in range(p):
                one += weights[q, a, i] * i
                two += weights[q, a, i] * i * i
            first[q, a], second[q, a] = base[q, a] + one, two - one * one
    return first, second


@njit(cache=True, inline="always")
def is_far(base, a, b, reach):
    """Whether the first indices of two nodes differ by ``reach`` or more on any axis."""
    return (
        abs(base[a, 0] - base[b, 0]) >= reach
        or abs(base[a, 1] - base[b, 1]) >= reach
        or abs(base[a, 2] - base[b, 2]) >= reach
    )


@njit(cache=True)
def far_pair(first, second, a, b, scales, sums):
    """The components of the response for the pair a, b into ``sums``: G xx .. yz, and with 15 of them R and W.

    ``scales`` (3,) are 1/(eta h), 1/(eta h^2), 1/(eta h^3).
    """
    x, y, z = first[a, 0] - first[b, 0], first[a, 1] - first[b, 1], first[a, 2] - first[b, 2]
    u, v, w = second[a, 0] + second[b, 0], second[a, 1] + second[b, 1], second[a, 2] + second[b, 2]
    r = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / r, y / r, z / r
    t, q = u + v + w, u * x * x + v * y * y + w * z * z
    one, three = scales[0] / (8 * np.pi * r), scales[0] / (16 * np.pi * r**3)
    same, along = one + three * (3 * q - t), one + three * (15 * q - 3 * t)
    sums[0] = same + along * x * x + three * (2 - 12 * x * x) * u
    sums[1] = same + along * y * y + three * (2 - 12 * y * y) * v
    sums[2] = same + along * z * z + three * (2 - 12 * z * z) * w
    sums[3] = (along - 6 * three * (u + v)) * x * y
    sums[4] = (along - 6 * three * (u + w)) * x * z
    sums[5] = (along - 6 * three * (v + w)) * y * z
    if len(sums) > 6:
        one, two = scales[1] / (8 * np.pi * r * r), scales[1] / (16 * np.pi * r**4)
        along = one + two * (15 * q - 3 * t)
        sums[6], sums[7], sums[8] = (6 * two * u - along) * x, (6 * two * v - along) * y, (6 * two * w - along) * z
        three = scales[2] / (16 * np.pi * r**3)
        sums[9], sums[10], sums[11] = three * (3 * x * x - 1), three * (3 * y * y - 1), three * (3 * z * z - 1)
        sums[12], sums[13], sums[14] = three * 3 * x * y, three * 3 * x * z, three * 3 * y * z
