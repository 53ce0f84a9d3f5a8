"""Filaments cut at the faces of the periodic box."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from ibfil.analysis.periodic_images import unwrapped, wrapped

ORIGIN, BOX = np.array([-1.5, -1.0, -0.5]), np.array([3.0, 2.0, 1.0])


def test_a_filament_in_the_box_is_left_alone():
    r = np.column_stack([np.linspace(-1, 1, 9), np.zeros(9), np.zeros(9)])
    pieces = wrapped(r, ORIGIN, BOX)
    assert pieces.lengths == [9]
    assert not pieces.image.any()
    assert np.array_equal(pieces.take(r), r)
    assert np.array_equal(unwrapped(9).take(r), r)


def test_a_filament_across_a_face_has_a_point_on_each_side_of_it():
    r = np.column_stack([np.linspace(1, 2, 5), np.full(5, 0.25), np.zeros(5)])  # the face is at x = 1.5, a node
    r[:, 0] += 0.1  # ... and now it lies between two
    pieces = wrapped(r, ORIGIN, BOX)
    shown = pieces.take(r) - pieces.image * BOX
    assert pieces.lengths == [3, 4]
    np.testing.assert_allclose(shown[[2, 3], 0], [1.5, -1.5], atol=1e-12)
    np.testing.assert_allclose(pieces.station[[2, 3]], [1.6, 1.6])
    np.testing.assert_allclose(pieces.take(np.arange(5.0)), pieces.station, atol=1e-12)


@given(hnp.arrays(float, (7, 3), elements=st.floats(-8, 8, width=32)))
def test_all_points_lie_in_the_box_and_the_parts_make_the_whole(r):
    pieces = wrapped(r, ORIGIN, BOX)
    shown = pieces.take(r) - pieces.image * BOX
    assert np.all(shown >= ORIGIN - 1e-9)
    assert np.all(shown <= ORIGIN + BOX + 1e-9)
    ends = np.cumsum(pieces.lengths)
    parts = np.split(shown, ends[:-1])
    length = sum(np.linalg.norm(np.diff(part, axis=0), axis=1).sum() for part in parts)
    np.testing.assert_allclose(length, np.linalg.norm(np.diff(r, axis=0), axis=1).sum(), rtol=1e-9, atol=1e-9)
    nodes = np.isin(np.arange(7.0), pieces.station)
    assert nodes.all()
