"""The Navier-Stokes fluid against exact solutions, its own scheme and other paths to the same; what it remembers."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.inertial_fluid import FAR, NOTHING, ZERO, advection, begin, coast, fluid, places, velocity, vortices, waves
from helpers.scenes import slopes

from ibfil.fluids.coupling import Nodes
from ibfil.fluids.fields import GridFields
from ibfil.fluids.immersed_boundary import Immersed
from ibfil.fluids.inertial_fields import InertialFields
from ibfil.fluids.navier_stokes import NavierStokes, Workspace
from ibfil.fluids.spaces.periodic import PeriodicSpace
from ibfil.fluids.stokes import StokesByTable
from ibfil.fluids.torque_coupling import TorqueCoupling, TorqueStokesSolve
from ibfil.grid.kernels import KERNELS
from ibfil.grid.periodic_grid import Grid
from ibfil.grid.spreading import interpolate

# --- steps -----------------------------------------------------------------------------------------------------------


def test_taylor_green_is_not_advected_and_decays_by_the_schemes_own_factor():
    it = fluid(density=1.7, viscosity=0.3)
    x, y, _ = places(it)
    u, rate, dt = vortices(x, y), 2 * 0.3 / 1.7, 0.1
    begin(it, u)
    assert np.abs(advection(it)).max() < 5e-16  # round-off of rho u u
    amplitudes, dts = [1.0], [0.0]
    for k in range(12):
        dts.append(dt * (1.0 if k < 6 else 0.8 + 0.1 * k))
        w = dts[-1] / dts[-2] if k > 0 else 0.0
        tau = dts[-1] * (1 + w) / (1 + 2 * w)
        past = amplitudes[-1] if k == 0 else ((1 + w) ** 2 * amplitudes[-1] - w * w * amplitudes[-2]) / (1 + 2 * w)
        amplitudes.append(past / (1 + rate * tau))
        coast(it, dts[-1], w)
        assert np.abs(velocity(it) - amplitudes[-1] * u).max() < 1e-12
        assert np.abs(advection(it)).max() < 5e-16  # round-off of rho u u


@pytest.mark.parametrize("order", [1, 2])
def test_taylor_green_decays_exponentially_at_the_schemes_order(order):
    errors = []
    for steps in (20, 40, 80):
        it = fluid(viscosity=0.25)
        x, y, _ = places(it)
        begin(it, vortices(x, y))
        dt = 1.0 / steps
        for k in range(steps):
            coast(it, dt, 1.0 if order == 2 and k > 0 else 0.0)
        errors.append(np.abs(velocity(it) - np.exp(-0.5) * vortices(x, y)).max())
    assert slopes(errors) == pytest.approx(order, abs=0.12)
    assert errors[-1] < (3e-3 if order == 1 else 3e-5)


@pytest.mark.parametrize("order", [1, 2])
def test_vortices_drift_with_a_uniform_flow(order):
    """An exact solution whose advection does not vanish: u = U + v(x - U t) exp(-2 nu t)."""
    flow = lambda r, t: np.tile([0.7, -0.4, 0.0], (len(r), 1))  # noqa: E731
    errors = []
    for steps in (20, 40, 80):
        it = fluid(viscosity=0.05, flow=flow)
        x, y, _ = places(it)
        begin(it, vortices(x, y))
        it.history.dt_old, dt = 0.0, 1.0 / steps
        for k in range(steps):
            coast(it, dt, 1.0 if order == 2 and k > 0 else 0.0)
        errors.append(np.abs(velocity(it) - np.exp(-0.1) * vortices(x - 0.7, y + 0.4)).max())
    assert slopes(errors) == pytest.approx(order, abs=0.15)
    assert errors[-1] < (3e-3 if order == 1 else 3e-4)


def test_waves_that_disturb_each_other_converge_at_second_order_by_any_steps():
    def end(steps: int, uneven: bool) -> np.ndarray:
        it = fluid(viscosity=0.02)
        begin(it, waves(it))
        it.history.dt_old, old = 0.0, 0.0
        for k in range(steps):
            dt = (1.0 + (0.4 * (-1) ** k if uneven else 0.0)) / steps
            coast(it, dt, dt / old if old else 0.0)
            old = dt
        return velocity(it)

    reference = end(640, False)
    for uneven in (False, True):
        errors = [np.abs(end(n, uneven) - reference).max() for n in (20, 40, 80)]
        assert slopes(errors) == pytest.approx(2, abs=0.2)
        assert errors[-1] < 5e-4


def test_a_point_force_sets_the_fluid_in_motion_as_the_unsteady_stokes_equation_says():
    """The velocity at the node is a sum over modes, each of which grows like (1 - exp(-nu k^2 t))/(eta k^2)."""
    density, viscosity, end = 2.0, 0.3, 0.4
    force, errors = np.array([[0.3, 0.2, -0.1]]) * 1e-6, []  # advection is too small to be seen
    for steps in (20, 40, 80):
        it = fluid(density=density, viscosity=viscosity)
        for k in range(steps):
            w = 1.0 if k else 0.0
            tau = end / steps * (1 + w) / (1 + 2 * w)
            response = it.response(FAR, ZERO, 0.0, tau, w)
            answer = response.forced(force, NOTHING, ZERO)
            it.advance(response, ZERO, answer.force)
        base, weights = it.immersed.stencil(FAR)
        (kx, ky, kz), (sx, sy, sz) = it.grid.wave_numbers()
        blob = np.zeros(it.grid.cells)
        for i in np.ndindex(4, 4, 4):
            at = tuple((base[0] + i) % it.grid.cells)
            blob[at] += weights[0, 0, i[0]] * weights[0, 1, i[1]] * weights[0, 2, i[2]]
        f = np.fft.rfftn(blob) * force.T[:, :, None, None] / it.grid.spacing**3
        k = np.stack(np.broadcast_arrays(kx[:, None, None], ky[:, None], kz))
        square, true = np.sum(k * k, axis=0), sx[:, None, None] + sy[:, None] + sz
        f -= k * np.sum(k * f, axis=0) / np.where(square > 0, square, 1.0)
        f *= -np.expm1(-viscosity / density * true * end) / np.where(true > 0, viscosity * true, np.inf)
        u = np.fft.irfftn(f, it.grid.cells, axes=(1, 2, 3))
        expected = np.sum(u * blob, axis=(1, 2, 3))
        errors.append(np.abs(it.velocity_at(FAR, FAR, ZERO, force, end)[0] - expected).max() / np.abs(expected).max())
        assert np.abs(answer.move[0] / tau - expected).max() < 0.05 * np.abs(expected).max()
    assert slopes(errors) == pytest.approx(2, abs=0.25)
    assert errors[-1] < 1e-4


def test_a_net_force_is_carried_by_the_back_pressure_and_the_fluid_gains_no_momentum():
    it = fluid()
    for k in range(5):
        response = it.response(FAR, ZERO, 0.0, 0.1, float(k > 0))
        it.advance(response, ZERO, response.forced(np.array([[1.0, 2.0, -3.0]]), NOTHING, ZERO).force)
    assert np.abs(velocity(it)).max() > 0.01
    assert not it.history.now[:, 0, 0, 0].any()
    assert np.abs(velocity(it).mean(axis=(1, 2, 3))).max() < 1e-16


@pytest.mark.parametrize("flow", [None, lambda r, t: np.tile([0.7, -0.4, 0.0], (len(r), 1))])
def test_the_pressure_is_that_of_the_flow_and_of_the_forces(flow):
    it = fluid(density=1.7, flow=flow)
    x, y, _ = places(it)
    begin(it, vortices(x, y))
    fields, names = InertialFields(it, flow), ["velocity", "vorticity", "pressure"]
    base, weights = it.immersed.stencil(FAR)
    found = fields.evaluate(base, weights, ZERO, 0.0, names)
    background = np.zeros(3) if flow is None else np.array([0.7, -0.4, 0.0])
    assert found["velocity"] == pytest.approx(np.moveaxis(vortices(x, y), 0, -1) + background, abs=1e-6)
    assert found["vorticity"][..., 2] == pytest.approx(2 * np.sin(x) * np.sin(y), abs=1e-6)
    assert found["pressure"] == pytest.approx(1.7 / 4 * (np.cos(2 * x) + np.cos(2 * y)), abs=1e-6)
    force = np.array([[1.0, -0.3, 0.7]])
    pushed = fields.evaluate(base, weights, force, 0.0, names)["pressure"] - found["pressure"]
    steady = GridFields(it.grid, 0.1, None).evaluate(base, weights, force, 0.0, names)["pressure"]
    assert pushed == pytest.approx(steady, abs=1e-5 * float(np.abs(steady).max()))


# --- what it remembers -----------------------------------------------------------------------------------------------


def test_asking_changes_nothing_and_only_the_step_asked_for_last_is_taken():
    it, other = fluid(), fluid()
    for one in (it, other):
        begin(one, 0.5 * waves(one), waves(one))
    first = it.response(FAR, ZERO, 0.0, 0.3, 1.0)
    it.response(FAR, ZERO, 0.0, 0.1)
    with pytest.raises(ValueError, match="asked for last"):
        it.advance(first, ZERO, ZERO)
    for one in (it, other):
        coast(one, 0.2, 0.7)
    assert np.array_equal(it.history.now, other.history.now)
    assert np.array_equal(it.history.n_now, other.history.n_now)


def test_operators_are_made_when_the_step_changes_and_not_for_its_round_off():
    it, made = fluid(), []
    make = it._make
    it._make = lambda alpha: made.append(alpha) or make(alpha)
    for k, dt in enumerate([0.1, 0.1, 0.1 * (1 + 1e-14), 0.1, 0.05, 0.05, 0.05]):
        coast(it, dt, float(k not in (0, 4)))
    assert made == pytest.approx([10.0, 15.0, 20.0, 30.0])


def test_memory_is_all_there_is():
    it, other = fluid(), fluid()
    assert it.memory() == {}
    begin(it, 0.5 * waves(it), waves(it))
    coast(it, 0.2, 0.7)
    other.recall(
        {key: np.copy(value) if isinstance(value, np.ndarray) else value for key, value in it.memory().items()}
    )
    for one in (it, other):
        coast(one, 0.1, 0.5)
    assert np.array_equal(it.history.now, other.history.now)
    assert (it.time, it.fastest, it.history.dt_old) == (other.time, other.fastest, other.history.dt_old)


# --- rods that stir it (rotation = "grid") ---------------------------------------------------------------------------


def stirred() -> tuple[NavierStokes, Nodes]:
    """A fluid with one node that stirs it, and the node."""
    grid, axis = Grid([2 * np.pi] * 3, [16] * 3), np.array([[0.6, 0.0, 0.8]])
    coupling = TorqueCoupling(np.zeros(1), np.ones(1))
    made = Immersed(PeriodicSpace.of(grid), KERNELS["peskin4"], 0.3, np.zeros(1), None, coupling=coupling)
    workspace = Workspace(grid, vectors=2)
    return NavierStokes(made, 2.0, lambda alpha: StokesByTable(made, alpha), workspace), made.nodes(FAR, axis)


def test_a_node_turns_with_half_the_vorticity_of_the_past():
    it, nodes = stirred()
    begin(it, waves(it))
    spin = it.response(FAR, nodes.axes, 0.0, 1e-9).flow[0, 3]  # nothing changes in so short a step
    k = np.stack(
        np.broadcast_arrays(
            *(a.reshape(s) for a, s in zip(it.grid.wave_numbers()[0], [(-1, 1, 1), (-1, 1), (-1,)], strict=True))
        )
    )
    curl = np.fft.irfftn(1j * np.cross(k, it.history.now, axis=0), it.grid.cells, axes=(1, 2, 3)) * 16**3
    expected = 0.5 * interpolate(nodes.base, nodes.weights, curl)[0] @ nodes.axes[0]
    assert abs(expected) > 0.01
    assert spin == pytest.approx(expected, rel=1e-6)


def test_a_torque_on_fluid_at_rest_leaves_the_flow_that_the_stirred_solve_has():
    it, nodes = stirred()
    tau, push = 0.2, np.array([[0.3, -0.1, 0.2, 0.7]])
    it.advance(it.response(FAR, nodes.axes, 0.0, tau), 0 * push, push)
    solve = TorqueStokesSolve(it.grid, 0.3, alpha=2.0 / tau)
    expected = solve.velocity(nodes.base, nodes.weights, it.immersed.coupling.to_grid(nodes.axes, push))[0, :3]
    assert it.velocity_at(FAR, FAR, nodes.axes, push, tau)[0] == pytest.approx(expected, rel=1e-10)
