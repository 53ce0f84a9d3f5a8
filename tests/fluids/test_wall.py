"""Nodes above a wall: known mobilities, spheres and rods near it, positivity, FFTs, fields, what a force pumps."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.fluids.coupling import TRANSLATION, Nodes
from ibfil.fluids.spaces import wall_pairs
from ibfil.fluids.spaces.base import velocity_of
from ibfil.fluids.spaces.free import FreeSpace
from ibfil.fluids.spaces.wall import FreeSlipWall, NoSlipWall
from ibfil.fluids.spaces.wall_fields import MirrorFields, WallFields
from ibfil.fluids.torque_coupling import TorqueCoupling
from ibfil.grid.far_pairs import is_far, moments
from ibfil.grid.free_fft import FreeSolve
from ibfil.grid.free_space import REACH, response
from ibfil.grid.kernels import KERNELS
from ibfil.grid.periodic_grid import Lattice
from ibfil.grid.spreading import Stencil
from ibfil.grid.wall_fft import MirrorSolve, WallSolve
from ibfil.grid.wall_tables import HIGH, image

STICKS, SLIDES, FREE = NoSlipWall(1.0), FreeSlipWall(1.0), FreeSpace(1.0)
TWO = np.array([[0.37, 0.21, 0.43], [1.87, -0.29, 0.63]])
PLACES = np.array([[0.1, 0.2, 0.0], [0.45, 0.7, 0.0], [0.8, 0.35, 0.0]])


def at(r: np.ndarray, kernel: str = "peskin4", space: FreeSpace = STICKS) -> Nodes:
    return Nodes(*space.stencil(KERNELS[kernel], r), np.zeros((len(r), 3)))


def matrix(r: np.ndarray, kernel: str = "peskin4", space: FreeSpace = STICKS) -> np.ndarray:
    """The mobility (3 n, 3 n) of nodes at r (n, 3), eta = 1, no slip."""
    points = KERNELS[kernel].points
    return space.mobility(TRANSLATION, points, 1.0).matrix(at(r, kernel, space), np.zeros((len(r), 3)))


def share(height: float, kernel: str = "peskin4", space: FreeSpace = STICKS) -> tuple[float, float]:
    """The mobility of a node along and across the wall over its own in free space, mean of three places."""
    found = []
    for place in PLACES + np.array([0, 0, height]):
        found.append(np.diag(matrix(place[None], kernel, space)) / np.diag(matrix(place[None], kernel, FREE)))
    x, y, z = np.mean(found, axis=0)
    return 0.5 * (x + y), z


# --- pairs of nodes --------------------------------------------------------------------------------------------------


def test_known_mobilities_of_two_nodes():
    """Independent code, to twelve digits; the lower pair has folded stencils."""
    m = matrix(TWO + np.array([0, 0, 3]))
    assert np.diag(m)[:3] == pytest.approx([0.031822004254, 0.031806869389, 0.023894255691], abs=1e-11)
    pair = [0.024450192269, 0.001986652502, -0.000705028668, 0.012527857728]
    assert [m[0, 3], m[0, 5], m[2, 3], m[2, 5]] == pytest.approx(pair, abs=1e-11)
    low = np.diag(matrix(TWO + np.array([0, 0, 0.2])))[:3]
    assert low == pytest.approx([0.007927662052, 0.007928799270, 0.002777455970], abs=1e-11)


def test_a_pair_is_the_sum_over_all_pairs_of_points():
    """Free response and Blake's image between the points of two stencils, one of them folded, point by point."""
    r = np.array([[0.3, 0.4, 1.2], [5.1, -3.2, 2.7]])
    base, weights = STICKS.stencil(KERNELS["peskin4"], r)
    free, m = response(6, (12, 12, 12)), np.zeros((2, 3, 2, 3))
    names = {(0, 0): 0, (1, 1): 1, (2, 2): 2, (0, 1): 3, (0, 2): 4, (1, 2): 5}
    places = np.array(list(np.ndindex(4, 4, 4)))
    for p in range(2):
        for q in range(2):
            for i in places:
                for j in places:
                    w = np.prod(weights[p, range(3), i]) * np.prod(weights[q, range(3), j])
                    here, there = base[p] + i, base[q] + j
                    if w == 0.0:
                        continue
                    d, sums = here - there, np.zeros(8)
                    image(float(d[0]), float(d[1]), float(here[2]), float(there[2]), w, sums)
                    for (a, b), k in names.items():
                        value = w * free[k][tuple(np.abs(d))] * (1 if a == b else np.sign(d[a]) * np.sign(d[b]))
                        m[p, a, q, b] += value
                        m[p, b, q, a] += value if a != b else 0.0
                    for k, (a, b) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (2, 0), (2, 1), (0, 2), (1, 2)]):
                        m[p, a, q, b] += sums[k]
                    m[p, 1, q, 0] += sums[3]
    assert np.abs(matrix(r) - m.reshape(6, 6)).max() < 5e-14 * m.max()
    assert np.abs(matrix(r[::-1]) - m[::-1, :, ::-1].reshape(6, 6)).max() < 5e-14 * m.max()


