"""The rule that makes an error bar out of three levels."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from ibfil.studies.estimates import combined, estimate, limit, observed_order

SIZES = (1.0, 0.6, 0.3)


def power(order, scale=1.0, limit=1.0, sizes=SIZES):
    return [limit + scale * h**order for h in sizes]


@pytest.mark.parametrize("order", [1.0, 2.0, 2.5])
@pytest.mark.parametrize("level", [0, 1])
@pytest.mark.parametrize("scale", [0.1, -0.1])
def test_a_pure_power_gives_its_order_and_its_error_with_its_sign(order, level, scale):
    found = estimate(power(order, scale), SIZES, order, level)
    assert found.word == "seen"
    assert found.order == pytest.approx(order, abs=1e-10)
    assert found.error == pytest.approx(scale * SIZES[level] ** order, rel=1e-12)
    assert found.doubt == pytest.approx(0.25 * abs(found.error))


def test_the_limit_of_a_pure_power_is_exact():
    assert limit(power(2.0), SIZES, 2.0) == pytest.approx(1.0, abs=1e-14)


def test_the_order_is_not_believed_above_the_nominal_one():
    """An order of 2.6 where 2 is due: the error is that of order 2, which is larger than the levels alone would say."""
    values = power(2.6)
    found = estimate(values, SIZES, 2.0)
    assert found.word == "seen"
    assert found.error == pytest.approx(values[0] - limit(values, SIZES, 2.0))
    assert found.error > 1.0


def test_words():
    assert estimate(power(4.0), SIZES, 2.0).word == "fast"
    assert estimate(power(0.8), SIZES, 2.0).word == "low"
    assert estimate(power(0.2), SIZES, 2.0).word == "unseen"
    assert estimate([1.0, 1.1, 1.0], SIZES, 2.0).word == "unseen"
    assert estimate([1.0, 1.0 + 5e-9, 1.0 - 3e-9], SIZES, 2.0).word == "round-off"
    assert estimate(power(2.0), (1.0, 0.97, 0.5), 2.0).word == "levels alike"
    assert estimate([1.0, np.nan, 1.0], SIZES, 2.0).doubt == np.inf


def test_where_no_order_is_seen_the_doubt_covers_both_distances_twice():
    found = estimate([1.0, 1.1, 1.0], SIZES, 2.0)
    assert (found.error, found.doubt) == (0.0, pytest.approx(0.2))
    assert estimate([1.0, 1.1, 1.0], SIZES, 2.0, level=1).error == pytest.approx(0.1)


def test_round_off_is_measured_by_a_scale_where_the_value_vanishes():
    noise = [1e-12, -2e-12, 3e-12]
    assert estimate(noise, SIZES, 2.0).word == "unseen"
    assert estimate(noise, SIZES, 2.0, scale=1.0).word == "round-off"


def test_levels_that_are_not_three_or_do_not_fall_are_refused():
    for values, sizes in (([1, 2], (1, 0.5)), ([1, 2, 3], (0.5, 1, 0.2)), ([1, 2, 3], (1, 0.5, 0.0))):
        with pytest.raises(ValueError, match="allowed"):
            estimate(values, sizes, 2.0)


def test_order_of_any_three_sizes_solves_its_equation():
    rng = np.random.default_rng(0)
    for _ in range(50):
        sizes = np.sort(rng.uniform(0.1, 2.0, 3))[::-1] * [1.2, 1.0, 0.8]
        order = rng.uniform(-2.5, 7.0)
        assert observed_order(power(order, sizes=sizes), sizes) == pytest.approx(order, abs=1e-9)


def test_errors_add_with_their_signs_and_doubts_as_squares():
    parts = [estimate(power(2.0, scale), SIZES, 2.0) for scale in (0.3, -0.4)]
    error, doubt = combined(parts)
    assert error == pytest.approx(-0.1)
    assert doubt == pytest.approx(0.25 * 0.5)


def test_the_rule_loads_no_optimizer():
    """Loading one takes longer than the rule: start-up counts."""
    code = (
        "import sys; from ibfil.studies.estimates import observed_order; "
        "assert abs(observed_order([1.16, 1.04, 1.01], [0.4, 0.2, 0.1]) - 2.0) < 1e-9; "
        "assert 'scipy.optimize' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
