"""How equal steps are cut, with a walker that only counts them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ibfil.marching import EvenSteps


class Walker:
    """Takes any step, and keeps its length."""

    def __init__(self, dt_old: float = 0.0) -> None:
        self.time, self.taken = 0.0, []
        self.state_now = SimpleNamespace(dt_old=dt_old)

    def attempt(self, dt: float) -> float:
        return dt

    def accept(self, step: float, time: float) -> None:
        self.taken.append(step)
        self.time, self.state_now.dt_old = time, step

    def longest_step(self) -> float:
        return np.inf


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
    walker = Walker(before)
    EvenSteps(1.0, growth=2.0).advance(walker, 1.0, lambda: None)
    assert walker.taken == pytest.approx(taken)
    assert walker.time == 1.0


def test_without_a_bound_on_growth_they_are_the_fewest_equal_ones():
    walker = Walker(1e-6)
    EvenSteps(0.3).advance(walker, 1.0, lambda: None)
    assert walker.taken == pytest.approx([0.25] * 4)
