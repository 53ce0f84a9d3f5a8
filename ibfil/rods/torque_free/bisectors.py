"""Tangents as the bisectors of neighbouring segments, and the forces over which they have no net torque.

    u = d/|d|,  s_i = (u_{i-1/2} + u_{i+1/2})/(1 + u_{i-1/2}.u_{i+1/2}),  s_1 = u_{3/2}, s_N = u_{N-1/2},  e3 = s/|s|

so u.s = 1 on either side of a node. At a clamp s = T/(u.T).
"""

from __future__ import annotations

import numpy as np

from ..geometry import Configuration
from ..mesh import Mesh


def before(values: np.ndarray) -> np.ndarray:
    """The value of the segment on the left of each node."""
    return np.concatenate([np.zeros_like(values[:1]), values[:-1]])


def outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The products (n, 3, 3) of vectors (n, 3)."""
    return a[:, :, None] * b[:, None, :]


def skew(v: np.ndarray) -> np.ndarray:
    """The matrices (n, 3, 3) of v x."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return out - np.swapaxes(out, 1, 2)


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The scalar products (n,) of vectors (n, 3)."""
    return np.einsum("ij,ij->i", a, b)


def after(values: np.ndarray) -> np.ndarray:
    """The value at the node on the right of each segment."""
    return np.concatenate([values[1:], np.zeros_like(values[:1])])


class Bisectors:
    """u (n, 3) at half nodes, s (n, 3) at nodes, and how s changes with u on the left and on the right (n, 3, 3)."""

    def __init__(self, mesh: Mesh, r: np.ndarray) -> None:
        n = len(r)
        joined = mesh.joined
        self.edge = np.zeros((n, 3))
        self.edge[:-1] = np.where(joined[:-1, None], np.diff(r, axis=0), 0.0)
        self.length = np.where(joined, np.sqrt(dot(self.edge, self.edge)), 1.0)
        self.u = self.edge / self.length[:, None]
        left, right = before(self.u), self.u
        self.has_left, self.has_right = np.append(False, joined[:-1]), joined
        inner = self.has_left & self.has_right
        c = np.where(inner, 1.0 + dot(left, right), 1.0)
        self.least = float(np.min(c))
        c = np.maximum(c, 1e-12)
        self.s = (left + right) / c[:, None]
        one = np.broadcast_to(np.eye(3), (n, 3, 3)) / c[:, None, None]
        scale = np.where(inner, 1.0 / c, 0.0)[:, None, None]
        self.on_left = one - scale * outer(self.s, right)
        self.on_right = one - scale * outer(self.s, left)
        clamped = mesh.c1.any(axis=1)
        if clamped.any():
            t, u = mesh.c1[clamped], (left + right)[clamped]
            s = t / dot(t, u)[:, None]
            self.s[clamped] = s
            self.on_left[clamped] = self.on_right[clamped] = -outer(s, s)
        self.size = np.sqrt(dot(self.s, self.s))
        self.e3 = self.s / self.size[:, None]
        # What the tangent does at a clamp is prescribed, to the last bit.
        self.e3[clamped] = mesh.c1[clamped]


def measure(mesh: Mesh, r: np.ndarray, e1: np.ndarray) -> Configuration:
    """Strains about the bisectors; ``r_s`` holds s, ``metric`` its size. ``e1`` (n, 3) is taken as normal to them."""
    b = Bisectors(mesh, r)
    columns = mesh.first[:, None] + np.arange(mesh.w2.shape[1])
    r_ss = np.einsum("ik,ikc->ic", mesh.w2, r[columns]) + mesh.c2
    e2 = np.cross(b.e3, e1)
    bend = np.stack([-dot(e2, r_ss), dot(e1, r_ss)], axis=1)
    twist = np.zeros(len(r))
    sine, cosine = dot(e2[:-1] + e2[1:], e1[1:] - e1[:-1]), dot(e1[:-1], e1[1:]) + dot(e2[:-1], e2[1:])
    twist[:-1] = np.arctan2(sine, cosine) / mesh.ds[:-1]
    return Configuration.of(
        r=r,
        e1=e1,
        e2=e2,
        e3=b.e3,
        metric=b.size,
        r_s=b.s,
        r_ss=r_ss,
        bend=bend,
        twist=np.where(mesh.joined, twist, 0.0),
        edge=b.edge,
        length=b.length,
    )
