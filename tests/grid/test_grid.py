"""The grid: its places, spreading and interpolation, and the Stokes solve mode by mode."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.grid.kernels import KERNELS
from ibfil.grid.periodic_grid import Grid, cells_for
from ibfil.grid.spectral import project
from ibfil.grid.spreading import interpolate, spread

KERNEL = pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)
CELLS = pytest.mark.parametrize("cells", [(12, 12, 12), (9, 14, 11), (16, 8, 7)])
H = 0.3


def grid_of(cells: tuple[int, int, int]) -> Grid:
    return Grid([n * H for n in cells], cells)


def test_the_grid_of_a_thickness_is_the_next_smooth_one_less_than_20_per_cent_finer() -> None:
    """Seven cells a side have a factor of 7; eight are 1.21 or 1.27 times as fine as what is asked for."""
    assert cells_for([1.0, 2.0, 1.0], 1 / 6.6) == (8, 16, 8)
    assert cells_for([1.0, 2.0, 1.0], 1 / 6.3) is None
    assert cells_for([1.0, 2.0, 1.0], 1 / 6.0) == (6, 12, 6)


def scattered(grid: Grid, count: int, seed: int = 0) -> np.ndarray:
    """Nodes in the box, on its seams, at grid points, and many boxes away."""
    r = np.random.default_rng(seed).uniform(-0.5, 0.5, (count, 3)) * grid.box
    r[0] = grid.origin
    r[1] = -grid.origin
    r[2] = 0.0
    r[3] += grid.box * (37, -52, 0)
    r[4] += grid.box * (-1, 1, 100)
    return r


# --- places ----------------------------------------------------------------------------------------------------------


@CELLS
def test_a_grid_point_is_at_the_origin_and_the_box_about_it(cells):
    grid = grid_of(cells)
    assert grid.spacing == pytest.approx(H, rel=1e-15)
    assert np.array_equal(grid.coordinates(np.zeros((1, 3)))[0], [n // 2 for n in cells])
    assert grid.coordinates(grid.origin[None])[0] == pytest.approx([0, 0, 0], abs=1e-14)
    points = [grid.origin[a] + H * np.arange(n) for a, n in enumerate(cells)]
    for axis, x in enumerate(points):
        assert x[cells[axis] // 2] == pytest.approx(0, abs=1e-14)
        assert abs(x[0] + x[-1]) < H * (1 + 1e-14)  # even: one point more on the left; odd: symmetric


# --- spreading and interpolation -------------------------------------------------------------------------------------


@KERNEL
@CELLS
def test_interpolation_is_the_transpose_of_spreading(kernel, cells):
    grid, rng = grid_of(cells), np.random.default_rng(1)
    base, weights = kernel.stencil(grid.coordinates(scattered(grid, 20)))
    force, field = rng.standard_normal((20, 3)), rng.standard_normal((3, *cells))
    out = np.zeros((3, *cells))
    spread(base, weights, force, out)
    there, here = np.sum(out * field), np.sum(force * interpolate(base, weights, field))
    scale = np.sum(np.abs(out * field))
    assert abs(there - here) < 1e-14 * scale


@KERNEL
@CELLS
def test_spreading_loses_no_force_and_interpolation_keeps_a_uniform_flow(kernel, cells):
    grid = grid_of(cells)
    base, weights = kernel.stencil(grid.coordinates(scattered(grid, 20)))
    force = np.random.default_rng(2).standard_normal((20, 3))
    out = np.zeros((3, *cells))
    spread(base, weights, force, out)
    assert out.sum(axis=(1, 2, 3)) == pytest.approx(force.sum(axis=0), abs=1e-13)
    flow = np.array([0.3, -1.7, 2.9])
    field = np.broadcast_to(flow[:, None, None, None], out.shape).copy()
    assert interpolate(base, weights, field) == pytest.approx(np.tile(flow, (20, 1)), abs=1e-14 * 10)


@pytest.mark.parametrize("name", ["roma3", "peskin4", "bspline4", "bspline6", "bkp6"])
def test_kernels_with_first_moment_zero_keep_torque_and_linear_flows(name):
    grid, kernel = grid_of((14, 16, 15)), KERNELS[name]
    rng = np.random.default_rng(3)
    r = rng.uniform(-1.0, 1.0, (20, 3))  # no stencil reaches the seam, where a linear flow is not periodic
    base, weights = kernel.stencil(grid.coordinates(r))
    x = np.stack(np.meshgrid(*(grid.origin[a] + H * np.arange(n) for a, n in enumerate(grid.cells)), indexing="ij"))
    gradient = rng.standard_normal((3, 3))
    assert interpolate(base, weights, np.tensordot(gradient, x, 1)) == pytest.approx(r @ gradient.T, abs=1e-13)
    force = rng.standard_normal((20, 3))
    out = np.zeros(x.shape)
    spread(base, weights, force, out)
    torque = np.cross(x, out, axis=0).sum(axis=(1, 2, 3))
    assert torque == pytest.approx(np.cross(r, force).sum(axis=0), abs=1e-12)


@KERNEL
def test_nodes_boxes_away_spread_to_the_same_points(kernel):
    grid = grid_of((9, 14, 11))
    r = np.random.default_rng(4).uniform(-0.5, 0.5, (12, 3)) * grid.box
    away = r + grid.box * np.random.default_rng(5).integers(-9, 9, (12, 3))
    force = np.random.default_rng(6).standard_normal((12, 3))
    fields = []
    for places in (r, away):
        base, weights = kernel.stencil(grid.coordinates(places))
        out = np.zeros((3, *grid.cells))
        spread(base, weights, force, out)
        fields.append(out)
    # Coordinates of nodes up to 130 cells away have a round-off of 130 times 2^-53; weights have slopes up to ~2.
    assert np.abs(fields[0] - fields[1]).max() < 1e-12 * np.abs(fields[0]).max()


def test_one_node_is_spread_over_the_points_around_it_with_the_products_of_its_weights():
    grid, kernel = grid_of((8, 9, 10)), KERNELS["peskin4"]
    at = np.array([3.25, 8.5, 9.9])  # in cells from index 0: the second and third axis reach over the seam
    r = (at - grid.cells // 2) * H
    base, weights = kernel.stencil(grid.coordinates(r[None]))
    out = np.zeros((3, *grid.cells))
    spread(base, weights, np.array([[0.0, 2.0, 0.0]]), out)

    def phi(x):
        x = abs(x)
        if x >= 2:
            return 0.0
        if x < 1:
            return (3 - 2 * x + np.sqrt(1 + 4 * x - 4 * x * x)) / 8
        return (5 - 2 * x - np.sqrt(-7 + 12 * x - 4 * x * x)) / 8

    for index in np.ndindex(*grid.cells):
        away = [(i - x + n / 2) % n - n / 2 for i, x, n in zip(index, at, grid.cells, strict=True)]
        expected = 2 * np.prod([phi(x) for x in away])
        assert out[(1, *index)] == pytest.approx(expected, abs=1e-13)
    assert not out[0].any()
    assert not out[2].any()


# --- the solve, mode by mode -----------------------------------------------------------------------------------------


def solved(grid: Grid, field: np.ndarray, alpha: float = 0.0, viscosity: float = 1.0) -> np.ndarray:
    """(alpha - eta Lap)^-1 P of a field (3, nx, ny, nz), by NumPy's transforms and the package's ``project``."""
    modes = np.ascontiguousarray(np.fft.rfftn(field, axes=(1, 2, 3)))
    (kx, ky, kz), (sx, sy, sz) = grid.wave_numbers()
    project(modes.view(float), kx, ky, np.repeat(kz, 2), sx, sy, np.repeat(sz, 2), alpha, viscosity, 1.0)
    return np.fft.irfftn(modes, s=tuple(grid.cells), axes=(1, 2, 3))


def numbers(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Integer wave numbers (3, nx, ny, nz), and the wave numbers of derivatives: zero at Nyquist."""
    m = np.stack(np.meshgrid(*(np.fft.fftfreq(n, 1 / n) for n in grid.cells), indexing="ij"))
    k = 2 * np.pi * m / grid.box[:, None, None, None]
    half = grid.cells[:, None, None, None] / 2
    return k, np.where(np.abs(m) == half, 0.0, k)


