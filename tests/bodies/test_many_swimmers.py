"""Bodies by FFT and Krylov: the numbers of the exact table, balances to round-off, resumed runs, and the choice."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.bacterium import bacterium
from helpers.swimmers import BOX, FREE, INERTIAL, WALL, simulated

from ibfil.assembly.bodies.swimmers import apart
from ibfil.fluids.shells.interplay import ByTransforms
from ibfil.simulation.simulation import Simulation

TWO = [(0.3, 0.3, 0.5), (0.35, 0.75, 0.6)]
LINK = """
[link.one]
kind = "spring"
between = [{ filament = "tail0", at = "finish" }, { filament = "tail1", at = "finish" }]
stiffness = 2.0
"""
BALL = '[body.ball]\nshape = { kind = "sphere", radius = 0.15 }\nposition = [0.4, 0.5, 1.1]\nforce = [0, 0, "-1 - t"]\n'
FLOW = '\nflow = ["0", "sin(2*pi*x/2.4)", "0"]'
SCENES = {
    "box": (BOX, ""),
    "free": (FREE, BALL),
    "wall": (WALL, ""),
    "free-slip": (WALL.replace("no-slip", "free-slip"), ""),
    "torques": (FREE + '\nrotation = "grid"', ""),
    "flow": (BOX + FLOW, BALL),
    "link": (BOX, LINK),
    "inertia": (INERTIAL, ""),
}


def numbers(sim: Simulation) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Velocities of bodies, forces on the fluid of bodies and nodes, and places of all."""
    now = sim.snapshot()
    rates = [np.concatenate([body.velocity, body.spin]) for body in now.bodies.values()]
    forces = [np.concatenate([body.force, body.torque]) for body in now.bodies.values()]
    forces += [filament.force.ravel() for filament in now.filaments.values()]
    return np.concatenate(rates), np.concatenate(forces), sim.configuration.r


@pytest.mark.parametrize("scene", list(SCENES))
def test_two_swimmers_move_as_by_the_table(scene):
    """Velocities, forces and places, also of a body alone; total force, and without links the torque, to round-off."""
    (fluid, more), known = SCENES[scene], None
    for method in ("table", "krylov", "fft") if scene in ("box", "inertia") else ("table", "krylov"):
        sim = simulated(TWO, f'{fluid}\nmethod = "{method}"', more)
        sim.advance(0.04, lambda: None)
        step = sim.attempt(0.02)
        sim.accept(step, 0.06)
        assert isinstance(step.response, ByTransforms) == (method != "table")
        found, now = numbers(sim), sim.snapshot()
        known = known or found
        for one, other, share in zip(found, known, (3e-7, 3e-7, 1e-8), strict=True):
            np.testing.assert_allclose(one, other, atol=share * np.abs(other).max())
        largest = np.abs(found[1]).max()
        pushed = np.array([0.0, 0.0, -1.06]) if more == BALL else np.zeros(3)
        np.testing.assert_allclose(now.diagnostics["net_force"], pushed, atol=1e-12 * largest)
        if not more:
            assert np.abs(now.diagnostics["net_torque"]).max() < 1e-12 * largest
        if method != "table":
            assert 1 <= step.response.products <= (40 if method == "krylov" else 12)


def test_each_swimmer_feels_the_others():
    """Without what they give each other the numbers are others: the test above could tell."""
    both, alone = simulated(TWO, f'{BOX}\nmethod = "krylov"'), simulated(TWO[:1], BOX)
    for sim in (both, alone):
        sim.advance(0.02, lambda: None)
    one, other = (sim.snapshot().bodies["head0"].velocity for sim in (both, alone))
    assert np.linalg.norm(one - other) > 1e-2 * np.linalg.norm(other)


