"""Where a start shape is put: anchor, direction, align and normal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.shape_scene import ARC, KEY, SPATIAL, X, Y, Z, fault, rod

from ibfil.errors import CaseError
from ibfil.shapes.initial import end_tangents, initial_shape


def test_anchor_stands_at_position() -> None:
    place = np.array([0.3, -0.2, 0.5])
    keys = {"nodes": 40, "position": place.tolist(), "shape": ARC}  # no node at s = L/2
    r, _ = initial_shape(rod(anchor="start", **keys))
    np.testing.assert_allclose(r[0], place, atol=1e-16)
    r, _ = initial_shape(rod(anchor="middle", **keys))
    # The middle of the arc lies (1 - cos 1)/2, its sagitta, to the right of the middle of the chord.
    chord = r[-1] - r[0]
    across = np.cross(chord, Z) / np.linalg.norm(chord)
    sagitta = 0.5 * (1.0 - np.cos(1.0))
    np.testing.assert_allclose(place, 0.5 * (r[0] + r[-1]) + sagitta * across, atol=1e-14)
    r, _ = initial_shape(rod(anchor="centroid", **keys))
    np.testing.assert_allclose((0.5 * (r[1:] + r[:-1])).mean(axis=0), place, atol=1e-15)


def test_align_points_the_chord_or_the_tangent() -> None:
    direction = np.array([1.0, 2.0, 2.0]) / 3.0
    for align, shape in (("chord", ARC), ("axis", ARC), ("tangent", ARC)):
        filament = rod(align=align, direction=direction.tolist(), shape=shape)
        r, _ = initial_shape(filament)
        along = r[-1] - r[0] if align != "tangent" else end_tangents(filament)[0]
        np.testing.assert_allclose(along / np.linalg.norm(along), direction, atol=1e-14)


def test_auto_takes_the_axis_for_relaxed_and_the_tangent_otherwise() -> None:
    bent = rod(curvature=[2, 0], shape={"kind": "relaxed"})
    r, _ = initial_shape(bent)
    np.testing.assert_allclose(r[-1] - r[0], np.sin(1.0) * X, atol=1e-14)
    np.testing.assert_allclose(end_tangents(rod(shape=ARC))[0], X, atol=1e-15)


def test_normal_is_where_e1_points_across_the_axis() -> None:
    normal = np.array([0.2, 1.0, -0.5])
    filament = rod(curvature=[3, 1], twist_rate=-2, shape={"kind": "relaxed"}, normal=normal.tolist(), **SPATIAL)
    _, e1 = initial_shape(filament)
    across = e1[0] - (e1[0] @ X) * X
    np.testing.assert_allclose(across / np.linalg.norm(across), np.array([0, 1, -0.5]) / 1.25**0.5, atol=1e-14)


def test_placing_neither_stretches_nor_mirrors() -> None:
    shape = {"kind": "helix", "radius": 0.1, "pitch": 0.3}
    own, own_e1 = initial_shape(rod(shape=shape, **SPATIAL))
    keys = {"direction": [0.3, -2.0, 1.0], "normal": [1.0, 1.0, 5.0], "position": [3.0, 1.0, 2.0]}
    r, e1 = initial_shape(rod(shape=shape, **keys, **SPATIAL))
    motion = np.linalg.lstsq(own, r - [3.0, 1.0, 2.0], rcond=None)[0]
    np.testing.assert_allclose(motion @ motion.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(motion) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(e1, own_e1 @ motion, atol=1e-12)


def test_an_upright_filament_has_a_normal_and_is_that_along_x_turned() -> None:
    """x -> z, y -> x, z -> y: the first cilium of a user stands, and bends in the x-z plane."""
    keys = {"curvature": [2, 0], "shape": {"kind": "relaxed"}, "anchor": "start", "align": "tangent"}
    lying, lying_e1 = initial_shape(rod(**keys))
    for direction in ([0, 0, 1], [0, "0", "2*1"], [0.0, 0.0, 1.0]):
        upright, e1 = initial_shape(rod(direction=direction, **keys))
        np.testing.assert_allclose(upright, lying[:, [1, 2, 0]], atol=1e-12)
        np.testing.assert_allclose(e1, lying_e1[:, [1, 2, 0]], atol=1e-12)
    assert np.ptp(lying[:, 1]) > 0.5
    down, _ = initial_shape(rod(direction=[0, 0, -1], **keys))
    np.testing.assert_allclose(down[:, 1], 0.0, atol=1e-12)


BOW = {"kind": "expression", "r": ["3 + s*cos(0.4)", "5 + s*sin(0.4)", "2"]}


def test_given_points_stay_where_they_are(tmp_path: Path) -> None:
    """They were centred on the origin and turned along x, and the places of filaments to each other were lost."""
    r, e1 = initial_shape(rod(shape=BOW))
    s = np.linspace(0.0, 1.0, 41)
    given = np.stack((3 + s * np.cos(0.4), 5 + s * np.sin(0.4), 2 + 0 * s), axis=1)
    assert np.array_equal(r, given)
    assert np.all(e1 == Z)
    np.savetxt(tmp_path / "a.csv", given, delimiter=",", fmt="%.17g")
    r, e1 = initial_shape(rod(shape={"kind": "file", "path": "a.csv"}), KEY, tmp_path)
    assert np.array_equal(r, given)
    assert np.all(e1 == Z)


def test_given_points_are_moved_where_a_place_is_given_and_turned_where_a_direction_is() -> None:
    given, _ = initial_shape(rod(shape=BOW))
    moved, _ = initial_shape(rod(shape=BOW, position=[1, 0, 0], anchor="start"))
    np.testing.assert_allclose(moved, given - given[0] + X, atol=1e-14)
    turned, e1 = initial_shape(rod(shape=BOW, direction=[0, 1, 0]))
    np.testing.assert_allclose(turned, given[20] + np.outer(np.linspace(-0.5, 0.5, 41), Y), atol=1e-9)
    assert np.all(e1 == Z)
    both, _ = initial_shape(rod(shape=BOW, direction=[0, 1, 0], position=[0, 0, 0]))
    np.testing.assert_allclose(both, np.outer(np.linspace(-0.5, 0.5, 41), Y), atol=1e-9)


def test_given_points_have_the_normal_that_is_given_or_that_of_the_file(tmp_path: Path) -> None:
    normal = np.array([1.0, 0.0, 1.0])
    r, e1 = initial_shape(rod(shape=BOW, normal=normal.tolist()))
    tangent = np.array([np.cos(0.4), np.sin(0.4), 0.0])
    across = normal - (normal @ tangent) * tangent
    np.testing.assert_allclose(e1, np.tile(across / np.linalg.norm(across), (41, 1)), atol=1e-9)
    np.savetxt(tmp_path / "a.csv", np.hstack((r, e1)), delimiter=",", fmt="%.17g")
    file = {"kind": "file", "path": "a.csv"}
    np.testing.assert_allclose(initial_shape(rod(shape=file), KEY, tmp_path)[1], e1, atol=1e-12)
    np.testing.assert_allclose(initial_shape(rod(shape=file, normal=[0, 0, 1]), KEY, tmp_path)[1], [Z] * 41, atol=1e-9)
    upright = rod(shape={"kind": "expression", "r": [0, 0, "s"]})
    assert np.all(initial_shape(upright)[1] == X)
    along = rod(shape={"kind": "expression", "r": ["s", 0, 0]}, normal=[0, 1, 0]).model_copy(
        update={"normal": (1.0, 0.0, 0.0)}
    )
    assert fault(along).startswith("filament.rod.normal: parallel to the curve at s = 0")


def test_the_plane_of_given_points_is_theirs() -> None:
    """A rod without twisting, bent by kappa2 in the x-z plane that its points lie in, may be pushed within it alone."""
    keys = {"curvature": [0, 2], "normal": [1, 0, 0], "shape": {"kind": "expression", "r": [0, 0, "s"]}}
    rod(**keys, loads={"weight": [1, 0, -1]})
    with pytest.raises(CaseError, match=r"loads\.weight: found what leads out of the plane"):
        rod(**keys, loads={"weight": [0, 1, 0]})


def test_what_cannot_be_placed_is_refused_in_one_line() -> None:
    parallel = rod(direction=[1, 0, 0]).model_copy(update={"normal": (2.0, 0.0, 0.0)})
    assert fault(parallel).startswith("filament.rod.normal: parallel")
    closed = rod(curvature=["2*pi", 0], shape={"kind": "relaxed"})
    assert fault(closed).startswith("filament.rod.align: the ends meet, so the mean tangent is zero")
    flat = rod(shape={"kind": "helix", "curvature": 3.0, "torsion": 0.0}, **SPATIAL)
    assert "align: the axis lies along e1" in fault(flat)
