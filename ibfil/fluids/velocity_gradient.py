"""The gradient of a background flow, A_ij = d_j u_i, and what that makes of nodes.

By central differences over a small part of a length of the scene, the spacing of the grid or of the nodes: for a flow
that changes over some of these the error is below 1e-7 of the gradient, and none but round-off for a linear one.
"""

from __future__ import annotations

import numpy as np

from .base import Flow

STEP = 1e-3  # of the length: shorter ones lose digits of a fast flow that hardly changes


def gradient(flow: Flow, r: np.ndarray, time: float, length: float) -> np.ndarray:
    """A_ij = d_j u_i (n, 3, 3) of a flow at places r (n, 3)."""
    d = STEP * length
    places = r + d * np.concatenate([np.eye(3), -np.eye(3)])[:, None]
    u = flow(places.reshape(-1, 3), time).reshape(6, len(r), 3)
    return np.ascontiguousarray(np.moveaxis((u[:3] - u[3:]) / (2 * d), 0, 2))


def curl(flow: Flow, r: np.ndarray, time: float, length: float) -> np.ndarray:
    """The curl (n, 3) of a flow at places r (n, 3)."""
    a = gradient(flow, r, time, length)
    return np.stack([a[:, 2, 1] - a[:, 1, 2], a[:, 0, 2] - a[:, 2, 0], a[:, 1, 0] - a[:, 0, 1]], axis=1)


def advected(flow: Flow, r: np.ndarray, axes: np.ndarray | None, time: float, length: float) -> np.ndarray:
    """The motions (n, 3) or (n, 4) of nodes at r (n, 3) that a flow carries along, and turns about ``axes`` (n, 3).

    It turns them at axis . curl u/2, as it does a slender body that no torque acts on (Jeffery 1922).
    """
    if axes is None:
        return flow(r, time)
    return np.column_stack([flow(r, time), 0.5 * np.sum(axes * curl(flow, r, time, length), axis=1)])
