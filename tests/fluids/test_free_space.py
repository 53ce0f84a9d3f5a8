"""Nodes in free space: known mobilities, the periodic box as it grows, radii, drag, positivity, FFTs and fields."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.ring_cylinder import drag

from ibfil.fluids.coupling import TRANSLATION, Nodes
from ibfil.fluids.spaces.free import FreeSpace
from ibfil.fluids.spaces.free_fields import FreeFields
from ibfil.fluids.spaces.periodic import PeriodicSpace
from ibfil.fluids.torque_coupling import TorqueCoupling
from ibfil.grid.far_pairs import far_pair, moments
from ibfil.grid.free_fft import FreeSolve
from ibfil.grid.free_space import PAIRS, REACH
from ibfil.grid.kernels import KERNELS
from ibfil.grid.periodic_grid import Lattice
from ibfil.grid.spreading import Stencil

UNIT = FreeSpace(1.0)
TWO = np.array([[0.37, 0.21, 0.43], [1.87, -0.29, 0.63]])
NAMES = ("velocity", "vorticity", "pressure")


def at(r: np.ndarray, kernel: str = "peskin4", space: FreeSpace | PeriodicSpace = UNIT) -> Nodes:
    """Nodes that spin about no axis."""
    return Nodes(*space.stencil(KERNELS[kernel], r), np.zeros((len(r), 3)))


def matrix(r: np.ndarray, kernel: str = "peskin4", space: FreeSpace | PeriodicSpace = UNIT) -> np.ndarray:
    """The mobility (3 n, 3 n) of nodes at r (n, 3), eta = 1, no slip."""
    points = KERNELS[kernel].points
    return space.mobility(TRANSLATION, points, 1.0).matrix(at(r, kernel, space), np.zeros((len(r), 3)))


def row(count: int, ds: float = 1.0, place: tuple[float, float, float] = (0.1, 0.3, 0.7)) -> np.ndarray:
    """Nodes in a row along x."""
    return np.arange(count)[:, None] * np.array([ds, 0, 0]) + np.array(place)


# --- pairs of nodes --------------------------------------------------------------------------------------------------


def test_known_mobilities_of_two_nodes():
    """Independent code, to twelve digits."""
    m = matrix(TWO)
    assert np.diag(m)[:3] == pytest.approx([0.040279101019, 0.040264515276, 0.040282033529], abs=1e-11)
    pair = [0.032324762362, -0.001782691317, 0.000672909099, 0.027916221125, -0.000226703125, 0.027382711575]
    assert [m[0, 3], m[0, 4], m[0, 5], m[1, 4], m[1, 5], m[2, 5]] == pytest.approx(pair, abs=1e-11)
    m = matrix(TWO, "roma3")
    assert (m[0, 0], m[0, 3]) == pytest.approx((0.054337157379, 0.037970533194), abs=1e-11)


@pytest.mark.parametrize("kernel", ["peskin4", "bkp6"])
def test_a_box_gives_up_what_hasimoto_says_as_it_grows(kernel):
    """-2.837297/(6 pi L), and then 2 v/(3 L^3), v the variance of the node's weights, and nothing else."""
    node, left = TWO[:1], []
    for side in (16, 32, 64):
        space = PeriodicSpace((float(side),) * 3, (side,) * 3)
        differs = np.trace(matrix(node, kernel, space) - matrix(node, kernel)) / 3
        left.append(differs + 2.837297 / (6 * np.pi * side))
    assert left[0] / left[1] == pytest.approx(8, abs=0.02)
    assert left[1] / left[2] == pytest.approx(8, abs=0.02)
    variance = float(np.mean(moments(*UNIT.stencil(KERNELS[kernel], node))[1]))
    assert left[2] == pytest.approx(2 * variance / (3 * 64**3), rel=3e-3)


def test_pairs_beyond_the_table_are_what_a_larger_table_has():
    """Nodes less than REACH apart seen as far ones: the error falls with the fourth power, and is told for REACH."""
    errors, node = [], matrix(TWO[:1])[0, 0]
    for apart in (12, 24, 47):
        r = np.array([[0.3, 0.6, 0.1], [0.3 + apart, 0.4 * apart, 0.2 * apart], [0.8, 0.2 - apart, 0.9]])
        nodes, sums = at(r), np.empty(6)
        near, worst = matrix(r).reshape(3, 3, 3, 3), 0.0
        for other in (1, 2):
            far_pair(*moments(nodes.base, nodes.weights), 0, other, np.ones(3), sums)
            worst = max(worst, *(abs(sums[i] - near[0, a, other, b]) for i, (a, b) in enumerate(PAIRS)))
        errors.append(worst / node)
    assert errors[0] / errors[1] == pytest.approx(2**5, rel=0.4)
    assert errors[2] < 3e-8


