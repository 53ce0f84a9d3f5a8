"""The discrete delta kernels: the axioms each one satisfies, and what each one is physically."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from helpers.scenes import STOKES, swimmer
from scipy.optimize import brentq
from scipy.special import gamma

from ibfil.case.consistency.space import SUPPORT
from ibfil.check.report import report
from ibfil.fluids import mobility_table
from ibfil.grid.kernels import KERNELS, Kernel
from ibfil.grid.periodic_grid import Grid

ALL = pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)
OFFSETS = np.concatenate([np.arange(16) / 16, np.random.default_rng(0).random(200)])


def stencil(kernel: Kernel, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First index (n,) and weights (n, P) along one axis."""
    base, weights = kernel.stencil(np.stack([x] * 3, axis=1))
    return base[:, 0], weights[:, 0]


def distances(kernel: Kernel, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (n, P) of the grid points from nodes at x, and their weights."""
    base, weights = stencil(kernel, x)
    return base[:, None] + np.arange(kernel.points) - x[:, None], weights


# --- axioms ----------------------------------------------------------------------------------------------------------

AXIOMS: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "sum": lambda x, w: w.sum(axis=1) - 1,
    "first": lambda x, w: (x * w).sum(axis=1),
    "even-odd": lambda x, w: (w * (-1.0) ** np.arange(w.shape[1])).sum(axis=1),
    "squares": lambda x, w: (w * w).sum(axis=1) - np.mean((w * w).sum(axis=1)),
    "second": lambda x, w: (x**2 * w).sum(axis=1) - np.mean((x**2 * w).sum(axis=1)),
    "third": lambda x, w: (x**3 * w).sum(axis=1),
}
SATISFIED = {
    "roma3": {"sum", "first", "squares"},
    "peskin4": {"sum", "first", "even-odd", "squares"},
    "bspline4": {"sum", "first", "second", "third"},
    "bspline6": {"sum", "first", "second", "third"},
    "bkp6": set(AXIOMS),
    "es4": {"sum"},
    "es5": {"sum"},
    "es6": {"sum"},
}


@ALL
def test_each_kernel_satisfies_its_axioms_and_no_others(kernel):
    x, w = distances(kernel, OFFSETS)
    largest = {name: np.abs(axiom(x, w)).max() for name, axiom in AXIOMS.items()}
    assert {name for name, value in largest.items() if value < 2e-14} == SATISFIED[kernel.name]
    # What is not satisfied fails by far more than round-off: nothing is in the table, or out of it, by chance.
    assert min((v for n, v in largest.items() if n not in SATISFIED[kernel.name]), default=1) > 1e-5


def test_constants_of_the_axioms_are_the_published_ones():
    squares = {name: (stencil(KERNELS[name], OFFSETS)[1] ** 2).sum(axis=1)[0] for name in ("roma3", "peskin4")}
    assert squares["roma3"] == pytest.approx(1 / 2, abs=1e-15)
    assert squares["peskin4"] == pytest.approx(3 / 8, abs=1e-15)
    for name, second in (("bspline4", 4 / 12), ("bspline6", 6 / 12), ("bkp6", 59 / 60 - np.sqrt(29) / 20)):
        x, w = distances(KERNELS[name], OFFSETS)
        assert (x * x * w).sum(axis=1) == pytest.approx(second, abs=1e-14)


@ALL
def test_weights_are_those_of_the_nearest_points_even_and_not_negative(kernel):
    x, w = distances(kernel, OFFSETS)
    assert w.shape[1] == kernel.points == SUPPORT[kernel.name]
    assert np.abs(x).max() <= kernel.points / 2
    assert w.min() > -1e-15
    # Even: seen from the other side, a node at -x has the same weights in reverse (none is on a cell's edge here).
    inside = OFFSETS[16:]
    assert stencil(kernel, -inside)[1] == pytest.approx(stencil(kernel, inside)[1][:, ::-1], abs=1e-14)


@ALL
def test_a_shift_by_whole_cells_shifts_the_index_alone(kernel):
    x = np.arange(16) / 16
    base, weights = stencil(kernel, x)
    for cells in (-70, -1, 3, 1000):
        moved, same = stencil(kernel, x + cells)
        assert np.array_equal(moved, base + cells)
        assert np.array_equal(same, weights)


def side_derivatives(kernel: Kernel, at: float, towards: float, order: int) -> np.ndarray:
    """The ``order``-th derivative (P,) of the weights in the node's place, at ``at`` from the side of ``towards``."""
    u = np.polynomial.chebyshev.chebpts1(9)
    x = at + (towards - at) * (u + 1) / 2
    _, weights = stencil(kernel, x)
    series = np.polynomial.chebyshev.chebfit(u, weights, 8)
    if order:
        series = np.polynomial.chebyshev.chebder(series, order) * (2 / (towards - at)) ** order
    return np.polynomial.chebyshev.chebval(-1.0, series)


def jump(kernel: Kernel, order: int) -> float:
    """The largest jump of a derivative of a grid point's weight, as a node crosses from one cell to the next."""
    edge = 1.0 if kernel.points % 2 == 0 else 0.5
    before = np.append(side_derivatives(kernel, edge, edge - 0.05, order), 0.0)
    after = np.append(0.0, side_derivatives(kernel, edge, edge + 0.05, order))
    return float(np.abs(before - after).max())


@pytest.mark.parametrize(
    ("name", "smooth"), [("roma3", 1), ("peskin4", 1), ("bspline4", 2), ("bspline6", 4), ("bkp6", 3)]
)
def test_continuous_derivatives(name, smooth):
    kernel = KERNELS[name]
    for order in range(smooth + 1):
        assert jump(kernel, order) < 1e-3  # round-off of a 4th derivative by 9 points
    assert jump(kernel, smooth + 1) > 0.5


@pytest.mark.parametrize(("name", "beta"), [("es4", 1.785 * 4), ("es5", 1.886 * 5), ("es6", 1.714 * 6)])
def test_semicircle_kernels_drop_at_the_rim_by_their_rim_value(name, beta):
    kernel = KERNELS[name]
    edge = 0.0 if kernel.points % 2 == 0 else 0.5
    before, after = stencil(kernel, np.array([edge - 1e-13, edge]))[1]
    drop = np.append(before, 0) - np.append(0, after)
    # The two outermost points come and go, one on each side, so nothing else changes.
    assert np.abs(drop[1:-1]).max() < 1e-4 * np.abs(drop[0])
    x = np.arange(kernel.points) - (kernel.points - 1) // 2 + edge
    bell = np.exp(beta * (np.sqrt(1 - (2 * np.abs(x) / kernel.points) ** 2) - 1))
    assert after == pytest.approx(bell / bell.sum(), rel=1e-12)
    assert drop[-1] == pytest.approx(-np.exp(-beta) / bell.sum(), rel=1e-4)


# --- what a kernel is physically -------------------------------------------------------------------------------------


@cache
def table(cells: int, points: int) -> np.ndarray:
    grid = Grid([float(cells)] * 3, [cells] * 3)
    return mobility_table.octant(mobility_table.point_response(grid, 1.0), points)


def between(kernel: Kernel, cells: int, places: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Mobility (3, k, 3) of the first of ``places`` (n, 3) to forces on ``columns`` (k,), h = eta = 1."""
    base, weights = kernel.stencil(places)
    none = np.zeros(len(places))
    return mobility_table.pairs(table(cells, kernel.points), base, weights, none, np.arange(1), columns)[0]


def self_mobility(kernel: Kernel, cells: int, places: np.ndarray) -> np.ndarray:
    """Mean of the three directions, for a node at each of ``places`` (n, 3)."""
    one = np.arange(1)
    return np.array([np.trace(between(kernel, cells, p[None], one)[:, 0]) / 3 for p in places])


def lattice(axes: int, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Places that differ among ``parts**axes`` of them in a cell, which is symmetric, and how often each occurs."""
    half = np.arange(parts // 2 + 1)
    count = np.where((half == 0) | (half == parts // 2), 1, 2)
    mesh = np.meshgrid(*[half] * axes, indexing="ij")
    often = np.prod(np.meshgrid(*[count] * axes, indexing="ij"), axis=0)
    return np.stack([m.ravel() for m in mesh], axis=1) / parts, often.ravel() / parts**axes


def hasimoto(ratio: float) -> float:
    return 1 - 2.837297 * ratio + 4.18879 * ratio**3 - 27.4 * ratio**6


def point(kernel: Kernel, cells: int) -> tuple[float, float]:
    """Point radius, and the spread of the self mobility times 6 pi eta a."""
    places, often = lattice(3, 8)
    mu = self_mobility(kernel, cells, places)
    a = brentq(lambda a: hasimoto(a / cells) / (6 * np.pi * a) - mu @ often, 0.3, 4.0)
    return a, float(np.ptp(mu)) * 6 * np.pi * a


def line(kernel: Kernel, cells: int) -> tuple[float, float]:
    """Line radius from the motion along the row, and from that across it."""
    places, often = lattice(2, 16)
    along, across = 0.0, 0.0
    for (y, z), part in zip(places, often, strict=True):
        row = np.column_stack([np.arange(cells), np.full(cells, y), np.full(cells, z)]).astype(float)
        m = between(kernel, cells, row, np.arange(cells)).sum(axis=1)
        along += part * m[0, 0]
        across += part * (m[1, 1] + m[2, 2]) / 2
    scale = cells * 2 * np.sqrt(np.pi) / gamma(0.25) ** 2
    return scale * np.exp(-2 * np.pi * along), scale * np.exp(-4 * np.pi * across)


@ALL
def test_point_radius_and_translation_error_are_those_measured_in_any_box(kernel):
    for cells in (16, 32, 64):
        radius, spread = point(kernel, cells)
        assert radius == pytest.approx(kernel.point_radius, rel=1e-3)
        assert spread == pytest.approx(kernel.translation_error, rel=0.05)  # two digits are given


@ALL
def test_line_radius_is_the_one_measured_along_and_across(kernel):
    small, large = line(kernel, 32), line(kernel, 64)
    for a, b in zip(small, large, strict=True):
        assert b + (b - a) / 3 == pytest.approx(kernel.line_radius, rel=1e-3)


@ALL
def test_random_places_agree_with_the_lattice_of_places(kernel):
    places, often = lattice(3, 8)
    mean = self_mobility(kernel, 32, places) @ often
    mu = self_mobility(kernel, 32, np.random.default_rng(1).random((400, 3)))
    # The semicircle kernels jump at a cell's edge, where the lattice has places: half of the part in 1000.
    assert abs(mu.mean() - mean) < 4 * mu.std() / np.sqrt(len(mu)) + 5e-4 * mean
    assert np.ptp(mu) < 1.2 * kernel.translation_error * mean


@pytest.mark.parametrize(("name", "radius"), [("roma3", 1.128), ("peskin4", 1.5045), ("bkp6", 1.732)])
def test_twist_radius(name, radius):
    assert KERNELS[name].twist_radius == pytest.approx(radius, abs=5e-4)
    # 1/(C sqrt(pi)) in closed form, C = 1/2 and 3/8
    closed = {"roma3": 2 / np.sqrt(np.pi), "peskin4": 8 / (3 * np.sqrt(np.pi))}
    assert KERNELS[name].twist_radius == pytest.approx(closed.get(name, KERNELS[name].twist_radius), rel=1e-14)


def test_schema_and_package_name_the_same_kernels():
    assert set(SUPPORT) == set(KERNELS)
    assert all(name == kernel.name for name, kernel in KERNELS.items())


@pytest.mark.parametrize("name", sorted(KERNELS))
def test_check_tells_the_radii_and_the_translation_error(name):
    """On a grid of h = 1/16."""
    kernel, text = KERNELS[name], report(swimmer({**STOKES, "kernel": name}, end=0.1))
    assert f"radius {kernel.line_radius / 16:.4g} when dragged" in text
    told = (
        f"kernel {name}: one node moves as a sphere of radius {kernel.point_radius / 16:.4g}; its mobility differs by"
    )
    assert f"{told} {kernel.translation_error:.2g} of itself" in text
