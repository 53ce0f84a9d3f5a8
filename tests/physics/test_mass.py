"""Rods with mass: m s^2 + zeta s + A k^4 = 0 for every mode of bending, the same of twist, and bodies that fall.

In resistive-force theory these are exact; on a grid a stiff rod falls as one body with the grid's own drag.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.cut import assert_same_bits
from helpers.scenes import run, scene, slopes

from ibfil.check.dimensionless import oscillations
from ibfil.linalg.constraints import Prescribed
from ibfil.simulation import timescales
from ibfil.simulation.simulation import Simulation

DRAG = {"perp": 0.2, "par": 0.2}
LIGHT: dict[str, Any] = {"model": "rft", "drag": DRAG}
CLAMPED: dict[str, Any] = {
    "length": 1.0,
    "nodes": 21,
    "bending": 1.0,
    "stretching": 1e5,
    "mass": 1.0,
    "anchor": "start",
    "start": {"end": "clamped"},
}
K1 = 1.8751040687  # cos k cosh k = -1


def ring(y: np.ndarray, dt: float) -> tuple[float, float]:
    """Decay and frequency of a record that rings in one mode: least squares of y_{i+1} = 2 c y_i - q y_{i-1}."""
    columns = np.stack([y[1:-1], y[:-2]], axis=1)
    (twice, minus), *_ = np.linalg.lstsq(columns, y[2:], rcond=None)
    root = complex(twice / 2, np.sqrt(complex(-minus - twice**2 / 4)).real)
    return -np.log(abs(root)) / dt, np.angle(root) / dt


def rung(simulation: Simulation, until: float, every: float = 0.04) -> tuple[float, float]:
    """Decay and frequency of the free end's y."""
    y: list[float] = []
    for k in range(1, round(until / every) + 1):
        simulation.advance(k * every, lambda: None)
        y.append(simulation.configuration.r[-1, 1])
    return ring(np.array(y), every)


