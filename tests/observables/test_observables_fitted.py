"""Observables that need the whole run, against motions known exactly."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.motions import EVEN, LENGTH, NODES, UNEVEN, S, seen, straight, tip_at, value
from hypothesis import given, settings
from hypothesis import strategies as st

from ibfil.observables import time_series

# --- kinds that need the whole run -----------------------------------------------------------------------------------


def test_drift_over_whole_periods_is_the_mean_speed():
    def motion(t):
        return straight() + np.array([0.3 * t + np.sin(np.pi * t), -0.1 * t, 0])

    keys = 'kind = "drift"\nat = "centroid"\nover = [2, 8]'
    assert value(keys, motion, EVEN) == pytest.approx(np.array([0.3, -0.1, 0]), abs=1e-12)
    assert value(keys + "\nalong = [0, -1, 0]", motion, EVEN) == pytest.approx(0.1)
    series, _ = seen(keys + "\nalong = [1, 0, 0]", motion, EVEN)
    assert series == pytest.approx(1 + 0.3 * EVEN + np.sin(np.pi * EVEN), abs=1e-12)


def test_drift_between_outputs_is_on_the_straight_line():
    def motion(t):
        return straight() + np.array([t**2, 0, 0])

    # From (0.25, its chord value) to (1.5, likewise), outputs at whole times.
    keys = 'kind = "drift"\nalong = [1, 0, 0]\nover = [0.25, 1.5]'
    assert value(keys, motion, [0.0, 1.0, 2.0]) == pytest.approx((2.5 - 0.25) / 1.25)


@pytest.mark.parametrize("times", [EVEN, UNEVEN])
def test_growth_of_an_exponential(times):
    def motion(t):
        return tip_at(2, 0.01 * np.exp(0.37 * t), 0)

    assert value('kind = "growth"\nover = [1, 9]', motion, times) == pytest.approx(0.37, rel=1e-10)


@pytest.mark.parametrize("rate", [0.37, -0.37])
def test_growth_of_a_spiral_and_of_an_oscillation(rate):
    def spiral(t):
        a = 0.01 * np.exp(rate * t)
        return tip_at(2, a * np.cos(4 * t), a * np.sin(4 * t))

    def planar(t):
        return tip_at(2, 0, 0.01 * np.exp(rate * t) * np.cos(4 * t + 0.3))

    assert value('kind = "growth"', spiral, EVEN) == pytest.approx(rate, rel=1e-10)
    assert value('kind = "growth"', planar, EVEN) == pytest.approx(rate, rel=2e-3)
    assert value('kind = "growth"', planar, np.linspace(0, 10, 1001)) == pytest.approx(rate, rel=1e-6)


def test_growth_of_nothing_is_no_number():
    assert np.isnan(value('kind = "growth"', lambda t: tip_at(2, 0, 0), EVEN))


def test_circularity_of_an_ellipse():
    def ellipse(b):
        return lambda t: tip_at(2 + t, 1 + 0.5 * np.cos(np.pi * t + 0.4), b * np.sin(np.pi * t + 0.4))

    for b in (0.5, 0.25, 0.0):
        found = value('kind = "circularity"\nover = [2, 8]', ellipse(b), EVEN)
        assert found == pytest.approx((b / 0.5) ** 2, abs=1e-12)
    # Seen along z the tip leaves on a line along x.
    along_z = value('kind = "circularity"\nalong = [0, 0, 1]', lambda t: tip_at(t, 0, np.sin(t)), EVEN)
    assert along_z == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("times", [EVEN, UNEVEN])
@pytest.mark.parametrize(("b", "grows"), [(1.0, 0.0), (0.6, 0.0), (0.1, 0.0), (1.0, 0.4), (0.6, -0.2)])
def test_frequency_of_rotation_has_a_sign(times, b, grows):
    for omega in (4.321, -4.321):

        def motion(t, omega=omega):
            a = 0.2 * np.exp(grows * t)
            return tip_at(2, a * np.cos(omega * t), b * a * np.sin(omega * t)) + np.array([0, 3, 3])

        assert value('kind = "frequency"', motion, times) == pytest.approx(omega, rel=1e-8)
        assert value('kind = "frequency"\nalong = [-1, 0, 0]', motion, times) == pytest.approx(-omega, rel=1e-8)


@settings(max_examples=30, deadline=None)
@given(
    axis=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    omega=st.floats(1.0, 12.0),
    sign=st.sampled_from([-1, 1]),
)
def test_frequency_about_any_axis(axis, omega, sign):
    n = np.array(axis) / np.linalg.norm(axis)
    first = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    first /= np.linalg.norm(first)

    def motion(t):
        turned = np.cos(omega * t) * first + sign * np.sin(omega * t) * np.cross(n, first)
        return tip_at(*(0.4 * turned + 1.5 * n))

    keys = f'kind = "frequency"\nalong = [{", ".join(map(repr, axis))}]'
    assert value(keys, motion, EVEN) == pytest.approx(sign * omega, rel=1e-9)


@pytest.mark.parametrize("times", [EVEN, UNEVEN, np.linspace(0, 10, 1001)])
def test_frequency_of_flailing_in_a_plane_is_positive(times):
    def motion(t):
        wave = 0.3 * np.cos(3.21 * t + 0.5) + 0.05 * np.cos(3 * 3.21 * t) + 0.1
        return tip_at(2, 0.8 * wave, -0.6 * wave)

    for along in ("[1, 0, 0]", "[-1, 0, 0]"):
        assert value(f'kind = "frequency"\nalong = {along}', motion, times) == pytest.approx(3.21, rel=1e-6)


def test_to_and_fro_on_an_arc_about_the_axis_is_no_rotation():
    """Turns one way and as far back: three harmonics fit it to 2 J5(0.9) = 3e-4 of its width."""

    def motion(t):
        angle = 0.9 * np.sin(3.21 * t)
        return tip_at(2, np.cos(angle), np.sin(angle))

    assert value('kind = "frequency"', motion, EVEN) == pytest.approx(3.21, rel=3e-4)


def test_frequency_of_a_growing_oscillation():
    def motion(t):
        return tip_at(2, 0.01 * np.exp(0.4 * t) * np.cos(3.21 * t), 0)

    assert value('kind = "frequency"', motion, EVEN) == pytest.approx(3.21, rel=1e-6)


@pytest.mark.parametrize("tip", [lambda t: 0.0, lambda t: t, lambda t: np.exp(-t), lambda t: np.cos(0.3 * t)])
def test_frequency_without_a_period_is_no_number(tip):
    assert np.isnan(value('kind = "frequency"', lambda t: tip_at(2, tip(t), 0), EVEN))


def test_frequency_of_the_start_is_seen_from_the_centroid():
    def motion(t):  # the finish rests, the start goes round
        turned = np.array([0, np.cos(2 * t), np.sin(2 * t)])
        return straight() + (LENGTH - S[:, None]) * 0.1 * turned

    assert value('kind = "frequency"\nat = "start"', motion, EVEN) == pytest.approx(2.0, rel=1e-9)


def shuffled_walk(along: float, across: float, shape, count: int = 200):
    """A shape that moves, from output to output, by ``along`` its axis and ``across`` it, and turns meanwhile."""
    location, places, axes = np.zeros(3), [], []
    for k in range(count + 1):
        axis = np.array([np.cos(0.3 * k), np.sin(0.3 * k), 0.0])
        places.append(location.copy())
        axes.append(axis)
        normal = np.array([0.0, 0.0, 1.0]) if k % 2 else np.cross([0, 0, 1], axis)
        location = location + along * axis * (-1) ** k + across * normal
    return lambda t: shape(axes[round(10 * t)]) + places[round(10 * t)]


def rod_along(axis: np.ndarray) -> np.ndarray:
    return (S - 1)[:, None] * axis


def ring_about(axis: np.ndarray) -> np.ndarray:
    other = np.cross([0, 0, 1], axis)
    turn = np.linspace(0, 2 * np.pi, NODES)
    return np.cos(turn)[:, None] * other + np.sin(turn)[:, None] * np.array([0, 0, 1.0])


@pytest.mark.parametrize("shape", [rod_along, ring_about])
def test_diffusion_ratio_is_of_mean_squares_about_the_axis_at_each_start(shape):
    times = np.arange(101) / 10
    motion = shuffled_walk(0.5, 0.2, shape)
    # Across there are two directions: D_perp/D_par = (0.2^2/2) / 0.5^2.
    keys = 'kind = "diffusion_ratio"\ninterval = 0.1'
    series, summary = seen(keys, motion, times)
    assert np.all(np.isnan(series[0]))
    assert series[1:, 0] == pytest.approx(np.full(100, 0.25))
    assert np.sum(series[1:, 1:], axis=1) == pytest.approx(np.full(100, 0.04))
    assert summary.value == pytest.approx(0.08)
    for kind, expected in (("", 0.29 / 6), ("_along", 0.25 / 2), ("_across", 0.04 / 4)):
        assert value(f'kind = "diffusion{kind}"\ninterval = 0.1', motion, times) == pytest.approx(expected / 0.1)
    # An irregular last output is no interval.
    assert value(keys, lambda t: motion(round(10 * t) / 10), [*times, 10.03]) == pytest.approx(0.08)


def test_diffusion_ratio_over_a_longer_interval():
    """Steps along a fixed rod's axis x of 1 and across it of 1, in turn: over three outputs 2 and 1, or 1 and 2."""

    def motion(t):
        k = round(10 * t)
        return straight() + np.array([(k + 1) // 2, k // 2, 0])

    def expected(starts):
        moved = [((k + 4) // 2 - (k + 1) // 2, (k + 3) // 2 - k // 2) for k in starts]
        return 0.5 * sum(y * y for _, y in moved) / sum(x * x for x, _ in moved)

    keys = 'kind = "diffusion_ratio"\ninterval = 0.3'
    assert value(keys, motion, np.arange(21) / 10) == pytest.approx(expected(range(18)))
    found = value(keys + "\nover = [0.5, 1.2]", motion, np.arange(21) / 10)
    assert found == pytest.approx(expected(range(5, 10)))


def test_efficiency():
    force = np.tile([0.0, 1.0, 0.0], (NODES, 1))
    velocity = np.tile([9.0, 0.25, 0.0], (NODES, 1))  # the power is 2.5

    def motion(t):
        return straight() + np.array([0.4 * t, 0.3 * t, 0]), {"force": force, "velocity": velocity}

    drag = 2 * np.pi * 0.5 * LENGTH
    assert value('kind = "efficiency"', motion, EVEN) == pytest.approx(drag * 0.25 / 2.5)
    keys = 'kind = "efficiency"\nalong = [1, 0, 0]\nover = [2, 6]'
    assert value(keys, motion, EVEN) == pytest.approx(drag * 0.16 / 2.5)


# --- fits alone ------------------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    omega=st.floats(1.3, 10.0),
    phase=st.floats(0, 6.28),
    minor=st.floats(0.06, 1.0),
    tilt=st.floats(0, 3.1),
    sign=st.sampled_from([-1, 1]),
)
def test_rate_of_any_ellipse(omega, phase, minor, tilt, sign):
    t = EVEN
    along, across = np.cos(omega * t + phase), sign * minor * np.sin(omega * t + phase)
    xy = np.column_stack([np.cos(tilt) * along - np.sin(tilt) * across, np.sin(tilt) * along + np.cos(tilt) * across])
    assert time_series.angular_rate(t, xy).value == pytest.approx(sign * omega, rel=1e-8)


def test_a_fit_says_how_well_it_fits_and_why_there_is_none() -> None:
    """Growth and frequency by their own words: what they rest on, what they leave."""
    t = np.linspace(0.0, 10.0, 101)
    grows = time_series.growth(t, np.exp(0.3 * t))
    assert grows.quality.startswith("from 101 outputs over 3 e-foldings, to ")
    assert "hardly" not in grows.quality
    wobbles = time_series.growth(t, np.exp(0.03 * t + 0.3 * np.sin(0.5 * t)))
    assert "hardly exponential" in wobbles.quality
    assert time_series.growth(t, 0 * t).quality.startswith("no growth of 0 outputs")
    turns = time_series.angular_rate(t, np.column_stack([np.cos(2 * t), np.sin(2 * t)]))
    assert turns.quality.startswith("a rotation, 3.2 turns, to ")
    coarse = t[::14]
    unsure = time_series.angular_rate(coarse, np.column_stack([np.cos(2 * coarse), np.sin(2 * coarse)]))
    assert "too far apart" in unsure.quality
    swings = time_series.angular_rate(t, np.column_stack([np.cos(2 * t), 0 * t]))
    assert swings.quality.startswith("an oscillation, 3.2 periods, the fit leaves ")
    noise = np.cos(2 * t) + 1.5 * np.random.default_rng(0).standard_normal(101)
    assert "hardly an oscillation" in time_series.angular_rate(t, np.column_stack([noise, 0 * t])).quality
    assert time_series.angular_rate(t, np.column_stack([t, 0 * t])).quality.startswith("no frequency")
    assert time_series.angular_rate(t, np.zeros((101, 2))).quality == "no frequency: nothing moves"
    assert time_series.angular_rate(t[:3], np.zeros((3, 2))).quality == "no frequency of 3 outputs: it takes four"


def test_the_quality_of_a_fit_stands_beside_its_number() -> None:
    def motion(t):
        return straight() * [1, 0, 0] + np.outer(S, [0, np.exp(0.3 * t), 0])

    _, found = seen('kind = "growth"', motion, list(np.linspace(0, 5, 11)))
    assert found.value == pytest.approx(0.3)
    assert found.quality.startswith("from 11 outputs over 1.5 e-foldings")
