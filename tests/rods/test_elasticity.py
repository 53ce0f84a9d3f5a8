"""Eq. 44: forces that sum to zero for any moment, springs that pull, a stiffness that is the exact Jacobian."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.jacobians import assert_exact_jacobian
from helpers.scenes import NoEnds, bare, slopes

from ibfil.rods.constitutive import Linear, gather
from ibfil.rods.elastic_force import Moment, nodal_force
from ibfil.rods.mesh import Segmented, stack
from ibfil.rods.system import RodSystem
from ibfil.rods.torque_free.mechanics import TorqueFree

S = np.linspace(0.0, 1.0, 15) ** 1.2
TANGENT = np.array([1.0, 0.2, 0.1]) / np.linalg.norm([1.0, 0.2, 0.1])
KINDS = pytest.mark.parametrize("kind", [RodSystem, TorqueFree], ids=["eq44", "torque-free"])


def preferred(s: np.ndarray) -> np.ndarray:
    """kappa1, kappa2, tau0 (n, 3), none of them zero or constant."""
    return np.stack([np.sin(7 * s), 0.4 + s, 0.5 + np.cos(3 * s)], axis=1)


def pair(clamped: bool, derivative: int, s: np.ndarray = S) -> list[Segmented]:
    """Two rods: clamped ones at opposite ends, or free ones."""
    held = TANGENT if clamped else None
    return [Segmented(s, derivative, held, None), Segmented(s, derivative, None, held)]


def wild(n: int, seed: int = 0) -> np.ndarray:
    """Two curves of n nodes in all three dimensions, unevenly stretched and noisy, (2 n, 3)."""
    s = np.linspace(0.0, 1.0, n) ** 1.2
    one = np.stack([s, 0.2 * np.sin(3 * s), 0.3 * np.cos(4 * s)], axis=1)
    two = np.stack([s, 0.2 * np.sin(3 * s), 1 + 0.3 * np.cos(2 * s)], axis=1)
    return np.concatenate([one, two]) + 1e-3 * np.random.default_rng(seed).standard_normal((2 * n, 3))


def directors(n: int, seed: int = 0) -> np.ndarray:
    """Directors that turn along the rods, (n, 3), still to be made normal to them."""
    rng = np.random.default_rng(seed)
    return np.tile([0.1, 1.0, 0.3], (n, 1)) + 0.3 * rng.standard_normal((n, 3))


# Eq. 44 itself


@pytest.mark.parametrize("derivative", [2, 6])
@pytest.mark.parametrize("clamped", [False, True], ids=["free", "clamped"])
@pytest.mark.parametrize("seed", range(3))
def test_the_forces_sum_to_zero_for_any_moment_and_any_shape(derivative: int, clamped: bool, seed: int) -> None:
    """Random numbers for moments, at the ends too; each filament by itself."""
    rods = bare(pair(clamped, derivative))
    rng, n = np.random.default_rng(seed), 2 * len(S)
    shape = rods.start(wild(len(S), seed), directors(n, seed))
    twist = np.where(rods.mesh.joined, rng.standard_normal(n), 0.0)
    moment = Moment(rng.standard_normal((n, 2)), np.zeros((n, 2, 2)), twist, np.zeros(n))
    force = np.zeros((n, 3))
    nodal_force(rods.mesh, shape, moment, np.full(n, 1e4), force)
    for filament in (force[: len(S)], force[len(S) :]):
        assert np.abs(filament.sum(axis=0)).max() < 1e-15 * np.abs(filament).sum()


@KINDS
@pytest.mark.parametrize("nodes", [9, 17])
@pytest.mark.parametrize("stretch", [1.03, 0.97])
def test_a_stretched_rod_pulls_its_ends_in_by_the_stiffness_times_the_strain(
    kind: type[RodSystem], nodes: int, stretch: float
) -> None:
    """Eq. 20, corrected: the spring force is EA (|d|/ds - 1) along d, at every spacing."""
    rods = bare([Segmented(np.linspace(0.0, 2.0, nodes), 6, None, None)], kind=kind, stretching=80.0)
    r = np.zeros((nodes, 3))
    r[:, 0] = stretch * np.linspace(0.0, 2.0, nodes)
    force, _ = rods.forces(rods.start(r, np.tile([0.0, 1.0, 0.0], (nodes, 1))), 0.0)
    pull = 80.0 * (stretch - 1)
    expected = np.zeros((nodes, 4))
    expected[0, 0], expected[-1, 0] = pull, -pull
    assert np.abs(force - expected).max() < 1e-11


@KINDS
@pytest.mark.parametrize("derivative", [2, 6])
def test_a_rod_in_pure_bending_bears_no_force(kind: type[RodSystem], derivative: int) -> None:
    """On an arc of curvature k, Q' = A k^2 e3 along the rod; P = A k^2 in the tension takes it away."""
    left = []
    for nodes in (17, 33, 65):
        s = np.linspace(0.0, 1.0, nodes)
        k = 3.0
        r = np.stack([np.sin(k * s) / k, (1 - np.cos(k * s)) / k, np.zeros(nodes)], axis=1)
        rods = bare([Segmented(s, derivative, None, None)], kind=kind)
        force, _ = rods.forces(rods.start(r, np.tile([0.0, 0.0, 1.0], (nodes, 1))), 0.0)
        through = np.cumsum(force[:, :3], axis=0)[nodes // 8 : -(nodes // 8)]
        left.append(float(np.abs(through).max()))
    assert slopes(left) == pytest.approx([2.0, 2.0], abs=0.1)
    assert left[-1] < 0.01 * k**2


@KINDS
@pytest.mark.parametrize("clamped", [False, True], ids=["free", "clamped"])
def test_moments_and_twist_sources_vanish_at_free_ends_and_only_there(kind: type[RodSystem], clamped: bool) -> None:
    rods = bare(pair(clamped, 6), kind=kind, strains=preferred)
    shape = rods.start(wild(len(S)), directors(2 * len(S)))
    moment = rods.moment(shape, 0.0)
    bent = np.abs(moment.bend).max(axis=1) > 0
    expected = np.ones(2 * len(S), bool)
    expected[[0, len(S) - 1, len(S), -1]] = False
    if clamped:
        expected[[0, -1]] = True
    assert np.array_equal(bent, expected)
    assert np.array_equal(np.abs(moment.bend_slope).max(axis=(1, 2)) > 0, expected)


@KINDS
def test_moving_one_filament_leaves_the_force_on_another_as_it_is(kind: type[RodSystem]) -> None:
    rods = bare(pair(True, 6), kind=kind, strains=preferred)
    n = len(S)
    r, e1 = wild(n), directors(2 * n)
    before, _ = rods.forces(rods.start(r, e1), 0.0)
    r[n:] += 0.05 * np.random.default_rng(5).standard_normal((n, 3))
    after, _ = rods.forces(rods.start(r, e1), 0.0)
    assert np.array_equal(before[:n], after[:n])
    assert not np.allclose(before[n:], after[n:])


# The stiffness


@KINDS
@pytest.mark.parametrize("m", [3, 4], ids=["no twist", "twist"])
@pytest.mark.parametrize("derivative", [2, 6])
@pytest.mark.parametrize("clamped", [False, True], ids=["free", "clamped"])
@pytest.mark.parametrize("displaced", [False, True], ids=["at the start", "displaced"])
def test_the_stiffness_is_the_jacobian_of_the_forces(
    kind: type[RodSystem], m: int, derivative: int, clamped: bool, displaced: bool
) -> None:
    """In 3-D, A1 != A2, twisted, stretched, uneven spacing, preferred strains.

    Displaced, tangents have turned by half a radian since the step began and carried the frame along: what
    that turns it about the tangent (its holonomy) is part of the derivative.
    """
    rods = bare(pair(clamped, derivative), kind=kind, unknowns=m, strains=preferred)
    n = 2 * len(S)
    start = rods.start(wild(len(S)), directors(n))
    y = np.zeros((n, m))
    if displaced:
        along = start.r[:, :1]
        y[:, :3] = 0.15 * np.concatenate([np.sin(4 * along), np.cos(5 * along), np.sin(3 * along)], axis=1)
        y[:, 3:] = 0.7 * np.cos(3 * along)
        assert np.arccos(np.sum(rods.move(start, y).e3 * start.e3, axis=1)).max() > 0.5
    assert_exact_jacobian(rods, start, y)


@KINDS
@pytest.mark.parametrize("clamped", [False, True], ids=["free", "clamped"])
def test_follower_forces_take_part_in_the_jacobian(kind: type[RodSystem], clamped: bool) -> None:
    n = len(S)
    rods = bare(pair(clamped, 6), kind=kind, strains=preferred, followers={0: 20.0, n - 1: -30.0, n: 7.0})
    start = rods.start(wild(n), directors(2 * n))
    y = np.zeros((2 * n, 4))
    y[:, 1] = 0.1 * np.sin(4 * start.r[:, 0])
    assert_exact_jacobian(rods, start, y)


def test_without_twist_the_stiffness_is_the_same_block() -> None:
    three, four = (bare(pair(True, 6), unknowns=m, torsion=0.0, strains=preferred) for m in (3, 4))
    start = four.start(wild(len(S)), directors(2 * len(S)))
    matrices = []
    for rods in (three, four):
        _, moment = rods.forces(start, 0.0)
        matrices.append(rods.stiffness(start, start, moment, 0.0).dense())
    assert np.abs(matrices[0] - matrices[1][:, :3, :, :3]).max() < 1e-12 * np.abs(matrices[0]).max()


@KINDS
@pytest.mark.parametrize("m", [3, 4])
def test_the_definite_stiffness_leaves_out_the_compression_and_nothing_else(kind: type[RodSystem], m: int) -> None:
    """The difference of the two matrices is F'3/ds 1 on the segments where F'3 < 0."""
    rods = bare(pair(True, 6), kind=kind, unknowns=m, strains=preferred)
    shape = rods.start(wild(len(S)), directors(2 * len(S)))
    _, moment = rods.forces(shape, 0.0)
    exact, definite = (of(shape, shape, moment, 0.0).dense() for of in (rods.stiffness, rods.definite_stiffness))
    mesh, p = rods.mesh, np.sum(moment.bend * shape.bend, axis=1)
    expected = np.zeros_like(exact)
    seen = set()
    for i in np.nonzero(mesh.joined)[0]:
        f = rods.stretching[i] * (1 - mesh.ds[i] / shape.length[i]) - 0.5 * (p[i] + p[i + 1])
        seen.add(bool(f < 0))
        for c in range(3):
            b = min(f, 0.0) / mesh.ds[i]
            expected[i, c, i, c] -= b
            expected[i, c, i + 1, c] += b
            expected[i + 1, c, i + 1, c] -= b
            expected[i + 1, c, i, c] += b
    assert seen == {True, False}
    assert np.abs((exact - definite) - expected).max() < 1e-12 * np.abs(exact).max()


# The linear law, Eq. 9


def test_the_linear_law_is_the_modulus_times_the_excess_strain() -> None:
    n = 6
    rng = np.random.default_rng(0)
    bending, torsion = rng.uniform(1, 2, (n, 2)), rng.uniform(1, 2, n)
    k, rate = rng.standard_normal((2, n)), rng.standard_normal(n)
    law = Linear(bending, torsion, (lambda t: t * k[0], lambda t: k[1]), lambda t: t * rate)
    bend, twist, t = rng.standard_normal((n, 2)), rng.standard_normal(n), 3.0
    moment, slope = law.bending(bend, t)
    assert moment[:, 0] == pytest.approx(bending[:, 0] * (bend[:, 0] - t * k[0]), rel=1e-14)
    assert moment[:, 1] == pytest.approx(bending[:, 1] * (bend[:, 1] - k[1]), rel=1e-14)
    assert np.array_equal(slope, np.einsum("ia,ab->iab", bending, np.eye(2)))
    moment3, slope3 = law.twisting(twist, t)
    half = t * 0.5 * (rate[1:] + rate[:-1])
    assert moment3[:-1] == pytest.approx(torsion[:-1] * (twist[:-1] - half), rel=1e-13)
    assert np.array_equal(slope3, torsion)


def test_zeroing_the_ends_of_what_a_law_returns_leaves_the_law_as_it_was() -> None:
    """Mechanics puts zeros at free ends into the law's own arrays, step after step."""
    rods = bare([Segmented(S, 6, None, None)], strains=preferred)
    shape = rods.start(wild(len(S))[: len(S)], directors(len(S)))
    first, _ = rods.forces(shape, 0.0)
    again, _ = rods.forces(shape, 0.0)
    assert np.array_equal(first, again)
    assert isinstance(rods.ends, NoEnds)


def test_a_field_is_gathered_from_one_function_a_filament() -> None:
    s = np.linspace(0.0, 1.0, 5)
    parts = [(slice(0, 5), lambda s, t: s + t, s), (slice(5, 10), lambda s, t: s * t, s)]
    assert np.array_equal(gather(parts, (10,))(2.0), np.concatenate([s + 2, s * 2]))
    assert np.array_equal(gather(parts[:1], (5,))(2.0), s + 2)


def test_a_field_is_right_at_a_time_after_another_one_had_no_value() -> None:
    def refused(s, t):
        if t > 1:
            raise ValueError("none")
        return s * t

    s = np.linspace(0, 1, 5)
    values = gather([(slice(0, 5), lambda s, t: s + t, s), (slice(5, 10), refused, s)], (10,))
    before = values(1.0).copy()
    with pytest.raises(ValueError, match="none"):
        values(2.0)
    assert np.array_equal(values(1.0), before)


def test_a_stack_of_even_rods_has_the_spring_constants_of_each() -> None:
    """Rest lengths come from each filament's own spacing."""
    short, long = np.linspace(0, 1, 9), np.linspace(0, 4, 9)
    mesh = stack([Segmented(short, 6, None, None), Segmented(long, 2, None, None)])
    assert mesh.ds[:8] == pytest.approx(np.full(8, 0.125), rel=1e-14)
    assert mesh.ds[9:17] == pytest.approx(np.full(8, 0.5), rel=1e-14)
