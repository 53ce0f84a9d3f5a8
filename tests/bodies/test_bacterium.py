"""A sphere and a helix with a motor in resistive-force theory: exact Jacobian, balance, the rigid solve, restart."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.bacterium import cell

from ibfil.bodies.resistance import ellipsoid
from ibfil.case.reading import parse_case
from ibfil.fluids.resistive_force import resist
from ibfil.simulation.simulation import Simulation

CASE = """
{cell}{more}
[fluid]
model = "rft"
drag = "paper"
viscosity = 1.0
[time]
end = 0.4
step = 0.02
[output]
every = 0.4
"""


def bacterium(nodes: int, more: str = "") -> Simulation:
    return Simulation(parse_case(CASE.format(cell=cell(nodes, 3.0), more=more), "bacterium"))


@pytest.mark.parametrize(
    ("axes", "translation", "rotation"),
    [
        ((0.1, 0.1, 0.1), [0.6 * np.pi] * 3, [8e-3 * np.pi] * 3),
        ((1.0, 0.5, 0.5), [11.346877, 12.995817, 12.995817], [5.068499, 9.455730, 9.455730]),
        ((1.0, 1.0, 0.5), [14.942183, 14.942183, 17.064602], [14.220502, 14.220502, 17.719089]),
    ],
)
def test_resistances_of_ellipsoids(axes, translation, rotation):
    """Stokes' sphere; Kim & Karrila's closed forms of spheroids."""
    found = ellipsoid(np.array(axes), 1.0)
    np.testing.assert_allclose(found.translation, translation, rtol=1e-7)
    np.testing.assert_allclose(found.rotation, rotation, rtol=1e-7)


def test_jacobian_by_differences():
    """Places, turns, forces and loads as they follow every unknown of the bodies, after turns of 0.4 rad."""
    sim = bacterium(15, 'force = [0.2, 0.1, -0.4]\ntorque = [0.05, -0.02, 0.03]\nframe = "body"')
    system, start, t = sim.system, sim.start, 0.02
    n, shape = system.rows.n, (system.rows.count, 4)
    rng = np.random.default_rng(0)
    y = np.zeros(shape)
    y[:n] = 1e-3 * rng.standard_normal((n, 4))
    y[n, :3], y[n + 1, :3], y[n + 2, 0] = [0.02, 0.01, 0.03], [0.3, -0.2, 0.25], 0.2

    def at(y):
        there = system.move(start, y)
        force, moment = system.forces(there, t)
        held = system.bodies(start).carried(system.held(0.0, t), start, there, moment, t, y)
        return held.carried, force[:n], system.stiffness(there, start, moment, t)

    y.ravel()[at(y)[0].at] += at(y)[0].value
    carried, _, stiffness = at(y)
    assert np.abs(carried.value).max() < 1e-14
    for k, q in enumerate(carried.by):
        d = np.zeros(shape)
        d.ravel()[q], d.ravel()[carried.at] = 1.0, carried.lever[:, k]
        after, before = at(y + 1e-6 * d), at(y - 1e-6 * d)
        change = (after[1] - before[1]) / 2e-6
        known = stiffness.times(d[:n]) + carried.columns[:, :, k]
        np.testing.assert_allclose(known, change, atol=1e-6 * np.abs(change).max())
        assert np.abs(after[0].value - before[0].value).max() < 1e-14
        np.testing.assert_allclose((after[0].want - before[0].want) / 2e-6, carried.slope[:, k], atol=1e-8)


def test_the_rigid_solve():
    """A stiff swimmer moves as the rigid one of its own nodes: total force and torque zero, motor rate 1."""
    sim = bacterium(49)
    sim.advance(0.4, lambda: None)
    now, there, n = sim.snapshot(), sim._there, sim.system.rows.n
    r, e3, centre = there.r[:n], np.ascontiguousarray(there.e3[:n]), there.r[n]
    axis = sim.system.rows.poses(there).axes[0][:, 0]

    def wrench(v, rate):
        u = np.empty((n, 4))
        u[:, :3] = v[:3] + np.cross(v[3:] + rate * axis, r - centre)
        u[:, 3] = e3 @ (v[3:] + rate * axis)
        felt = resist(sim.fluid.drag, e3, u)
        torque = (np.cross(r - centre, felt[:, :3]) + felt[:, 3:] * e3).sum(axis=0)
        body = np.concatenate([6 * np.pi * 0.2 * v[:3], 8 * np.pi * 0.2**3 * v[3:]])
        return np.concatenate([felt[:, :3].sum(axis=0), torque]) + body, axis @ torque

    matrix = np.array([wrench(v, 0.0)[0] for v in np.eye(6)]).T
    v = np.linalg.solve(matrix, -wrench(np.zeros(6), 1.0)[0])
    head, motor = now.bodies["head"], now.motors["tail_start"]
    for found, rigid in ((head.velocity, v[:3]), (head.spin, v[3:])):
        np.testing.assert_allclose(found, rigid, atol=5e-5 * np.linalg.norm(rigid))
    assert motor.torque == pytest.approx(wrench(v, 1.0)[1], rel=1e-4)
    largest = np.abs(now.filaments["tail"].force).max()
    for total in (now.diagnostics["net_force"], now.diagnostics["net_torque"]):
        assert np.abs(total).max() < 1e-12 * largest
