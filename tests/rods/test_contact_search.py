"""Distances of segments against exact answers and a minimiser; the search against all pairs, and what it costs."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.contact_scenes import suspension
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from ibfil.rods.neighbour_search import Segments, closest, search

OPEN = np.zeros(3)


def between(p, p_end, q, q_end, pull=0.0):
    """a, b, distance and gap of the segments between four points."""
    p, p_end, q, q_end = (np.array(x, float) for x in (p, p_end, q, q_end))
    gap = np.empty(3)
    a, b, d = closest(p, p_end - p, q, OPEN, q_end - q, pull, gap)
    assert gap == pytest.approx(p + a * (p_end - p) - q - b * (q_end - q), abs=1e-14)
    assert d == pytest.approx(np.linalg.norm(gap), rel=1e-14)
    return a, b, d, gap


# --- two segments ---------------------------------------------------------------------------------------------------


def test_crossing_segments_are_closest_inside():
    a, b, d, gap = between([-1, 0, 0.3], [3, 0, 0.3], [0, -1, 0], [0, 1, 0])
    assert (a, b, d) == pytest.approx((0.25, 0.5, 0.3), abs=1e-15)
    assert gap == pytest.approx([0, 0, 0.3])


def test_segments_that_meet_are_at_no_distance():
    assert between([0, 0, 0], [2, 2, 0], [2, 0, 0], [0, 2, 0])[:3] == pytest.approx((0.5, 0.5, 0.0), abs=1e-15)


def test_an_end_against_a_side():
    a, b, d, _ = between([0.3, 0.5, 0], [0.3, 2, 0], [0, 0, 0], [1, 0, 0])
    assert (a, b, d) == pytest.approx((0.0, 0.3, 0.5))


def test_an_end_against_an_end():
    assert between([0, 0, 0], [1, 0, 0], [2, 2, 1], [3, 3, 1])[:3] == pytest.approx((1.0, 0.0, np.sqrt(6)))
    assert between([0, 0, 0], [1, 0, 0], [4, 0, 0], [3, 0, 0])[:3] == pytest.approx((1.0, 1.0, 2.0))


def test_parallel_segments_beside_and_behind_each_other():
    assert between([0, 0, 0], [2, 0, 0], [1, 1, 0], [3, 1, 0])[2] == pytest.approx(1.0)
    assert between([0, 0, 0], [2, 0, 0], [3, 1, 0], [1, 1, 0])[2] == pytest.approx(1.0)
    assert between([0, 0, 0], [1, 0, 0], [2, 1, 0], [5, 1, 0])[:3] == pytest.approx((1.0, 0.0, np.sqrt(2)))


def test_points_are_segments_too():
    assert between([0.3, 1, 0], [0.3, 1, 0], [0, 0, 0], [1, 0, 0])[1:3] == pytest.approx((0.3, 1.0))
    assert between([0, 0, 0], [1, 0, 0], [2, 1, 0], [2, 1, 0])[::2][0] == 1.0
    assert between([1, 2, 3], [1, 2, 3], [1, 2, 5], [1, 2, 5])[2] == 2.0


points = st.tuples(*[st.floats(-1, 1)] * 3)


@given(points, points, points, points, st.sampled_from([0.0, 1e-9, 1e-4]), st.booleans())
def test_no_points_of_any_two_segments_are_closer(p, u, q, v, turn, aligned):
    """Against the bounded least-squares problem; nearly parallel segments among them."""
    p, u, q, v = (np.array(x) for x in (p, u, q, v))
    if aligned:
        v = 0.7 * u + turn * v
    a, b, d, _ = between(p, p + u, q, q + v)
    assert 0 <= a <= 1
    assert 0 <= b <= 1
    tries = [(0, 0), (0, 1), (1, 0), (1, 1), (0.5, 0.5)]
    x = lsq_linear(np.column_stack([u, -v]), q - p, (0, 1), method="bvls").x
    tries.append(tuple(np.clip(x, 0, 1)))
    least = min(float(np.linalg.norm(p + s * u - q - t * v)) for s, t in tries)
    assert d <= least + 1e-8


@given(points, points, points, points)
def test_it_does_not_matter_which_is_first_or_where_they_begin(p, u, q, v):
    p, u, q, v = (np.array(x) for x in (p, u, q, v))
    _, _, d, gap = between(p, p + u, q, q + v)
    _, _, same, opposite = between(q, q + v, p, p + u)
    _, _, turned, _ = between(p + u, p, q, q + v)
    assert (same, turned) == pytest.approx((d, d), abs=1e-8)
    assert opposite == pytest.approx(-gap, abs=1e-6) or d < 1e-6


def test_pulled_points_move_smoothly_where_segments_turn_past_parallel():
    """Exact ones jump from end to end."""
    turns = np.linspace(-1e-3, 1e-3, 21)
    ends = [([0, 0, 0], [1, 0, 0], [0.0, -0.5 * t, 0.1], [1, 0.5 * t, 0.1 + t]) for t in turns]
    exact = np.array([between(*e)[0] for e in ends])
    pulled = np.array([between(*e, pull=0.01)[0] for e in ends])
    assert np.max(np.abs(np.diff(exact))) > 0.9
    assert np.max(np.abs(np.diff(pulled))) < 0.01
    assert pulled[10] == pytest.approx(0.5)
    for e in ends:
        assert between(*e, pull=0.01)[2] == pytest.approx(between(*e)[2], rel=0.01)


@pytest.mark.parametrize("where", [0.0, 0.2, 0.5])
def test_pulled_points_of_crossing_segments_are_the_closest_within_the_pull(where):
    """Least is (a - where)^2 + pull (a - 1/2)^2 along the first."""
    a, b, d, _ = between([-where, 0, 0.1], [1 - where, 0, 0.1], [0, -0.5, 0], [0, 0.5, 0], pull=0.01)
    assert (a, b) == pytest.approx(((where + 0.01 / 2) / (1 + 0.01), 0.5), rel=1e-13)
    assert d == pytest.approx(np.hypot(0.1, a - where), rel=1e-13)


# --- the search -----------------------------------------------------------------------------------------------------


def all_pairs(r, segments, box, factor, margin):
    """The same by looking at every pair and every image: distances by i, j and shift."""
    out, gap = {}, np.empty(3)
    p, u = r[segments.first], r[segments.first + 1] - r[segments.first]
    middle, half = p + 0.5 * u, 0.5 * np.linalg.norm(u, axis=1)
    touch = segments.radius[:, None] + segments.radius
    reach = factor * touch + margin
    home = np.zeros((len(p), len(p), 3))
    closed = box > 0
    home[..., closed] = box[closed] * np.round((middle[:, None] - middle)[..., closed] / box[closed])
    for image in np.ndindex(3, 3, 3):
        shift = home + box * (np.array(image) - 1)
        away = np.linalg.norm(middle[:, None] - middle - shift, axis=-1)
        for i, j in zip(*np.nonzero(away < half[:, None] + half + reach), strict=True):
            apart = segments.begin[i] - segments.end[j]
            same = segments.rod[i] == segments.rod[j] and not np.any(shift[i, j])
            _, _, d = closest(p[i], u[i], p[j], shift[i, j], u[j], 0.0, gap)
            if j < i and d < reach[i, j] and not (same and apart < np.pi * touch[i, j]):
                out[i, j, *np.round(shift[i, j], 9)] = d
    return out


@pytest.mark.parametrize("sides", [(0, 0, 0), (1, 1, 1), (1, 0, 0.8), (0.36, 0.55, 0.7)])
@pytest.mark.parametrize(("factor", "margin"), [(1.0, 0.0), (2.0, 0.01)])
def test_the_search_finds_what_looking_at_all_pairs_finds(sides, factor, margin):
    """Open, periodic, along some axes only; down to two cells."""
    box = np.array(sides, float)
    r, segments = suspension(5, 24, 9, 0.8, radius=0.012)
    found = search(segments, r, box, factor, margin)
    expected = all_pairs(r, segments, box, factor, margin)
    got = {(i, j, *np.round(s, 9)): d for i, j, s, d in zip(found.i, found.j, found.shift, found.distance, strict=True)}
    assert len(expected) > 4
    assert len(got) == len(found.i)
    assert got.keys() == expected.keys()
    assert list(got.values()) == pytest.approx([expected[key] for key in got], rel=1e-12)
    p, u = r[segments.first], r[segments.first + 1] - r[segments.first]
    i, j = found.i, found.j
    gap = p[i] + found.a[:, None] * u[i] - p[j] - found.shift - found.b[:, None] * u[j]
    assert found.gap == pytest.approx(gap, abs=1e-14)
    assert np.linalg.norm(found.gap, axis=1) == pytest.approx(found.distance, rel=1e-12)


def test_neighbours_are_left_out_up_to_pi_times_the_distance():
    """A ring all of which is near: segments are found from pi times the distance on, to within a segment."""
    n, radius = 250, 0.3
    angle = 2 * np.pi * np.arange(n) / n
    r = radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    ds = float(np.linalg.norm(r[1] - r[0]))
    k = np.arange(n - 1)
    segments = Segments(k, k * ds, (k + 1) * ds, np.zeros(n - 1, np.int64), np.full(n - 1, 0.05), np.zeros(n - 1))
    found = search(segments, r, OPEN, 10.0, 0.0)  # all of the ring is within ten times 0.1
    apart = (np.abs(found.i - found.j) - 1) * ds
    assert 0.1 * np.pi <= np.min(apart) < 0.1 * np.pi + ds
    assert len(found.i) == sum((i - j - 1) * ds >= 0.1 * np.pi for i in k for j in range(i))


def test_a_rod_longer_than_its_box_meets_its_own_image():
    """Straight along x and a little askew: it comes back past its start after one box, 0.06 away."""
    r = np.column_stack([np.linspace(0, 1.4, 29), np.linspace(0, 0.084, 29), np.zeros(29)])
    k = np.arange(28)
    segments = Segments(k, k * 0.05, (k + 1) * 0.05, np.zeros(28, np.int64), np.full(28, 0.04), np.zeros(28))
    assert search(segments, r, OPEN, 1.0, 0.0).i.size == 0
    found = search(segments, r, np.array([1.0, 1.0, 1.0]), 1.0, 0.0)
    assert found.i.size > 0
    assert np.all(np.abs(found.shift) == [1.0, 0.0, 0.0])
    assert np.min(found.distance) == pytest.approx(0.06 / np.hypot(1, 0.06), rel=1e-3)
    # One box along itself is less than pi times a distance of 0.34; an image is no neighbour for that.
    thick = segments._replace(radius=np.full(28, 0.17))
    found = search(thick, r, np.array([1.0, 1.0, 1.0]), 1.0, 0.0)
    assert np.min(found.distance) == pytest.approx(0.06 / np.hypot(1, 0.06), rel=1e-3)


def test_a_search_costs_as_much_as_there_are_segments():
    """Counts of what is looked at, at one density: as many a segment however many there are; all pairs would be 8 x."""
    looked = []
    for count, side in ((60, 1.0), (480, 2.0)):
        r, segments = suspension(1, count, 11, side)
        looked.append(search(segments, r, np.full(3, side), 1.0, 0.0).looked / len(segments.first))
    assert looked[0] < 100
    assert looked[1] < 1.5 * looked[0]


def test_rods_far_apart_cost_no_more_than_near_ones():
    """Cells are hashed: empty space between them is free."""
    r, segments = suspension(2, 50, 11, 1.0)
    far = r.reshape(50, 11, 3) + 1e6 * np.arange(50)[:, None, None]
    near, apart = (search(segments, x.reshape(-1, 3), OPEN, 1.0, 0.0) for x in (r, far))
    assert apart.looked <= near.looked + 20 * len(segments.first)
    assert np.all(segments.rod[apart.i] == segments.rod[apart.j])


def test_nodes_that_are_not_finite_are_near_nothing():
    r, segments = suspension(3, 10, 9, 0.5)
    r[40] = np.nan
    found = search(segments, r, OPEN, 2.0, 0.0)
    assert np.all(np.isfinite(found.distance))
