"""Stencils: exact for polynomials, at any spacing, at clamps, and never across two filaments."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from ibfil.linalg.finite_differences import clamped_weights, weights
from ibfil.rods.geometry import tangents
from ibfil.rods.mesh import Mesh, Segmented, stack

EPS = np.finfo(float).eps
EVEN = np.linspace(0.0, 2.5, 12)
UNEVEN = 2.5 * np.linspace(0.0, 1.0, 12) ** 1.3
SPACINGS = pytest.mark.parametrize("s", [EVEN, UNEVEN], ids=["even", "uneven"])


def polynomials(degree: int) -> list[Polynomial]:
    """Three polynomials of this degree, the coordinates of a curve."""
    return [Polynomial(c) for c in np.random.default_rng(degree).standard_normal((3, degree + 1))]


def apply(mesh: Mesh, r: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
    """The derivative of r (n, 3) by the mesh's stencils, and the round-off that is to be expected (n,)."""
    w, c = (mesh.w1, mesh.c1) if order == 1 else (mesh.w2, mesh.c2)
    columns = mesh.first[:, None] + np.arange(w.shape[1])
    rounding = 40 * EPS * (np.abs(w).sum(axis=1) * np.abs(r).max() + np.abs(c).max())
    return np.einsum("ik,ikc->ic", w, r[columns]) + c, rounding


def assert_derivative(mesh: Mesh, s: np.ndarray, curve: list[Polynomial], order: int, nodes: slice) -> None:
    r = np.stack([p(s) for p in curve], axis=1)
    exact = np.stack([p.deriv(order)(s) for p in curve], axis=1)
    found, rounding = apply(mesh, r, order)
    assert np.all(np.abs(found - exact)[nodes] <= rounding[nodes, None])


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("count", [3, 4, 7])
def test_weights_are_exact_for_polynomials_through_their_points(count: int, order: int) -> None:
    x = np.sort(np.random.default_rng(count).uniform(-1.0, 1.0, count))
    for degree in range(count):
        p = Polynomial.basis(degree)
        w = weights(x, 0.3, order)
        assert w @ p(x) == pytest.approx(p.deriv(order)(0.3), abs=100 * EPS * np.abs(w).sum())


def test_weights_are_the_textbook_ones_at_even_spacing() -> None:
    x, h = np.array([0.0, 0.5, 1.0]), 0.5
    assert weights(x, 0.0, 1) * h == pytest.approx([-1.5, 2.0, -0.5], abs=1e-14)
    assert weights(x, 0.5, 2) * h**2 == pytest.approx([1.0, -2.0, 1.0], abs=1e-14)
    seven = np.arange(7.0)
    assert weights(seven, 3.0, 1) * 60 == pytest.approx([-1, 9, -45, 0, 45, -9, 1], abs=1e-11)
    assert weights(seven, 3.0, 2) * 180 == pytest.approx([2, -27, 270, -490, 270, -27, 2], abs=1e-10)


@SPACINGS
def test_order_two_is_exact_for_parabolas_and_at_the_ends_r2_for_cubics(s: np.ndarray) -> None:
    mesh = stack([Segmented(s, 2, None, None)])
    for order in (1, 2):
        assert_derivative(mesh, s, polynomials(2), order, slice(None))
    for end in (slice(0, 1), slice(-1, None)):
        assert_derivative(mesh, s, polynomials(3), 2, end)


@SPACINGS
def test_order_six_is_exact_for_the_sixth_degree_at_every_node(s: np.ndarray) -> None:
    mesh = stack([Segmented(s, 6, None, None)])
    for order in (1, 2):
        assert_derivative(mesh, s, polynomials(6), order, slice(None))


@pytest.mark.parametrize(("derivative", "degree"), [(2, 3), (6, 7)])
def test_the_next_degree_is_not_exact(derivative: int, degree: int) -> None:
    """The checks above can fail: a polynomial too high is missed by far more than round-off."""
    mesh = stack([Segmented(UNEVEN, derivative, None, None)])
    r = np.stack([p(UNEVEN) for p in polynomials(degree)], axis=1)
    exact = np.stack([p.deriv(1)(UNEVEN) for p in polynomials(degree)], axis=1)
    found, rounding = apply(mesh, r, 1)
    assert np.abs(found - exact).max() > 1e3 * rounding.max()