def test_a_bacterium_turns_back_by_fft_as_by_the_table():
    """Its velocity, its counter-rotation and its motor's torque; heat and the flow at a probe."""
    found = []
    for method in ("table", "pruned"):
        sim = bacterium(f'{BOX}\nmethod = "{method}"', nodes=13)
        sim.advance(0.06, lambda: None)
        now = sim.snapshot()
        head = now.bodies["head"]
        torque = [now.motors["tail_start"].torque, now.diagnostics["dissipation"]]
        found.append(np.concatenate([head.velocity, head.spin, torque, now.diagnostics["probe_velocity"].ravel()]))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6, atol=1e-10)


@pytest.mark.parametrize("fluid", [BOX, INERTIAL], ids=["stokes", "inertia"])
def test_a_run_goes_on_bit_for_bit(fluid):
    first, again = (simulated(TWO, f'{fluid}\nmethod = "krylov"') for _ in range(2))
    first.advance(0.04, lambda: None)
    again.restore(first.state())
    for sim in (first, again):
        sim.accept(sim.attempt(0.02), 0.06)
    np.testing.assert_array_equal(first.configuration.table, again.configuration.table)


def test_heat_and_flow_are_those_of_the_table():
    """The forces of markers are found again from those of bodies, in a flow too; the flow on a marker is its motion."""
    found = []
    for method in ("table", "krylov"):
        sim = simulated(TWO, f'{BOX}{FLOW}\nmethod = "{method}"', BALL)
        sim.advance(0.02, lambda: None)
        step = sim.attempt(0.02)
        there, shells = step.there, sim.fluid.immersed.shells
        heat = sim.model.fluid_model.output(sim.rods, sim.fluid).dissipation(there, step.velocity, step.force, 0.04)
        marks = shells.places(there.r, there.e3)[-9:]  # of the ball
        u = sim.fluid.velocity_at(marks, there.r, there.e3, step.force, 0.04)
        turn = step.velocity[shells.end - 1, :3] / shells.length
        known = step.velocity[shells.end - 2, :3] + np.cross(turn, marks - there.r[shells.end - 2])
        np.testing.assert_allclose(u, known, atol=1e-5 * np.abs(u).max())
        assert heat["dissipation"] + heat["background_power"] == pytest.approx(
            float(np.sum(step.velocity * step.force)), rel=1e-5
        )
        found.append([heat["dissipation"], heat["background_power"], *u.ravel()])
    np.testing.assert_allclose(found[1], found[0], rtol=1e-5, atol=1e-7)


def test_many_swimmers_take_krylov_by_themselves_and_check_says_why():
    """64 cells of 26 markers: their table does not fit; by counts, before anything is built."""
    at = 0.3 + 1.2 * np.arange(4)
    places = [(x, y, z) for x in at for y in at for z in at]
    sim = simulated(places, 'model = "stokes"\nbox = [4.8, 4.8, 4.8]\ncells = [96, 96, 96]')
    assert sim.method == "krylov"
    assert [len(one.bodies) for one in apart(sim.case, sim.rods)] == [1] * 64
    told = sim.model.fluid_model.solved(sim.rods)[0]
    assert "in 64 swimmers or unjoined parts: each solved for by itself" in told
    assert sim.model.seconds["table"] == np.inf
    assert simulated(TWO, BOX).method == "table"


@pytest.mark.parametrize("side", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_a_step_of_many_swimmers(side):
    """Total force and torque to round-off; those at corners of the lattice, out of phase, move differently."""
    at = 0.3 + 1.2 * np.arange(side)
    places = [(x, y, z) for x in at for y in at for z in at]
    wide = [1.2 * side] * 3
    sim = simulated(places, f'model = "stokes"\nbox = {wide}\ncells = {[24 * side] * 3}\nmethod = "krylov"')
    sim.accept(sim.attempt(0.02), 0.02)
    now = sim.snapshot()
    largest = np.abs(numbers(sim)[1]).max()
    for total in (now.diagnostics["net_force"], now.diagnostics["net_torque"]):
        assert np.abs(total).max() < 1e-12 * largest
    assert np.linalg.norm(now.bodies["head0"].velocity - now.bodies["head3"].velocity) > 1e-3