def test_the_far_pair_is_better_than_spheres_and_these_than_points():
    """Along the line between two nodes 24 apart; Rotne & Prager's spheres have the kernel's point radius."""
    a, r, sums, errors = KERNELS["peskin4"].point_radius, 24.0, np.empty(6), []
    for place in np.random.default_rng(0).uniform(0, 1, (8, 3)):
        pair = np.array([place, place + np.array([r, 0, 0])])
        exact, nodes = matrix(pair)[0, 3], at(pair)
        far_pair(*moments(nodes.base, nodes.weights), 0, 1, np.ones(3), sums)
        oseen, spheres = 2 / (8 * np.pi * r), (2 - 4 / 3 * a**2 / r**2) / (8 * np.pi * r)
        errors.append([abs(x / exact - 1) for x in (oseen, spheres, sums[0])])
    point, sphere, blob = np.max(errors, axis=0)
    assert point == pytest.approx(1.8e-3, rel=0.2)
    assert sphere == pytest.approx(2.1e-4, rel=0.5)
    assert blob < 1e-5


def test_near_and_far_pairs_meet_without_a_step():
    """As a node goes through the reach of the table, the mobility goes on as smoothly as before."""
    x = REACH - 2 + 0.05 * np.arange(80)
    found = np.array([matrix(np.array([[0.0, 0.0, 0.0], [p, 0.3, 0.2]]), "bkp6")[0, 3] for p in x])
    assert np.abs(np.diff(found, 3)).max() < 3e-8 * matrix(np.zeros((1, 3)), "bkp6")[0, 0]
    assert found[0] > found[-1]


def test_a_mobility_is_symmetric_and_positive():
    rng, least = np.random.default_rng(1), {}
    for ds in (1.0, 0.5, 0.25):
        lines = rng.standard_normal((5, 3))
        lines /= np.linalg.norm(lines, axis=1)[:, None]
        s = ds * np.arange(20.0)[:, None]  # along a grid line nodes would be more than the planes they push
        m = matrix(np.concatenate([s * line + rng.uniform(0, 30, 3) for line in lines]))
        assert np.array_equal(m, m.T)
        least[ds] = np.linalg.eigvalsh(m).min()
    apart = matrix(rng.uniform(0, 40, (300, 3)))
    assert np.linalg.eigvalsh(apart).min() > 1e-4
    assert least[1.0] > 1e-7
    assert least[0.5] > 1e-9
    assert least[0.25] > 0


# --- what a node and a row of them is --------------------------------------------------------------------------------


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_node_is_a_sphere_of_the_point_radius(kernel):
    steps = (np.arange(8) + 0.5) / 8
    places = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3)
    mobility, one, none = UNIT.mobility(TRANSLATION, KERNELS[kernel].points, 1.0), np.arange(1), np.zeros((1, 3))
    own = [np.trace(mobility.block(at(p[None], kernel), none, one, one)) / 3 for p in places]
    assert 1 / (6 * np.pi * np.mean(own)) == pytest.approx(KERNELS[kernel].point_radius, rel=1e-3)


