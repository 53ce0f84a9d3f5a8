"""How fast a scene is driven: the automatic step sees everything that changes in time, and everything that pushes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.scenes import RFT, scene
from scipy.optimize import brentq

from ibfil.check.dimensionless import groups
from ibfil.check.report import modelled, report
from ibfil.check.warnings import warnings
from ibfil.simulation import timescales
from ibfil.simulation.simulation import Simulation

PERP = 4 * np.pi
OMEGA = 300.0
ROD = {"length": 1.0, "nodes": 11, "bending": 1.0, "twisting": 1.0, "stretching": 1e4, "radius": 0.1}
WAVE = f"0.3*cos({OMEGA}*t)"
FREE: dict[str, dict[str, Any]] = {
    "curvature": {"curvature": [WAVE, 0]},
    "twist rate": {"twist_rate": WAVE},
    "spin": {"start": {"end": "clamped", "spin": OMEGA}},
    "moving end": {"start": {"end": "hinged", "moves": [0, WAVE, 0]}},
    "end force": {"finish": {"force": [0, WAVE, 0]}},
    "follower": {"finish": {"follower": WAVE}},
    "end moment": {"finish": {"moment": [0, WAVE, 0]}},
    "force": {"loads": {"force": [0, f"s*{WAVE}", 0]}},
    "body force": {"loads": {"body_force": [0, WAVE, 0]}},
    "active moment": {"loads": {"moment": [WAVE, 0, 0]}},
    "internal moment": {"loads": {"internal_moment": [WAVE, 0]}},
    "tethers": {"loads": {"tether": {"stiffness": 0.1, "to": [WAVE, "s", 0]}}},
}


def step(rod: dict[str, Any], flow: list | None = None) -> float:
    fluid = RFT if flow is None else {**RFT, "flow": flow}
    return Simulation(scene({"rod": {**ROD, **rod}}, fluid, end=1.0)).step_length


@pytest.mark.parametrize("name", FREE)
def test_the_automatic_step_resolves_whatever_oscillates(name: str) -> None:
    """25 steps a period; a cosine's largest rate over half its range is its angular frequency, as sampled to 1 %."""
    assert step(FREE[name]) == pytest.approx(2 * np.pi / OMEGA / 25, rel=0.02)


def test_and_a_flow_that_does() -> None:
    assert step({}, [WAVE, 0, 0]) == pytest.approx(2 * np.pi / OMEGA / 25, rel=0.02)


STEADY: dict[str, tuple[dict[str, Any], float]] = {
    "end force": ({"finish": {"force": [0, 3.0, 4.0]}}, 5.0),
    "follower": ({"finish": {"follower": -5.0}}, 5.0),
    "weight": ({"loads": {"weight": [0, 0, -5.0]}}, 5.0),
    "body force": ({"loads": {"body_force": [0, 3.0, 4.0]}}, 5.0),
    "force of place": ({"loads": {"force": [0, 0, "10*abs(x)"]}}, 2.5),  # from -1/2 to 1/2
}


@pytest.mark.parametrize("name", STEADY)
def test_a_steady_force_is_resolved_in_the_time_in_which_it_moves_a_rod_by_its_length(name: str) -> None:
    """zeta_perp L^2/F; a rod as soft as this takes far longer to go to rest."""
    rod, size = STEADY[name]
    strong = {"bending": 1e-6, **rod}
    assert step(strong) == pytest.approx(PERP / size / 25, rel=0.02)


@pytest.mark.parametrize("name", [*STEADY, "nothing"])
def test_a_feeble_force_does_not_make_steps_longer_than_the_rod_relaxes(name: str) -> None:
    rod = STEADY[name][0] if name in STEADY else {}
    assert step({"bending": 1e6, **rod}) == pytest.approx(PERP / (1e6 * 500.564) / 25, rel=1e-3)


def test_a_flow_is_resolved_by_its_change_along_the_rod() -> None:
    """Shear by the rate at which its ends part; a uniform and steady one drives nothing."""
    soft = {"bending": 1e-6, "direction": [0, 1, 0]}
    assert step(soft, ["3*y", 0, 0]) == pytest.approx(1 / 3 / 25, rel=1e-6)
    assert step(soft, [100, 0, 0]) == step(soft)


def test_only_what_oscillates_has_an_omega_dt_to_be_warned_of() -> None:
    """A rod on its way to rest may be stepped as coarsely as one likes."""
    rods = {"weight": {**ROD, "loads": {"weight": [0, 0, -5.0]}}, "wave": {**ROD, "curvature": [WAVE, 0]}}
    for name, rod in rods.items():
        simulation = Simulation(scene({"rod": rod}, end=100.0, step=1.0))
        assert ("omega dt" in groups(simulation)) == (name == "wave")
        assert any("time.step: 1 is 48 of 0.0209" in line for line in warnings(simulation)) == (name == "wave")
        assert "sperm number" in groups(simulation)


def test_steps_that_a_tolerance_chooses_are_not_foretold() -> None:
    case = scene({"rod": {**ROD, "curvature": [WAVE, 0]}}, end=10.0, tolerance=1e-3)
    told = report(case)
    assert "omega dt" not in told
    assert "as many steps as time.tolerance asks for" in told
    assert "at first, then what an error of 0.001 allows" in told


def test_the_report_names_every_load_and_law() -> None:
    """`ibfil check` says what is modelled."""
    ends = {"force": [0, 0, 1], "moment": [0, 1, 0], "follower": 1, "spring": {"stiffness": 1}}
    loads = {
        "force": [0, 0, 1],
        "body_force": [0, 0, 1],
        "moment": [0, 0, 1],
        "internal_moment": [1, 0],
        "weight": [0, 0, 1],
        "tether": {"stiffness": 1},
    }
    law = {"kind": "two-well", "wells": [-1, 1], "barrier": 1, "gradient": 1}
    held = {"end": "clamped", "spin": 1, "moves": ["t", 0, 0]}
    rods = {"full": {**ROD, "law": law, "start": held, "finish": ends, "loads": loads}, "bare": ROD}
    full, bare, flow, *_ = modelled(scene(rods, {**RFT, "flow": [1, 0, 0]}))
    words = "two-well law, start clamped, prescribed motion at start, spin at start, finish free, force at finish, "
    words += (
        "follower force at finish, moment at finish, spring at finish, force per length, body force, active moment, "
    )
    assert full.endswith(words + "internal moment, weight, tethers")
    assert bare.endswith("stretching, twisting, start free, finish free")
    assert flow.startswith("a background flow")


@pytest.mark.parametrize(
    ("start", "finish", "zero", "near"),
    [
        ("free", "free", lambda b: np.cos(b) - 1 / np.cosh(b), 4.7),
        ("clamped", "clamped", lambda b: np.cos(b) - 1 / np.cosh(b), 4.7),
        ("clamped", "free", lambda b: np.cos(b) + 1 / np.cosh(b), 1.9),
        ("free", "hinged", lambda b: np.tan(b) - np.tanh(b), 3.9),
        ("hinged", "clamped", lambda b: np.tan(b) - np.tanh(b), 3.9),
        ("hinged", "hinged", np.sin, 3.1),
    ],
)
def test_the_slowest_bending_time_is_that_of_the_beams_first_mode(start, finish, zero, near):
    """zeta L^4/(A beta^4), beta the first root of the beam's characteristic equation but those of rigid motions."""
    beta = brentq(zero, near - 0.2, near + 0.2, xtol=1e-14)
    assert timescales.bending_time(3.0, 2.0, 5.0, start, finish) == pytest.approx(3 * 16 / (5 * beta**4), rel=1e-5)
