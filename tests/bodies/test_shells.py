"""Shells of markers: their points, the radius that they have, and swimmers on a grid against a rigid mobility solve."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.bodies.markers import area, markers
from ibfil.bodies.resistance import ellipsoid
from ibfil.bodies.rotation import rotation
from ibfil.case.reading import parse_case
from ibfil.errors import CaseError
from ibfil.fluids.coupling import TRANSLATION, Nodes
from ibfil.fluids.shells.calibration import fitted
from ibfil.fluids.shells.shell import Shells
from ibfil.fluids.spaces.free import FreeSpace
from ibfil.fluids.spaces.periodic import PeriodicSpace
from ibfil.fluids.spaces.wall import NoSlipWall
from ibfil.grid.kernels import KERNELS
from ibfil.simulation.simulation import Simulation

from ..helpers.bacterium import cell

SPACING = 1.75
PLACE = np.array([0.23, 0.41, 0.07])  # in a cell: none of those by which shells are fitted
BOX = 'model = "stokes"\nbox = [2.4, 2.4, 2.4]\ncells = [48, 48, 48]'
WALL = 'model = "stokes"\nbox = "free"\nspacing = 0.05\nwall = "no-slip"'
FREE = 'model = "stokes"\nbox = "free"\nspacing = 0.05'

BACTERIUM = """
{cell}{more}
[fluid]
{fluid}
kernel = "bspline4"
viscosity = 1.3
[time]
end = 0.1
step = 0.02
[output]
every = 0.1
probes = [[0.5, 0.3, 0.1]]
[observe.heat]
kind = "dissipation"
"""

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


def bacterium(fluid: str, nodes: int = 25, more: str = "", up: float = 0.0) -> Simulation:
    return Simulation(parse_case(BACTERIUM.format(cell=cell(nodes, 1.5, up), more=more, fluid=fluid), "bacterium"))


@pytest.mark.parametrize("axes", [(4.0, 4.0, 4.0), (6.0, 3.0, 3.0), (5.0, 4.0, 3.0)])
def test_markers_lie_evenly_on_their_ellipsoid(axes):
    size = np.array(axes)
    points = markers(size, round(area(size) / SPACING**2))
    np.testing.assert_allclose(np.linalg.norm(points / size, axis=1), 1.0, rtol=1e-12)
    between = np.linalg.norm(points[:, None] - points, axis=2) + 9 * np.eye(len(points))
    nearest = between.min(axis=1)
    assert nearest.min() > 0.85 * SPACING  # of 1.07, were they all at the corners of even triangles
    assert nearest.max() < 1.25 * SPACING
    np.testing.assert_array_equal(points, markers(size, len(points)))


def resistance(space, kernel: str, points: np.ndarray, place: np.ndarray = PLACE) -> np.ndarray:
    """The 6 x 6 of a rigid shell of points (k, 3) about the origin of the body, at a place of its own in a cell."""
    levers = Shells(0, (points,), 1.0).levers(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]), 6)
    nodes = Nodes(*space.stencil(KERNELS[kernel], points + place), np.zeros_like(points))
    mobility = space.mobility(TRANSLATION, KERNELS[kernel].points, 1.0).matrix(nodes, np.zeros_like(points))
    return levers.T @ np.linalg.solve(mobility, levers)


@pytest.mark.parametrize("kernel", ["peskin4", "bspline4"])
def test_a_sphere_is_dragged_with_the_radius_that_is_asked_for(kernel):
    """Stokes' 6 pi eta a in free space, at a place in the cell and an orientation that were not used to find it."""
    a = 4.3
    points = fitted((a, a, a), kernel, SPACING, False).markers @ rotation(np.array([0.4, -0.2, 0.9])).T
    found = resistance(FreeSpace(1.0), kernel, points)
    np.testing.assert_allclose(np.diag(found)[:3], 6 * np.pi * a, rtol=1.5e-3)
    turning = fitted((a, a, a), kernel, SPACING, True).markers
    np.testing.assert_allclose(np.diag(resistance(FreeSpace(1.0), kernel, turning))[3:], 8 * np.pi * a**3, rtol=3e-3)


def test_a_sphere_in_a_box_is_slowed_by_its_images():
    """Hasimoto's series at a/L = 0.1; its turning by 1 - (4 pi/3) x^3, with the radius of turning that it has."""
    a, side = 3.2, 32
    fit = fitted((a, a, a), "bspline4", SPACING, False)
    space = PeriodicSpace((float(side),) * 3, (side,) * 3)
    mobility = np.linalg.inv(resistance(space, "bspline4", fit.markers))
    x = a / side
    slowed = 1 - 2.837297 * x + 4.18879 * x**3 - 27.4 * x**6
    np.testing.assert_allclose(np.diag(mobility)[:3] * 6 * np.pi * a, slowed, rtol=1.5e-3)
    own = (8 * np.pi * np.diag(mobility)[3:] / (1 - 4 * np.pi / 3 * x**3)) ** (-1 / 3)
    np.testing.assert_allclose(own, a * fit.rotation ** (-1 / 3), rtol=1e-3)


