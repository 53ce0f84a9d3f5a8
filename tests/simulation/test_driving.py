"""What drives a scene: rates, jumps and periods of expressions, found from their structure and against values known."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.scenes import RFT, scene

from ibfil.case.expressions import parse
from ibfil.simulation.driving.breaks import Breaks
from ibfil.simulation.driving.intervals import bounds
from ibfil.simulation.driving.periods import Period, common_period
from ibfil.simulation.driving.windows import windows
from ibfil.simulation.simulation import Simulation

ALONG = {"s": np.linspace(0.0, 1.0, 33)}


def found(text: str, end: float):
    expression = parse(text, ("s", "t"))
    return windows(expression.tree, end, ALONG if "s" in expression.variables else {})


def period(*texts: str, end: float, turns: tuple[float, ...] = ()) -> Period | None:
    trees = [parse(text, ("s", "t")) for text in texts]
    return common_period([(e.tree, ALONG if "s" in e.variables else {}) for e in trees], turns, end)


EXPRESSIONS = [
    *(
        "sin(3*t)",
        "cos(t - 2*s)*exp(-t/3)",
        "tan(0.2*t)",
        "asin(0.3*sin(t))",
        "acos(0.1*t)",
        "atan(5*t)",
        "atan2(t, 2 - t)",
    ),
    *("sinh(0.3*t)", "cosh(0.2*t - 1)", "tanh(5*sin(2*t))", "log(1 + t)", "sqrt(t + 0.1)", "abs(sin(t))", "t**3 - 2*t"),
    *("(t - 2)**2", "(1 + t)**-1.5", "1/(1.2 + sin(t))", "min(t, 2, 3 - t)", "max(sin(t), cos(t))", "-t*sin(t)"),
    *("where(t < 1, t, 2 - t)", "where(sin(t) >= s, t, -t)", "step(t - 1)*t", "sign(sin(2*t))", "s*t - t/2"),
]


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_bounds_hold_all_values_and_slopes_and_are_exact_on_a_point(text: str) -> None:
    """Against values by numexpr and central differences; over intervals of every size, to rounding."""
    expression = parse(text, ("s", "t"))
    places = ALONG if "s" in expression.variables else {}
    function = expression.bind("t", *places)
    rng = np.random.default_rng(1)
    begin = rng.uniform(0.0, 3.0, 60)
    width = rng.uniform(0.0, 1.0, 60) ** 4 * 1.5
    found = bounds(expression.tree, begin, begin + width, places)
    for k in range(60):
        times = begin[k] + width[k] * np.linspace(0.0, 1.0, 17)[:, None]
        columns = [np.broadcast_to(v, (17, len(v))) for v in places.values()]
        value = function(np.broadcast_to(times, columns[0].shape if columns else times.shape), *columns)
        assert np.all(value >= found.low[k] - 1e-9)
        assert np.all(value <= found.high[k] + 1e-9)
        if not np.any(found.jump[k]):
            slope = np.diff(value, axis=0) / np.diff(times, axis=0)
            room = 1e-12 * (1 + np.abs(value).max()) / np.diff(times, axis=0).min() + 1e-9  # of rounding
            assert np.all(slope >= found.slope_low[k] - room)
            assert np.all(slope <= found.slope_high[k] + room)
    at = bounds(expression.tree, begin, begin, places)
    assert np.allclose(at.low, at.high)
    assert np.allclose(at.slope_low, at.slope_high)


@pytest.mark.parametrize(
    ("text", "end", "rate", "size"),
    [
        ("8*cos(20*pi*t)*sin(4*pi*s)", 39.9, 20 * np.pi, 8.0),  # 399 periods, looked at 400 times: none was seen
        ("8*sin(4*pi*s - 2*pi*t)", 399.0, 2 * np.pi, 8.0),
        ("8*sin(4*pi*s - 2*pi*t)", 400.0, 2 * np.pi, 8.0),
        ("0.2*tanh(5*sin(10*t))", 2.2, 50.0, 0.2),
        ("exp(-((t - 5)/1e-5)**2)", 10.0, 2 * np.sqrt(2 / np.e) * 1e5, 0.5),
        ("1 - exp(-t/0.01)", 20.0, 200.0, 0.5),
        ("sin(t**2)", 50.0, 100.0, 1.0),
        ("0.5*t", 50.0, 2 / 50, 12.5),
        ("abs(sin(3*t))", 50.0, 6.0, 0.5),
        ("3 + 0*t", 50.0, 0.0, 0.0),
    ],
)
def test_the_rate_is_the_steepest_slope_over_half_the_range(text: str, end: float, rate: float, size: float) -> None:
    one = found(text, end)
    assert rate * 0.999 <= one.fastest <= 1.4 * rate  # bounds are tight to 1.25, and a window's
    assert one.size == pytest.approx(size, rel=0.05)


def test_sinusoids_have_their_frequency_to_rounding() -> None:
    for text, rate in (("8*cos(20*pi*t)*sin(4*pi*s)", 20 * np.pi), ("8*sin(4*pi*s - 2*pi*t)", 2 * np.pi)):
        assert found(text, 399.0).fastest == pytest.approx(rate, rel=1e-12)


def test_a_soft_start_is_fast_while_it_lasts() -> None:
    one = found("(1 - exp(-t/0.01))*sin(3*t)", 20.0)
    assert one.rate(0.0, 0.005) > 10
    assert one.rate(1.0, 1.1) == pytest.approx(3.0, rel=0.05)
    pulse = found("sin(t) + exp(-((t - 5)/1e-4)**2)", 10.0)
    assert pulse.rate(4.9999, 5.0001) > 5e3
    assert pulse.rate(1.0, 4.9) < 2


def test_jumps_are_found_to_rounding_and_their_distance_is_a_rate() -> None:
    one = found("where(t > 0.3, 1, 0) + where(t >= 0.7, 1, 0)", 1.0)
    assert one.jumps == pytest.approx([0.3, 0.7], abs=1e-15)
    assert one.jumps[1] < 0.7  # at 0.7 it has jumped, at 0.3 not yet
    assert one.fastest == pytest.approx(np.pi / 0.4)
    square = found("sign(sin(10*t))", 31.0)
    assert square.jumps[square.jumps > 1e-9][:3] == pytest.approx(np.pi / 10 * np.arange(1, 4), abs=1e-13)
    assert square.fastest == pytest.approx(10.0, rel=1e-6)
    assert len(found("where(t < 5, t/5, 1)", 10.0).jumps) == 0  # it bends there, and does not jump


def test_jumps_that_travel_along_a_rod_are_a_rate_and_none_to_end_at() -> None:
    one = found("sign(sin(4*pi*s - 10*t))", 3.1)
    assert len(one.jumps) == 0
    assert one.fastest == pytest.approx(10.0, rel=1e-6)


@pytest.mark.parametrize(
    ("texts", "end", "length"),
    [
        (("0.2*tanh(5*sin(10*t))",), 2.2, 2 * np.pi / 10),
        (("8*sin(4*pi*s - 2*pi*t)",), 400.0, 1.0),
        (("sin(3*t) + sin(5*t)",), 40.0, 2 * np.pi),
        (("sin(t)**2",), 40.0, np.pi),
        (("abs(sin(3*t))",), 40.0, np.pi / 3),
        (("where(sin(3*t) > 0.3, 1, 0)",), 40.0, 2 * np.pi / 3),
        (("sin(3*t)", "cos(4.5*t)*s"), 50.0, 2 * np.pi / 1.5),
        (("5*sin(2*pi*t/3)",), 1.0, 3.0),  # longer than the run
        (("sin(t**2)",), 50.0, None),
        (("0.5*t",), 50.0, None),
        (("0.5*t + sin(3*t)",), 50.0, None),
        (("sin(t) + sin(1.41421356*t)",), 500.0, None),
        (("sin(3*s*t)",), 50.0, None),
    ],
)
def test_the_period_is_that_of_the_values(texts: tuple[str, ...], end: float, length: float | None) -> None:
    one = period(*texts, end=end)
    assert (one is None) == (length is None)
    if one is not None:
        assert one.length == pytest.approx(length, rel=1e-12)
        assert one.since == 0.0


def test_a_soft_start_has_a_period_once_it_is_over() -> None:
    ramp = period("min(t/5, 1)*sin(7*t)", end=50.0)
    assert ramp is not None
    assert ramp.length == pytest.approx(2 * np.pi / 7)
    assert 5.0 <= ramp.since < 5.1
    soft = period("(1 - exp(-t/0.5))*sin(7*t)", end=50.0)
    assert soft is not None
    assert 4.0 < soft.since < 8.0  # exp(-t/0.5) of 1e-6 is at 6.9


def test_spins_and_angles_have_periods_too() -> None:
    assert period(end=50.0, turns=(3.0,)) == Period(2 * np.pi / 3, 0.0)
    rod = {"length": 1.0, "nodes": 11, "bending": 1.0, "twisting": 1.0, "stretching": 1e4, "radius": 0.1}

    def of(**start) -> Period | None:
        return Simulation(scene({"rod": {**rod, "start": {"end": "clamped", **start}}}, RFT, end=9.0)).drivers.period

    assert of(spin=4.0).length == pytest.approx(np.pi / 2)  # type: ignore[union-attr]
    assert of(angle="4*t").length == pytest.approx(np.pi / 2)  # type: ignore[union-attr]
    assert of(spin="0.3*cos(5*t)").length == pytest.approx(2 * np.pi / 5)  # type: ignore[union-attr]
    assert of(spin="2 + 0.3*cos(4*t)").length == pytest.approx(np.pi)  # type: ignore[union-attr]
    assert of(spin="0.1*t") is None


def test_steps_end_before_a_jump_and_begin_after_it() -> None:
    breaks = Breaks([0.5, np.nextafter(1.0, 0.0)], 2.0)
    assert breaks.goal(0.0, 1.0) == 0.5
    assert breaks.goal(0.5, 1.0) == 1.0  # an output's time, which it goes by
    assert breaks.before(1.0) == np.nextafter(1.0, 0.0)
    assert breaks.before(0.75) == 0.75
    assert [breaks.at(t) for t in (0.5, 0.7, 1.0)] == [True, False, True]


ROD = {"length": 1.0, "nodes": 17, "bending": 1.0, "stretching": 1e3, "anchor": "start", "start": {"end": "clamped"}}


@pytest.mark.parametrize("compare", [">", ">="])
def test_a_load_that_jumps_at_an_output_costs_no_order(compare: str) -> None:
    """The jump stands at t = 0.04, an output's time: halved steps must quarter the error, whichever it is."""
    end = 0.08

    def tip(parts: int) -> np.ndarray:
        rod = {**ROD, "finish": {"force": [0, f"2*where(t {compare} 0.04, 1, 0)", 0]}}
        case = scene({"rod": rod}, RFT, end=end, step=end / parts)
        simulation = Simulation(case)
        simulation.advance(0.04, lambda: None)
        simulation.advance(end, lambda: None)
        return simulation.configuration.r[-1]

    fine = tip(2048)
    errors = [float(np.linalg.norm(tip(parts) - fine)) for parts in (64, 128, 256)]
    assert errors[0] / errors[1] > 3.0
    assert errors[1] / errors[2] > 3.0


