"""Drag coefficients for RFT that agree with a grid: a straight rod is dragged through the grid and feels its drag.

The rod has the filament's node spacing. It moves without turning at unit velocity u, along itself or across,

    (J L^-1 S + s) f = u,     zeta = sum f.u / L

with the exact mobility of its nodes, slip included. The grid tells places and directions apart (a rod along an axis
feels about 1 % more across than one askew), and RFT does not: zeta is the mean over 8 places within a cell of a rod
along the three axes, the six diagonals of faces and the four of the cube, weighed so that the mean is one over all
directions; the scatter is the standard deviation. It scales with the viscosity, so it is measured once, at 1, and
kept in the user's cache folder.

Where twist torques go onto the grid (rotation = "grid") the rod is spun about itself too: the torques that turn all its
nodes at unit rate, ends and the rod's own radius included, are its drag against spin.

RFT knows no interaction between parts of a rod but through these numbers: they are smaller for a longer rod, and the
right length is one over which a rod moves as one, a wavelength (fluids/README.md).
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.linalg import LinAlgError, LinAlgWarning, solve

from .. import cache
from ..grid.kernels import KERNELS
from ..version import __version__
from .coupling import TRANSLATION, Nodes
from .immersed_boundary import slip_mobility
from .spaces.free import FreeSpace
from .spaces.periodic import PeriodicSpace
from .torque_coupling import TorqueCoupling, spin_mobility

PLACES = 8  # of the rod within a cell, for each direction


@dataclass(frozen=True)
class Rod:
    """The rod that drag is measured on: its length and nodes, and the space it is dragged through."""

    length: float
    nodes: int
    space: PeriodicSpace | FreeSpace
    kernel: str
    slip: float
    radius: float = 0.0  # that it spins with, below the kernel's scale; 0: its spin is not asked for


@dataclass(frozen=True)
class Match:
    """Drag per length over viscosity, across and along the rod, and the standard deviations relative to them.

    ``spin`` is that against spin about the rod, 0 where it was not asked for.
    """

    perp: float
    par: float
    perp_scatter: float
    par_scatter: float
    spin: float = 0.0
    spin_scatter: float = 0.0

    @property
    def ratio(self) -> float:
        """Drag across over drag along."""
        return self.perp / self.par

    @property
    def scatter(self) -> float:
        """The largest of the relative standard deviations."""
        return max(self.perp_scatter, self.par_scatter, self.spin_scatter)


@lru_cache
def match(rod: Rod) -> Match:
    """The drag of the rod, from the cache where it is there. Raises ValueError where the grid cannot tell it."""
    path = cache_file(rod)
    known = _recall(path, rod)
    if known is not None:
        return known
    found = measure(rod)
    _remember(path, rod, found)
    return found


def measure(rod: Rod) -> Match:
    """The drag of the rod, measured. Raises ValueError where its nodes' mobility is singular."""
    kernel = KERNELS[rod.kernel]
    mobility = rod.space.mobility(TRANSLATION, kernel.points, 1.0)
    own = TRANSLATION.own(slip_mobility(rod.slip, kernel, rod.space.spacing, 1.0, _volume(rod)))
    drags, weights = [], []
    for weight, frame in directions():
        for place in places(PLACES):
            zeta = _drag(mobility.matrix(_laid(rod, frame[0], place), own)) / rod.length
            drags.append(np.einsum("ac,cd,ad->a", frame, zeta, frame))
            weights.append(weight)
    par, *perp = np.transpose(drags)
    across, across_scatter = _mean(np.concatenate(perp), np.tile(weights, 2))
    along, along_scatter = _mean(par, np.array(weights))
    return Match(across, along, across_scatter, along_scatter, *(_spin(rod) if rod.radius else (0.0, 0.0)))


def _volume(rod: Rod) -> np.ndarray:
    """The nodes' control volumes (n,), half as large at the ends."""
    volume = np.full(rod.nodes, rod.length / (rod.nodes - 1))
    volume[[0, -1]] *= 0.5
    return volume


def _laid(rod: Rod, along: np.ndarray, place: np.ndarray) -> Nodes:
    """The nodes of the rod along a direction (3,), its middle at a place (3,) in a cell."""
    space = rod.space
    s = np.linspace(-0.5 * rod.length, 0.5 * rod.length, rod.nodes)[:, None]
    stencil = space.stencil(KERNELS[rod.kernel], s * along + place * space.spacing)
    return Nodes(*stencil, np.tile(along, (rod.nodes, 1)))