def brenner(a: float, height: float) -> float:
    """The mobility towards a no-slip wall over that far from it (Brenner 1961): an exact series."""
    angle, n = np.arccosh(height / a), np.arange(1, 60)
    above = 2 * np.sinh((2 * n + 1) * angle) + (2 * n + 1) * np.sinh(2 * angle)
    below = 4 * np.sinh((n + 0.5) * angle) ** 2 - (2 * n + 1) ** 2 * np.sinh(angle) ** 2
    terms = n * (n + 1) / ((2 * n - 1) * (2 * n + 3)) * (above / below - 1)
    return 1.0 / float(4 / 3 * np.sinh(angle) * terms.sum())


def test_a_sphere_near_a_wall():
    """Towards a no-slip wall by Brenner's series, along it by Faxen's; its surface is three cells from the wall."""
    a, height = 4.0, 7.0
    points = fitted((a, a, a), "bspline4", SPACING, False).markers
    found = resistance(NoSlipWall(1.0), "bspline4", points, np.array([0.3, 0.1, height]))
    mobility, x = np.diag(np.linalg.inv(found))[:3] * 6 * np.pi * a, a / height
    assert mobility[2] == pytest.approx(brenner(a, height), rel=0.01)
    along = 1 - 9 / 16 * x + x**3 / 8 - 45 / 256 * x**4 - x**5 / 16
    np.testing.assert_allclose(mobility[:2], along, rtol=0.01)


def test_an_ellipsoid_has_its_mean_mobility():
    """And each axis to a percent; turning about the long one is off by what the fit tells."""
    axes = np.array([6.0, 4.0, 3.0])
    fit = fitted((6.0, 4.0, 3.0), "bspline4", SPACING, False)
    found, known = np.linalg.inv(resistance(FreeSpace(1.0), "bspline4", fit.markers)), ellipsoid(axes, 1.0)
    ratio = np.diag(found)[:3] * known.translation
    assert np.sum(np.diag(found)[:3]) == pytest.approx(np.sum(1 / known.translation), rel=1e-3)
    np.testing.assert_allclose(ratio, 1.0, atol=0.01)
    np.testing.assert_allclose(np.diag(found)[3:] * known.rotation, fit.rotation, rtol=5e-3)


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
    turning = 2 * 8 * np.pi * 1.3 * 0.2**3 / fitted((4.0, 4.0, 4.0), "bspline4", SPACING, False).rotation[2]
    np.testing.assert_allclose(given.torque, [0, 0, turning], atol=3e-3 * turning)


FAULTS = {
    "body.head: found markers at z = ": {"fluid": WALL, "up": 0.15},
    'fluid.method: found "fft" in a scene with bodies; allowed: "table" or "auto"': {"fluid": BOX + '\nmethod = "fft"'},
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


INERTIAL = BOX.replace('"stokes"', '"navier-stokes"') + "\ndensity = {density}"


def test_with_little_inertia_a_bacterium_moves_as_without():
    """To the tolerance of Newton's iteration over a step; with more of it differently."""
    found = []
    for fluid in (BOX, INERTIAL.format(density=1e-6), INERTIAL.format(density=30.0)):
        sim = bacterium(fluid, nodes=13)
        sim.advance(0.06, lambda: None)
        found.append(sim.snapshot().bodies["head"])
    np.testing.assert_allclose(found[1].velocity, found[0].velocity, atol=2e-4 * np.linalg.norm(found[0].velocity))
    np.testing.assert_allclose(found[1].spin, found[0].spin, atol=2e-4 * np.linalg.norm(found[0].spin))
    assert np.linalg.norm(found[2].velocity - found[0].velocity) > 1e-2 * np.linalg.norm(found[0].velocity)


@pytest.mark.parametrize("rotation", ["local", "grid"])
def test_the_fluid_with_inertia_moves_with_the_body_after_each_step(rotation):
    """At the markers its new velocity, of the grid's own fields, is that of the rigid body; a run goes on as it was."""
    sim = bacterium(INERTIAL.format(density=10.0) + f'\nrotation = "{rotation}"', nodes=13)
    sim.advance(0.04, lambda: None)
    again = bacterium(INERTIAL.format(density=10.0) + f'\nrotation = "{rotation}"', nodes=13)
    again.restore(sim.state())
    for one in (sim, again):
        step = one.attempt(0.02)
        one.accept(step, 0.06)
        there, n, shells = step.there, one.system.rows.n, one.fluid.immersed.shells
        places = shells.places(there.r, there.e3)
        u = one.fluid.velocity_at(places, there.r, there.e3, step.force, 0.06)
        turn = step.velocity[n + 1, :3] / one.system.rows.length
        known = step.velocity[n, :3] + np.cross(turn, places - there.r[n])
        np.testing.assert_allclose(u, known, atol=1e-10 * np.abs(known).max())
        assert np.abs(one.snapshot().diagnostics["net_force"]).max() < 1e-12 * np.abs(step.force).max()
    np.testing.assert_array_equal(sim.configuration.table, again.configuration.table)
    assert sim.snapshot().diagnostics["dissipation"] == again.snapshot().diagnostics["dissipation"]
