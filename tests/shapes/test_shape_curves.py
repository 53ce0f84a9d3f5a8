"""Curves against closed forms: the frame equations, formulas, directors."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.shape_scene import ARC, KEY, SPATIAL, X, Z, fault, rod

from ibfil.case.spacing import node_arclength
from ibfil.shapes.curves import _motions, curve_from_formula, integrate_frame, perpendicular
from ibfil.shapes.initial import initial_shape, stretch_warning


def test_frame_equations_are_integrated_to_sixth_order() -> None:
    def strains(s: np.ndarray) -> np.ndarray:
        return np.stack([3.0 * np.sin(5.0 * s), 2.0 + np.cos(7.0 * s), 4.0 * s**2], axis=-1)

    s = np.linspace(0.0, 1.0, 5)
    exact = _motions(strains, s, 256)
    errors = [np.max(np.abs(_motions(strains, s, pieces) - exact)) for pieces in (4, 8, 16)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(6.0, abs=0.1)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(6.0, abs=0.1)


def test_frames_stay_orthonormal_over_many_turns() -> None:
    _, snapshot = integrate_frame(lambda s: np.tile([300.0, 0.0, 400.0], (s.size, 1)), np.linspace(0.0, 1.0, 200))
    np.testing.assert_allclose(
        snapshot.transpose(0, 2, 1) @ snapshot, np.broadcast_to(np.eye(3), (200, 3, 3)), atol=1e-12
    )


def test_formula_of_an_arc_is_that_arc() -> None:
    text = ["sin(2*s)/2", "(1 - cos(2*s))/2", 0]
    r, e1 = initial_shape(rod(shape={"kind": "expression", "r": text}, direction=[1, 0, 0], position=[0, 0, 0]))
    arc, _ = initial_shape(rod(shape=ARC))
    np.testing.assert_allclose(r, arc, atol=1e-10)  # the tangent is a difference quotient
    assert np.all(e1 == Z)


def test_formula_may_run_along_its_own_z_axis() -> None:
    r, e1 = initial_shape(
        rod(shape={"kind": "expression", "r": [0, "s**2/2", "s"]}, direction=[1, 0, 0], normal=[0, 0, 1])
    )
    own = curve_from_formula(lambda s: np.stack((0 * s, s**2 / 2, s), axis=1), np.linspace(0.0, 1.0, 41))
    assert np.all(own.e1 == X)
    # e1 = own x along the lab's z, e3 = own z along x: own y, which is e2, along -y.
    s = np.linspace(0.0, 1.0, 41)
    np.testing.assert_allclose(r - r[20], np.stack((s - 0.5, 0.125 - s**2 / 2, 0 * s), axis=1), atol=1e-9)
    assert np.all(e1 == Z)


def test_formula_gives_the_nodes_also_where_it_stretches_the_rod() -> None:
    filament = rod(shape={"kind": "expression", "r": ["s + s**2/10", 0, 0]}, anchor="start")
    s = node_arclength(filament)
    r, _ = initial_shape(filament)
    np.testing.assert_allclose(r, np.outer(s + s**2 / 10, X), atol=1e-15)
    (line,) = stretch_warning(s, r, KEY)
    assert "by 0.25 % to 19.8 %" in line
    assert stretch_warning(s, 1.009 * np.outer(s, X), KEY) == []
    assert len(stretch_warning(s, 0.989 * np.outer(s, X), KEY)) == 1


def test_frame_of_a_formula_has_no_twist() -> None:
    # A helix with k = sqrt 3, t = 1, tangent x and binormal z at s = 0. Against its own frame, of twist t,
    # the frame without twist turns back by -t s. It is carried from node to node: second order.
    text = ["s/4 + 3/8*sin(2*s)", "sqrt(3)/4*(1 - cos(2*s))", "sqrt(3)/4*s - sqrt(3)/8*sin(2*s)"]
    turned = {"kind": "helix", "curvature": 3**0.5, "torsion": 1.0, "twist": -1}
    errors = []
    for nodes in (41, 81):
        keys = {"nodes": nodes, "length": 2.0, "align": "tangent", "anchor": "start", **SPATIAL}
        r, e1 = initial_shape(rod(shape={"kind": "expression", "r": text}, **keys))
        exact_r, exact_e1 = initial_shape(rod(shape=turned, **keys))
        np.testing.assert_allclose(r, exact_r, atol=1e-9)
        errors.append(np.max(np.abs(e1 - exact_e1)))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_formulas_without_a_tangent_are_refused_in_one_line() -> None:
    def refused(*r: str) -> str:
        return fault(rod(shape={"kind": "expression", "r": list(r)}))

    assert refused("s**2", "0*s", "0*s") == "filament.rod.shape.r: dr/ds vanishes at node 0"
    assert refused("abs(s - 0.51)", "0*s", "0*s").endswith("the tangent reverses between nodes 20 and 21")
    assert refused("s", "log(s)", "0*s").startswith("filament.rod.shape.r.1: not a finite number at s = 0: log(s)")
    overlap = fault(rod(shape={"perturb": ["-min(s, 0.1)", 0, 0]}))
    assert overlap == "filament.rod.shape: nodes 0 and 1 start at the same point"


def test_perpendicular_leaves_the_bits_of_what_is_perpendicular() -> None:
    tangent = np.stack((np.cos(np.arange(9.0)), np.sin(np.arange(9.0)), np.zeros(9)), axis=1)
    assert np.all(perpendicular(np.tile(Z, (9, 1)), tangent) == Z)
    made = perpendicular(np.tile([0.3, 0.4, 0.5], (9, 1)), tangent)
    np.testing.assert_allclose(np.sum(made * tangent, axis=1), 0.0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(made, axis=1), 1.0, atol=1e-15)
    # In the plane of the old e1 and the tangent, on the same side.
    np.testing.assert_allclose(np.sum(np.cross([0.3, 0.4, 0.5], tangent) * made, axis=1), 0.0, atol=1e-15)
    assert np.all(made @ [0.3, 0.4, 0.5] > 0.0)
    assert np.all(np.isnan(perpendicular(X, X)))
