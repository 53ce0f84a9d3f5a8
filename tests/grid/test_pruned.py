"""Pruned transforms: the same velocity as whole ones, whatever the box of the filaments looks like."""

import numpy as np
import pytest

from ibfil.fluids.stokes import StokesSolve
from ibfil.grid.kernels import PESKIN4
from ibfil.grid.periodic_grid import Grid
from ibfil.grid.pruned_fft import PrunedSolve, _Lines, _Planes, bounding_box, extent, is_thin


@pytest.mark.parametrize(
    ("cells", "expected"),
    [([5], (5, 1)), ([3, 4, 7], (3, 5)), ([0, 1, 11], (11, 3)), ([0, 6], (6, 7)), (list(range(12)), (0, 12))],
)
def test_the_shortest_run_of_a_periodic_axis(cells, expected):
    occupied = np.zeros(12, bool)
    occupied[cells] = True
    start, size = extent(occupied)
    assert size == expected[1]
    assert set(cells) <= {(start + k) % 12 for k in range(size)}


def _nodes(kind, rng):
    n = 15
    across = {"planar": (0.9, 0.2, 0), "thick": (0.9, 0.8, 0.7), "point": (0, 0, 0), "line in z": (0, 0.1, 1.1)}
    return rng.uniform(-1, 1, (n, 3)) * across[kind]


@pytest.mark.parametrize("cells", [(32, 32, 32), (24, 36, 30), (15, 27, 40)])
@pytest.mark.parametrize("kind", ["planar", "thick", "point", "line in z"])
@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (1.31, -7.4, 22.05)])
def test_equal_to_whole_transforms_to_round_off(cells, kind, shift):
    """Also across the seam and far outside the box; on non-cubic grids, even and odd, and for every order of axes."""
    rng = np.random.default_rng(1)
    grid = Grid(0.1 * np.array(cells), cells)
    base, weights = PESKIN4.stencil(grid.coordinates(_nodes(kind, rng) + shift))
    force = rng.standard_normal((len(base), 3))
    whole = StokesSolve(grid, 1.7).velocity(base, weights, force)
    pruned = PrunedSolve(grid, 1.7).velocity(base, weights, force)
    assert np.abs(whole - pruned).max() < 1e-12 * np.abs(whole).max()


def test_both_forms_of_the_third_pass_agree():
    grid = Grid([2.4, 2.0, 3.0], [24, 20, 30])
    ks, squares = grid.wave_numbers()
    shape, planes, rng = (20, 7, 3, 16), 7, np.random.default_rng(2)
    wide = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    other = wide.copy()
    _Planes(ks, squares, planes, 0.8, 1.0).apply(wide)
    _Lines(ks, squares, shape, 0.8, 1.0 / 24, 1).apply(other)
    assert np.abs(wide - other).max() < 1e-13 * np.abs(wide).max()


def test_it_follows_filaments_that_move():
    grid, rng = Grid([3.2] * 3, [32] * 3), np.random.default_rng(4)
    pruned, whole = PrunedSolve(grid, 1.0), StokesSolve(grid, 1.0)
    for size in (0.2, 0.9, 0.2):
        base, weights = PESKIN4.stencil(grid.coordinates(size * rng.uniform(-1, 1, (9, 3))))
        force = rng.standard_normal((9, 3))
        u = whole.velocity(base, weights, force)
        assert np.abs(pruned.velocity(base, weights, force) - u).max() < 1e-12 * np.abs(u).max()


def test_the_box_and_the_choice_come_from_counts():
    grid = Grid([6.4] * 3, [64] * 3)
    base, _ = PESKIN4.stencil(grid.coordinates(np.array([[-0.5, 0.0, 0.0], [0.5, 0.11, 0.0]])))
    _, sizes = bounding_box(base, 4, grid.cells)
    assert sizes == [16, 8, 4]  # 10 + 4 points, 1 + 4, 4, rounded up to fours
    assert is_thin(4, 64)
    assert not is_thin(60, 64)