HEIGHTS = [0, 0.3, 0.5, 1, 1.3, 1.8, 2.3, 3.3, 4.3, 6.3, 9.3]
ALONG = [0, 0.0563, 0.1352, 0.3855, 0.5002, 0.6238, 0.6967, 0.7827, 0.8312, 0.8837, 0.9208]
ACROSS = [0, 0.0178, 0.0455, 0.1526, 0.2230, 0.3347, 0.4366, 0.5799, 0.6690, 0.7694, 0.8423]


def test_a_node_is_a_sphere_near_a_wall_down_to_its_radius_and_stops_on_it():
    """Independent code at all heights; spheres of Rotne & Prager above a wall where nodes are some."""
    found = np.array([share(height) for height in HEIGHTS])
    assert found[:, 0] == pytest.approx(ALONG, abs=2e-4)
    assert found[:, 1] == pytest.approx(ACROSS, abs=2e-4)
    assert not found[0].any()
    a = KERNELS["peskin4"].point_radius
    for height in (*HEIGHTS[7:], 20.0, 60.0, 130.0):
        e = a / height
        spheres = 1 - (9 * e - 2 * e**3 + e**5) / 16, 1 - (9 * e - 4 * e**3 + e**5) / 8
        assert share(height) == pytest.approx(spheres, abs=3e-3 if height < 3.3 * a else 1.5e-3)


def test_a_node_above_a_wall_without_friction_is_a_sphere_with_its_mirror_image():
    """1 + 3/8 e + e^3/16 along, 1 - 3/4 e + e^3/8 across."""
    for height, known in ((6.3, (1.0916, 0.8210)), (12.3, (1.0468, 0.9079))):
        e = KERNELS["bkp6"].point_radius / height
        found = share(height, "bkp6", SLIDES)
        assert found == pytest.approx(known, abs=5e-4)
        assert found == pytest.approx((1 + 3 / 8 * e + e**3 / 16, 1 - 3 / 4 * e + e**3 / 8), abs=5e-4)


@pytest.mark.parametrize("space", [STICKS, SLIDES], ids=["sticks", "slides"])
def test_a_mobility_is_symmetric_and_positive_down_to_the_wall(space):
    rng = np.random.default_rng(0)
    layer = matrix(rng.uniform(0, 1, (200, 3)) * [25, 25, 4], space=space)
    assert np.array_equal(layer, layer.T)
    assert np.linalg.eigvalsh(layer).min() > 1e-11
    s = np.arange(20.0)[:, None]
    standing = [0.3 + np.array([x, 0.7 * x, 0]) + s * [0.1, 0, 1] for x in (0.0, 2.0, 5.0)]
    lying = [np.array([30.0 + x, 0, 0.5]) + s * [0.8, 0.6, 0] for x in (0.0, 3.1)]
    cilia = matrix(np.concatenate([*standing, *lying]), space=space)
    assert np.linalg.eigvalsh(cilia).min() > 1e-9


