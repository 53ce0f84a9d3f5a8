"""A relaxed start shape is at rest as the nodes have it, not only as a curve."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.scenes import RFT, STOKES, scene

from ibfil.simulation.simulation import Simulation

PLANAR: dict[str, Any] = {
    "length": 1.0,
    "nodes": 21,
    "bending": 1.0,
    "stretching": 1e4,
    "curvature": ["4*sin(2*pi*s)", 0],
    "shape": {"kind": "relaxed"},
}
SPACE = {**PLANAR, "twisting": 0.7, "radius": 0.02, "curvature": [3, "2*sin(5*s)"], "twist_rate": "6*s"}
HELIX = {**SPACE, "nodes": 31, "curvature": [8, 0], "twist_rate": 4}
SHAPES: dict[str, dict[str, Any]] = {
    "planar": PLANAR,
    "order 2": {**PLANAR, "derivative": 2},
    "uneven": {**PLANAR, "spacing": "q + 0.1*sin(2*pi*q)/pi"},
    "moduli that vary": {**PLANAR, "bending": "1 + s", "stretching": "1e4*(1 + s)"},
    "space": SPACE,
    "ribbon": {**SPACE, "bending": [1.0, 0.4]},
    "torque-free": {**SPACE, "force": "torque-free"},
    "stiffening": {**SPACE, "law": {"kind": "stiffening", "coefficient": 0.5, "exponent": 2}},
    "a clamp": {**SPACE, "start": {"end": "clamped"}},
    "two clamps": {**PLANAR, "start": {"end": "clamped"}, "finish": {"end": "clamped"}},
    "hinges": {**SPACE, "start": {"end": "hinged"}, "finish": {"end": "hinged"}},
    "helix": {**HELIX, "shape": {"kind": "helix", "curvature": 8, "torsion": 4}},
    "arc": {**PLANAR, "curvature": [3, 0], "shape": {"kind": "circle", "curvature": 3}},
}


def pushed(rod: dict[str, Any], settled: bool, monkeypatch) -> np.ndarray:
    """The elastic forces (n, m) on the unconstrained unknowns of the start, of nodes at rest or of the curve's."""
    with monkeypatch.context() as patch:
        if not settled:
            patch.setattr("ibfil.shapes.initial.at_rest", lambda filament: False)
        simulation = Simulation(scene({"rod": rod}, RFT))
    system, start = simulation.system, simulation.start
    force = system.elastic(start, system.moment(start, 0.0), system.stretching)
    force.ravel()[system.ends.index] = 0.0
    return force


@pytest.mark.parametrize("name", SHAPES)
def test_no_force_acts_where_the_shape_is_relaxed(name: str, monkeypatch) -> None:
    """Newton leaves 1e-9 A/L^2, between two hinges 1e-6, where the curve's nodes were pulled at by 1e-3 to 100."""
    before = np.abs(pushed(SHAPES[name], False, monkeypatch)).max()
    after = np.abs(pushed(SHAPES[name], True, monkeypatch)).max()
    assert before > 1e-3
    assert after < 1e-6 * before


def test_it_moves_nodes_by_what_chords_are_shorter_than_arcs() -> None:
    """Segments are chords, ds long at rest, where the arc's are (kappa ds)^2/24 shorter: of order 2."""
    longer = []
    for nodes in (21, 41, 81):
        simulation = Simulation(scene({"rod": {**SHAPES["arc"], "nodes": nodes}}, RFT))
        ends = simulation.start.r[-1] - simulation.start.r[0]
        assert np.linalg.norm(np.diff(simulation.start.r, axis=0), axis=1) == pytest.approx(1 / (nodes - 1), rel=1e-12)
        longer.append(np.linalg.norm(ends) / (2 * np.sin(1.5) / 3) - 1)
    assert 0 < longer[0] < 2e-3
    assert longer[0] / longer[1] == pytest.approx(4, abs=0.7)
    assert longer[1] / longer[2] == pytest.approx(4, abs=0.4)


def test_a_perturbation_is_of_the_rod_at_rest() -> None:
    still = Simulation(scene({"rod": PLANAR}, RFT)).start.r
    moved = Simulation(
        scene({"rod": {**PLANAR, "shape": {"kind": "relaxed", "perturb": [0, "0.01*s", 0]}}}, RFT)
    ).start.r
    assert moved - still == pytest.approx(np.outer(np.linspace(0, 1, 21), [0, 0.01, 0]), abs=1e-15)


def test_a_curve_that_the_nodes_cannot_follow_stays_as_it_is() -> None:
    rod = {**PLANAR, "nodes": 11, "curvature": ["40*sin(40*s)", 0]}
    assert np.isfinite(Simulation(scene({"rod": rod}, RFT)).start.r).all()


@pytest.mark.parametrize("fluid", [RFT, STOKES])
def test_the_first_output_is_no_other_than_the_rest(fluid) -> None:
    """Power at t = 0 was 13 times that of the whole run: of forces that no step has ever felt."""
    for shape in ({"kind": "relaxed"}, {"kind": "straight"}):
        rod = {**PLANAR, "curvature": ["4*sin(2*pi*s - t)", 0], "shape": shape}
        simulation = Simulation(scene({"rod": rod}, fluid, end=0.2, step=0.01))
        first = simulation.snapshot()
        simulation.advance(0.01, lambda: None)
        second = simulation.snapshot()
        assert first.diagnostics["power"] == pytest.approx(second.diagnostics["power"], rel=1e-9)
        assert first.filaments["rod"].velocity == pytest.approx(second.filaments["rod"].velocity, rel=1e-9, abs=1e-12)
