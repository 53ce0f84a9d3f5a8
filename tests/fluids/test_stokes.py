"""The immersed-boundary Stokes fluid against known answers: periodic Stokeslets, dragged rods, no mean flow."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erfc

from ibfil.fluids.immersed_boundary import Immersed, slip_mobility
from ibfil.fluids.spaces.periodic import PeriodicSpace
from ibfil.fluids.stokes import StokesByFFT, StokesByTable, StokesSolve
from ibfil.grid.kernels import KERNELS, Kernel
from ibfil.grid.periodic_grid import Grid
from ibfil.linalg.constraints import Prescribed
from ibfil.linalg.stiffness import Stiffness, no_pairs

NOTHING = Prescribed(np.zeros(0, np.int64), np.zeros(0))


def immersed(grid: Grid, nodes: int, kernel: Kernel = KERNELS["peskin4"], eta=1.0, slip=0.0, **more) -> Immersed:
    """A fluid for ``nodes`` nodes with that slip mobility each, and no twist."""
    return Immersed(PeriodicSpace.of(grid), kernel, eta, np.full(nodes, slip), None, **more)


def by_fft(fluid: Immersed) -> StokesByFFT:
    return StokesByFFT(fluid, StokesSolve(fluid.space.grid, fluid.viscosity))


# --- a point force ---------------------------------------------------------------------------------------------------


def stokeslet(x: np.ndarray, box: float = 1.0) -> np.ndarray:
    """Velocity (3, 3) at x of unit point forces in a periodic box with no mean flow, eta = 1: Ewald's sum.

    Hasimoto 1959; split as by Lindbo & Tornberg 2010, J. Comput. Phys. 229, 8994.
    """
    split, waves, eye = 6.0 / box, np.arange(-14, 15), np.eye(3)
    out = np.zeros((3, 3))
    for image in np.ndindex(5, 5, 5):
        r = x + box * (np.array(image) - 2)
        d = np.linalg.norm(r)
        bell = np.exp(-((split * d) ** 2)) / np.sqrt(np.pi)
        near = 2 * (split * bell / d**2 + erfc(split * d) / (2 * d**3))
        out += near * (d * d * eye + np.outer(r, r)) - 4 * split * bell * eye
    k = 2 * np.pi / box * np.stack(np.meshgrid(waves, waves, waves, indexing="ij"), -1).reshape(-1, 3)
    k = k[np.any(k != 0, axis=1)]
    q = np.sum(k * k, axis=1) / (4 * split**2)
    far = 8 * np.pi / box**3 * (1 + q) * np.exp(-q) * np.cos(k @ x) / (4 * split**2 * q)
    out += eye * far.sum() - np.einsum("k,ki,kj->ij", far / (4 * split**2 * q), k, k)
    return out / (8 * np.pi)


def laplacian(x: np.ndarray, step: float = 1e-2) -> np.ndarray:
    """Of the Stokeslet, by differences of fourth order."""
    return sum(
        (16 * (stokeslet(x + d) + stokeslet(x - d)) - stokeslet(x + 2 * d) - stokeslet(x - 2 * d) - 30 * stokeslet(x))
        / (12 * step**2)
        for d in step * np.eye(3)
    )


def test_pair_mobility_is_the_periodic_stokeslet_seen_by_two_blobs():
    # A blob's second moment K h^2 (an axis) makes it see, and make, (1 + K h^2/2 Lap) of the point's flow: Faxen.
    kernel, second = KERNELS["bkp6"], 59 / 60 - np.sqrt(29) / 20
    first, apart = np.array([0.013, 0.007, -0.004]), np.array([0.31, 0.12, -0.20])
    errors = []
    for n in (32, 64):
        fluid = StokesByTable(immersed(Grid([1.0] * 3, [n] * 3), 2, kernel))
        r = np.array([first, first + apart])
        force = np.zeros((2, 3, 3))
        force[1] = np.eye(3)
        response = fluid.response(r, np.zeros((2, 3)), 0.0, 1.0)
        got = np.stack([response.forced(force[..., c], NOTHING, np.zeros((2, 3))).move[0] for c in range(3)], axis=1)
        expected = stokeslet(apart) + second / n**2 * laplacian(apart)
        errors.append(np.abs(got - expected).max() / np.abs(stokeslet(apart)).max())
    assert errors[0] < 2e-4
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.3)  # what is left are fourth moments


@pytest.mark.parametrize("name", KERNELS)
@pytest.mark.parametrize("way", ["table", "fft"])
def test_a_node_in_a_periodic_box_moves_by_hasimotos_series(name, way):
    # a is the kernel's radius; a node's place in its cell matters as much as the kernel's translation error says.
    kernel, eta, load = KERNELS[name], 0.7, 1.3
    for cells, box in ((32, 3.2), (48, 3.0)):
        grid = Grid([box] * 3, [cells] * 3)
        fluid = immersed(grid, 1, kernel, eta)
        fluid = StokesByTable(fluid) if way == "table" else by_fft(fluid)
        response = fluid.response(np.array([[0.31, -0.22, 1.57]]), np.zeros((1, 3)), 0.0, 1.0)
        velocity = response.forced(np.array([[0.0, load, 0.0]]), NOTHING, np.zeros((1, 3))).move[0, 1]
        a = kernel.point_radius * grid.spacing
        x = a / box
        expected = load / (6 * np.pi * eta * a) * (1 - 2.837297 * x + 4.18879 * x**3 - 27.4 * x**6)
        assert velocity == pytest.approx(expected, rel=kernel.translation_error + 1e-3)


# --- a rod -----------------------------------------------------------------------------------------------------------


def drag(nodes: int, cells: int, fraction: float = 0.0) -> tuple[float, float]:
    """Drag per length along and across a rod of length 1 on a grid line through the middle of a box of 3.2."""
    grid = Grid([3.2] * 3, [cells] * 3)
    r = np.zeros((nodes, 3))
    r[:, 0] = np.linspace(-0.5, 0.5, nodes)
    a = KERNELS["peskin4"].point_radius * grid.spacing
    fluid = StokesByTable(immersed(grid, nodes, slip=fraction / (6 * np.pi * a)))
    response = fluid.response(r, np.zeros((nodes, 3)), 0.0, 0.25)
    zero = np.zeros((nodes, 3))
    out = []
    for axis in (0, 1):
        whole = zero.copy()
        whole[:, axis] = 0.25  # a velocity of 1
        answer = response.forced(zero, Prescribed(np.arange(3 * nodes), whole.ravel()), zero)
        assert answer.reaction.sum(axis=0) == pytest.approx(np.eye(3)[axis] * answer.reaction[:, axis].sum(), abs=1e-9)
        out.append(float(answer.reaction[:, axis].sum()))
    return out[0], out[1]


@pytest.mark.parametrize(
    ("nodes", "cells", "slip", "along", "across"),
    [
        (21, 64, 0.0, 3.866703, 5.760179),
        (21, 64, 0.01, 3.763333, 5.628168),
        (41, 128, 0.0, 2.732906, 4.272104),
        (41, 128, 0.01, 2.688965, 4.215131),
    ],
)
def test_drag_of_a_straight_rod(nodes, cells, slip, along, across):
    assert drag(nodes, cells, slip) == pytest.approx((along, across), rel=1e-6)


def test_drag_of_a_long_rod_is_that_of_a_cylinder_of_the_kernels_line_radius():
    # A row through the whole box is a square array of cylinders (Hasimoto 1959): mobility per length of one.
    n, kernel, eta = 48, KERNELS["bkp6"], 1.9
    box = 4.8
    grid = Grid([box] * 3, [n] * 3)
    r = np.zeros((n, 3))
    r[:, 0] = np.arange(n) * box / n
    response = StokesByTable(immersed(grid, n, kernel, eta)).response(r, r, 0.0, 1.0)
    a = kernel.line_radius * grid.spacing
    part = np.pi * a * a / box**2
    for axis, factor in ((0, 2.0), (1, 4.0)):
        force = np.zeros((n, 3))
        force[:, axis] = box / n  # one a length
        move = response.forced(force, NOTHING, np.zeros((n, 3))).move[:, axis]
        # ln(1/part)/2 - 0.738 + part: the last of a blurred line is not a solid cylinder's, but as small.
        expected = (0.5 * np.log(1 / part) - 0.7382) / (factor * np.pi * eta)
        assert move == pytest.approx(expected, rel=2 * part)


# --- slip ------------------------------------------------------------------------------------------------------------


def test_slip_is_a_part_of_a_nodes_mobility_and_constant_along_a_rod_for_any_spacing():
    kernel = KERNELS["bkp6"]
    grid = Grid([3.2] * 3, [64] * 3)
    ds = np.array([0.025, 0.05, 0.0125])  # h/2, h, h/4
    s = slip_mobility(0.01, kernel, grid.spacing, 2.0, ds)
    one = 1 / (6 * np.pi * 2.0 * 1.520 * 0.05)
    assert s == pytest.approx(0.01 * one * np.array([1.0, 0.5, 2.0]), rel=1e-14)
    assert not slip_mobility(0.0, kernel, grid.spacing, 2.0, ds).any()
    assert s * ds == pytest.approx((s * ds)[0], rel=1e-14)  # velocity of a force per length


# --- the field -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cells", [(16, 16, 16), (15, 18, 14)])
def test_field_has_no_divergence_and_no_mean_whatever_the_net_force(cells):
    grid = Grid([0.1 * n for n in cells], cells)
    solve, kernel = StokesSolve(grid, 1.0), KERNELS["roma3"]
    base, weights = kernel.stencil(grid.coordinates(np.array([[0.11, -0.53, 0.27], [0.79, 0.02, -0.66]])))
    u = solve.field(base, weights, np.array([[1.0, 2.0, -0.5], [0.7, 0.1, 0.3]])).copy()
    top = np.abs(u).max()
    assert np.abs(u.mean(axis=(1, 2, 3))).max() < 1e-16 * np.prod(cells) ** 0.5 * top
    modes = np.fft.rfftn(u, axes=(1, 2, 3))
    (kx, ky, kz), _ = grid.wave_numbers()
    divergence = kx[:, None, None] * modes[0] + ky[:, None] * modes[1] + kz * modes[2]
    assert np.abs(divergence).max() < 1e-12 * (np.abs(modes).max() * np.pi / 0.1)
    # The next call starts from nothing.
    assert np.array_equal(solve.field(base, weights, np.array([[1.0, 2.0, -0.5], [0.7, 0.1, 0.3]])), u)
    assert not solve.field(base, weights, np.zeros((2, 3))).any()


def test_back_pressure_carries_the_force_that_holds_a_rod():
    # A rod held in a uniform pull: the fluid as a whole stays where it is, and something flows.
    n = 11
    grid = Grid([2.0] * 3, [24] * 3)
    fluid = immersed(grid, n)
    r = np.column_stack([np.linspace(-0.5, 0.5, n), np.zeros(n), np.zeros(n)])
    held = Prescribed(np.arange(3), np.zeros(3))
    force = np.tile([0.0, 0.0, 1.0], (n, 1))
    answer = StokesByTable(fluid).response(r, r, 0.0, 0.01).forced(force, held, np.zeros((n, 3)))
    net = answer.force.sum(axis=0)
    assert net[2] > 1
    u = StokesSolve(grid, 1.0).field(*fluid.stencil(r), answer.force)
    assert np.abs(u).max() > 0.1
    assert np.abs(u.mean(axis=(1, 2, 3))).max() < 1e-14


# --- the two ways ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", KERNELS)
def test_columns_and_products_of_table_and_fft_are_the_same(name):
    n = 7
    grid = Grid([1.2, 1.5, 1.4], [12, 15, 14])
    fluid = immersed(grid, n, KERNELS[name], eta=0.6, slip=0.05)
    r = np.random.default_rng(0).uniform(-2, 2, (n, 3))
    table, fft = (way.response(r, r, 0.0, 0.1) for way in (StokesByTable(fluid), by_fft(fluid)))
    index = np.array([4, 0, 17])
    force = np.random.default_rng(1).standard_normal(3 * n)
    top = np.abs(table.matrix).max()
    assert np.abs(table.columns(index) - fft.columns(index)).max() < 1e-12 * top
    assert np.abs(table.apply(force) - fft.apply(force)).max() < 1e-12 * np.abs(table.apply(force)).max()
    assert np.array_equal(table.columns(index), table.matrix[:, index])


def test_fft_solve_that_does_not_converge_says_so_as_a_singular_matrix_does(monkeypatch):
    n = 5
    grid = Grid([1.2] * 3, [12] * 3)
    fluid = by_fft(immersed(grid, n))
    monkeypatch.setattr("scipy.sparse.linalg.gmres", lambda *args, **more: (np.zeros(3 * n), 1))
    response = fluid.response(np.random.default_rng(2).uniform(-0.5, 0.5, (n, 3)), np.zeros((n, 3)), 0.0, 0.1)
    zero = np.zeros((n, 3))
    with pytest.raises(np.linalg.LinAlgError, match="GMRES"):
        response.implicit(np.ones((n, 3)), Stiffness(np.zeros((n, 3, 15)), no_pairs(3)), NOTHING, zero, zero)