def derivative(grid: Grid, field: np.ndarray, axis: int) -> np.ndarray:
    """The spectral derivative of a scalar field (nx, ny, nz)."""
    _, k = numbers(grid)
    return np.fft.ifftn(1j * k[axis] * np.fft.fftn(field)).real


@CELLS
@pytest.mark.parametrize("alpha", [0.0, 2.5])
def test_solution_satisfies_the_stokes_equations(cells, alpha):
    grid, eta = grid_of(cells), 1.7
    force = np.random.default_rng(8).standard_normal((3, *cells))
    u = solved(grid, force, alpha, eta)
    scale = np.abs(u).max() / H
    assert np.abs(sum(derivative(grid, u[a], a) for a in range(3))).max() < 1e-13 * scale
    assert np.abs(u.mean(axis=(1, 2, 3))).max() < 1e-15 * np.abs(u).max() * np.prod(cells) ** 0.5
    # alpha u - eta Lap u - f is a gradient, but for the mean: take any gradient's part of it away and nothing is left.
    k, slope = numbers(grid)
    modes = np.fft.fftn(u, axes=(1, 2, 3))
    rest = np.fft.fftn(force, axes=(1, 2, 3)) - (alpha + eta * (k * k).sum(axis=0)) * modes
    rest[:, 0, 0, 0] = 0
    square = (slope * slope).sum(axis=0)
    pressure = (slope * rest).sum(axis=0) / np.where(square == 0, 1, square)
    assert np.abs(rest - slope * pressure).max() < 1e-12 * np.abs(rest).max()