def test_clamped_weights_are_the_formula_of_three_nodes_at_even_spacing() -> None:
    ds = 0.2
    w, slope = clamped_weights(ds * np.arange(3.0))
    assert w == pytest.approx(np.array([-7.0, 8.0, -1.0]) / (2 * ds**2), rel=1e-12)
    assert slope == pytest.approx(-6 * ds / (2 * ds**2), rel=1e-12)


@SPACINGS
@pytest.mark.parametrize("derivative", [2, 6])
@pytest.mark.parametrize("end", [0, -1])
def test_at_a_clamp_r1_is_the_tangent_and_r2_exact_for_cubics(s: np.ndarray, derivative: int, end: int) -> None:
    curve = polynomials(3)
    held = np.array([p.deriv()(s[end]) for p in curve])
    mesh = stack([Segmented(s, derivative, held if end == 0 else None, held if end == -1 else None)])
    where = slice(0, 1) if end == 0 else slice(-1, None)
    assert np.all(mesh.w1[end] == 0.0)
    assert np.array_equal(mesh.c1[end], held)
    assert_derivative(mesh, s, curve, 2, where)
    assert np.count_nonzero(mesh.w2[end]) == 3
    assert np.all(np.delete(mesh.c2, end, axis=0) == 0.0)


@SPACINGS
@pytest.mark.parametrize("end", [0, -1])
def test_by_a_ghost_node_r2_at_a_clamp_takes_two_nodes_and_is_exact_for_parabolas(s: np.ndarray, end: int) -> None:
    curve = polynomials(2)
    held = np.array([p.deriv()(s[end]) for p in curve])
    mesh = stack([Segmented(s, 2, held if end == 0 else None, held if end == -1 else None, ghost=True)])
    assert_derivative(mesh, s, curve, 2, slice(0, 1) if end == 0 else slice(-1, None))
    assert np.count_nonzero(mesh.w2[end]) == 2


@SPACINGS
def test_control_volumes_are_half_the_segments_beside_a_node(s: np.ndarray) -> None:
    mesh = stack([Segmented(s, 6, None, None)])
    edges = np.concatenate([[s[0]], 0.5 * (s[1:] + s[:-1]), [s[-1]]])
    assert mesh.volume == pytest.approx(np.diff(edges), rel=1e-13)
    assert mesh.volume.sum() == pytest.approx(s[-1], rel=1e-13)


@pytest.mark.parametrize("order", [(2, 6, 2), (6, 2, 6), (2, 2), (6, 6)], ids=str)
def test_stacked_filaments_do_not_reach_into_one_another(order: tuple[int, ...]) -> None:
    """Each has the stencils it has alone; those of a row never name a node of another filament."""
    tangent = np.array([0.0, 0.6, 0.8])
    parts = [Segmented(UNEVEN[: 8 + k], d, tangent if k == 1 else None, None) for k, d in enumerate(order)]
    mesh = stack(parts)
    ends = np.cumsum([0] + [len(part.s) for part in parts])
    assert np.array_equal(np.nonzero(~mesh.joined)[0], ends[1:] - 1)
    r = np.random.default_rng(0).standard_normal((ends[-1], 3))
    assert np.all(mesh.first >= 0)
    assert np.all(mesh.first + mesh.w1.shape[1] <= ends[-1])
    for part, (low, high) in zip(parts, pairwise(ends), strict=True):
        alone = stack([part])
        columns = mesh.first[low:high, None] + np.arange(mesh.w1.shape[1])
        outside = (columns < low) | (columns >= high)
        assert np.all(mesh.w1[low:high][outside] == 0.0)
        assert np.all(mesh.w2[low:high][outside] == 0.0)
        for k in (1, 2):
            stacked, rounding = apply(mesh, r, k)
            single, _ = apply(alone, r[low:high], k)
            assert np.all(np.abs(stacked[low:high] - single) <= rounding[low:high, None])
        assert np.array_equal(mesh.ds[low : high - 1], np.diff(part.s))
        assert np.array_equal(mesh.volume[low:high], alone.volume)


def test_tangents_are_the_unit_vectors_of_the_stencils() -> None:
    mesh = stack([Segmented(UNEVEN, 6, np.array([0.0, 0.6, 0.8]), None)])
    r = np.stack([UNEVEN, np.sin(UNEVEN), np.cos(2 * UNEVEN)], axis=1)
    slope, _ = apply(mesh, r, 1)
    e3 = tangents(mesh, r)
    assert e3 == pytest.approx(slope / np.linalg.norm(slope, axis=1)[:, None], abs=1e-14)
    assert e3[0] == pytest.approx([0.0, 0.6, 0.8], abs=1e-15)
