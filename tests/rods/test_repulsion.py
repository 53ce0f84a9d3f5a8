"""Repulsion: the force between segments against its formula and its energy, and runs that it keeps apart."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.contact_scenes import GRID, case, crossed, ran, suspension

from ibfil.errors import RunFailed
from ibfil.rods import repulsion as rods_repulsion
from ibfil.rods.contact import ContactRepels
from ibfil.rods.neighbour_search import Segments
from ibfil.rods.repulsion import farthest
from ibfil.simulation.simulation import Simulation


def cross(ds: float, gap: float, distance: float = 1.0, offset: float = 0.0) -> tuple[ContactRepels, np.ndarray]:
    """Two straight rods at right angles ``gap`` apart, long as seen from where they cross, and their contact."""
    half = int(np.ceil(6 * distance / ds))
    s = ds * (np.arange(-half, half + 1) + offset)
    zero, k = 0 * s, np.arange(2 * half)
    r = np.concatenate([np.column_stack([s, zero, zero + gap]), np.column_stack([zero, s, zero])])
    begin, first = np.tile(s[:-1], 2), np.concatenate([k, k + len(s)])
    segments = Segments(
        first, begin, begin + ds, np.repeat([0, 1], len(k)), np.full(2 * len(k), distance / 2), np.zeros(2 * len(k))
    )
    return ContactRepels(segments, ["one", "other"], [0, len(s)], np.zeros(3), 3.0), r


def repulsion(contact: ContactRepels, r: np.ndarray) -> np.ndarray:
    """The forces (n, 3)."""
    (load,) = contact.loads()
    force = np.zeros_like(r)
    load.add_force(Shape(r), 0.0, force)
    return force


class Shape:
    """What a repulsion asks of a configuration."""

    def __init__(self, r: np.ndarray) -> None:
        self.r = r


@pytest.mark.parametrize(("gap", "expected"), [(1.0, 1.0), (0.5, 1.5), (1.9, 0.1), (2.0, 0.0), (2.5, 0.0)])
def test_two_segments_repel_by_the_formula(gap, expected):
    """Long segments that cross in their middles: one pair. F at contact, nothing at twice its distance."""
    contact, r = cross(10.0, gap, offset=0.5)
    force = repulsion(contact, r)
    count = len(r) // 2
    assert force[:count].sum(axis=0) == pytest.approx([0, 0, 3.0 * expected], abs=1e-12)
    assert np.count_nonzero(force[:, 2]) == (4 if expected else 0)
    loaded = force[force[:, 2] > 0]
    assert loaded == pytest.approx(np.tile(force[:count].sum(axis=0) / 2, (len(loaded), 1)))  # the lever rule


def test_fine_rods_that_cross_and_touch_repel_with_the_strength_whatever_their_nodes():
    """The error is first order in the spacing: closest points of segments for points of rods."""
    errors = []
    for ds in (0.2, 0.1, 0.05):
        contact, r = cross(ds, 1.0, offset=0.3)
        errors.append(repulsion(contact, r)[: len(r) // 2, 2].sum() / 3.0 - 1.0)
    assert errors[-1] < 0.06
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([1, 1], abs=0.1)


@pytest.mark.parametrize("ds", [0.1, 0.5, 1.0, 1.77, 3.0, 10.0])
def test_rods_of_any_spacing_repel_with_one_to_some_four_times_the_strength(ds):
    for offset in (0.0, 0.2, 0.5):
        contact, r = cross(ds, 1.0, offset=offset)
        assert 0.99 < repulsion(contact, r)[: len(r) // 2, 2].sum() / 3.0 < 4.2


@pytest.mark.parametrize("box", [0.0, 1.0])
def test_repulsion_adds_no_force_and_no_torque(box):
    """In a box the torque is about each pair's own image, so it is looked at without."""
    r, segments = suspension(7, 40, 9, 0.8)
    contact = ContactRepels(segments, [], [], np.full(3, box), 2.0)
    force = repulsion(contact, r)
    scale = np.abs(force).sum()
    assert np.count_nonzero(force[:, 0]) > 50
    assert np.abs(force.sum(axis=0)).max() < 1e-14 * scale
    if not box:
        assert np.abs(np.cross(r, force).sum(axis=0)).max() < 1e-14 * scale * np.abs(r).max()