@CELLS
def test_a_gradient_drives_nothing(cells):
    grid = grid_of(cells)
    pressure = np.random.default_rng(9).standard_normal(cells)
    force = np.stack([derivative(grid, pressure, a) for a in range(3)])
    assert np.abs(solved(grid, force)).max() < 1e-13 * np.abs(force).max() * H**2 * max(cells) ** 2


@pytest.mark.parametrize("alpha", [0.0, 2.5])
def test_the_mean_of_the_force_drives_nothing(alpha):
    grid = grid_of((8, 9, 10))
    assert not solved(grid, np.ones((3, 8, 9, 10)), alpha).any()


@pytest.mark.parametrize("alpha", [0.0, 0.7])
def test_a_known_flow(alpha):
    # u = (cos y' sin z', 0, 0) with wave numbers 2 and 3 of its box: div u = 0, and -Lap u = (k^2 + l^2) u.
    cells = (6, 12, 15)
    grid, eta = Grid([1.2, 2.4, 3.0], cells), 0.4
    y, z = 2 * np.pi * 2 * np.arange(12) / 12, 2 * np.pi * 3 * np.arange(15) / 15
    u = np.zeros((3, *cells))
    u[0] = np.cos(y)[None, :, None] * np.sin(z)[None, None, :]
    square = (2 * np.pi * 2 / 2.4) ** 2 + (2 * np.pi * 3 / 3.0) ** 2
    assert solved(grid, (alpha + eta * square) * u, alpha, eta) == pytest.approx(u, abs=1e-15 * 20)


def test_at_nyquist_the_derivative_is_zero_and_the_square_is_kept():
    cells = (8, 10, 12)
    grid, eta = grid_of(cells), 1.3
    zigzag = [(-1.0) ** np.arange(n) for n in cells]
    nyquist = (np.pi / H) ** 2
    for axis in range(3):
        shape = [1, 1, 1]
        shape[axis] = cells[axis]
        wave = np.broadcast_to(zigzag[axis].reshape(shape), cells)
        for direction in range(3):  # along the wave too: no real field can balance it, so it is not a gradient
            force = np.zeros((3, *cells))
            force[direction] = wave
            assert solved(grid, force, 0.0, eta) == pytest.approx(force / (eta * nyquist), abs=1e-16 * 10)
    # Zigzag in x times a wave in y: the gradient is along y alone, the square has both.
    y = np.cos(2 * np.pi * 3 * np.arange(10) / 10)
    force = np.zeros((3, *cells))
    force[:] = (zigzag[0][:, None] * y[None, :])[None, :, :, None]
    u = solved(grid, force, 0.0, eta)
    square = nyquist + (2 * np.pi * 3 / (10 * H)) ** 2
    assert u[0] == pytest.approx(force[0] / (eta * square), abs=1e-15)
    assert u[2] == pytest.approx(force[2] / (eta * square), abs=1e-15)
    assert np.abs(u[1]).max() < 1e-15


def test_odd_axes_have_no_nyquist_wave_number():
    grid = grid_of((9, 11, 7))
    slopes, squares = grid.wave_numbers()
    for k, square in zip(slopes, squares, strict=True):
        assert np.array_equal(k * k, square)
    even = grid_of((8, 10, 12))
    for k, square, n in zip(*even.wave_numbers(), even.cells, strict=True):
        assert k[n // 2] == 0
        assert square[n // 2] == pytest.approx((np.pi / H) ** 2, rel=1e-14)
        assert np.count_nonzero(k * k != square) == 1
