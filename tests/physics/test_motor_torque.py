"""A torque on a clamped end that may turn, as of a motor."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.scenes import scene

from ibfil.errors import CaseError
from ibfil.simulation.simulation import Simulation

TORQUE, RADIUS, LENGTH = 0.3, 0.05, 2.0
ROD = {"length": LENGTH, "nodes": 21, "bending": 1.0, "stretching": 100.0, "twisting": 1.0, "radius": RADIUS}
MOTOR = {"end": "clamped", "twist": "free", "frame": "body", "moment": [0, 0, TORQUE]}


@pytest.mark.parametrize("end", ["start", "finish"])
def test_it_spins_a_straight_rod_against_its_own_drag(end: str) -> None:
    """At m/(4 pi eta a^2 L) once it is wound up; that twist is m (L - s)/(C L) per length from a motor at s = 0."""
    simulation = Simulation(scene({"rod": {**ROD, end: MOTOR}}, end=2.0, step=0.02))
    simulation.advance(2.0, lambda: None)
    rod = simulation.snapshot().filaments["rod"]
    rate = np.sum(rod.spin * simulation.configuration.e3, axis=1)
    assert rate == pytest.approx(TORQUE / (4 * np.pi * RADIUS**2 * LENGTH), rel=1e-6)
    assert np.abs(rod.position[:, 1:]).max() < 1e-12
    s = np.linspace(0.0, LENGTH, 21)
    along = -(LENGTH - s) if end == "start" else s
    assert rod.moment[5:-5, 2] == pytest.approx(TORQUE * along[5:-5] / LENGTH, rel=1e-3)


@pytest.mark.parametrize(
    "keys", [{"moment": [0.1, 0, TORQUE]}, {"moment": [0, "t", TORQUE]}, {"frame": "lab"}, {"twist": "held"}]
)
def test_a_clamp_takes_no_other_moment(keys: dict[str, object]) -> None:
    with pytest.raises(CaseError) as refused:
        scene({"rod": {**ROD, "start": {**MOTOR, **keys}}})
    (line,) = refused.value.faults
    assert "filament.rod.start.moment: found moment with end = " in line
    assert "at a clamped one [0, 0, m], a torque" in line