@pytest.mark.parametrize(
    ("kernel", "radius"), [("peskin4", 1.1057), ("roma3", 0.8313), ("bkp6", 1.2817), ("es6", 1.3106)]
)
def test_a_row_of_nodes_is_a_cylinder_of_the_line_radius(kernel, radius):
    """The middle of 257 nodes under a uniform force f a node: slender-body theory of a prolate body, L = 257."""
    count, places = 257, [(p, q, (p + 0.37) % 1) for p in (0.1, 0.35, 0.6, 0.85) for q in (0.05, 0.3, 0.55, 0.8)]
    along, across = [], []
    for place in places:
        r = row(count, 1.0, place)
        mobility, none = UNIT.mobility(TRANSLATION, KERNELS[kernel].points, 1.0), np.zeros((count, 3))
        block = mobility.block(at(r, kernel), none, np.array([count // 2]), np.arange(count)).reshape(3, count, 3)
        along.append(block[0, :, 0].sum())
        across.append(0.5 * (block[1, :, 1].sum() + block[2, :, 2].sum()))
    found = (
        count * np.exp(-(4 * np.pi * np.mean(along) + 1) / 2),
        count * np.exp(-(8 * np.pi * np.mean(across) - 1) / 2),
    )
    assert found == pytest.approx((radius, radius), rel=1e-3)
    assert KERNELS[kernel].line_radius == pytest.approx(radius, rel=1e-3)


def test_a_row_of_torques_is_a_cylinder_of_the_twist_radius():
    count, spins = 257, []
    coupling = TorqueCoupling(np.zeros(count), np.ones(count))
    mobility = UNIT.mobility(coupling, 4, 1.0)
    for place in (np.arange(16) + 0.5) / 16:
        nodes = Nodes(
            *UNIT.stencil(KERNELS["peskin4"], row(count, 1.0, (0.3, place, (3 * place) % 1))),
            np.tile([1.0, 0, 0], (count, 1)),
        )
        block = mobility.block(nodes, np.zeros((count, 4)), np.array([count // 2]), np.arange(count))
        spins.append(block.reshape(4, count, 4)[3, :, 3].sum())
    assert 1 / np.sqrt(4 * np.pi * np.mean(spins)) == pytest.approx(KERNELS["peskin4"].twist_radius, rel=1e-3)


@pytest.mark.parametrize(
    ("count", "along", "across"),
    [(17, 3.687, 4.960), (33, 2.664, 3.824), (65, 2.051, 3.107), (129, 1.659, 2.622), (257, 1.392, 2.274)],
)
def test_a_straight_rod_has_the_drag_of_a_cylinder_that_reaches_further_than_its_nodes(count, along, across):
    """Rods a cell between nodes; of rings of the line radius, 3.1 cells longer along the axis and 2.5 across."""
    places, length = [(0.1, 0.3, 0.7), (0.5, 0.85, 0.2), (0.8, 0.55, 0.45)], count - 1
    found = np.zeros(3)
    for place in places:
        push = np.linalg.solve(matrix(row(count, 1.0, place)), np.tile(np.eye(3), (count, 1)))
        found += np.diag(push.reshape(count, 3, 3).sum(axis=0)) / (len(places) * length)
    assert found[0] == pytest.approx(along, rel=3e-3)
    assert found[1:].mean() == pytest.approx(across, rel=3e-3)
    if count >= 65:
        assert found[0] == pytest.approx(drag(length + 3.1, 1.1057, True) / length, rel=5e-3)
        assert found[1:].mean() == pytest.approx(drag(length + 2.5, 1.1057, False) / length, rel=5e-3)


# --- by FFT ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("extents", [(30, 8, 6), (40, 40, 40), (3, 20, 33), (1, 1, 1)])
@pytest.mark.parametrize("kernel", ["peskin4", "es5"])
def test_convolutions_are_the_pairs(extents, kernel):
    rng, space, n = np.random.default_rng(0), FreeSpace(0.1), 30
    r = rng.uniform(0, 0.1, (n, 3)) * np.array(extents) - 0.7
    axes = rng.standard_normal((n, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    nodes, points = Nodes(*space.stencil(KERNELS[kernel], r), axes), KERNELS[kernel].points
    for coupling in (TRANSLATION, TorqueCoupling(np.zeros(n), np.ones(n))):
        force = rng.standard_normal((n, coupling.components))
        exact = space.mobility(coupling, points, 0.7).matrix(nodes, np.zeros_like(force)) @ force.ravel()
        solve = FreeSolve(0.1, 0.7, coupling.grid_vectors)
        found = coupling.from_grid(axes, solve.velocity(nodes.base, nodes.weights, coupling.to_grid(axes, force)))
        assert np.abs(found - exact.reshape(n, -1)).max() < 1e-12 * np.abs(exact).max()


def test_convolutions_of_nodes_farther_apart_than_the_table_are_exact():
    r = np.array([[0.2, 0.3, 0.4], [REACH + 12.3, 0.7, 5.1], [REACH + 9.8, 2.2, 4.0]])
    nodes, force = at(r), np.array([[1.0, 2.0, -1.0], [0.5, 0.3, 2.0], [-2.0, 1.0, 1.0]])
    found = FreeSolve(1.0, 1.0).velocity(nodes.base, nodes.weights, force)
    differs = np.abs(found.ravel() - matrix(r) @ force.ravel()).max()
    assert differs < 1e-7 * np.abs(found).max()  # of the far pairs


def test_the_same_nodes_again_are_answered_with_the_same_bits_whatever_was_asked_between():
    """Plans and symbols belong to the extents: they do not remember others."""
    rng, solve = np.random.default_rng(2), FreeSolve(1.0, 1.0)
    small, large = at(rng.uniform(0, 9, (8, 3))), at(rng.uniform(0, 25, (8, 3)))
    force = rng.standard_normal((8, 3))
    first = solve.velocity(small.base, small.weights, force)
    solve.velocity(large.base, large.weights, force)
    assert np.array_equal(first, solve.velocity(small.base, small.weights, force))


# --- fields ----------------------------------------------------------------------------------------------------------


def points_as_nodes(window: Lattice, points: int) -> Stencil:
    """Points of a lattice as nodes that are spread over themselves alone."""
    base = np.rint(window.points() / window.spacing).astype(np.int64)
    weights = np.zeros((len(base), 3, points))
    weights[..., 0] = 1.0
    return Stencil(base, weights)


@pytest.mark.parametrize("away", [0.0, 3.0, 15.0])
@pytest.mark.parametrize("torques", [False, True])
def test_fields_are_the_pairs_of_nodes_and_points(away, torques):
    """Velocity and, by torques on the points, half the vorticity; near and beyond the reach of the table."""
    rng, h, n, eta = np.random.default_rng(4), 0.1, 5, 0.7
    window = Lattice([6, 5, 8], h, h * np.array([-3, 2, -1]))
    r = rng.uniform(-0.3, 0.3, (n, 3)) + np.array([away, 0.5 * away, 0])
    axes = rng.standard_normal((n, 3))
    nodes = FreeSpace(h).stencil(KERNELS["bkp6"], r)
    force = rng.standard_normal((n, 6 if torques else 3))
    found = FreeFields(window, eta, None).evaluate(*nodes, force, 0.0, NAMES)
    places = points_as_nodes(window, 6)
    count = len(places.base)
    coupling = TorqueCoupling(np.zeros(1), np.ones(1))
    mobility = FreeSpace(h).mobility(coupling, 6, eta)
    expected = np.zeros((count, 6))
    for axis in range(3):
        spins = np.concatenate([axes, np.tile(np.eye(3)[axis], (count, 1))])
        pushes = np.column_stack([force[:, :3], np.ones(n)]) if torques else np.column_stack([force, np.zeros(n)])
        spins[:n] = force[:, 3:] if torques else 0.0
        both = Nodes(np.concatenate([nodes.base, places.base]), np.concatenate([nodes.weights, places.weights]), spins)
        block = mobility.block(both, np.zeros((n + count, 4)), np.arange(n, n + count), np.arange(n))
        u = (block @ pushes.ravel()).reshape(count, 4)
        expected[:, :3], expected[:, 3 + axis] = u[:, :3], u[:, 3]
    shape = (*window.cells, 3)
    limit = 2e-6 if away < 10 else 2e-5  # fields are of single precision; W of a far pair has its own error
    assert found["velocity"] == pytest.approx(expected[:, :3].reshape(shape), abs=limit * np.abs(expected[:, :3]).max())
    curl = 2 * expected[:, 3:].reshape(shape)
    assert found["vorticity"] == pytest.approx(curl, abs=limit * np.abs(curl).max())


def test_the_pressure_of_a_force_is_its_dipole_and_the_flow_is_added():
    """F.x/(4 pi r^3) far away, whatever eta; and the background's velocity and curl."""
    h, force = 0.1, np.array([[0.4, -0.3, 0.7]])
    window = Lattice([4, 4, 4], h, h * np.array([12, 9, -14]))
    nodes = FreeSpace(h).stencil(KERNELS["bkp6"], np.array([[0.02, 0.03, 0.01]]))

    def flow(r: np.ndarray, time: float) -> np.ndarray:
        return np.stack([time + 0 * r[:, 0], 3.0 * r[:, 0], 0 * r[:, 0]], axis=1)

    found = FreeFields(window, 0.3, flow).evaluate(*nodes, force, 2.0, NAMES)
    x = window.points() - [0.02, 0.03, 0.01]
    expected = x @ force[0] / (4 * np.pi * np.linalg.norm(x, axis=1) ** 3)
    assert found["pressure"].ravel() == pytest.approx(expected, rel=0.02)
    bare = FreeFields(window, 0.3, None).evaluate(*nodes, force, 2.0, NAMES)
    carried = found["velocity"] - bare["velocity"]
    assert carried[..., 0] == pytest.approx(2.0, abs=1e-5)
    assert carried[..., 1].ravel() == pytest.approx(3.0 * window.points()[:, 0], abs=1e-5)
    assert found["vorticity"] - bare["vorticity"] == pytest.approx(
        np.array([0, 0, 3.0] * 64).reshape(4, 4, 4, 3), abs=1e-4
    )
