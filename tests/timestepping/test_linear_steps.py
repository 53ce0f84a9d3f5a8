"""Small disturbances by the spectrum, against runs of every scheme, and what a scheme makes up or hides."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.rests import CLAMPED, straight
from helpers.scenes import RFT, scene

from ibfil.simulation.at_rest import SceneAtRest
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping.base import State, Stepper
from ibfil.timestepping.implicit import Implicit
from ibfil.timestepping.linear_steps import Course, Spectrum, apart
from ibfil.timestepping.semi_implicit import SemiImplicit

SMALL = 1e-6  # of the length
SOFT = {"stretching": 400.0}
PUSHED = {"start": CLAMPED, "finish": {"follower": -30.0}, "stretching": 400.0}


def after(rod: dict[str, Any], dt: float, steps: int, **time: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A disturbed rod at rest: its displacements (k,) at the start, after ``steps``, and the last as foretold."""
    keys = scene({"rod": rod}, RFT, end=steps * dt, step=dt, **time)
    here = Simulation(keys)
    rest = SceneAtRest(here)
    motion = rest.motion(rest.next_rest().configuration)
    y = SMALL * np.random.default_rng(1).standard_normal(motion.shape).cumsum(axis=0)
    y.ravel()[motion.held.at] = 0.0
    run = Simulation(keys)
    run.state_now = State(0.0, run.system.move(motion.configuration, y), np.zeros(y.shape), 0.0)
    before = apart(motion, run.configuration)
    assert before == pytest.approx(y.ravel()[motion.free], abs=1e-3 * SMALL)
    run.advance(steps * dt, lambda: None)
    foretold = Spectrum(motion).steps(run.model.stepper, dt).after(before, np.array([steps]))[0]
    return before, apart(motion, run.configuration), foretold


@pytest.mark.parametrize("rod", ["pushed", "twisting"])
@pytest.mark.parametrize(
    ("time", "dt", "steps", "within"),
    [
        ({"scheme": "implicit", "order": 1}, 0.02, 7, 1e-3),
        ({"scheme": "semi-implicit", "order": 1}, 0.02, 7, 1e-3),
        ({"scheme": "explicit", "order": 1}, 5e-6, 40, 1e-3),
        ({"scheme": "implicit", "order": 2}, 2e-4, 200, 0.02),  # its first step is one of first order
    ],
    ids=["euler", "semi-implicit", "explicit", "bdf2"],
)
def test_it_is_what_a_run_does_with_a_small_disturbance(rod, time, dt, steps, within):
    keys = straight(9, **(PUSHED if rod == "pushed" else {"start": CLAMPED, "twisting": 0.5, "radius": 0.1, **SOFT}))
    before, found, foretold = after(keys, dt, steps, **time)
    assert np.abs(found - before).max() > 0.03 * np.abs(before).max()
    assert np.abs(found - foretold).max() < within * np.abs(found).max()


def test_semi_implicit_steps_make_growth_up_where_nothing_grows():
    """A rod below its flutter: what steps of 0.03 still damp, steps of 0.1 let grow; backward Euler damps both."""
    rod = straight(21, **{**PUSHED, "stretching": 2e5})
    still = SceneAtRest(Simulation(scene({"rod": rod}, RFT, end=1.0, step=0.1)))
    spectrum = Spectrum(still.motion(still.next_rest().configuration))
    assert spectrum.leading.real < 0

    def largest(scheme: Stepper, dt: float) -> float:
        return float(np.exp(spectrum.steps(scheme, dt).rates.real.max()))

    assert largest(SemiImplicit(), 0.03) < 0.99
    assert largest(SemiImplicit(), 0.1) > 1.002
    assert max(largest(Implicit(1), dt) for dt in (0.03, 0.1)) < 0.9


def test_the_motion_itself_is_the_exponential_of_its_matrix():
    from scipy.linalg import expm

    still = SceneAtRest(Simulation(scene({"rod": straight(9, **PUSHED)}, RFT, end=1.0, step=0.1)))
    motion = still.motion(still.next_rest().configuration)
    x = np.random.default_rng(1).standard_normal(motion.free.size)
    found = Spectrum(motion).itself().after(x, np.array([0.0, 0.05]))
    assert found[0] == pytest.approx(x, rel=1e-9)
    assert np.abs(found[1] - expm(0.05 * motion.matrix) @ x).max() < 1e-8 * np.abs(x).max()


def test_a_start_far_beyond_all_numbers_is_told_as_such():
    """Growth over many steps overflows, and says so by no number, without a warning."""
    grown = Course(np.log(np.array([10.0 + 0j])), np.eye(1, dtype=complex)).after(np.ones(1), np.array([1, 1000]))
    assert grown[0, 0] == pytest.approx(10.0)
    assert not np.isfinite(grown[1, 0])
