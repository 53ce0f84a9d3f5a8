"""Activity from Python: feedback within the Newton iteration, and its memory in the checkpoint."""

from __future__ import annotations

import numpy as np
import pytest
import tomli_w

from ibfil.case.reading import parse_case
from ibfil.case.schema import Case
from ibfil.errors import CaseError
from ibfil.simulation.simulation import Simulation

SLOWEST = 12.36236  # of a clamped rod, A/(zeta L^4)


def clamped(*overrides: str, end: float = 1.0, **given: object) -> Case:
    bent = {"kind": "straight", "perturb": [0, "1e-4*s**2*(6 - 4*s + s**2)", 0]}
    rod = {"length": 1.0, "nodes": 21, "bending": 1.0, "stretching": 1e6, "start": {"end": "clamped"}, "shape": bent}
    drag = {"model": "rft", "viscosity": 1.0, "drag": {"perp": 1.0, "par": 0.5, "spin": 1e-3}}
    case = {
        "filament": {"rod": rod | given},
        "fluid": drag,
        "time": {"end": end, "step": 0.01},
        "output": {"every": 0.05},
    }
    return parse_case(tomli_w.dumps(case), "rod.toml", overrides)


class Feedback:
    """m = -g O + mu dO/dt + a z, with z that follows the curvature: T dz/dt + z = O."""

    def __init__(self, share: float, mu: float, memory: float = 0.0, lag: float = 0.1) -> None:
        self.share, self.mu, self.of_memory, self.lag, self.z = share, mu, memory, lag, None

    def active(self, strain, rate, s, time):
        one = np.broadcast_to(np.eye(2), (len(s), 2, 2))
        moment = -self.share * strain + self.mu * rate
        if self.z is not None:
            moment = moment + self.of_memory * self.z
        return moment, -self.share * one, self.mu * one

    def advance(self, strain, rate, s, time, dt):
        self.z = strain + ((0.0 if self.z is None else self.z) - strain) * np.exp(-dt / self.lag)

    def memory(self):
        return {} if self.z is None else {"z": self.z}

    def recall(self, memory):
        self.z = memory.get("z")


@pytest.mark.parametrize(("share", "mu"), [(0.5, 0.0), (0.0, 0.2), (-1.0, 0.05)])
def test_feedback_changes_the_rate_of_a_clamped_rod_as_it_should(share, mu):
    """k (1 - g)/(1 + mu k): also where |g| = 1 and mu is many steps, at which feedback lagged by a step explodes."""
    rate = SLOWEST * (1 - share) / (1 + mu * SLOWEST)
    simulation, dt, tips = Simulation(clamped(), "", {"rod": Feedback(share, mu)}), 0.02 / rate, []
    for _ in range(60):
        simulation.accept(simulation.attempt(dt), simulation.time + dt)
        tips.append(simulation.configuration.r[-1, 1] - simulation.configuration.r[0, 1])
    assert -np.diff(np.log(tips))[30:].mean() / dt == pytest.approx(rate, rel=0.01)


def test_memory_is_part_of_the_state():
    """Bit for bit, also with damping beneath it; the object that goes on begins without a memory of its own."""
    case = clamped(end=0.2, damping=0.03)
    one, other = (Simulation(case, "", {"rod": Feedback(0.2, 0.1, 0.3)}) for _ in range(2))
    one.advance(0.1, lambda: None)
    state = one.state()
    assert np.abs(state["rods_activity_of_rod_own_z"]).max() > 0
    other.restore(state)
    for simulation in (one, other):
        simulation.advance(0.2, lambda: None)
    assert np.array_equal(one.configuration.table, other.configuration.table)


@pytest.mark.parametrize(
    ("override", "found"),
    [
        ("time.scheme=explicit", 'time.scheme = "explicit"'),
        ("thermal.energy=1e-9", "[thermal]"),
        ("filament.rod.copies={count=2, region=[[0, 0, 0], [1, 1, 1]]}", "copies"),
    ],
)
def test_what_an_activity_does_not_go_with_is_told(override, found):
    with pytest.raises(CaseError) as told:
        Simulation(clamped(override), "", {"rod": Feedback(0.0, 0.1)})
    assert str(told.value) == f"rod.toml: laws: found an activity of rod with {found}; allowed: without it"


def test_other_shapes_are_refused():
    class Wrong(Feedback):
        def active(self, strain, rate, s, time):
            return strain, strain, strain

    with pytest.raises(TypeError, match="activity Wrong: found arrays"):
        Simulation(clamped(), "", {"rod": Wrong(0.0, 0.0)}).advance(0.01, lambda: None)