@pytest.mark.parametrize("higher", [False, True], ids=["apart", "high"])
def test_pairs_beyond_the_table_are_what_a_larger_table_has(higher):
    """Images of pairs in the table by the closed form: the error falls, and is told for the table's end.

    Far apart it is that of second moments along the wall; high above it heights are summed and there is next to none.
    """
    errors, own = [], matrix(np.array([[0, 0, 9.0]]))[0, 0]
    for apart in (12.0, 24.0, 46.0):
        r = np.array([[0.3, 0.6, 2.7], [0.3 + apart, 0.4 * apart, 4.1]])
        if higher:
            r = np.array([[0.3, 0.6, apart], [3.6, 2.2, apart + 1.1]])
        nodes, sums = at(r), np.empty(8)
        exact = (matrix(r) - matrix(r, space=FREE)) if higher else matrix(r)
        centres = moments(nodes.base, nodes.weights)
        wall_pairs._closed(nodes.base, nodes.weights, centres, 0, 1, 1.0, not higher, sums)
        order = [(0, 0), (1, 1), (2, 2), (0, 1), (2, 0), (2, 1), (0, 2), (1, 2)]
        errors.append(max(abs(sums[k] - exact[a, 3 + b]) for k, (a, b) in enumerate(order)) / own)
    assert errors[0] > 4 * errors[1] > 16 * errors[2]
    assert errors[2] < 3e-8


def test_the_tables_end_is_where_closed_forms_begin():
    """Along the wall and upwards, from a pair in the table to one beyond it: no step beyond what is told."""
    own = matrix(np.array([[0, 0, 9.0]]))[0, 0]
    for step, first, second in (
        (np.array([1.0, 0, 0]), [0.3, 0.4, 5.2], [REACH + 0.4, 0.9, 8.1]),
        (np.array([0, 0, 1.0]), [0.3, 0.4, HIGH / 2 - 0.2], [3.2, 0.9, HIGH / 2 + 2.3]),
    ):
        pairs = [np.array([first, second + k * step]) for k in range(-2, 3)]
        bases = [at(pair).base for pair in pairs]
        beyond = [bool(is_far(base, 0, 1, REACH)) or base[:, 2].sum() >= HIGH for base in bases]
        assert {*beyond} == {True, False}
        images = np.array([(matrix(pair) - matrix(pair, space=FREE))[:3, 3:].ravel() for pair in pairs])
        assert np.abs(np.diff(images, 4, axis=0)).max() < 2e-7 * own  # of 1/R: 24/(8 pi 48^5)


@pytest.mark.parametrize("space", [STICKS, SLIDES], ids=["sticks", "slides"])
def test_far_above_the_wall_and_far_apart_is_free_space(space):
    for height in (60.0, 300.0, 3000.0):
        r = TWO + np.array([0, 0, height])
        assert matrix(r, space=space) == pytest.approx(matrix(r, space=FREE), abs=9 / 8 * 1.01 / (6 * np.pi * height))
    apart = np.array([[0.2, 0.3, 4.0], [500.0, 0.7, 5.0]])
    found = matrix(apart, space=space)[0, 3]
    # Along a no-slip wall flows fall off as 12 z z' x^2/(8 pi r^5) does, along one without friction as two forces do.
    assert found == pytest.approx(
        12 * 20 / (8 * np.pi * 500**3) if space is STICKS else 4 / (8 * np.pi * 500), rel=0.01
    )


def test_torques_and_inertia_have_no_image():
    for space in (STICKS, SLIDES):
        with pytest.raises(ValueError, match="torques"):
            space.mobility(TorqueCoupling(np.ones(1), np.ones(1)), 4, 1.0)
        with pytest.raises(ValueError, match="Stokes"):
            space.mobility(TRANSLATION, 4, 1.0, 0.3)


# --- stencils --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kernel", ["roma3", "peskin4", "bspline4", "bspline6", "bkp6"])
def test_a_shear_above_the_wall_is_interpolated_exactly_at_any_height(kernel):
    r = np.array([[0.3, 0.4, z] for z in (0.0, 0.1, 0.5, 0.77, 1.0, 1.6, 2.5, 4.2)])
    base, weights = STICKS.stencil(KERNELS[kernel], r)
    z = base[:, 2:] + np.arange(weights.shape[2])
    assert np.sum(weights[:, 2] * z, axis=1) == pytest.approx(r[:, 2], abs=1e-14)
    assert not weights[:, 2][z < 1].any()


