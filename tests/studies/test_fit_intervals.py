"""Intervals of `ibfil fit` on linear models, whose truth is known: coverage, memory of noise, weak directions."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.studies.fit.intervals import memory, spread, weakest

FRAMES, POINTS = 40, 13
S, T = np.linspace(0, 1, POINTS), np.linspace(0, 2, FRAMES)
MODEL = np.stack(
    [
        np.outer(np.sin(2 * np.pi * T), np.ones(POINTS)),
        np.outer(np.cos(2 * np.pi * T), S),
        np.outer(np.cos(5 * T), S**2),
    ],
    axis=2,
)


def noise(rng, along, remembers):
    """Gaussian noise (frames, points): correlated over ``along`` in s, and by ``remembers`` from frame to frame."""
    root = np.linalg.cholesky(np.exp(-(((S[:, None] - S) / along) ** 2) / 2) + 1e-9 * np.eye(POINTS)) if along else 1.0
    own = rng.normal(size=(FRAMES, POINTS))
    own = own @ root.T if along else own
    for k in range(1, FRAMES):
        own[k] = remembers * own[k - 1] + np.sqrt(1 - remembers**2) * own[k]
    return own


@pytest.mark.parametrize(
    ("along", "remembers", "least", "white"), [(0, 0, 0.92, True), (0.2, 0, 0.9, False), (0.2, 0.5, 0.86, False)]
)
def test_intervals_cover_the_truth_whatever_goes_together(along, remembers, least, white):
    rng, trials = np.random.default_rng(5), 300
    flat = MODEL.reshape(-1, 3)
    solve = np.linalg.pinv(flat)
    inside, independent = np.zeros(3), np.zeros(3)
    for _ in range(trials):
        r = noise(rng, along, remembers)
        off = solve @ r.ravel()
        left = r - MODEL @ off
        bars = spread(list(MODEL), list(left), np.zeros((0, 3)), memory(left))
        inside += np.abs(off) < bars.half
        independent += np.abs(off) < 1.96 * np.sqrt(np.diag(bars.white))
    assert inside.mean() / trials >= least
    assert (independent.mean() / trials > 0.92) == white  # what the blocks are for
    assert inside.mean() / trials <= 0.99


def test_the_memory_of_noise_is_that_of_its_law():
    rng = np.random.default_rng(2)
    x = rng.normal(size=(4000, 5))
    assert memory(x) == 1.0
    for k in range(1, len(x)):
        x[k] += 0.6 * x[k - 1]
    assert memory(x) == pytest.approx(1.6 / 0.4, rel=0.2)  # (1 + q)/(1 - q), cut at 0.05
    assert memory(np.zeros((5, 2))) == 1.0


def test_observables_alone_have_the_intervals_of_their_errors():
    bars = spread([], [], np.array([[2.0]]), 1.0)
    assert bars.half[0] == pytest.approx(1.95996 / 2, rel=1e-5)
    assert bars.blocks == 0


def test_the_weakest_direction_is_found():
    sizes, direction = weakest(np.array([[1.0, -1.0], [1e-3, 1e-3], [0, 0]]))
    np.testing.assert_allclose(direction, [0.5**0.5, 0.5**0.5])
    np.testing.assert_allclose(sizes, [2**0.5, 1e-3 * 2**0.5])
