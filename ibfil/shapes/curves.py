"""Space curves with a material frame in coordinates of their own: from strains, from a formula, from points.

A frame is the triad e3 (tangent), e1, e2 = e3 x e1 of the paper, with de_i/ds = Omega x e_i, that is

    O1 = -e2 . r'',   O2 = e1 . r'',   O3 = e2 . e1'.

A curve that says nothing of its e1 (a formula, points without e1) has e1(0) along its own z axis made
normal to the tangent there (its x axis where the two are parallel), carried along the curve without twist
(Eq. 41).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..rods.frame import transport

Strains = Callable[[np.ndarray], np.ndarray]  # s (n,) -> O1, O2, O3 (n, 3)
Formula = Callable[[np.ndarray], np.ndarray]  # s (n,) -> r (n, 3)

_GAUSS = 0.5 + np.sqrt(15.0) / 10.0 * np.array([-1.0, 0.0, 1.0])
_PIECES = 1 << 16  # of a curve, at most: strains that jump would be refined for ever
_CHANGE = 1e-12


class Curve(NamedTuple):
    """A curve and its frame at N nodes; lengths in the case's units."""

    r: np.ndarray  # (N, 3)
    slope: np.ndarray  # (N, 3) dr/ds, along e3; of length 1 where the curve is not stretched
    e1: np.ndarray  # (N, 3) of length 1, normal to slope
    middle: np.ndarray  # (3,) the point at s = L/2, be it a node or not
    axis: np.ndarray | None  # (3,) the axis of a helix, towards growing s; None: the curve has none


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) at length 1; NaN where one vanishes."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def perpendicular(e1: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Make ``e1`` (N, 3) normal to the unit ``tangent`` (N, 3), of length 1; NaN where they are parallel.

    An e1 that is of length 1 and exactly normal to the tangent comes back with the same bits.
    """
    along = np.sum(e1 * tangent, axis=-1, keepdims=True)
    return unit(e1 - along * tangent)


def _bracket(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Minus the commutator of two screws (..., 6): turns first, shifts last."""
    turn = np.cross(b[..., :3], a[..., :3])
    shift = np.cross(b[..., :3], a[..., 3:]) - np.cross(a[..., :3], b[..., 3:])
    return np.concatenate((turn, shift), axis=-1)


