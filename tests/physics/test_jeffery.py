"""Rods in shear flow: Jeffery's orbits (Proc. R. Soc. A 102, 1922) by the couple of the flow across their thickness.

A spheroid of aspect ratio r turns its axis by e3' = W e3 + B (1 - e3 e3) E e3, B = (r^2 - 1)/(r^2 + 1), once in
2 pi (r + 1/r)/gamma, and spins about it with half the vorticity along it. A straight rod has r^2 = K1/K2.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from helpers.scenes import RFT, run, scene

import ibfil
from ibfil.case.reading import parse_case
from ibfil.simulation.simulation import Simulation

ROD: dict[str, Any] = {"length": 1.0, "nodes": 21, "derivative": 2, "bending": 1e3, "stretching": 1e6}
SHEAR = ["y", 0, 0]
BOX: dict[str, Any] = {"model": "stokes", "box": [4, 4, 4], "cells": [64, 64, 64]}  # 17 nodes one cell apart


def line_drag(nodes: int) -> float:
    """K1 of the rod of length 1 in RFT, paper's drag, eta = 1."""
    s, volume = np.linspace(-0.5, 0.5, nodes), np.full(nodes, 1 / (nodes - 1))
    volume[[0, -1]] *= 0.5
    return float(4 * np.pi * np.sum(volume * s**2))


def thick(fluid: Mapping[str, Any] = RFT, flow: list[Any] = SHEAR, **rod: Any) -> dict[str, Any]:
    return {"rods": {"rod": {**ROD, "radius": 0.05, **rod}}, "fluid": {**fluid, "flow": flow, "thick": True}}


