"""Where a filament starts: a curve in its own coordinates turned and moved to the place the case gives it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..errors import CaseError
from .curves import Curve, unit

if TYPE_CHECKING:
    from ..case.filament import Filament


def place(curve: Curve, s: np.ndarray, filament: Filament, key: str) -> Curve:
    """Turn ``curve`` to the ``direction`` and ``normal`` of the filament and move it to its ``position``.

    align = "tangent": e3 at s = 0. "chord": from the first node to the last. "axis": the helix axis where
    the curve has one, else the mean tangent, which is the chord. "auto": axis for kinds helix and
    relaxed, else tangent. The turn about ``direction`` brings e1(0), projected normal to it, to
    ``normal``, projected likewise. anchor = "start", "middle" (s = L/2) or "centroid": of the nodes ``s``
    (N,), each with its control volume.

    A curve whose points are given in the lab frame (``in_place``) is moved only where position or anchor is given, and
    turned, about its anchor, only where direction or align is; e1 is turned about e3 to ``normal`` only where that is.
    ``key`` begins each message. Raises CaseError where the curve or the case does not tell the turn.
    """
    turn = _turn(curve, s, filament, key) if filament.turned else np.eye(3)
    anchor = _ANCHORS[filament.anchor](curve, s)
    there = np.asarray(filament.position, float) if filament.moved else anchor
    shift = there - turn @ anchor if filament.moved or filament.turned else np.zeros(3)
    e1 = curve.e1 if filament.turned or filament.own_normal else _about_e3(curve, filament, key)
    return Curve(
        curve.r @ turn.T + shift,
        curve.slope @ turn.T,
        e1 @ turn.T,
        turn @ curve.middle + shift,
        None if curve.axis is None else turn @ curve.axis,
    )


def _turn(curve: Curve, s: np.ndarray, filament: Filament, key: str) -> np.ndarray:
    """The rotation (3, 3) that brings the curve to direction and normal."""
    align = filament.aligned
    own = _basis(_POINTERS[align](curve, s, key), curve.e1[0])
    if own is None:
        raise CaseError(
            [f'{key}.align: the {align} lies along e1 at s = 0, so normal has no hold; use align = "tangent"']
        )
    target = _basis(unit(np.asarray(filament.direction, float)), np.asarray(filament.normal, float))
    if target is None:
        raise CaseError([f"{key}.normal: parallel to direction; e1 cannot point there"])
    return np.asarray(target @ own.T)


def _about_e3(curve: Curve, filament: Filament, key: str) -> np.ndarray:
    """The directors (N, 3), all turned about their tangents by the angle that brings the first to ``normal``."""
    e3 = unit(curve.slope)
    target = _basis(e3[0], np.asarray(filament.normal, float))
    if target is None:
        raise CaseError([f"{key}.normal: parallel to the curve at s = 0; e1 cannot point there"])
    e2 = np.cross(e3, curve.e1)
    return np.asarray((target[:, 0] @ curve.e1[0]) * curve.e1 + (target[:, 0] @ e2[0]) * e2)


# --- the unit vector (3,) of a curve that is to point along ``direction``


def _tangent(curve: Curve, s: np.ndarray, key: str) -> np.ndarray:
    return unit(curve.slope[0])


def _axis(curve: Curve, s: np.ndarray, key: str) -> np.ndarray:
    return _chord(curve, s, key, "mean tangent") if curve.axis is None else unit(curve.axis)


def _chord(curve: Curve, s: np.ndarray, key: str, name: str = "chord") -> np.ndarray:
    chord = curve.r[-1] - curve.r[0]
    if np.linalg.norm(chord) < 1e-9 * (s[-1] - s[0]):
        raise CaseError([f'{key}.align: the ends meet, so the {name} is zero; use align = "tangent"'])
    return unit(chord)


_POINTERS: dict[str, Callable[[Curve, np.ndarray, str], np.ndarray]] = {
    "tangent": _tangent,
    "axis": _axis,
    "chord": _chord,
}


def _basis(axis: np.ndarray, normal: np.ndarray) -> np.ndarray | None:
    """Columns n, axis x n, axis (3, 3): n is ``normal`` made normal to the unit ``axis``; None: parallel."""
    across = normal - (normal @ axis) * axis
    if np.linalg.norm(across) < 1e-9 * np.linalg.norm(normal):
        return None
    across = unit(across)
    return np.column_stack((across, np.cross(axis, across), axis))


# --- the point (3,) of a curve that is to stand at ``position``


def _centroid(curve: Curve, s: np.ndarray) -> np.ndarray:
    volume = 0.5 * (np.diff(s, prepend=s[0]) + np.diff(s, append=s[-1]))
    return np.asarray(volume @ curve.r / (s[-1] - s[0]))


_ANCHORS: dict[str, Callable[[Curve, np.ndarray], np.ndarray]] = {
    "start": lambda curve, s: np.asarray(curve.r[0]),
    "middle": lambda curve, s: curve.middle,
    "centroid": _centroid,
}