def _magnus(omega: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Screws (..., 6) of pieces of length ``h`` (...) from the strains (..., 3, 3) at three Gauss points.

    Magnus' expansion to sixth order (Blanes, Casas, Oteo and Ros, Physics Reports 470, 2009) for g' = g
    X: the brackets have the sign opposite to that for g' = X g. X holds the strains and, as shift, r' =
    e3. Exact for constant strains.
    """
    shift = np.zeros_like(omega)
    shift[..., 2] = 1.0
    x = np.concatenate((omega, shift), axis=-1) * h[..., None, None]
    a1 = x[..., 1, :]
    a2 = np.sqrt(15.0) / 3.0 * (x[..., 2, :] - x[..., 0, :])
    a3 = 10.0 / 3.0 * (x[..., 2, :] - 2.0 * x[..., 1, :] + x[..., 0, :])
    c1 = _bracket(a1, a2)
    c2 = -_bracket(a1, 2.0 * a3 + c1) / 60.0
    return np.asarray(a1 + a3 / 12.0 + _bracket(-20.0 * a1 - a3 + c1, a2 + c2) / 240.0)


def _exponential(screw: np.ndarray) -> np.ndarray:
    """Motions (..., 4, 4) of screws (..., 6): [[R, V shift], [0, 1]], R and V by Rodrigues' formula."""
    angle = np.linalg.norm(screw[..., :3], axis=-1)
    square = angle**2
    series = 1.0 / 6.0 - square / 120.0 + square**2 / 5040.0 - square**3 / 362880.0
    large = np.where(angle < 0.1, 1.0, angle)
    a = np.sinc(angle / np.pi)
    b = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    c = np.where(angle < 0.1, series, (large - np.sin(large)) / large**3)
    k = np.zeros((*angle.shape, 3, 3))
    x, y, z = (screw[..., i] for i in range(3))
    k[..., 0, 1], k[..., 0, 2], k[..., 1, 2] = -z, y, -x
    k[..., 1, 0], k[..., 2, 0], k[..., 2, 1] = z, -y, x
    kk = k @ k
    a, b, c = (value[..., None, None] for value in (a, b, c))
    motion = np.zeros((*angle.shape, 4, 4))
    motion[..., :3, :3] = np.eye(3) + a * k + b * kk
    motion[..., :3, 3:] = (np.eye(3) + b * k + c * kk) @ screw[..., 3:, None]
    motion[..., 3, 3] = 1.0
    return motion


def _motions(strains: Strains, s: np.ndarray, pieces: int) -> np.ndarray:
    """Frame and position (n, 4, 4) at ``s`` (n,), each interval cut into ``pieces`` (a power of two)."""
    h = np.diff(s)[:, None] / pieces * np.ones(pieces)
    points = s[:-1, None, None] + h[..., None] * (np.arange(pieces)[:, None] + _GAUSS)
    omega = strains(points.ravel()).reshape(*points.shape, 3)
    step = _exponential(_magnus(omega, h))
    while step.shape[1] > 1:
        step = step[:, 0::2] @ step[:, 1::2]
    motion = np.empty((len(s), 4, 4))
    motion[0] = np.eye(4)
    for i in range(len(s) - 1):
        motion[i + 1] = motion[i] @ step[i, 0]
    return motion


def integrate_frame(strains: Strains, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) and frames (n, 3, 3) = (e1, e2, e3) at ``s`` (n,), from 0 and the unit frame.

    The pieces are halved until nothing changes by 1e-12 (of the length), to sixth order; strains that
    jump stop short of that, at 65536 pieces. Strains about e1 alone leave e1 with the same bits.
    """
    length = s[-1] - s[0]
    pieces = 2
    motion = _motions(strains, s, pieces)
    scale = np.ones((4, 4))
    scale[:3, 3] = length
    while 2 * pieces * (len(s) - 1) <= max(_PIECES, 8 * len(s)):
        pieces *= 2
        last, motion = motion, _motions(strains, s, pieces)
        if np.max(np.abs(motion - last) / scale) < _CHANGE:
            break
    return motion[:, :3, 3], motion[:, :3, :3]


def curve_from_strains(strains: Strains, s: np.ndarray, axis: np.ndarray | None = None) -> Curve:
    """Nodes at ``s`` (N,) of the curve of unit speed with these strains, from r = 0 with the unit frame."""
    places = np.unique(np.append(s, 0.5 * (s[0] + s[-1])))
    r, frame = integrate_frame(strains, places)
    nodes, half = np.searchsorted(places, s), np.searchsorted(places, 0.5 * (s[0] + s[-1]))
    return Curve(r[nodes], frame[nodes, :, 2], frame[nodes, :, 0], r[half], axis)


def curve_from_formula(formula: Formula, s: np.ndarray) -> Curve:
    """Nodes at ``formula(s)``, whatever its speed |dr/ds|; e1 carried along without twist.

    Raises ValueError, with a sentence, where dr/ds vanishes or the tangent reverses.
    """
    slope = derivative(formula, s)
    middle = formula(np.array([0.5 * (s[0] + s[-1])]))[0]
    return Curve(formula(s), slope, transported_frame(slope), middle, None)


def derivative(formula: Formula, s: np.ndarray) -> np.ndarray:
    """Slope d formula/ds (N, 3), by a parabola through three points 1e-5 L apart within [s[0], s[-1]]."""
    h = 1e-5 * (s[-1] - s[0])
    first = np.clip(s - h, s[0], s[-1] - 2.0 * h)
    q = ((s - first) / h)[:, None]
    f0, f1, f2 = formula(first), formula(first + h), formula(np.minimum(first + 2.0 * h, s[-1]))
    return np.asarray(((q - 1.5) * f0 + (2.0 - 2.0 * q) * f1 + (q - 0.5) * f2) / h)


def transported_frame(slope: np.ndarray) -> np.ndarray:
    """Carry e1 (N, 3) from the curve's own z (or x) axis along ``slope`` (N, 3), without twist (Eq. 41)."""
    tangent = unit(slope)
    lost = np.nonzero(~np.all(np.isfinite(tangent), axis=1))[0]
    if len(lost):
        raise ValueError(f"dr/ds vanishes at node {lost[0]}")
    own = np.array([0.0, 0.0, 1.0]) if abs(tangent[0, 2]) < 1.0 - 1e-9 else np.array([1.0, 0.0, 0.0])
    e1 = np.empty_like(tangent)
    e1[0] = perpendicular(own, tangent[0])
    for i in range(len(tangent) - 1):
        e1[i + 1 : i + 2], left = transport(e1[i : i + 1], tangent[i : i + 1], tangent[i + 1 : i + 2], np.zeros(1))
        if left < 1e-6:
            raise ValueError(f"the tangent reverses between nodes {i} and {i + 1}")
    return e1