def angles(simulation: Simulation, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Times, and the angle of the chord in the x-y plane, from x to y, continuous."""
    times, chords = [simulation.time], [simulation.configuration.r[-1] - simulation.configuration.r[0]]

    def look() -> None:
        times.append(simulation.time)
        chords.append(simulation.configuration.r[-1] - simulation.configuration.r[0])

    simulation.advance(until, look)
    x, y, _ = np.transpose(chords)
    return np.array(times), np.unwrap(np.arctan2(y, x))


def half_period(given: dict[str, Any], until: float, step: float = 0.05) -> float:
    """The time of half a turn from across the flow, where it turns fastest."""
    case = scene(given["rods"], given["fluid"], end=until, step=step)
    time, angle = angles(Simulation(case), until)
    assert angle[-1] < -0.5 * np.pi
    return float(np.interp(0.5 * np.pi, -angle, time))


ACROSS = {"direction": [0, 1, 0], "normal": [0, 0, 1]}


def test_a_rod_turns_over_in_half_jefferys_period():
    """T = 73.276 with a = L/20 and the paper's drag; without the couple it never comes past the flow."""
    ratio = np.sqrt(line_drag(21) / (np.pi * 0.05**2))
    assert 2 * half_period(thick(**ACROSS), 37.0) == pytest.approx(2 * np.pi * (ratio + 1 / ratio), rel=2e-4)
    thin = thick(**ACROSS)
    thin["fluid"]["thick"] = False
    _, angle = angles(Simulation(scene(thin["rods"], thin["fluid"], end=37.0, step=0.05)), 37.0)
    assert 0 < angle[-1] == pytest.approx(np.arctan(1 / 37.0), rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("radius", "period"), [(0.05, 73.276), (0.025, 145.738)])
def test_whole_periods(radius, period):
    given = thick(**ACROSS, radius=radius)
    simulation = Simulation(scene(given["rods"], given["fluid"], end=1.02 * period, step=0.05))
    time, angle = angles(simulation, 1.02 * period)
    chord = simulation.configuration.r[-1] - simulation.configuration.r[0]
    assert np.interp(1.5 * np.pi, -angle, time) == pytest.approx(period, rel=1e-4)
    assert np.linalg.norm(chord) == pytest.approx(1.0, abs=3e-7)


def test_a_given_aspect_ratio_is_that():
    given = thick(**ACROSS)
    given["fluid"]["thick"] = {"aspect": 5.0}
    assert 2 * half_period(given, 17.0) == pytest.approx(2 * np.pi * 5.2, rel=3e-4)
    assert Simulation(scene(given["rods"], given["fluid"])).model.aspect_ratios == {"rod": pytest.approx(5.0)}


def test_out_of_the_plane_it_keeps_its_orbit_and_spins():
    """sqrt(x^2/r^2 + y^2)/z of its axis stays; and e1 turns about it with half the vorticity along it."""
    rod = {"twisting": 1.0, "direction": [0.5, 0.6, 0.4], "normal": [0, 0, 1], "nodes": 11}
    given = thick(**rod)
    case = scene(given["rods"], given["fluid"], end=40.0, step=0.04)
    simulation = Simulation(case)
    ratio = np.sqrt(line_drag(11) / (np.pi * 0.05**2))
    orbits: list[float] = []
    missed: list[float] = []

    def look() -> None:
        r = simulation.configuration.r
        x, y, z = (r[-1] - r[0]) / np.linalg.norm(r[-1] - r[0])
        orbits.append(float(np.hypot(y, x / ratio) / z))
        spin = simulation.snapshot().filaments["rod"].spin
        assert spin is not None
        middle = simulation.configuration.e3[5]
        missed.append(float(spin[5] @ middle + 0.5 * middle[2]))

    simulation.advance(40.0, look)
    assert orbits == pytest.approx([orbits[0]] * len(orbits), rel=1e-4)
    assert np.abs(missed[3:]).max() < 3e-4  # the first step is Euler's


@pytest.mark.parametrize("fluid", [RFT, BOX, {**BOX, "rotation": "grid"}], ids=["rft", "local", "grid"])
def test_a_rod_along_the_vorticity_spins_with_half_of_it(fluid):
    rod = {**ROD, "nodes": 9, "twisting": 1.0, "radius": 0.05, "direction": [0, 0, 1], "normal": [1, 0, 0]}
    simulation = run(scene({"rod": rod}, {**fluid, "flow": ["3*y", 0, 0]}, end=0.4, step=0.05))
    e1 = simulation.configuration.e1
    assert np.arctan2(e1[:, 1], e1[:, 0]) == pytest.approx(np.full(9, -0.5 * 3 * 0.4), abs=1e-6)


def test_its_heat_is_that_of_line_and_couple():
    """A rigid rod along the flow turns at -1/(1 + r^2); line and couple dissipate K2 r^2/(1 + r^2) together.

    No torque of its own is on the fluid.
    """
    given = thick(direction=[1, 0, 0], normal=[0, 0, 1])
    case = scene(given["rods"], given["fluid"], end=0.1, step=0.001)
    text = case.text + '[observe.heat]\nkind = "dissipation"\n'
    simulation = run(parse_case(text, "heat.toml"))
    found, k2 = simulation.snapshot().diagnostics, np.pi * 0.05**2
    square = line_drag(21) / k2
    turning = simulation.snapshot().filaments["rod"].velocity[-1, 1] / 0.5
    assert turning == pytest.approx(-1 / (1 + square), rel=2e-3)
    assert found["dissipation"] == pytest.approx(k2 * square / (1 + square), rel=1e-4)
    assert found["couple_dissipation"] == pytest.approx(k2 * (square / (1 + square)) ** 2, rel=1e-4)
    assert np.abs(found["net_torque"]).max() < 1e-6 * k2


def test_on_a_grid_it_turns_by_the_drag_that_check_finds():
    """17 nodes one cell apart, as thick as the kernel; half a turn within half a percent of its own K1/K2."""
    rod = {**ROD, **ACROSS, "nodes": 17}
    fluid = {**BOX, "flow": SHEAR, "thick": True}
    ratio = Simulation(scene({"rod": rod}, fluid)).model.aspect_ratios["rod"]
    assert ratio == pytest.approx(7.98, abs=0.05)
    found = half_period({"rods": {"rod": rod}, "fluid": fluid}, 26.0, step=0.1)
    assert found == pytest.approx(np.pi * (ratio + 1 / ratio), rel=5e-3)


def test_with_little_inertia_it_is_that_of_stokes():
    """In a shear that the box repeats, u = sin(pi y/2) 2/pi, over a third of a turn."""
    rod = {**ROD, **ACROSS, "nodes": 9}
    small = {"box": [4, 4, 4], "cells": [32, 32, 32], "flow": ["sin(pi*y/2)*2/pi", 0, 0], "thick": True}
    stokes = run(scene({"rod": rod}, {**small, "model": "stokes"}, end=2.0, step=0.05)).configuration.r
    dense = {**small, "model": "navier-stokes", "density": 1e-4}
    assert run(scene({"rod": rod}, dense, end=2.0, step=0.05)).configuration.r == pytest.approx(stokes, abs=2e-5)
    thin = run(scene({"rod": rod}, {**small, "model": "stokes", "thick": False}, end=2.0, step=0.05)).configuration.r
    assert np.abs(thin - stokes).max() > 5e-4


def test_the_flow_of_a_recorded_run_has_the_couple(tmp_path):
    """velocity_at of a run file is what probes saw, which know the fluid itself; without the couple it is not."""
    rod = {**ROD, "nodes": 9, "direction": [1, 1, 0], "normal": [0, 0, 1]}
    fluid = {"model": "stokes", "box": [2, 2, 2], "cells": [16, 16, 16], "flow": SHEAR, "thick": True}
    case = scene({"rod": rod}, fluid, end=0.2, step=0.01)
    text = case.text.replace("[output]", "[output]\nprobes = [[0.3, 0.1, 0.05], [-0.2, 0.4, 0.0]]")
    path = tmp_path / "run.h5"
    (tmp_path / "case.toml").write_text(text)
    ibfil.run(tmp_path / "case.toml", output=path)
    with ibfil.open(path) as opened:
        points = np.array([[0.3, 0.1, 0.05], [-0.2, 0.4, 0.0]])
        seen = np.asarray(opened.diagnostics["probe_velocity"])[-1]
        assert opened.velocity_at(points, 0.2) == pytest.approx(seen, abs=1e-12)
    assert np.abs(seen - points[:, 1:2] * [1, 0, 0]).max() > 1e-3
