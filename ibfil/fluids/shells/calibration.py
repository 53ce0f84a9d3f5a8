"""The shell of markers that moves as an ellipsoid of given semi-axes: its offset within them is measured, not assumed.

Markers push the fluid through the kernel, so a shell drags along more than it holds. It moves as a body of one more
offset on each semi-axis. That offset is found such that the mean mobility of the shell in free space, over directions
and places in a cell, is the ellipsoid's (Stokes flow; bodies/resistance.py). A sphere's other radius, and the single
directions of an ellipsoid, are then off by what `Fit` tells.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ...bodies.markers import area, markers
from ...bodies.resistance import ellipsoid
from ...grid.kernels import KERNELS
from ..coupling import TRANSLATION, Nodes
from ..spaces.free import FreeSpace
from .shell import Shells

PLACES = np.array([[0.11, 0.27, 0.43], [0.61, 0.77, 0.93], [0.36, 0.02, 0.68], [0.86, 0.52, 0.18]])  # in a cell
_FEW = 200  # markers above which one place will do: the scatter falls with their number
_ROUNDS, _ENOUGH = 12, 1e-7


class Fit(NamedTuple):
    """A shell: markers (k, 3) in the body's axes, how deep they lie, its mobilities over the ellipsoid's, (3,) each.

    All in units of the spacing; ``scatter`` is how far the first differ between places in a cell.
    """

    markers: np.ndarray
    offset: float
    translation: np.ndarray
    rotation: np.ndarray
    scatter: float


class TooSmall(ValueError):
    """A body too small for its grid: the geometric semi-axis that markers would have."""


LEAST = 1.5  # spacings: the least geometric semi-axis


def fitted(axes: tuple[float, float, float], kernel: str, spacing: float, turning: bool) -> Fit:
    """The shell for semi-axes in units of the grid's spacing, markers ``spacing`` of those apart. Raises TooSmall.

    ``turning``: the mean mobility that is met is that of rotation.
    """
    return _fitted(tuple(round(a, 12) for a in axes), kernel, spacing, turning)


@lru_cache(maxsize=32)
def _fitted(axes: tuple[float, ...], kernel: str, spacing: float, turning: bool) -> Fit:
    wanted = np.array(axes)
    begin = 0.5 * KERNELS[kernel].point_radius
    _refuse(wanted - begin)
    inner = wanted - begin
    points = markers(inner, max(4, round(area(inner) / spacing**2))) / inner
    places = PLACES if len(points) <= _FEW else PLACES[:1]
    resistance = ellipsoid(wanted, 1.0)
    target = np.array([resistance.translation, resistance.rotation])
    found: dict[float, np.ndarray] = {}

    def off(offset: float) -> float:
        """How much the shell's mobility differs, in terms of a radius."""
        _refuse(wanted - offset)
        found[offset] = np.array([mobilities(points * (wanted - offset), kernel, place) for place in places])
        mean = found[offset].mean(axis=0)[int(turning)].mean() / (1.0 / target[int(turning)]).mean()
        return float(wanted.mean() * (mean ** (-1 / 3 if turning else -1.0) - 1.0))

    offset = _root(off, begin)
    ratio = found[offset] * target
    scatter = float(np.ptp(ratio[:, 0].mean(axis=1)))
    moved, turned = ratio.mean(axis=0)
    return Fit(points * (wanted - offset), offset, moved, turned, scatter)


def _refuse(inner: np.ndarray) -> None:
    if inner.min() < LEAST:
        raise TooSmall(f"{inner.min():.3g}")


def _root(off: Callable[[float], float], x: float) -> float:
    """The zero of a function of slope near -1, by secants; the last place at which it was asked."""
    y = off(x)
    slope = -1.0
    for _ in range(_ROUNDS):
        if abs(y) < _ENOUGH:
            break
        new = x - y / slope
        value = off(new)
        slope = (value - y) / (new - x)
        x, y = new, value
    return x


def mobilities(points: np.ndarray, kernel: str, place: np.ndarray) -> np.ndarray:
    """Mobilities (2, 3) along and about the axes of a shell of points (k, 3) at a place in a cell; eta = h = 1."""
    return np.diag(np.linalg.inv(resistance(points, kernel, place))).reshape(2, 3)


def resistance(points: np.ndarray, kernel: str, place: np.ndarray) -> np.ndarray:
    """The 6 x 6 resistance in free space, about the centre, of a rigid shell of points (k, 3): B^T M^-1 B."""
    space, shape = FreeSpace(1.0), KERNELS[kernel]
    none = np.zeros_like(points)
    nodes = Nodes(*space.stencil(shape, points + place), none)
    matrix = space.mobility(TRANSLATION, shape.points, 1.0).matrix(nodes, none)
    levers = Shells(0, (points,), 1.0).levers(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]), 6)
    out: np.ndarray = levers.T @ cho_solve(cho_factor(matrix), levers)
    return out