@pytest.mark.parametrize("space", [STICKS, SLIDES], ids=["sticks", "slides"])
def test_nodes_below_the_wall_move_nothing(space):
    assert not space.stencil(KERNELS["peskin4"], np.array([[0.3, 0.4, -0.01]])).weights[:, 2].any()


# --- rods ------------------------------------------------------------------------------------------------------------


def rod_drag(height: float) -> np.ndarray:
    """Drag over length along, aside, and down of 41 nodes a cell apart."""
    found = np.zeros(3)
    for place in PLACES:
        r = np.arange(41.0)[:, None] * [1, 0, 0] + place + [0, 0, height]
        push = np.linalg.solve(matrix(r), np.tile(np.eye(3), (41, 1)))
        found += np.diag(push.reshape(41, 3, 3).sum(axis=0)) / (40 * len(PLACES))
    return found


@pytest.mark.parametrize(
    ("height", "known"),
    [
        (3, (4.673, 8.162, 17.23)),
        (5, (3.763, 6.459, 10.92)),
        (12, (3.000, 4.874, 6.557)),
        (40, (2.611, 3.958, 4.427)),
    ],
)
def test_a_rod_near_a_wall_has_the_drag_of_a_cylinder(height, known):
    """Independent code; and the long cylinder of Jeffrey & Onishi 1981 that falls to a wall, but for the ends."""
    found = rod_drag(height)
    assert found == pytest.approx(known, rel=3e-3)
    if height == 3:
        e = KERNELS["peskin4"].line_radius / height
        long = 4 * np.pi / (np.arccosh(1 / e) - np.sqrt(1 - e**2))
        assert long == pytest.approx(17.31, rel=1e-3)
        assert found[2] == pytest.approx(long, rel=0.1)


# --- the flow, and what it carries -----------------------------------------------------------------------------------


def flow_at(places: np.ndarray, r: np.ndarray, force: np.ndarray, space: FreeSpace = STICKS) -> np.ndarray:
    kernel = KERNELS["peskin4"]
    mobility = space.mobility(TRANSLATION, kernel.points, 0.7)
    return velocity_of(mobility, TRANSLATION, space.stencil(kernel, places), at(r, space=space), force)


def flux(x: float, r: np.ndarray, force: np.ndarray) -> float:
    """Through the half-plane at x, by Gauss points on y = s tan, z = s tan."""
    points, w = np.polynomial.legendre.leggauss(40)
    y, wy = 12 * np.tan(0.5 * np.pi * points * 0.999), 12 * 0.5 * np.pi * 0.999 * w
    wy = wy * (1 + (y / 12) ** 2)
    half = 0.25 * np.pi * (1 + points) * 0.999
    z, wz = 12 * np.tan(half), 12 * 0.25 * np.pi * 0.999 * w / np.cos(half) ** 2
    mesh = np.stack(np.broadcast_arrays(x, y[:, None], z[None, :]), -1).reshape(-1, 3)
    return float(np.outer(wy, wz).ravel() @ flow_at(mesh, r, force)[:, 0])


@pytest.mark.parametrize("x", [0.0, 9.3])
def test_a_force_along_the_wall_pumps_its_height_over_pi_eta(x):
    """Q = F z/(pi eta) through any plane across, by the flow of the mobility; forces aside and up pump nothing."""
    r = np.array([[0.3, 0.2, 6.4]])
    expected = 6.4 / (np.pi * 0.7)
    assert flux(x, r, np.array([[1.0, 0, 0]])) == pytest.approx(expected, rel=5e-3)
    assert flux(x, r, np.array([[0, 1.0, 0]])) == pytest.approx(0, abs=5e-3 * expected)
    assert abs(flux(9.3, r, np.array([[0, 0, 1.0]]))) < 0.02 * expected


