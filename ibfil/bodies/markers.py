"""Points spread evenly over the surface of an ellipsoid: the markers by which a grid feels a body."""

from __future__ import annotations

import numpy as np

_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
_THOMSEN = 1.6075  # of the formula for an ellipsoid's area: relative error below 1.1 %
_ROUNDS = 80
_STEEP = 7  # the power with which points drive each other off: short-ranged, so that tips get no more than their share


def area(axes: np.ndarray) -> float:
    """The surface of an ellipsoid with semi-axes (3,), to a hundredth (Thomsen)."""
    a, b, c = axes**_THOMSEN
    return float(4 * np.pi * ((a * b + a * c + b * c) / 3) ** (1 / _THOMSEN))


def markers(axes: np.ndarray, count: int) -> np.ndarray:
    """So many points (count, 3) on the ellipsoid of semi-axes (3,), as far from each other as they drive themselves.

    They begin on a spiral of even steps in height, and move along the surface for a fixed number of rounds: the same
    points in every run.
    """
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    around, turn = np.sqrt(1.0 - z * z), _GOLDEN * np.arange(count)
    points = axes * np.column_stack([around * np.cos(turn), around * np.sin(turn), z])
    apart = np.sqrt(area(axes) / count)
    for k in range(_ROUNDS):
        points = _onto(points + _pushed(points, axes, apart, 0.1 * (1.0 - k / _ROUNDS)), axes)
    return points


def _norms(x: np.ndarray) -> np.ndarray:
    out: np.ndarray = np.linalg.norm(x, axis=1)
    return out


def _onto(points: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Points (k, 3), along their radius back onto the ellipsoid."""
    return points / _norms(points / axes)[:, None]


def _pushed(points: np.ndarray, axes: np.ndarray, apart: float, most: float) -> np.ndarray:
    """How far (k, 3) points move along the surface, ``most`` of their distance ``apart`` at the most."""
    between = points[:, None] - points
    squares = np.einsum("abi,abi->ab", between, between)
    np.fill_diagonal(squares, np.inf)
    push = np.einsum("ab,abi->ai", (apart * apart / squares) ** (0.5 * (_STEEP + 1)), between) / apart
    normal = points / axes**2
    normal /= _norms(normal)[:, None]
    push -= np.einsum("ai,ai->a", push, normal)[:, None] * normal
    return most * apart * push / np.maximum(_norms(push), 1.0)[:, None]