def across(simulation: Simulation) -> tuple[complex, np.ndarray]:
    """The slowest root of a straight rod on its nodes, m = 1, drag 0.2, and its mode (n,), zero at a clamp.

    An eigenvalue problem of the exact stiffness across.
    """
    system, start = simulation.system, simulation.start
    _, inner = system.forces(start, 0.0)
    whole = system.stiffness(start, start, inner, 0.0).dense()[:, 1, :, 1]
    free = ~np.isin(np.arange(len(start.r)), system.ends.index // system.unknowns)
    values, modes = np.linalg.eig(-whole[np.ix_(free, free)] / system.mesh.volume[free, None])
    bending = np.argsort(np.where(values.real > 1.0, values.real, np.inf))[0]  # not moves as a rigid body
    mode = np.zeros(len(start.r))
    mode[free] = modes[:, bending].real
    return complex(np.roots([1.0, 0.2, values[bending].real])[0]), mode


def ringing(rod: dict[str, Any], dt: float, end: float = 4.0) -> Simulation:
    """A straight rod that starts with the velocity of its first mode, small."""
    simulation = Simulation(scene({"rod": rod}, LIGHT, end=end, step=dt))
    assert simulation.model.mass is not None
    simulation.model.mass.velocity[:, 1] = 1e-3 * across(simulation)[1]
    return simulation


def bent(nodes: int, dt: float) -> Simulation:
    """A clamped one."""
    return ringing({**CLAMPED, "nodes": nodes}, dt)


def test_the_first_mode_of_a_clamped_rod_rings_to_second_order_in_the_step():
    """To the root of the rod on its nodes, which is exact; extrapolated to no step."""
    found = np.array([rung(bent(21, dt), 4.0) for dt in (0.02, 0.01, 0.005)])
    root = across(bent(21, 0.01))[0]
    errors = np.abs(found - [-root.real, abs(root.imag)])
    assert min(slopes(list(errors[:, 1]))) > 1.9
    assert errors[-1] == pytest.approx([0.0, 0.0], abs=4e-4)
    limit = found[2] + (found[2] - found[1]) / 3
    assert limit == pytest.approx([-root.real, abs(root.imag)], rel=3e-4)


def test_what_the_scheme_takes_away_is_what_check_says():
    small = timescales.seen(complex(-0.1, 3.5), 0.01, 2)
    assert 3.5 - small.imag == pytest.approx(3.5 * 0.035**2 / 3, rel=0.02)
    assert 0.1 + small.real == pytest.approx(0.1 * 0.035**2 - 0.035**3 / 4 * 3.5, rel=0.02)
    simulation = ringing(CLAMPED, 0.08, 8.0)
    root = across(simulation)[0]
    seen = timescales.seen(root, 0.08, 2)  # a tenth more decay, a fortieth less omega
    assert rung(simulation, 8.0, every=0.08) == pytest.approx((-seen.real, seen.imag), rel=0.015)
    assert rung(ringing(CLAMPED, 0.08, 8.0), 8.0, every=0.08)[1] == pytest.approx(seen.imag, rel=1e-3)
    (found,) = oscillations(simulation).values()
    assert found == pytest.approx((3.5146, 0.1, seen.imag, -seen.real), rel=5e-3)


@pytest.mark.slow
def test_the_first_mode_of_a_clamped_rod_to_second_order_in_the_nodes():
    """s = (-zeta + sqrt(zeta^2 - 4 m A k^4))/2m = -0.1 + 3.514593 i."""
    roots = [across(bent(nodes, 0.01))[0] for nodes in (21, 41, 81)]
    exact = complex(-0.1, np.sqrt(K1**4 - 0.01))
    errors = [abs(abs(root.imag) - exact.imag) for root in roots]
    assert min(slopes(errors)) > 1.9
    assert rung(bent(41, 0.005), 4.0) == pytest.approx((0.1, 3.514593), rel=1e-3)


def test_a_free_rod_and_its_twist():
    """The first bending mode of a free rod, k = 4.73004, and of twist held at one end, k = pi/2."""
    k = 4.73004074486
    free = {**CLAMPED, "nodes": 41, "start": {}}
    decay, rate = rung(ringing(free, 1e-3, 0.6), 0.6, every=0.01)
    assert decay == pytest.approx(0.1, abs=5e-4)
    assert rate == pytest.approx(np.sqrt(k**4 - 0.01), rel=4e-3)
    twisted = {**CLAMPED, "twisting": 2.0, "radius": 0.1, "rotary_inertia": 0.05, "nodes": 41}
    twisted["shape"] = {"kind": "straight", "twist": "1e-3*pi/2*cos(pi*s/2)"}
    fluid = {**LIGHT, "drag": {**DRAG, "spin": 0.1}}
    simulation = Simulation(scene({"rod": twisted}, fluid, end=2.0, step=2e-3))
    angle: list[float] = []
    for i in range(1, 101):
        simulation.advance(0.02 * i, lambda: None)
        e1, e2 = simulation.configuration.e1, simulation.configuration.e2
        angle.append(float(np.arctan2(e1[-1] @ e2[0], e1[-1] @ e1[0])))
    decay, rate = ring(np.array(angle), 0.02)
    assert (decay, rate) == pytest.approx((1.0, np.sqrt(2.0 * (np.pi / 2) ** 2 / 0.05 - 1.0)), rel=5e-3)


def test_a_falling_rod_speeds_up_to_its_terminal_velocity():
    """v = (w/zeta)(1 - e^(-zeta t/m)) along itself, to second order."""
    rod = {**CLAMPED, "start": {}, "anchor": "middle", "mass": 3.0, "loads": {"weight": [5.0, 0, 0]}}
    errors = []
    for dt in (0.1, 0.05, 0.025):
        simulation = run(scene({"rod": rod}, {"model": "rft", "drag": {"perp": 2.0, "par": 2.0}}, end=1.5, step=dt))
        speed = simulation.snapshot().filaments["rod"].velocity[:, 0]
        errors.append(float(np.abs(speed - 2.5 * (1 - np.exp(-2.0 * 1.5 / 3.0))).max()))
    assert errors[-1] < 1e-3
    assert min(slopes(errors)) > 1.8


def test_a_rod_towed_at_constant_acceleration_needs_drag_and_mass_times_it():
    """zeta V L + m L a at its clamp; it trails by a stretch that is small, and by then at rest."""
    rod = {**CLAMPED, "mass": 2.0, "start": {"end": "clamped", "moves": ["-0.5*3*t**2", 0, 0]}}
    simulation = run(scene({"rod": rod}, {"model": "rft", "drag": {"perp": 9.0, "par": 4.0}}, end=1.0, step=0.01))
    pull = simulation.snapshot().filaments["rod"].reaction_start
    assert pull is not None
    assert pull[0] == pytest.approx(-(4.0 * 3.0 + 2.0 * 3.0), rel=2e-3)


def energies(dt: float) -> tuple[float, float]:
    """What is lost of elastic and kinetic energy, and what drag turned into heat, of a bent rod let go."""
    rod = {**CLAMPED, "velocity": ["0", "0.3*s**2", "0"], "stretching": 1e4}
    case = scene({"rod": rod}, {"model": "rft", "drag": {"perp": 2.0, "par": 1.0}}, end=0.5, step=dt)
    simulation, heat, stored = Simulation(case), 0.0, []

    def energy() -> float:
        now = simulation.snapshot().filaments["rod"]
        weights = simulation.system.mesh.volume
        bending = 0.5 * float(np.sum(weights * (now.moment[:, :2] ** 2).sum(axis=1)))
        stretching = 0.5 * float(np.sum(now.tension**2) / 1e4 / 20)
        return bending + stretching + float(simulation.snapshot().diagnostics["kinetic_energy"])

    stored.append(energy())
    while simulation.time < 0.5:
        simulation.advance(min(simulation.time + dt, 0.5), lambda: None)
        heat += dt * float(simulation.snapshot().diagnostics["power"])
    stored.append(energy())
    return stored[0] - stored[1], heat


def test_kinetic_and_elastic_energy_go_into_heat():
    """Power on the fluid, the force there being f - m dv/dt; of first order in the step as it is summed here."""
    left = []
    for dt in (4e-3, 2e-3, 1e-3):
        lost, heat = energies(dt)
        left.append(abs(lost - heat) / lost)
    assert left[-1] < 0.02
    assert min(slopes(left)) > 0.8


@pytest.mark.parametrize("method", ["table", "fft", "krylov"])
def test_on_a_grid_a_stiff_rod_falls_as_one_body(method):
    """m L v' = w L - zeta v, zeta the grid's own drag on nodes that move as one, from its mobility."""
    rod = {**CLAMPED, "start": {}, "anchor": "middle", "nodes": 11, "bending": 1e4, "mass": 40.0}
    rod["loads"] = {"weight": [0, -7.0, 0]}
    grid = {"model": "stokes", "box": [2, 2, 2], "cells": [20, 20, 20], "method": method}
    simulation = Simulation(scene({"rod": rod}, grid, end=3.0, step=0.05))
    start, zero = simulation.start, np.zeros((11, 3))
    inner = simulation.model.inner.response(start.r, start.e3, 0.0, 1.0)
    moved = np.zeros((11, 3))
    moved[:, 1] = 1.0
    drag = inner.forced(zero, Prescribed(np.arange(33), moved.ravel()), zero).force[:, 1].sum()
    simulation.advance(3.0, lambda: None)
    speed = simulation.snapshot().filaments["rod"].velocity[:, 1]
    assert speed == pytest.approx(np.full(11, -7.0 / drag * (1 - np.exp(-drag * 3.0 / 40.0))), rel=2e-3)


def test_in_a_fluid_of_hardly_any_density_it_is_that_of_stokes():
    rod = {**CLAMPED, "nodes": 9, "mass": 5.0, "velocity": ["0", "s**2", "0"]}
    grid = {"box": [4, 4, 4], "cells": [32, 32, 32]}
    one = run(scene({"rod": rod}, {**grid, "model": "stokes"}, end=0.3, step=0.01)).configuration.r
    dense = {**grid, "model": "navier-stokes", "density": 1e-6}
    other = run(scene({"rod": rod}, dense, end=0.3, step=0.01)).configuration.r
    assert other == pytest.approx(one, abs=1e-6)
    light = {**rod, "mass": 1e-3}
    assert (
        np.abs(run(scene({"rod": light}, {**grid, "model": "stokes"}, end=0.3, step=0.01)).configuration.r - one).max()
        > 0.01
    )


@pytest.mark.parametrize(
    "fluid",
    [
        LIGHT,
        {"model": "stokes", "box": [2, 2, 2], "cells": [16, 16, 16], "method": "krylov", "thick": True},
        {"model": "navier-stokes", "density": 1.0, "box": [2, 2, 2], "cells": [16, 16, 16]},
    ],
    ids=["rft", "krylov", "navier-stokes"],
)
def test_a_cut_run_goes_on_with_the_same_bits(fluid):
    rod = {**CLAMPED, "nodes": 9, "velocity": ["0", "s**2", "0"]}
    case = scene({"rod": rod}, fluid, end=0.2, step=0.01)
    assert_same_bits(case, 0.1, 0.2)


def test_the_first_output_has_the_velocity_it_is_given():
    simulation = Simulation(scene({"rod": {**CLAMPED, "velocity": ["0", "0.4*s", "0.1"]}}, LIGHT, end=1.0, step=0.01))
    first = simulation.snapshot().filaments["rod"].velocity
    assert first[1:, 1] == pytest.approx(0.4 * simulation.arclength[1:], abs=1e-3)
    assert first[0] == pytest.approx([0, 0, 0])  # held
