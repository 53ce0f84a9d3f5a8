"""The Navier-Stokes fluid against exact solutions, its own scheme, other paths to the same, and Stokes flow."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
import pytest
from scenes import STOKES, rms, run, slopes, swimmer

from ibfil.advection import filters
from ibfil.errors import RunFailed
from ibfil.fields import GridFields
from ibfil.fields_inertia import InertialFields
from ibfil.fluid import Held
from ibfil.grid import Grid, interpolate
from ibfil.immersed_boundary import Immersed, Nodes
from ibfil.kernels import KERNELS
from ibfil.navier_stokes import Background, NavierStokes, Room
from ibfil.past import Past, Weights
from ibfil.simulation import Simulation
from ibfil.slab import Block
from ibfil.stepping import NotConverged
from ibfil.stokes import StokesByTable
from ibfil.timescales import crossing
from ibfil.torque_coupling import TorqueCoupling, TorqueStokesSolve

NOTHING = Held(np.zeros(0, np.int64), np.zeros(0))
FAR = np.array([[0.3, -0.2, 0.1]])  # a node to ask at
ZERO = np.zeros((1, 3))


def fluid(cells=(16, 16, 16), density=1.0, viscosity=0.1, flow=None, parts=None) -> NavierStokes:
    """In a box of 2 pi along x, of cubic cells, with one node that has no slip."""
    grid = Grid([2 * np.pi * n / cells[0] for n in cells], cells)
    made = Immersed(grid, KERNELS["peskin4"], viscosity, np.zeros(1), None, flow)
    background = None if flow is None else Background(grid, flow, parts)
    return NavierStokes(made, density, lambda alpha: StokesByTable(made, alpha), Room(grid), background)


def low(it: NavierStokes) -> np.ndarray:
    """The modes whose products fall on none of the others, (nx, ny, nz//2 + 1)."""
    nx, ny, nz = it.fluid.grid.cells
    axes = [np.fft.fftfreq(nx, 1 / nx), np.fft.fftfreq(ny, 1 / ny), np.fft.rfftfreq(nz, 1 / nz)]
    x, y, z = (4 * np.abs(m) < n for m, n in zip(axes, (nx, ny, nz), strict=True))
    return x[:, None, None] & y[None, :, None] & z


def begin(it: NavierStokes, *fields: np.ndarray) -> None:
    """Gives it the velocities (3, nx, ny, nz) of its last steps, the oldest first, and their advection."""
    for u in fields:
        past = it.past
        past.old, past.now, past.n_old, past.n_now = past.now, past.old, past.n_now, past.n_old
        past.now[:] = np.fft.rfftn(u, axes=(1, 2, 3)) / it.room.flow.size
        modes, k = it.room.flow.modes, np.stack(np.meshgrid(*it.fluid.grid.wave_numbers()[0], indexing="ij"))
        modes[:3] = past.now * smooth(it)
        modes[3:] = 1j * np.cross(k, modes[:3], axis=0)
        it._advect(past.n_now)
    it.past.dt_old = 1.0


def velocity(it: NavierStokes) -> np.ndarray:
    """Its present velocity (3, nx, ny, nz)."""
    return np.fft.irfftn(it.past.now, it.fluid.grid.cells, axes=(1, 2, 3)) * it.room.flow.size


def smooth(it: NavierStokes) -> np.ndarray:
    """The filter, (nx, ny, nz//2 + 1)."""
    fx, fy, fz = filters(it.fluid.grid)
    return fx[:, None, None] * fy[:, None] * fz


def advection(it: NavierStokes) -> np.ndarray:
    """The modes (3, nx, ny, nz//2 + 1) of its present advection, as a step feels them: with 1/alpha = 1 of it alone."""
    return felt(it, 1.0, 0.0)


def felt(it: NavierStokes, n_now: float, n_old: float) -> np.ndarray:
    """The modes of so much of its advection now and before."""
    past = Past(it.fluid.grid, it.density, 0.0)
    past.n_now, past.n_old = it.past.n_now, it.past.n_old
    block = Block(np.zeros_like(past.now), 0, 0)
    past.coast(Weights(1.0, 0.0, 0.0, n_now, n_old, 1.0), block)
    return block.modes


def coast(it: NavierStokes, dt: float, w: float = 0.0) -> None:
    """A step without forces."""
    it.advance(it.response(FAR, ZERO, 0.0, dt * (1 + w) / (1 + 2 * w), w), ZERO)


def places(it: NavierStokes) -> np.ndarray:
    return it.fluid.grid.points().T.reshape(3, *it.fluid.grid.cells)


def vortices(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Taylor-Green: its advection is a gradient, so it decays by exp(-2 nu t) and nothing else."""
    return np.stack([np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y), 0 * x])


def waves(it: NavierStokes, seed: int = 0) -> np.ndarray:
    """A smooth field without divergence that has a bit of everything."""
    rng, (kx, ky, kz) = np.random.default_rng(seed), it.fluid.grid.wave_numbers()[0]
    k = np.stack(np.broadcast_arrays(kx[:, None, None], ky[:, None], kz))
    square = np.sum(k * k, axis=0)
    modes = rng.standard_normal(k.shape) + 1j * rng.standard_normal(k.shape)
    modes *= np.exp(-0.4 * square) * low(it) * (square > 0)
    modes -= k * np.sum(k * modes, axis=0) / np.where(square > 0, square, 1.0)
    u = np.fft.irfftn(modes, it.fluid.grid.cells, axes=(1, 2, 3))
    return u / np.abs(u).max()


# --- advection -------------------------------------------------------------------------------------------------------


def omega_cross_u(it: NavierStokes, u: np.ndarray) -> np.ndarray:
    """P (omega x u) by modes, on a grid twice as fine, where no product is aliased onto those of u's grid."""
    cells, length = it.fluid.grid.cells, it.fluid.grid.box
    fine = [2 * int(n) for n in cells]
    wide = np.zeros((3, fine[0], fine[1], fine[2] // 2 + 1), complex)
    x, y, z = ((n - 1) // 2 for n in cells)
    pick = np.ix_(range(3), np.r_[0 : x + 1, -x:0], np.r_[0 : y + 1, -y:0], np.arange(z + 1))
    wide[pick] = (np.fft.rfftn(u, axes=(1, 2, 3)) / np.prod(cells))[pick]
    frequencies = (np.fft.fftfreq, np.fft.fftfreq, np.fft.rfftfreq)
    kx, ky, kz = (2 * np.pi * f(n, a / n) for f, n, a in zip(frequencies, fine, length, strict=True))
    k = np.stack(np.broadcast_arrays(kx[:, None, None], ky[:, None], kz))

    def real(m):
        return np.fft.irfftn(m, fine, axes=(1, 2, 3)) * np.prod(fine)

    product = np.cross(real(1j * np.cross(k, wide, axis=0)), real(wide), axis=0)
    there = np.fft.rfftn(product, axes=(1, 2, 3)) / np.prod(fine)
    square = np.sum(k * k, axis=0)
    there -= k * np.sum(k * there, axis=0) / np.where(square > 0, square, 1.0)
    out = np.zeros((3, *smooth(it).shape), complex)
    out[pick] = there[pick]
    return out


@pytest.mark.parametrize("cells", [(16, 16, 16), (15, 18, 12)])
def test_advection_is_omega_cross_u_projected_and_filtered(cells):
    it = fluid(cells, density=2.3)
    u = waves(it)
    begin(it, u)
    expected = 2.3 * smooth(it) * omega_cross_u(it, u)
    assert np.abs(expected).max() > 0.01
    assert np.abs(advection(it) - expected).max() < 1e-13
    assert not advection(it)[:, :, :, -1].any() or np.abs(advection(it)[:, :, :, -1]).max() < 1e-15


def test_aliases_of_a_field_as_rods_make_it_are_few():
    """Of a point force's flow, which has all modes: against the same without aliases."""
    it = fluid((32, 32, 32), viscosity=1.0)
    response = it.response(FAR, ZERO, 0.0, 1e6)
    it.advance(response, np.array([[30.0, -10.0, 20.0]]))
    u = np.fft.irfftn(it.past.now * smooth(it), it.fluid.grid.cells, axes=(1, 2, 3)) * 32**3
    expected = smooth(it) * omega_cross_u(it, u)
    wrong, size = np.linalg.norm(advection(it) - expected), np.linalg.norm(expected)
    assert 1e-3 * size < wrong < 0.03 * size


def test_advection_does_no_work_and_moves_no_mean():
    it = fluid()
    u = waves(it)
    begin(it, u)
    n = np.fft.irfftn(advection(it), it.fluid.grid.cells, axes=(1, 2, 3)) * it.room.flow.size
    assert np.abs(np.sum(u * n)) < 1e-12 * np.sum(np.abs(u * n))
    assert np.abs(n.mean(axis=(1, 2, 3))).max() < 1e-17
    assert it.fastest == pytest.approx(np.abs(u).max(), rel=1e-12)
    assert it.longest_step() == pytest.approx(it.fluid.grid.spacing / np.abs(u).max(), rel=1e-12)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_background_flow_advects_and_is_advected(seed):
    """N(U + u) - N(U), each by the fluid that has no background."""
    flow = lambda r, t: np.stack([0.4 + np.sin(r[:, 1]), 0.2 + 0 * r[:, 0], np.cos(r[:, 0] - r[:, 1] + t)], axis=1)  # noqa: E731
    it, plain = fluid(flow=flow), fluid()
    x, y, _ = places(it)
    u, background = waves(it, seed), np.stack([0.4 + np.sin(y), 0.2 + 0 * x, np.cos(x - y)])
    begin(it, u)
    begin(plain, background, background + u)
    expected = felt(plain, 1.0, -1.0)
    assert np.abs(expected).max() > 0.01
    assert np.abs(advection(it) - expected).max() < 1e-14
    assert it.fastest == pytest.approx(np.abs(background + u).max())


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
        it.past.dt_old, dt = 0.0, 1.0 / steps
        for k in range(steps):
            coast(it, dt, 1.0 if order == 2 and k > 0 else 0.0)
        errors.append(np.abs(velocity(it) - np.exp(-0.1) * vortices(x - 0.7, y + 0.4)).max())
    assert slopes(errors) == pytest.approx(order, abs=0.15)
    assert errors[-1] < (3e-3 if order == 1 else 3e-4)


def test_waves_that_disturb_each_other_converge_at_second_order_by_any_steps():
    def end(steps: int, uneven: bool) -> np.ndarray:
        it = fluid(viscosity=0.02)
        begin(it, waves(it))
        it.past.dt_old, old = 0.0, 0.0
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
            it.advance(response, answer.force)
        base, weights = it.fluid.stencil(FAR)
        (kx, ky, kz), (sx, sy, sz) = it.fluid.grid.wave_numbers()
        blob = np.zeros(it.fluid.grid.cells)
        for i in np.ndindex(4, 4, 4):
            at = tuple((base[0] + i) % it.fluid.grid.cells)
            blob[at] += weights[0, 0, i[0]] * weights[0, 1, i[1]] * weights[0, 2, i[2]]
        f = np.fft.rfftn(blob) * force.T[:, :, None, None] / it.fluid.grid.spacing**3
        k = np.stack(np.broadcast_arrays(kx[:, None, None], ky[:, None], kz))
        square, true = np.sum(k * k, axis=0), sx[:, None, None] + sy[:, None] + sz
        f -= k * np.sum(k * f, axis=0) / np.where(square > 0, square, 1.0)
        f *= -np.expm1(-viscosity / density * true * end) / np.where(true > 0, viscosity * true, np.inf)
        u = np.fft.irfftn(f, it.fluid.grid.cells, axes=(1, 2, 3))
        expected = np.sum(u * blob, axis=(1, 2, 3))
        errors.append(np.abs(it.velocity_at(FAR, FAR, ZERO, force, end)[0] - expected).max() / np.abs(expected).max())
        assert np.abs(answer.move[0] / tau - expected).max() < 0.05 * np.abs(expected).max()
    assert slopes(errors) == pytest.approx(2, abs=0.25)
    assert errors[-1] < 1e-4


def test_a_net_force_is_carried_by_the_back_pressure_and_the_fluid_gains_no_momentum():
    it = fluid()
    for k in range(5):
        response = it.response(FAR, ZERO, 0.0, 0.1, float(k > 0))
        it.advance(response, response.forced(np.array([[1.0, 2.0, -3.0]]), NOTHING, ZERO).force)
    assert np.abs(velocity(it)).max() > 0.01
    assert not it.past.now[:, 0, 0, 0].any()
    assert np.abs(velocity(it).mean(axis=(1, 2, 3))).max() < 1e-16


@pytest.mark.parametrize("flow", [None, lambda r, t: np.tile([0.7, -0.4, 0.0], (len(r), 1))])
def test_the_pressure_is_that_of_the_flow_and_of_the_forces(flow):
    it = fluid(density=1.7, flow=flow)
    x, y, _ = places(it)
    begin(it, vortices(x, y))
    fields, names = InertialFields(it, flow), ["velocity", "vorticity", "pressure"]
    base, weights = it.fluid.stencil(FAR)
    found = fields.evaluate(base, weights, ZERO, 0.0, names)
    background = np.zeros(3) if flow is None else np.array([0.7, -0.4, 0.0])
    assert found["velocity"] == pytest.approx(np.moveaxis(vortices(x, y), 0, -1) + background, abs=1e-6)
    assert found["vorticity"][..., 2] == pytest.approx(2 * np.sin(x) * np.sin(y), abs=1e-6)
    assert found["pressure"] == pytest.approx(1.7 / 4 * (np.cos(2 * x) + np.cos(2 * y)), abs=1e-6)
    force = np.array([[1.0, -0.3, 0.7]])
    pushed = fields.evaluate(base, weights, force, 0.0, names)["pressure"] - found["pressure"]
    steady = GridFields(it.fluid.grid, 0.1, None).evaluate(base, weights, force, 0.0, names)["pressure"]
    assert pushed == pytest.approx(steady, abs=1e-5 * float(np.abs(steady).max()))


# --- what it remembers -----------------------------------------------------------------------------------------------


def test_asking_changes_nothing_and_only_the_step_asked_for_last_is_taken():
    it, other = fluid(), fluid()
    for one in (it, other):
        begin(one, 0.5 * waves(one), waves(one))
    first = it.response(FAR, ZERO, 0.0, 0.3, 1.0)
    it.response(FAR, ZERO, 0.0, 0.1)
    with pytest.raises(ValueError, match="asked for last"):
        it.advance(first, ZERO)
    for one in (it, other):
        coast(one, 0.2, 0.7)
    assert np.array_equal(it.past.now, other.past.now)
    assert np.array_equal(it.past.n_now, other.past.n_now)


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
    assert np.array_equal(it.past.now, other.past.now)
    assert (it.time, it.fastest, it.past.dt_old) == (other.time, other.fastest, other.past.dt_old)


# --- rods in it ------------------------------------------------------------------------------------------------------


def inertial(density: float, **more) -> dict:
    return {**STOKES, "model": "navier-stokes", "density": density, **more}


def test_the_fluid_keeps_its_momentum_and_that_of_a_free_rod():
    simulation = run(swimmer(inertial(20.0), rod={"nodes": 21}, end=0.1, step=0.01))
    past = simulation.fluid.past  # type: ignore[attr-defined]
    assert np.abs(past.now).max() > 1e-4
    assert not past.now[:, 0, 0, 0].any()
    frame = simulation.frame()
    force = frame.filaments["rod"].force
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()


@pytest.mark.parametrize(("scheme", "order"), [("semi-implicit", 1), ("implicit", 1), ("implicit", 2)])
def test_order_in_time(scheme, order):
    ends = []
    for steps in (20, 40, 80, 160):
        case = swimmer(
            inertial(30.0),
            rod={"nodes": 15},
            smooth=True,
            stretching=300.0,
            end=0.3,
            step=0.3 / steps,
            scheme=scheme,
            order=order,
        )
        ends.append(run(case).shape.r)
    errors = [rms(a - b) for a, b in pairwise(ends)]
    assert slopes(errors)[-1] == pytest.approx(order, abs=0.3)


def test_explicit_steps_converge_to_what_implicit_ones_do():
    more = {"rod": {"nodes": 11}, "stretching": 100.0, "end": 0.02}
    implicit = run(swimmer(inertial(5.0), step=1e-4, **more)).shape.r
    simulation = run(swimmer(inertial(5.0), step="auto", scheme="explicit", **more))
    dt = simulation.step_length
    assert 5e-4 < dt < 2e-3
    finer = (run(swimmer(inertial(5.0), step=dt / n, scheme="explicit", **more)) for n in (2, 4))
    errors = [rms(one.shape.r - implicit) for one in (simulation, *finer)]
    assert slopes(errors) == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("density", [1.0, 100.0])
def test_explicit_limit_knows_inertia(density):
    """It is where explicit steps stop being stable, or a little below."""
    more = {"rod": {"nodes": 11}, "stretching": 100.0}
    limit = Simulation(swimmer(inertial(density), step=1e-3, **more)).explicit_limit()
    assert limit > 1.5 * Simulation(swimmer(STOKES, step=1e-3, **more)).explicit_limit()
    run(swimmer(inertial(density), step=0.9 * limit, scheme="explicit", end=40 * limit, **more))
    with pytest.raises(RunFailed):
        run(swimmer(inertial(density), step=1.6 * limit, scheme="explicit", end=100 * limit, **more))


def test_hardly_any_inertia_is_stokes_flow():
    period = 2 * np.pi / 10
    settings = {"rod": {"nodes": 21}, "end": period, "step": period / 100}
    stokes, almost, far = (
        run(swimmer(fluid, **settings)).shape.r for fluid in (STOKES, inertial(1e-4), inertial(10.0))
    )
    assert rms(almost - stokes) < 3e-5
    assert rms(far - stokes) > 1e-3


@pytest.mark.slow
def test_hardly_any_inertia_is_stokes_flow_on_the_papers_grid():
    period = 2 * np.pi / 10
    grid = {"box": [3.2] * 3, "cells": [64] * 3}
    ends = [
        run(swimmer({**fluid, **grid}, stretching=400.0, end=period, step=period / 100))
        for fluid in (STOKES, inertial(1e-4))
    ]
    assert rms(ends[1].shape.r - ends[0].shape.r) < 3e-5


# --- rods that stir it (rotation = "grid") ---------------------------------------------------------------------------


def stirred() -> tuple[NavierStokes, Nodes]:
    """A fluid with one node that stirs it, and the node."""
    grid, axis = Grid([2 * np.pi] * 3, [16] * 3), np.array([[0.6, 0.0, 0.8]])
    made = Immersed(grid, KERNELS["peskin4"], 0.3, np.zeros(1), None, coupling=TorqueCoupling(np.zeros(1), np.ones(1)))
    room = Room(grid, vectors=2)
    return NavierStokes(made, 2.0, lambda alpha: StokesByTable(made, alpha), room), made.nodes(FAR, axis)


def test_a_node_turns_with_half_the_vorticity_of_the_past():
    it, nodes = stirred()
    begin(it, waves(it))
    spin = it.response(FAR, nodes.axes, 0.0, 1e-9).flow[0, 3]  # nothing changes in so short a step
    k = np.stack(
        np.broadcast_arrays(
            *(a.reshape(s) for a, s in zip(it.fluid.grid.wave_numbers()[0], [(-1, 1, 1), (-1, 1), (-1,)], strict=True))
        )
    )
    curl = np.fft.irfftn(1j * np.cross(k, it.past.now, axis=0), it.fluid.grid.cells, axes=(1, 2, 3)) * 16**3
    expected = 0.5 * interpolate(nodes.base, nodes.weights, curl)[0] @ nodes.axes[0]
    assert abs(expected) > 0.01
    assert spin == pytest.approx(expected, rel=1e-6)


def test_a_torque_on_fluid_at_rest_leaves_the_flow_that_the_stirred_solve_has():
    it, nodes = stirred()
    tau, push = 0.2, np.array([[0.3, -0.1, 0.2, 0.7]])
    it.advance(it.response(FAR, nodes.axes, 0.0, tau), push)
    solve = TorqueStokesSolve(it.fluid.grid, 0.3, alpha=2.0 / tau)
    expected = solve.velocity(nodes.base, nodes.weights, it.fluid.coupling.lift(nodes.axes, push))[0, :3]
    assert it.velocity_at(FAR, FAR, nodes.axes, push, tau)[0] == pytest.approx(expected, rel=1e-10)


# --- steps that are tried again --------------------------------------------------------------------------------------


def test_a_step_that_fails_and_is_halved_leaves_no_trace_in_the_past(monkeypatch):
    """The same steps, taken without a failure, come to the same."""
    case = swimmer(inertial(10.0), rod={"nodes": 15}, end=0.1, step=0.01)
    one, two = Simulation(case), Simulation(case)
    scheme, tried, fail = one._stepper, [], (1, 5, 6)

    class Failing:
        order = 2

        def step(self, rods, fluid, state, dt):
            tried.append(dt)
            step = scheme.step(rods, fluid, state, dt)
            if len(tried) in fail:
                raise NotConverged("so the test has it", 0)
            return step

    monkeypatch.setattr(one, "_stepper", Failing())
    one.advance(0.1, lambda: None)
    assert one.shortened == len(fail)
    good = [dt for k, dt in enumerate(tried, 1) if k not in fail]
    assert len(set(np.round(good, 9))) > 2
    for dt in good:
        two.accept(two.attempt(dt), two.time + dt)
    assert two.shape.r == pytest.approx(one.shape.r, abs=1e-14)
    assert two.fluid.past.now == pytest.approx(one.fluid.past.now, abs=1e-14)  # type: ignore[attr-defined]


@pytest.mark.parametrize("density", [1.0, 50.0])
def test_the_error_keeps_within_the_tolerance(density):
    """A unit time; the swimmer forgets some of it on the way."""
    settings = {"rod": {"nodes": 15}, "stretching": 300.0, "end": 0.6}
    reference = run(swimmer(inertial(density), step=0.6 / 600, **settings)).shape.r
    for tolerance in (0.1, 0.01):
        simulation = run(swimmer(inertial(density), tolerance=tolerance, **settings))
        assert tolerance / 50 < rms(simulation.shape.r - reference) / 0.6 < tolerance
        assert simulation.steps < 60


# --- steps and the speed of the fluid --------------------------------------------------------------------------------


def test_automatic_steps_let_no_fluid_cross_more_than_a_cell():
    """A stream of 10 past a swimmer, whose own motion asks for 25 steps a period: cells of 1/16, so steps of 1/160.

    Automatic ones are shorter by what rho u h/eta = 10/16 asks for.
    """
    settings = {"rod": {"nodes": 11}, "stretching": 300.0, "end": 2 * np.pi / 10}
    stream = inertial(1.0, flow=["10", "0", "0"])
    assert run(swimmer(inertial(1.0), **settings)).steps in (25, 26)
    for more, part in (({}, crossing(10 / 16)), ({"tolerance": 0.5}, 1.0)):
        simulation, ends = Simulation(swimmer(stream, **settings, **more)), [0.0]
        simulation.advance(settings["end"], lambda s=simulation, ends=ends: ends.append(s.time))
        assert part / 250 < max(np.diff(ends)) < 1.0001 * part / 160


def test_given_steps_in_which_the_fluid_goes_too_far_are_told_once():
    stream = inertial(1.0, flow=["10", "0", "0"])
    simulation = run(swimmer(stream, rod={"nodes": 11}, stretching=300.0, end=0.05, step=0.0125))
    assert simulation.steps == 4
    (told,) = simulation.notices
    assert re.search(r"at t = 0\.0125 the fluid crosses 2\.[0-4] cells in a step.*take a step below 0\.00", told)


def test_single_precision_keeps_single_fields_and_is_off_by_a_millionth():
    """Of the swimmer's length, at Re about 10: rounding of 6e-8 a step, against a motion of 1e-2 a step."""
    runs = []
    for precision in ("double", "single"):
        simulation = run(swimmer({**inertial(10.0), "precision": precision}, rod={"nodes": 21}, end=0.2, step=0.02))
        past = simulation.fluid.past  # type: ignore[attr-defined]
        assert {f.itemsize for f in (past.now, past.old, past.n_now, past.n_old)} == {8 if runs else 16}
        runs.append(simulation.shape.r)
    assert 1e-14 < rms(runs[0] - runs[1]) < 1e-6
