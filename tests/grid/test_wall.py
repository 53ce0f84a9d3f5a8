"""The image of a force in a no-slip plane: Blake's own form of it, on the plane, as table and in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.grid.free_space import REACH
from ibfil.grid.wall_tables import HIGH, image, images, octant, oseen


def stokeslet(d: np.ndarray) -> np.ndarray:
    """Oseen's tensor (3, 3) at a distance (3,), real or complex."""
    square = d @ d
    return (np.eye(3) / np.sqrt(square) + np.outer(d, d) / square**1.5) / (8 * np.pi)


def blake(x: np.ndarray, source: np.ndarray) -> np.ndarray:
    """The image (field, force) in his form: a Stokeslet, a doublet and a dipole, by derivatives along complex steps.

    Blake 1971, Eq. (6): -S_ij(R) + 2 h D_jk d/dR_k (h R_i/R^3 - d_i3/R - R_i R_3/R^3)/(8 pi), D = diag(1, 1, -1).
    """
    h, distance = source[2], x - source * [1, 1, -1]
    out = -stokeslet(distance)
    for j, sign in enumerate((1.0, 1.0, -1.0)):
        step = np.zeros(3, complex)
        step[j] = 1e-30j
        d = distance + step
        size = np.sqrt(d @ d)
        inner = (h * d / size**3) / (8 * np.pi) - stokeslet(d)[:, 2]
        out[:, j] += 2 * h * sign * inner.imag / 1e-30
    return out


def closed(x: np.ndarray, source: np.ndarray) -> np.ndarray:
    sums = np.zeros(8)
    image(x[0] - source[0], x[1] - source[1], x[2], source[2], 1.0, sums)
    return tensor(sums)


def tensor(sums: np.ndarray) -> np.ndarray:
    xx, yy, zz, xy, zx, zy, xz, yz = sums
    return np.array([[xx, xy, xz], [xy, yy, yz], [zx, zy, zz]])


def tabulated(x: np.ndarray, source: np.ndarray) -> np.ndarray:
    t = images(x[0] - source[0], x[1] - source[1], x[2] + source[2])
    both, apart = x[2] * source[2], source[2] - x[2]
    t2 = np.array([[t[6], t[8], -t[9]], [t[8], t[7], -t[10]], [t[9], t[10], t[6] + t[7]]])
    t1 = np.array([[0, 0, t[4]], [0, 0, t[5]], [t[4], t[5], 0]])
    return np.array([[t[0], t[3], 0], [t[3], t[1], 0], [0, 0, t[2]]]) + apart * t1 + both * t2


def places(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-5, 5, 3) * [1, 1, 0] + [0, 0, rng.uniform(1, 7)], np.array([0.4, -0.3, rng.uniform(1, 7)])


@pytest.mark.parametrize("seed", range(4))
def test_the_tables_and_the_closed_form_are_blakes_image(seed):
    x, source = places(seed)
    expected = blake(x, source)
    assert closed(x, source) == pytest.approx(expected, abs=1e-15)
    assert tabulated(x, source) == pytest.approx(expected, abs=1e-15)
    assert closed(source, x) == pytest.approx(expected.T, abs=1e-15)  # reciprocal


def test_force_and_image_leave_the_plane_at_rest():
    x, source = places(5)
    x[2] = 0.0
    sums = np.zeros(8)
    oseen(*(x - source), 1.0, sums)
    assert tensor(sums) == pytest.approx(stokeslet(x - source), abs=1e-16)
    assert np.abs(tensor(sums) + closed(x, source)).max() < 1e-16
    assert np.abs(closed(x, source)).max() > 1e-3


def test_the_octant_has_them_by_distances_and_heights():
    rim = 3
    table = octant(rim)
    assert table.shape[:2] == (REACH + 2 * rim,) * 2
    assert table.shape[2] > HIGH
    assert np.array_equal(table[rim + 5, rim - 2, 9], images(np.array(5.0), np.array(-2.0), np.array(9.0)))
    assert not table[:, :, :2].any()  # where folded stencils have no weights, and the image is not finite
