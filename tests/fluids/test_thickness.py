"""The couple of a flow across a rod's thickness, on segments that point anywhere; gradients of a flow."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.fluids.velocity_gradient import curl, gradient
from ibfil.fluids.wrapped.thickness import Thickness
from ibfil.linalg import banded

TAU = 0.03
GRADIENT = np.random.default_rng(3).standard_normal((3, 3))


def linear(r: np.ndarray, time: float) -> np.ndarray:
    return r @ GRADIENT.T + [7.0, 0.0, -3.0]


def two_rods() -> tuple[np.ndarray, np.ndarray]:
    """Nodes (9, 3) of a rod of 5 and one of 4, crooked, and kappa eta a^2 (9,) of the segments between."""
    rng = np.random.default_rng(0)
    stiff = rng.uniform(0.5, 2.0, 9)
    stiff[[4, 8]] = 0.0
    return np.cumsum(rng.standard_normal((9, 3)), axis=0), stiff


def by_hand(r: np.ndarray, stiff: np.ndarray, a: np.ndarray, u: np.ndarray) -> np.ndarray:
    """The forces (9, 3), segment by segment."""
    out = np.zeros_like(r)
    for i in np.nonzero(stiff)[0]:
        d = r[i + 1] - r[i]
        length = np.linalg.norm(d)
        across = np.eye(3) - np.outer(d, d) / length**2
        q = -stiff[i] / length * across @ (u[i + 1, :3] - u[i, :3] + a.T @ d)
        out[i + 1] += q
        out[i] -= q
    return out


@pytest.mark.parametrize("m", [3, 4])
def test_it_is_the_formula_and_its_matrix_is_symmetric_and_not_negative(m):
    r, stiff = two_rods()
    u = np.random.default_rng(1).standard_normal((9, m))
    couple = Thickness(stiff, linear, 0.1).at(r, 0.0, TAU)
    expected = by_hand(r, stiff, GRADIENT, u)
    assert couple.from_fluid(u)[:, :3] == pytest.approx(expected, abs=1e-9)
    assert not couple.from_fluid(u)[:, 3:].any()
    assert np.abs(couple.from_fluid(u).sum(axis=0)).max() < 1e-14

    constant, matrix = np.zeros((9, m)), np.zeros((9, m, 5 * m))
    couple.add(constant, matrix)
    assert constant - TAU * banded.multiply(matrix, u) == pytest.approx(couple.from_fluid(u), abs=1e-13)
    whole = banded.dense(matrix).reshape(9 * m, 9 * m)
    assert np.abs(whole - whole.T).max() < 1e-15 * np.abs(whole).max()
    assert np.linalg.eigvalsh(whole).min() > -1e-14 * np.abs(whole).max()


def test_a_rod_that_turns_with_a_rigid_flow_feels_nothing():
    r, stiff = two_rods()
    spin = np.array([0.3, -0.2, 0.9])

    def rigid(r: np.ndarray, time: float) -> np.ndarray:
        return np.cross(spin, r)

    couple = Thickness(stiff, rigid, 0.1).at(r, 0.0)
    assert np.abs(couple.from_fluid(rigid(r, 0.0))).max() < 1e-10
    assert couple.dissipation(rigid(r, 0.0)) < 1e-20


def test_in_a_strain_it_turns_a_rod_the_other_way():
    """Without the line's own drag a straight rod would turn as a disc does: e3' = -(1 - e3 e3) A e3 (Lambda = -1)."""
    along = np.array([np.cos(0.4), np.sin(0.4), 0.0])
    strain = np.diag([-1.0, 1.0, 0.0])
    r, stiff = np.outer(np.arange(4.0), along), np.array([1.0, 1.0, 1.0, 0.0])
    turn = -(np.eye(3) - np.outer(along, along)) @ strain @ along
    couple = Thickness(stiff, lambda r, time: r @ strain, 0.1).at(r, 0.0)
    assert np.abs(couple.from_fluid(np.outer(np.arange(4.0), turn))).max() < 1e-9


def test_gradient_and_curl_of_a_flow():
    r = np.random.default_rng(2).standard_normal((6, 3))
    assert gradient(linear, r, 0.0, 0.1) == pytest.approx(np.broadcast_to(GRADIENT, (6, 3, 3)), abs=1e-10)
    a = GRADIENT
    turning = [a[2, 1] - a[1, 2], a[0, 2] - a[2, 0], a[1, 0] - a[0, 1]]
    assert curl(linear, r, 0.0, 0.1) == pytest.approx(np.broadcast_to(turning, (6, 3)), abs=1e-10)

    def wave(r: np.ndarray, time: float) -> np.ndarray:
        return np.stack([np.sin(3 * r[:, 1]), 0 * r[:, 0], np.cos(2 * r[:, 0] + time)], axis=1)

    here = gradient(wave, r, 0.7, 0.1)
    assert here[:, 0, 1] == pytest.approx(3 * np.cos(3 * r[:, 1]), abs=1e-7)
    assert here[:, 2, 0] == pytest.approx(-2 * np.sin(2 * r[:, 0] + 0.7), abs=1e-7)
