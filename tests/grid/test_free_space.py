"""The response of free space to one cell: known numbers, its definition, and what it becomes far away."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.grid import free_space
from ibfil.grid.far_pairs import far_pair
from ibfil.grid.free_space import ODD, PAIRS, response

SMALL = (12, 12, 12)


@pytest.fixture(scope="module")
def whole() -> np.ndarray:
    return response(15, SMALL)


def test_known_numbers(whole):
    """Independent code, to twelve digits; W at the origin is exact."""
    expected = {
        (0, 0, 0, 0): 0.129591891606,
        (0, 1, 0, 0): 0.075749595691,
        (1, 1, 0, 0): 0.045816428484,
        (0, 1, 1, 0): 0.042929974555,
        (3, 1, 1, 0): 0.017982218698,
        (0, 10, 0, 0): 0.007908258579,
        (5, 0, 7, 3): 0.001986908232,
        (7, 0, 1, 0): -0.066301955428,
        (12, 1, 1, 0): 0.027985522750,
        (9, 0, 0, 0): 1 / 6,
    }
    assert {key: whole[key] for key in expected} == pytest.approx(expected, abs=1e-11)


def test_it_does_not_depend_on_how_it_is_found(whole, monkeypatch):
    assert np.abs(response(15, SMALL, 60) - whole).max() < 5e-15
    monkeypatch.setattr(free_space, "_XI", np.pi / 12.6)
    assert np.abs(response(15, SMALL, 60) - whole).max() < 5e-15
    monkeypatch.undo()
    # Of unequal sizes no part is another with its axes exchanged.
    uneven = response(15, (5, 12, 9))
    assert np.abs(uneven - whole[:, :5, :, :9]).max() < 5e-15


def test_it_is_what_its_definition_says():
    """(2 pi)^-3 int over the zone of cos(k.j) (1 - k k/k^2)/k^2, its integrable singularity by polar coordinates.

    Over the pyramid about each axis of the zone the radius goes out and takes k^2 with it.
    """
    node, weight = np.polynomial.legendre.leggauss(48)
    radius, share = 0.5 * (node + 1), 0.5 * weight  # of the way to the face
    j = np.array([2.0, 1.0, 3.0])
    out = np.zeros((3, 3))
    for axis in range(3):
        k = np.empty((48, 48, 48, 3))
        rest = [a for a in range(3) if a != axis]
        k[..., axis] = np.pi * radius[:, None, None]
        k[..., rest[0]] = np.pi * radius[:, None, None] * node[:, None]
        k[..., rest[1]] = np.pi * radius[:, None, None] * node
        square = np.sum(k * k, axis=-1)
        measure = 2 * np.pi**3 * (share * radius**2)[:, None, None] * weight[:, None] * weight / (2 * np.pi) ** 3
        value = measure * np.cos(k @ j) / square
        out += np.eye(3) * value.sum() - np.einsum("abc,abci,abcj->ij", value / square, k, k)
    got = response(6, (4, 4, 4))[:, 2, 1, 3]
    assert got == pytest.approx([out[a, b] for a, b in PAIRS], abs=1e-13)


def test_the_octant_is_even_and_odd(whole):
    octant = free_space.octant(15, 3)
    assert octant.shape[3] == 15
    for part in range(15):
        for axis in range(3):
            sign = -1.0 if axis in ODD[part] else 1.0
            there, here = [4, 5, 6], [4, 5, 6]
            there[axis], here[axis] = 2, 4  # one before and one after zero, which is the fourth
            assert octant[(*there, part)] == sign * octant[(*here, part)]
    assert np.abs(octant[3:12, 3:12, 3:12] - np.moveaxis(whole[:, :9, :9, :9], 0, 3)).max() < 1e-14


def test_far_pairs_are_the_second_order_of_blobs():
    """(1 + V:grad grad/2) of Oseen's tensor and of its half curls, by differences of the tensor itself."""
    rng = np.random.default_rng(3)
    d, v = np.array([3.0, -2.0, 4.0]), rng.uniform(0.3, 0.9, (2, 3))

    def oseen(x: np.ndarray) -> np.ndarray:
        r = np.linalg.norm(x)
        n = x / r
        return np.array([(float(a == b) + n[a] * n[b]) / (8 * np.pi * r) for a, b in PAIRS])

    def rotlet(x: np.ndarray) -> np.ndarray:
        return -x / (8 * np.pi * np.linalg.norm(x) ** 3)

    def second(of, x: np.ndarray, step: float = 0.02) -> np.ndarray:
        out = of(x)
        for a in range(3):
            e = step * np.eye(3)[a]
            bent = (16 * (of(x + e) + of(x - e)) - of(x + 2 * e) - of(x - 2 * e) - 30 * of(x)) / (12 * step**2)
            out = out + 0.5 * (v[0, a] + v[1, a]) * bent
        return out

    sums = np.empty(15)
    far_pair(np.array([d, np.zeros(3)]), v, 0, 1, np.array([2.0, 3.0, 5.0]), sums)
    assert sums[:6] == pytest.approx(2 * second(oseen, d), rel=1e-6)
    assert sums[6:9] == pytest.approx(3 * second(rotlet, d), rel=1e-6)
    n, r = d / np.linalg.norm(d), np.linalg.norm(d)
    assert sums[9:] == pytest.approx([5 * (3 * n[a] * n[b] - (a == b)) / (16 * np.pi * r**3) for a, b in PAIRS])
