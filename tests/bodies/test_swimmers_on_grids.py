"""Swimmers on a grid: against a rigid mobility solve, in flows, alone; and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.bacterium import BOX, FREE, WALL, bacterium

from ibfil.case.reading import parse_case
from ibfil.errors import CaseError
from ibfil.fluids.shells.calibration import fitted
from ibfil.simulation.simulation import Simulation

SWIMMER = """
[filament.tail]
length = 0.8
nodes = 13
bending = 1.0
twisting = 1.0
stretching = 1e4
radius = 0.02
curvature = ["{bend}", 0]
position = [0.2, 0, 0]
anchor = "start"
start = {{ end = "body", body = "head" }}
[body.head]
shape = {{ kind = "ellipsoid", axes = [0.2, 0.15, 0.15] }}
position = [0, 0, 0]
[fluid]
{fluid}
kernel = "bspline4"
viscosity = 1.3
[time]
end = 1.0
step = 0.02
[output]
every = 1.0
"""


def swimmer(fluid: str, bend: str = "0") -> Simulation:
    return Simulation(parse_case(SWIMMER.format(fluid=fluid, bend=bend), "swimmer"))


def rigid(sim: Simulation) -> tuple[np.ndarray, float, np.ndarray]:
    """Velocity and rate (6,) of the swimmer that bends nowhere, its motor's torque, and all forces (c (n + k),).

    M F = B V + b alpha, with the exact mobility of the run's own nodes and markers; force and torque of all F zero.
    """
    there, immersed = sim._there, sim.fluid.immersed
    n, centre = sim.system.rows.n, there.r[sim.system.rows.n]
    nodes = immersed.all_nodes(there.r, there.e3)
    r = np.concatenate([there.r[:n], immersed.shells.places(there.r, there.e3)])
    e3, axis = there.e3[:n], sim.system.rows.poses(there).axes[0][:, 0]
    c = immersed.coupling.components
    matrix = immersed.exact.matrix(nodes, immersed.own)
    keep = np.ones((len(r), c), bool)
    keep[n:, 3:] = False
    keep = keep.ravel()
    spins = np.zeros(n) if immersed.spin_drag is None else immersed.spin_drag

    def motion(v, rate):
        out = np.zeros((len(r), c))
        turn = np.zeros((len(r), 3)) + v[3:]
        turn[:n] += rate * axis
        out[:, :3] = v[:3] + np.cross(turn, r - centre)
        if c == 4:
            out[:n, 3] = (e3 * turn[:n]).sum(axis=1)
        return out, spins * (e3 * turn[:n]).sum(axis=1)

    def wrench(v, rate):
        moved, torque = motion(v, rate)
        felt = np.zeros(len(r) * c)
        felt[keep] = np.linalg.solve(matrix[np.ix_(keep, keep)], moved.ravel()[keep])
        felt = felt.reshape(-1, c)
        about = np.cross(r - centre, felt[:, :3])
        about[:n] += (torque + (felt[:n, 3] if c == 4 else 0.0))[:, None] * e3
        return np.concatenate([felt[:, :3].sum(axis=0), about.sum(axis=0)]), axis @ about[:n].sum(axis=0), felt

    by_each = np.array([wrench(v, 0.0)[0] for v in np.eye(6)]).T
    v = np.linalg.solve(by_each, -wrench(np.zeros(6), 1.0)[0])
    return v, *wrench(v, 1.0)[1:]


@pytest.mark.parametrize(
    "fluid", [BOX, FREE, FREE + '\nrotation = "grid"', WALL], ids=["box", "free", "torques", "wall"]
)
def test_a_bacterium_moves_as_the_rigid_one(fluid):
    """Its motor's torque, its velocity and counter-rotation; total force and torque zero; markers' forces, flow."""
    sim = bacterium(fluid, up=0.4 if "wall" in fluid else 0.0)
    sim.advance(0.1, lambda: None)
    now, (v, torque, felt) = sim.snapshot(), rigid(sim)
    head, motor = now.bodies["head"], now.motors["tail_start"]
    for found, known in ((head.velocity, v[:3]), (head.spin, v[3:])):
        np.testing.assert_allclose(found, known, atol=1e-3 * np.linalg.norm(known))
    assert motor.torque == pytest.approx(torque, rel=1e-3)
    largest = max(np.abs(now.filaments["tail"].force).max(), np.abs(felt).max())
    for total in (now.diagnostics["net_force"], now.diagnostics["net_torque"]):
        assert np.abs(total).max() < 1e-12 * largest
    np.testing.assert_allclose(head.force, felt[sim.system.rows.n :, :3].sum(axis=0), atol=2e-2 * largest)


@pytest.mark.parametrize(("rotation", "flow"), [("grid", "0"), ("local", "3 + 2*sin(pi*x)")])
def test_power_becomes_heat_and_the_flow_is_that_of_all(rotation, flow):
    """Of nodes and markers, recovered from the body's force and torque; a probe on a marker moves with the body.

    In a flow they do work upon it too, and that of markers is as large as that of nodes.
    """
    for fluid in (BOX, FREE):
        sim = bacterium(fluid + f'\nrotation = "{rotation}"\nflow = ["0", "{flow}", "{flow}"]')
        sim.advance(0.04, lambda: None)
        step = sim.attempt(0.02)
        there, shells, rows = step.there, sim.fluid.immersed.shells, sim.system.rows
        found = sim.model.fluid_model.output(sim.rods, sim.fluid)
        heat = found.dissipation(there, step.velocity, step.force, 0.06)
        power = float(np.sum(step.velocity * step.force))
        assert heat["dissipation"] + heat["background_power"] == pytest.approx(power, rel=1e-9)
        assert (abs(heat["background_power"]) > 1e-3 * power) == (flow != "0")
        assert heat["grid_power"] == pytest.approx(heat["flow_dissipation"], rel=1e-9)
        marks = shells.places(there.r, there.e3)[::7]
        u = sim.fluid.velocity_at(marks, there.r, there.e3, step.force, 0.06)
        turn = step.velocity[shells.nodes + 1, :3] / rows.length
        known = step.velocity[shells.nodes, :3] + np.cross(turn, marks - there.r[shells.nodes])
        np.testing.assert_allclose(u, known, atol=1e-11)


@pytest.mark.parametrize("rotation", ["local", "grid"])
def test_a_flow_that_turns_and_moves_carries_a_swimmer_along(rotation):
    """Rigid, and nothing pushes the fluid: its place by the turn about the flow's axis."""
    sim = swimmer(FREE + f'\nrotation = "{rotation}"\nflow = ["0.2 - 0.5*y", "0.5*x", "0"]')
    sim.advance(0.2, lambda: None)
    head = sim.snapshot().bodies["head"]
    known = [0.4 * np.sin(0.1), 0.4 - 0.4 * np.cos(0.1), 0.0]  # about (0, 0.4)
    np.testing.assert_allclose(
        head.position, known, atol=4e-5
    )  # the first step asks the flow where it begins: dt^2/2 of 0.1
    np.testing.assert_allclose(head.e1, [np.cos(0.1), np.sin(0.1), 0.0], atol=4e-5)
    np.testing.assert_allclose(head.spin, [0.0, 0.0, 0.5], atol=2e-4)
    assert np.abs(sim.snapshot().filaments["tail"].force).max() < 2e-3