def _spin(rod: Rod) -> tuple[float, float]:
    """The drag against spin, from torques that turn all nodes at unit rate (torque_coupling.py), and its scatter."""
    kernel = KERNELS[rod.kernel]
    widest = kernel.twist_radius * rod.space.spacing / math.sqrt(1.0 + rod.slip)
    spin = spin_mobility(np.full(rod.nodes, rod.radius), widest, rod.slip, 1.0, _volume(rod))
    coupling = TorqueCoupling(spin, np.ones(rod.nodes))
    mobility, own = rod.space.mobility(coupling, kernel.points, 1.0), coupling.own(np.zeros(rod.nodes))
    drags, weights = [], []
    for weight, frame in directions():
        for place in places(PLACES):
            whole = mobility.matrix(_laid(rod, frame[0], place), own)
            drags.append(_against(whole[3::4, 3::4]))
            weights.append(weight)
    return _mean(np.array(drags) / rod.length, np.array(weights))


def _against(mobility: np.ndarray) -> float:
    """The sum of what moves all n nodes at unit rate, with the mobility (n, n). Raises ValueError."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", LinAlgWarning)
        try:
            return float(solve(mobility, np.ones(len(mobility)), assume_a="pos").sum())
        except (LinAlgError, LinAlgWarning):
            raise ValueError("the mobility of a straight rod's nodes on this grid is singular") from None


def _mean(values: np.ndarray, weights: np.ndarray) -> tuple[float, float]:
    """The weighted mean, and the standard deviation relative to it."""
    mean = float(np.average(values, weights=weights))
    return mean, float(np.sqrt(np.average((values / mean - 1.0) ** 2, weights=weights)))


def directions() -> Iterator[tuple[float, np.ndarray]]:
    """Weights and frames (3, 3), the first row along the rod: Lebedev's rule of 26 points, taken as 13 lines.

    Exact for polynomials of degree 7 on the sphere (Lebedev 1976, USSR Comput. Math. Math. Phys. 16 (2), 10: weights
    1/21, 4/105 and 9/280 a point).
    """
    for line in itertools.product((1, 0, -1), repeat=3):
        if line > (0, 0, 0):  # one of two opposite points
            along = np.array(line) / np.linalg.norm(line)
            normal = np.cross(along, np.eye(3)[int(np.argmin(np.abs(line)))])
            normal /= np.linalg.norm(normal)
            weight = {1: 2 / 21, 2: 8 / 105, 3: 9 / 140}[int(np.abs(line).sum())]
            yield weight, np.array([along, normal, np.cross(along, normal)])


def places(count: int) -> np.ndarray:
    """Points (count, 3) that fill the unit cell evenly: multiples of 1/g, 1/g^2, 1/g^3 modulo 1, g^4 = g + 1.

    Roberts 2018, The unreasonable effectiveness of quasirandom sequences. No point mirrors another, as on a lattice.
    """
    g = 1.2207440846057596
    return (0.5 + np.arange(1, count + 1)[:, None] * g ** -np.arange(1.0, 4.0)) % 1.0


def _drag(matrix: np.ndarray) -> np.ndarray:
    """The drag (3, 3) of nodes with the mobility (3 n, 3 n) that move together. Raises ValueError."""
    n = len(matrix) // 3
    with warnings.catch_warnings():
        warnings.simplefilter("error", LinAlgWarning)
        try:
            force = solve(matrix, np.tile(np.eye(3), (n, 1)), assume_a="pos")
        except (LinAlgError, LinAlgWarning):
            raise ValueError("the mobility of a straight rod's nodes on this grid is singular") from None
    return force.reshape(n, 3, 3).sum(axis=0)


def _inputs(rod: Rod) -> dict[str, object]:
    """All that the result depends on, as JSON has it."""
    return json.loads(json.dumps({**asdict(rod), "places": PLACES, "version": __version__}))


def cache_file(rod: Rod) -> Path:
    """Where the drag of this rod is kept between runs."""
    name = hashlib.sha256(json.dumps(_inputs(rod), sort_keys=True).encode()).hexdigest()[:24]
    return cache.folder() / "matched-drag" / f"{name}.json"


def _recall(path: Path, rod: Rod) -> Match | None:
    """The drag in a file; None where there is none, or a damaged one, which costs a measurement and nothing else."""
    try:
        kept = json.loads(path.read_text())
        found = Match(**kept["drag"])
        whole = kept["inputs"] == _inputs(rod) and all(math.isfinite(x) and x >= 0 for x in asdict(found).values())
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return None
    return found if whole and found.perp > 0 and found.par > 0 else None


def _remember(path: Path, rod: Rod, found: Match) -> None:
    """Keeps it for the next run."""
    cache.keep(path, json.dumps({"inputs": _inputs(rod), "drag": asdict(found)}))
