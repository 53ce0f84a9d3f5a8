"""The start of a closed rod: its nodes on a closed curve, even chords, and its frame, of the linking number wanted."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from ..rods.linking import linking, writhe
from .curves import unit

_EVEN = 1e-13  # of a chord


def closed_nodes(r: np.ndarray, length: float) -> np.ndarray:
    """Nodes (N + 1, 3), the last the first, of N equal chords that are ``length`` together.

    They lie on the periodic spline through r (N + 1, 3), of which the last point is moved onto the first, and are
    scaled about their mean. Raises ValueError, with a sentence, where r does not close.
    """
    chords = np.linalg.norm(np.diff(r, axis=0), axis=1)
    apart = float(np.linalg.norm(r[-1] - r[0]))
    if apart > 2.0 * float(np.mean(chords)):
        raise ValueError(f"its ends are {apart:.3g} apart, more than two segments")
    r = np.concatenate([r[:-1], r[:1]])
    curve = CubicSpline(np.linspace(0.0, 1.0, len(r)), r, bc_type="periodic")
    at = np.linspace(0.0, 1.0, len(r))
    for _ in range(200):
        chords = np.linalg.norm(np.diff(curve(at), axis=0), axis=1)
        along = np.concatenate([[0.0], np.cumsum(chords)])
        if np.ptp(chords) < _EVEN * along[-1]:
            break
        at = np.interp(np.linspace(0.0, along[-1], len(r)), along, at)
        at[-1] = 1.0
    nodes = curve(at)
    nodes[-1] = nodes[0]
    middle = nodes[:-1].mean(axis=0)
    return middle + (length / float(np.sum(chords))) * (nodes - middle)


def _tangents(r: np.ndarray) -> np.ndarray:
    """Tangents (N + 1, 3) at the nodes, of the chords beside them."""
    return unit(r[np.r_[1 : len(r), 1]] - r[np.r_[-2, : len(r) - 1]])


def _carried(e3: np.ndarray, first: np.ndarray) -> np.ndarray:
    """The director ``first`` (3,) carried along the tangents e3 (N + 1, 3) without a turn about them."""
    out = np.empty_like(e3)
    out[0] = unit(first - (first @ e3[0]) * e3[0])
    for k in range(1, len(e3)):
        v, old = out[k - 1], e3[k - 1]
        out[k] = v - (v @ e3[k]) / (1.0 + old @ e3[k]) * (old + e3[k])
        out[k] = unit(out[k] - (out[k] @ e3[k]) * e3[k])
    return out


def _turned(e1: np.ndarray, e3: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """e1 (k, 3) turned about e3 by ``angle`` (k,)."""
    return np.cos(angle)[:, None] * e1 + np.sin(angle)[:, None] * np.cross(e3, e1)


def closed_frame(r: np.ndarray, first: np.ndarray, wanted: int | None) -> tuple[np.ndarray, float]:
    """Directors e1 (N + 1, 3) of closed nodes r, turned evenly to the linking number ``wanted``; by how many turns.

    e1 of node 0 is ``first`` (3,), as near as it is normal to the rod. None: the number nearest to the writhe, so the
    least twist.
    """
    e3 = _tangents(r)
    e1, share = _carried(e3, first), np.linspace(0.0, 1.0, len(r))
    missing = np.arctan2(np.cross(e1[-1], e1[0]) @ e3[0], e1[-1] @ e1[0])
    once = _turned(e1, e3, missing * share)
    once[-1] = once[0]
    have = linking(r, once).linking
    turns = (round(writhe(r)) if wanted is None else wanted) - have
    angle = missing + 2.0 * np.pi * turns
    out = _turned(e1, e3, angle * share)
    out[-1] = out[0]
    return out, float(angle / (2.0 * np.pi))