def test_repulsion_is_what_its_energy_gives_up():
    """f = -grad of F (2 D - d)^2/(2 D), for one pair that crosses inside; within what the pull costs."""
    contact, r = cross(10.0, 0.7, offset=0.4)
    force, step = repulsion(contact, r), 1e-5

    def energy(r: np.ndarray) -> float:
        d = contact.near(r, 2.0).distance
        return float(np.sum(3.0 * (2.0 - d) ** 2 / 2.0))

    for node, c in zip(*np.nonzero(np.abs(force) > 1e-9), strict=True):
        ahead, behind = r.copy(), r.copy()
        ahead[node, c] += step
        behind[node, c] -= step
        expected = (energy(behind) - energy(ahead)) / (2 * step)
        assert force[node, c] == pytest.approx(expected, abs=0.02 * np.abs(force).max())


def test_rods_laid_through_each_other_have_no_direction_to_part_in():
    contact, r = cross(10.0, 0.0, offset=0.5)
    assert np.all(repulsion(contact, r) == 0.0)


# Two segments each, so that closest points are inside both, inside one, at ends of both; the last through a face.
MEETINGS = {
    "crossed": ([[0, 0, 0], [1, 0.1, 0.05]], [[0.45, -0.5, 0.12], [0.5, 0.6, 0.1]], None),
    "end on side": ([[0, 0, 0], [1, 0.1, 0.05]], [[0.45, 0.16, 0.1], [0.5, 0.9, 0.3]], None),
    "side on end": ([[0.45, 0.16, 0.1], [0.5, 0.9, 0.3]], [[0, 0, 0], [1, 0.1, 0.05]], None),
    "end on end": ([[0, 0, 0], [1, 0.1, 0.05]], [[1.1, 0.2, 0.1], [1.9, 0.5, 0.3]], None),
    "side by side": ([[0, 0, 0], [1, 0.1, 0.05]], [[0.1, 0.15, 0.03], [1.05, 0.22, 0.1]], None),
    "through a face": ([[0, 0, 0], [1, 0.1, 0.05]], [[0.45, 3.5, 0.12], [0.5, 4.6, 0.1]], [4.0, 4.0, 4.0]),
}


@pytest.mark.parametrize("definite", [False, True])
@pytest.mark.parametrize("name", MEETINGS)
def test_the_stiffness_of_repulsion_is_the_derivative_of_its_force(name, definite):
    """Central differences with h = 1e-6 err by some 1e-9 of the largest entry. ``definite``: it draws back only."""
    one, other, box = MEETINGS[name]
    r = np.array([*one, *other], float)
    segments = Segments(np.array([0, 2]), np.zeros(2), np.array([1.0, 0.9]), np.arange(2), np.full(2, 0.1), np.zeros(2))
    sides = np.zeros(3) if box is None else np.array(box)
    asked = np.array([0]), np.array([1]), sides, 3.0

    def force(r: np.ndarray) -> np.ndarray:
        out = np.zeros((4, 3))
        rods_repulsion.repel(segments, r, *asked, out)
        return out

    blocks = np.empty((1, 4, 4, 3, 3))
    rods_repulsion.repel_stiffness(segments, r, *asked, definite, blocks)
    exact, numerical, h = blocks[0].transpose(0, 2, 1, 3), np.zeros((4, 3, 4, 3)), 1e-6
    assert np.abs(force(r)).max() > 0.1
    if definite:
        full = exact.reshape(12, 12)
        assert full == pytest.approx(full.T, abs=1e-13)
        assert np.linalg.eigvalsh(full).max() < 1e-12
        assert np.linalg.eigvalsh(full).min() < -10
        return
    for j, c in np.ndindex(4, 3):
        ahead, behind = r.copy(), r.copy()
        ahead[j, c] += h
        behind[j, c] -= h
        numerical[:, :, j, c] = (force(ahead) - force(behind)) / (2 * h)
    assert np.abs(exact - numerical).max() < 1e-7 * np.abs(numerical).max()
    assert np.abs(exact.sum(axis=2)).max() < 1e-12 * np.abs(exact).max()  # moved as one, nothing changes


def test_newton_squares_its_error_on_rods_that_repel():
    """Two rods pressed together, F/d as large as the rest: four iterations to 1e-8; half the stiffness took nine."""
    scene = case(crossed(0.03, 1.2), {"action": "repel", "distance": 0.02, "strength": 20.0}, step=0.01, end=0.1)
    simulation, most = Simulation(scene), []
    simulation.advance(0.1, lambda: most.append(simulation.snapshot().diagnostics["newton_iterations"]))
    assert max(most) <= 4