def test_steps_are_of_second_order():
    """Where the head is and points after a beat that begins from rest, as steps are halved."""
    ends = []
    for count in (8, 16, 32):
        sim = swimmer(FREE, "4*(1 - cos(3*t))*s")
        for _ in range(count):
            sim.accept(sim.attempt(1.0 / count), sim.time + 1.0 / count)
        head = sim.snapshot().bodies["head"]
        ends.append(np.concatenate([head.position, head.e1]))
    ratio = np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(ends[1] - ends[2])
    assert 3.3 < ratio < 4.7


ALONE = """
[filament.far]
length = 1.0
nodes = 11
bending = 1.0
stretching = 1e4
position = [0, 60, 0]
[body.ball]
shape = {{ kind = "sphere", radius = 0.2 }}
{motion}
[fluid]
{fluid}
kernel = "bspline4"
viscosity = 1.3
[time]
end = 0.1
step = 0.02
[output]
every = 0.1
"""


def test_a_sphere_alone_is_moved_and_turned_against_its_drag():
    """Stokes' force for a given motion, his velocity for a force; its torque by the radius it turns with."""
    moved = 'motion = { moves = ["0.5*t", "0", "0"], turns = ["0", "0", "2*t"] }'
    found = []
    for motion in (moved, "force = [1.0, 0, 0]"):
        sim = Simulation(parse_case(ALONE.format(motion=motion, fluid=FREE), "ball"))
        sim.advance(0.1, lambda: None)
        found.append(sim.snapshot().bodies["ball"])
    drag, (given, pushed) = 6 * np.pi * 1.3 * 0.2, found
    np.testing.assert_allclose(given.force, [0.5 * drag, 0, 0], atol=5e-4 * drag)
    np.testing.assert_allclose(given.reaction, given.force, atol=1e-12)
    np.testing.assert_allclose(pushed.velocity, [1 / drag, 0, 0], atol=1e-3 / drag)
    turning = 2 * 8 * np.pi * 1.3 * 0.2**3 / fitted((4.0, 4.0, 4.0), "bspline4", 1.75, False).rotation[2]
    np.testing.assert_allclose(given.torque, [0, 0, turning], atol=3e-3 * turning)


FAULTS = {
    "body.head: found markers at z = ": {"fluid": WALL, "up": 0.15},
    'fluid.precision: found "single" in a scene with bodies; allowed: "double"': {
        "fluid": FREE + '\nprecision = "single"'
    },
    "found a semi-axis of 2 cells, within which markers would lie at": {"fluid": FREE.replace("0.05", "0.1")},
}


@pytest.mark.parametrize("fault", list(FAULTS))
def test_what_is_not_there_is_refused(fault):
    with pytest.raises(CaseError) as caught:
        bacterium(**({"fluid": FREE} | FAULTS[fault]))
    assert fault in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_bodies_in_each_other_are_refused():
    more = '[body.other]\nshape = { kind = "sphere", radius = 0.2 }\nposition = [0.1, 0, 0]'
    with pytest.raises(CaseError, match=r"body.other: found markers .* cells from those of head; allowed: 0.4 cells"):
        bacterium(FREE, more=more)