def test_automatic_steps_see_every_jump_and_no_more_than_that(tmp_path) -> None:
    """A clamp that jumps just after the start gave 8e7 steps, and later jumps were stepped over."""
    for jump in ("0", "0.6"):
        rod = {**ROD, "start": {"end": "clamped", "moves": [0, f"0.05*where(t > {jump}, 1, 0)", 0]}}
        simulation = Simulation(scene({"rod": rod}, RFT, end=1.0))
        assert simulation.step_length > 1e-2
        simulation.advance(1.0, lambda: None)
        assert simulation.steps < 400
        assert simulation.configuration.r[0, 1] == pytest.approx(0.05)


def test_automatic_steps_do_not_alias() -> None:
    """Looked at 400 times, every end/399, this wave stands still."""
    rod = {
        "length": 1.0,
        "nodes": 21,
        "bending": 1e-3,
        "stretching": 1e3,
        "curvature": ["8*cos(20*pi*t)*sin(4*pi*s)", 0],
    }
    assert Simulation(scene({"rod": rod}, RFT, end=39.9)).step_length == pytest.approx(0.1 / 25, rel=1e-9)
    assert Simulation(scene({"rod": rod}, RFT, end=399.0)).step_length == pytest.approx(0.1 / 25, rel=1e-9)
