"""How equal steps are cut, with a loop that only counts them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ibfil.timestepping.step_control import FixedStep, StepControl, Verdict, equal_parts


def walked(control: StepControl, before: float, end: float) -> list[float]:
    """The steps taken from 0 to exactly ``end``, after one of length ``before``."""
    state, taken = SimpleNamespace(time=0.0, dt_old=before), []
    while state.time < end:
        dt, time = control.propose(state, end, np.inf)
        assert control.judge(state, None, dt) is Verdict.ACCEPTED
        taken.append(dt)
        state.time, state.dt_old = time, dt
    assert state.time == end
    return taken


@pytest.mark.parametrize(
    ("before", "taken"),
    [
        (0.6, [1.0]),
        (0.4, [0.5, 0.5]),  # and not 0.8, 0.2, whose ratio is no better than that of what follows it
        (0.2, [0.4, 0.6]),
        (0.1, [0.2, 0.4, 0.4]),
        (0.05, [0.1, 0.2, 0.35, 0.35]),
    ],
)
def test_after_a_short_step_they_grow_to_the_length_asked_for_without_a_short_last_one(before, taken):
    assert walked(FixedStep(1.0, growth=2.0), before, 1.0) == pytest.approx(taken)


def test_without_a_bound_on_growth_they_are_the_fewest_equal_ones():
    assert walked(FixedStep(0.3), 1e-6, 1.0) == pytest.approx([0.25] * 4)


@pytest.mark.parametrize(("length", "count"), [(0.314159265 / 10, 10), (0.25, 4), (0.25 - 2e-7, 4), (0.25 - 1e-6, 5)])
def test_a_length_that_lacks_a_millionth_of_an_equal_part_is_that_part(length, count):
    """As many digits of a period as a user writes down are enough."""
    end = np.pi / 10 if count == 10 else 1.0
    assert equal_parts(end, length) == count
    assert walked(FixedStep(length), 0.0, end) == pytest.approx([end / count] * count)
