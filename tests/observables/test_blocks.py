"""Standard errors from blocks, against series whose error is known."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.observables.blocks import means_of_blocks, rates_of_blocks, standard_error
from ibfil.observables.time_series import mean


def remembered(memory: float, outputs: int, seed: int) -> np.ndarray:
    """A Gaussian series of variance one that keeps ``memory`` of itself from output to output."""
    noise = np.random.default_rng(seed).standard_normal(outputs)
    out = np.empty(outputs)
    out[0] = noise[0]
    for k in range(1, outputs):
        out[k] = memory * out[k - 1] + np.sqrt(1 - memory**2) * noise[k]
    return out


@pytest.mark.parametrize("memory", [0.0, 0.8, 0.97])
def test_the_error_is_that_of_a_correlated_series(memory):
    """sqrt((1 + m)/(1 - m)/N); the mean over 30 series, each by itself within a third for most."""
    outputs, times = 8000, np.arange(8000.0)
    found, settled = [], 0
    for seed in range(30):
        values = remembered(memory, outputs, seed)
        error = standard_error(means_of_blocks(times, values), outputs, 0.0, times[-1])
        settled += error.settled
        found.append(float(error.value))
    assert settled >= 27  # at 0.97 blocks that are long enough are few, and now and then too few to be sure
    expected = np.sqrt((1 + memory) / (1 - memory) / outputs)
    assert np.mean(found) == pytest.approx(expected, rel=0.08)
    assert np.mean(np.abs(np.array(found) / expected - 1) < 0.33) > 0.85


def test_a_series_that_remembers_as_long_as_the_run_is_doubtful():
    times = np.arange(300.0)
    error = standard_error(means_of_blocks(times, remembered(0.998, 300, 1)), 300, 0.0, 299.0)
    assert not error.settled


def test_too_few_outputs_have_no_error():
    times = np.arange(8.0)
    assert standard_error(means_of_blocks(times, times), 8, 0.0, 7.0) is None


def test_means_of_blocks_are_those_of_the_broken_line_between_uneven_outputs():
    random = np.random.default_rng(2)
    times = np.sort(random.random(50))
    values, edges = random.random((50, 3)), np.linspace(times[0], times[-1], 8)
    found = means_of_blocks(times, values)(edges)
    for k in range(7):
        assert found[k] == pytest.approx(mean(times, values, edges[k], edges[k + 1]), rel=1e-12)


def test_a_random_walk_has_the_drift_error_of_its_steps():
    steps = np.random.default_rng(3).standard_normal(4000)
    times, places = np.arange(4001.0), np.concatenate([[0.0], np.cumsum(steps)])
    error = standard_error(rates_of_blocks(times, places), 4001, 0.0, 4000.0)
    assert float(error.value) == pytest.approx(1 / np.sqrt(4000), rel=0.1)