def test_the_fluid_rests_on_a_wall_it_sticks_to_and_does_not_go_through_either():
    rng = np.random.default_rng(1)
    r, force = rng.uniform(0, 9, (5, 3)), rng.standard_normal((5, 3))
    on = np.concatenate([rng.uniform(-9, 9, (20, 2)), np.zeros((20, 1))], axis=1)
    assert np.abs(flow_at(on, r, force)).max() < 1e-16
    slides = flow_at(on, r, force, SLIDES)
    assert np.abs(slides[:, 2]).max() < 1e-16
    assert np.abs(slides[:, :2]).max() > 1e-2
    # no friction: the velocity along the wall is as large a little above as on it, to second order
    above = [flow_at(on + np.array([0, 0, h]), r + np.array([0, 0, 4]), force, SLIDES)[:, :2] for h in (0.0, 0.5, 1.0)]
    first, second = (np.abs(a - above[0]).max() for a in above[1:])
    assert first < 0.5 * second


# --- by FFT ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("extents", "kernel"),
    [((30, 8, 6), "peskin4"), ((20, 25, 20), "peskin4"), ((1, 1, 1), "peskin4"), ((3, 20, 12), "es5")],
)
def test_convolutions_are_the_pairs(extents, kernel):
    rng, n, kern = np.random.default_rng(0), 25, KERNELS[kernel]
    r = rng.uniform(0, 0.1, (n, 3)) * np.array(extents) + [0.3, -0.7, 0]
    force = rng.standard_normal((n, 3))
    for space, solve in (
        (NoSlipWall(0.1), WallSolve(0.1, 0.7)),
        (FreeSlipWall(0.1), MirrorSolve(FreeSolve(0.1, 0.7))),
    ):
        nodes = at(r, kernel, space)
        exact = space.mobility(TRANSLATION, kern.points, 0.7).matrix(nodes, np.zeros((n, 3))) @ force.ravel()
        found = solve.velocity(nodes.base, nodes.weights, force)
        assert np.abs(found - exact.reshape(n, 3)).max() < 1e-12 * np.abs(exact).max()


def test_the_same_nodes_again_are_answered_with_the_same_bits_whatever_was_asked_between():
    rng, solve = np.random.default_rng(2), WallSolve(1.0, 1.0)
    small, large = at(rng.uniform(0, 9, (8, 3))), at(rng.uniform(0, 20, (8, 3)))
    force = rng.standard_normal((8, 3))
    first = solve.velocity(small.base, small.weights, force)
    solve.velocity(large.base, large.weights, force)
    assert np.array_equal(first, solve.velocity(small.base, small.weights, force))


# --- fields ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("away", [0.0, 4.0])
@pytest.mark.parametrize("start", [0, 3])
def test_fields_are_the_pairs_of_nodes_and_points(away, start):
    """In a window that stands on the wall, and in one above it; of nodes near it and far away."""
    rng, h, n, eta = np.random.default_rng(4), 0.1, 6, 0.7
    window = Lattice([6, 5, 8], h, h * np.array([-3, 2, start]))
    r = rng.uniform(0, 0.5, (n, 3)) + np.array([away, 0.5 * away, 0])
    force, kernel = rng.standard_normal((n, 3)), KERNELS["bkp6"]
    for space, fields in ((NoSlipWall(h), WallFields), (FreeSlipWall(h), MirrorFields)):
        nodes = at(r, "bkp6", space)
        found = fields(window, eta, None).evaluate(nodes.base, nodes.weights, force, 0.0, ["velocity"])["velocity"]
        base = np.rint(window.points() / h).astype(np.int64)
        weights = np.zeros((len(base), 3, 6))
        weights[..., 0] = 1.0
        if fields is WallFields:
            weights[base[:, 2] == 0] = 0.0  # it rests there
        mobility = space.mobility(TRANSLATION, kernel.points, eta)
        expected = velocity_of(mobility, TRANSLATION, Stencil(base, weights), nodes, force)
        expected = expected.reshape(*window.cells, 3)
        assert found == pytest.approx(expected, abs=3e-6 * np.abs(expected).max())
        if start == 0:
            assert np.abs(found[:, :, 0, 2]).max() < 1e-6 * np.abs(found).max()
            assert found[:, :, 0].any() == (fields is MirrorFields)