def test_rods_pressed_together_rest_where_the_repulsion_carries_the_load():
    """A weight of 1.2 on each of two rods, F = 2, segments so long that one pair meets: d = D (2 - 1.2/2)."""
    scene = case(
        crossed(0.2, 1.2), {"action": "repel", "distance": 0.02, "strength": 2.0}, end=8.0, every=8.0, step=0.05
    )
    result, _ = ran(scene)
    upper, lower = (rod.position for rod in result.snapshot.filaments.values())
    assert np.mean(upper[5:7, 2]) - np.mean(lower[5:7, 2]) == pytest.approx(1.4 * 0.02, rel=1e-5)
    assert result.snapshot.diagnostics["contacts"] == 0
    assert np.abs(result.snapshot.filaments["upper"].velocity).max() < 1e-4


@pytest.mark.parametrize("scheme", ["implicit", "semi-implicit"])
@pytest.mark.parametrize("strength", [2.0, 50.0])
@pytest.mark.parametrize("askew", [0.0, 0.02])
def test_rods_side_by_side_do_not_pass_through_each_other(scheme, strength, askew):
    """Nearly parallel, where closest points jump from end to end; the weights would take each past the other by 0.4."""
    upper = {"direction": [1, askew, 0], "position": [0, 0.005, 0.05], "loads": {"weight": [0, 0, -4.0]}}
    lower = {"direction": [1, 0, askew], "position": [0.1, 0, -0.05], "loads": {"weight": [0, 0, 4.0]}}
    contact = {"action": "repel", "distance": 0.04, "strength": strength}
    simulation = Simulation(case({"upper": upper, "lower": lower}, contact, scheme=scheme))
    nearest = []

    def look() -> None:
        pairs = simulation.rods.contact.near(simulation.configuration.r, 3.0)
        nearest.append(pairs.distance.min(initial=1.0))
        assert np.min(pairs.gap[:, 2] * (pairs.i - pairs.j), initial=0.0) <= 0.0  # the lower one comes second

    simulation.advance(0.25, look)
    assert min(nearest) > 0.5 * 0.04
    assert (
        simulation.configuration.r[simulation.nodes("upper"), 2].mean()
        > simulation.configuration.r[simulation.nodes("lower"), 2].mean()
    )


def test_rods_do_not_pass_through_each_other_in_one_long_step():
    """The step would take each past the other: it is halved until it does not, and the rods end as they began."""
    contact = {"action": "repel", "distance": 0.05, "strength": 40.0}
    scene = case(crossed(0.12, 4 * np.pi), contact, step=0.2, end=0.4, every=0.4)
    result, _ = ran(scene)
    upper, lower = (rod.position[:, 2] for rod in result.snapshot.filaments.values())
    assert np.min(upper[5:7]) > np.max(lower[5:7])
    assert result.snapshot.diagnostics["steps_shortened"] > 0


def test_a_load_that_would_press_rods_through_each_other_fails_the_run():
    with pytest.raises(RunFailed, match="pressed through") as failure:
        ran(case(crossed(0.2, 10.0), {"action": "repel", "distance": 0.05, "strength": 0.1}, min_step=1e-6))
    assert failure.value.filament in ("upper", "lower")
    assert failure.value.node in (5, 6)
    assert "contact.strength" in str(failure.value)


def test_rods_repel_in_a_grid_fluid_too():
    """The stiffness that couples them is in the matrix of every fluid."""
    contact = {"action": "repel", "distance": 0.05, "strength": 20.0}
    scene = case(crossed(0.12, 4.0), contact, GRID, step=0.01, end=0.3, every=0.3)
    result, _ = ran(scene)
    upper, lower = (rod.position[5:7, 2] for rod in result.snapshot.filaments.values())
    assert np.mean(upper) - np.mean(lower) > 0.05
    scale = np.abs(result.snapshot.filaments["upper"].force).sum()
    assert np.abs(result.snapshot.diagnostics["net_force"]).max() < 1e-6 * scale


@pytest.mark.parametrize("fluid", [{}, {**GRID, "method": "krylov"}], ids=["rft", "krylov"])
def test_a_run_that_goes_on_repels_as_one_that_was_not_cut(fluid):
    """To the last bit: pairs are looked for where the first run looked for them, and so factored in the same order."""
    contact = {"action": "repel", "distance": 0.05, "strength": 20.0}
    rods = {**crossed(0.12, 4.0), "third": {"direction": [1, 0.3, 0.1], "position": [0, 0.1, 0.2]}}
    rods["third"]["loads"] = {"weight": [0, 0, -3.0]}
    scene = case(rods, contact, fluid, step=0.01, end=0.3)
    one, other = Simulation(scene), Simulation(scene)
    one.advance(0.15, lambda: None)
    (load,) = one.rods.contact.loads()
    assert farthest(load.near, one.configuration.r) > 0  # not where it looked for pairs
    other.restore(one.state())
    for simulation in (one, other):
        simulation.advance(0.25, lambda: None)
    assert np.array_equal(one.configuration.table, other.configuration.table)
