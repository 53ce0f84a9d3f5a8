"""Thermal forces: the kicks, the scheme's step, and Boltzmann's law for what can be known exactly.

Statistical tests use fixed seeds; what they allow is three standard errors (or the chi-square bound of the same
probability), from the known spread and memory of each mode or, where those are not known, from independent rods.
Units: L = A = 1, drag across 1 per length, so that times are in units of zeta_perp L^4/A.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import tomli_w
from runs import content, go_on, interrupted, real, run
from scipy import linalg, stats

from ibfil import banded, report, rft, timescales
from ibfil.case import Case, parse_case
from ibfil.errors import CaseError
from ibfil.groups import groups, warnings
from ibfil.simulation import Simulation
from ibfil.stepping import State

USUAL = 0.9973  # how often three standard errors are kept
SPIN = 0.02
DRAG = {"perp": 1.0, "par": 0.5, "spin": SPIN}
ROD = {"length": 1.0, "nodes": 9, "bending": 1.0, "stretching": 200.0}
BENT = {**ROD, "twisting": 0.7, "curvature": [2.0, 1.0], "twist_rate": 3.0, "shape": {"kind": "relaxed"}}


def scene(
    rods: Mapping[str, Mapping[str, Any]],
    energy: float = 1e-2,
    *,
    drag: Mapping[str, float] | str = DRAG,
    fluid: Mapping[str, Any] | None = None,
    time: Mapping[str, Any] | None = None,
    **thermal: Any,
) -> Case:
    """Rods with thermal forces of that energy; ``thermal`` and ``time`` hold further keys of those tables."""
    text = {
        "filament": {name: dict(rod) for name, rod in rods.items()},
        "fluid": {"model": "rft", "viscosity": 1.0, "drag": drag, **(fluid or {})},
        "thermal": {"energy": energy, **thermal},
        "time": {"end": 1.0, "step": 1e-4, **(time or {})},
        "output": {"every": 1.0},
    }
    return parse_case(tomli_w.dumps(text), "test.toml")


def many(rod: Mapping[str, Any], count: int, energy: float, dt: float, **more: Any) -> Simulation:
    """A simulation of ``count`` independent rods."""
    return Simulation(scene({f"rod{k}": rod for k in range(count)}, energy, time={"step": dt}, **more))


def walk(simulation: Simulation, steps: int) -> None:
    """Takes steps of the case's length."""
    for _ in range(steps):
        simulation.accept(simulation.attempt(simulation.step_length), simulation.time + simulation.step_length)


def blocks(simulation: Simulation) -> np.ndarray:
    """Z (n, m, m) of every node, from the case alone: half a segment at an end."""
    rod = next(iter(simulation.case.filaments.values()))
    e3, m = simulation.shape.e3, simulation.mechanics.unknowns
    volume = np.full(len(e3), rod.length / (rod.nodes - 1))
    volume[:: rod.nodes] /= 2
    volume[rod.nodes - 1 :: rod.nodes] /= 2
    along = e3[:, :, None] * e3[:, None, :]
    out = np.zeros((len(e3), m, m))
    out[:, :3, :3] = DRAG["perp"] * (np.eye(3) - along) + DRAG["par"] * along
    if m == 4:
        out[:, 3, 3] = SPIN
    return volume[:, None, None] * out


# --- the kicks ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("directions", ["xyz", "xy"])
def test_kicks_have_the_covariance_of_the_drag_and_nodes_know_nothing_of_each_other(directions):
    energy, dt, count = 0.3, 1e-3, 20000
    simulation = Simulation(scene({"rod": BENT}, energy, directions=directions))
    noise, shape = simulation._noise, simulation.shape
    draws = np.array([noise.force(shape, dt) for _ in range(count)]) * dt
    mean = np.asarray(noise.force(shape, 1e300)) * dt  # what does not vanish as the step grows: the drift
    n = len(mean)
    z = blocks(simulation)
    kicked = [0, 1, 2, 3] if directions == "xyz" else [0, 1, 3]
    if directions == "xy":
        assert np.all(draws[:, :, 2] == 0)
    root = np.linalg.cholesky(2 * energy * dt * z[:, kicked][:, :, kicked])
    white = np.linalg.solve(root, (draws - mean)[:, :, kicked].transpose(1, 2, 0)).reshape(n * len(kicked), count)
    covariance = white @ white.T / count
    low, high = stats.chi2.ppf([(1 - USUAL) / 2, (1 + USUAL) / 2], count * len(white)) / (count * len(white))
    assert low < np.trace(covariance) / len(white) < high
    for values in (count * (np.diag(covariance) - 1) ** 2 / 2, count * covariance[np.triu_indices(len(white), 1)] ** 2):
        assert values.sum() < stats.chi2.ppf(USUAL, len(values))
    assert count * np.sum(white.mean(axis=1) ** 2) < stats.chi2.ppf(USUAL, len(white))


CLAMPED = {"end": "clamped"}


@pytest.mark.parametrize("directions", ["xyz", "xy"])
@pytest.mark.parametrize(
    "rod",
    [
        BENT,
        {**BENT, "derivative": 6},
        {**BENT, "spacing": "q*(1 + q)/2"},
        {**BENT, "start": CLAMPED},
        {**BENT, "start": {"end": "hinged"}},
    ],
    ids=["free", "order 6", "uneven", "clamped", "hinged"],
)
def test_the_drift_is_kt_times_the_divergence_of_the_mobility(rod, directions):
    """Each node's mobility is differenced along each direction it is kicked in; others do not enter it."""
    energy, h = 0.3, 1e-5
    simulation = Simulation(scene({"rod": rod}, energy, directions=directions))
    noise, shape = simulation._noise, simulation.shape
    if directions == "xy":  # in the plane, as it is meant
        flat = shape.r * [1, 1, 0]
        shape = simulation.mechanics.start(flat, np.tile([0.0, 0.0, 1.0], (len(flat), 1)))
    drag, dimensions = simulation.fluid.drag, len(directions)

    def mobility(r: np.ndarray, i: int, a: int) -> np.ndarray:
        """Column a of node i's mobility, at positions r."""
        unit = np.zeros((len(r), 4))
        unit[i, a] = 1.0
        return rft.mobilize(drag, simulation.mechanics.measure(r, shape.e1).e3, unit)[i, :3]

    expected = np.zeros_like(shape.r)
    free = np.setdiff1d(np.arange(4 * len(shape.r)), simulation.mechanics.ends.index)
    for i in np.unique(free[free % 4 < 3] // 4):
        for a in range(dimensions):
            there, back = shape.r.copy(), shape.r.copy()
            there[i, a] += h
            back[i, a] -= h
            expected[i] += energy * (mobility(there, i, a) - mobility(back, i, a)) / (2 * h)
    found = rft.mobilize(drag, shape.e3, noise.force(shape, 1e300))
    assert np.max(np.abs(expected)) > 1
    np.testing.assert_allclose(found[:, :3], expected, atol=1e-6 * np.max(np.abs(expected)))
    assert np.max(np.abs(found[:, 3])) < 1e-100


def test_without_the_drift_the_ends_of_a_free_rod_would_be_pushed_inwards_by_one_and_a_half_kt_over_ds():
    energy = 0.3
    simulation = Simulation(scene({"rod": ROD}, energy))
    drift = simulation._noise.force(simulation.shape, 1e300)
    expected = np.zeros((9, 3))
    expected[[0, -1], 0] = np.array([-1, 1]) * 1.5 * energy * 8
    np.testing.assert_allclose(drift, expected, atol=1e-12)


# --- the step -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("force", ["eq44", "torque-free"])
def test_a_step_is_the_linearised_trapezoid(force):
    """(Z - dt/2 K) y = dt (f + Z u0) + xi in full, K by differencing the forces, in a flow, with a spun clamp."""
    rod = {**BENT, "force": force, "start": {**CLAMPED, "spin": 3.0}, "shape": {"kind": "straight"}}
    flow = {"flow": ["0.3*y", "0.2", "10*t"]}
    dt = 1e-3
    simulation = Simulation(scene({"rod": rod}, 1e-3, fluid=flow, time={"step": dt}))
    twin = Simulation(simulation.case)
    start, mechanics = simulation.shape, simulation.mechanics
    n, m = len(start.r), 4
    middle = 0.5 * dt

    def forces(y: np.ndarray) -> np.ndarray:
        return mechanics.forces(mechanics.move(start, y.reshape(n, m)), middle)[0].ravel()

    h = 1e-6
    k = np.array([(forces(h * e) - forces(-h * e)) / (2 * h) for e in np.eye(n * m)]).T
    z = linalg.block_diag(*blocks(simulation))
    kicks = dt * twin._noise.force(start, dt).ravel()
    u0 = np.zeros((n, m))
    u0[:, :3] = np.stack([0.3 * start.r[:, 1], np.full(n, 0.2), np.full(n, 10 * middle)], axis=1)
    held, prescribed = mechanics.ends.index, np.array([0, 0, 0, 3.0 * dt])
    left, right = z - 0.5 * dt * k, dt * (forces(np.zeros(n * m)) + z @ u0.ravel()) + kicks
    free = np.setdiff1d(np.arange(n * m), held)
    expected = np.zeros(n * m)
    expected[held] = prescribed
    expected[free] = np.linalg.solve(left[np.ix_(free, free)], (right - left @ expected)[free])
    step = simulation.attempt(dt)
    np.testing.assert_allclose(step.state.y_old.ravel(), expected, atol=1e-6 * np.max(np.abs(expected)))
    # What the rods do to the fluid is what moves them against it, less its kicks.
    felt = (z @ (expected / dt - u0.ravel()) - kicks / dt).reshape(n, m)
    np.testing.assert_allclose(step.force, felt, atol=1e-5 * np.max(np.abs(felt)))


def test_a_free_rod_gives_the_fluid_no_net_force_however_it_is_kicked():
    simulation = Simulation(scene({"rod": BENT}, 1e-2))
    walk(simulation, 20)
    frame = simulation.frame()
    size = np.sum(np.abs(frame.filaments["rod"].force))
    assert size > 1
    assert np.max(np.abs(frame.diagnostics["net_force"])) < 1e-9 * size


@pytest.mark.parametrize("force", ["eq44", "torque-free"])
@pytest.mark.parametrize("spacing", ["even", "q*(2 + q)/3"])
@pytest.mark.parametrize("ends", [("free", "free"), ("clamped", "free"), ("hinged", "clamped"), ("clamped", "clamped")])
def test_the_stiffness_of_a_straight_rod_at_rest_is_symmetric(ends, spacing, force):
    """Else no drag gives it Boltzmann's law: with stencils of order 6, or the cubic at a clamp, it is not."""
    rod = {**BENT, "curvature": [0, 0], "twist_rate": 0, "spacing": spacing, "force": force, "nodes": 11}
    rod |= {"start": {"end": ends[0]}, "finish": {"end": ends[1]}}
    for derivative in (2, 6):
        simulation = Simulation(scene({"rod": {**rod, "derivative": derivative}}))
        mechanics, shape = simulation.mechanics, simulation.shape
        _, inner = mechanics.forces(shape, 0.0)
        k = banded.dense(mechanics.stiffness(shape, shape, inner, 0.0, False)).reshape(44, 44)
        free = np.setdiff1d(np.arange(44), mechanics.ends.index)
        k = k[np.ix_(free, free)]
        uneven = np.max(np.abs(k - k.T)) / np.max(np.abs(k))
        assert uneven < 1e-12 if derivative == 2 else uneven > 1e-3


# --- linear modes -------------------------------------------------------------------------------------------------


class Modes:
    """Independent linear modes: coordinates q = rows @ x of variance one each, and their rates lam.

    ``strain`` (k, n) are the strains whose squares are the energy kT/2 sum (strain x)^2, ``drag`` (n,) in units of kT.
    """

    def __init__(self, strain: np.ndarray, drag: np.ndarray) -> None:
        root = np.sqrt(drag)
        left, size, _ = np.linalg.svd(strain / root, full_matrices=False)
        kept = size > 1e-9 * size.max()
        self.rows, self.rates = left.T[kept] @ strain, size[kept] ** 2

    def memory(self, dt: float) -> np.ndarray:
        """How much of their squares the modes remember from step to step of the trapezoid."""
        return ((1 - 0.5 * self.rates * dt) / (1 + 0.5 * self.rates * dt)) ** 2

    def needed(self, dt: float, rods: int, error: float) -> tuple[int, int]:
        """Steps until no mode remembers a thousandth of its start, and steps that give each its square to ``error``."""
        longest = np.max(self.memory(dt))
        settled = np.log(1e-3) / np.log(longest)
        return int(settled) + 1, int(2 * (1 + longest) / (1 - longest) / (rods * error**2)) + 1

    def check(self, series: np.ndarray, dt: float) -> None:
        """The variance of ``series`` (steps, rods, modes), of all together and of each, is one."""
        steps, rods, modes = series.shape
        assert modes == len(self.rates)
        memory = self.memory(dt)
        # Of the mean square of a Gaussian series of variance one, whose squares are so remembered.
        error = np.sqrt(2 * (1 + memory) / (1 - memory) / (steps * rods))
        square = np.mean(series**2, axis=(0, 1))
        assert abs(np.mean(square - 1)) < 3 * np.sqrt(np.sum(error**2)) / modes
        assert np.sum(((square - 1) / error) ** 2) < stats.chi2.ppf(USUAL, modes)


def second_difference(nodes: int, clamped: bool) -> np.ndarray:
    """sqrt(ds) r'' inside (kT = A = 1), and at a clamp that of a ghost node, over half a segment."""
    ds = 1.0 / (nodes - 1)
    rows = [np.eye(nodes)[i - 1] - 2 * np.eye(nodes)[i] + np.eye(nodes)[i + 1] for i in range(1, nodes - 1)]
    if clamped:
        rows.insert(0, np.sqrt(0.5) * 2 * (np.eye(nodes)[1] - np.eye(nodes)[0]))
    return np.array(rows) * np.sqrt(ds) / ds**2


@pytest.mark.parametrize(
    ("end", "lam_dt"), [("free", 0.01), ("free", 1.0), ("free", 10.0), ("clamped", 0.01), ("clamped", 1.0)]
)
def test_bending_and_stretching_modes_have_half_kt_each_at_any_step(end, lam_dt):
    """Straight stiff rods; lam is the rate of the slowest bending mode. Backward Euler leaves 1/(1 + lam dt/2)."""
    nodes, rods, energy, stretching = 6, 60, 1e-14, 20.0
    clamped = end == "clamped"
    volume = np.full(nodes, 1.0 / (nodes - 1))
    volume[[0, -1]] /= 2
    free = slice(1 if clamped else 0, None)
    bent = Modes(second_difference(nodes, clamped)[:, free], volume[free])
    ds = 1.0 / (nodes - 1)
    stretched = Modes((np.diff(np.eye(nodes), axis=0) * np.sqrt(stretching / ds))[:, free], 0.5 * volume[free])
    dt = lam_dt / bent.rates.min()
    rod = {**ROD, "nodes": nodes, "stretching": stretching, "start": {"end": end}}
    simulation = many(rod, rods, energy, dt)
    rest = simulation.shape.r.reshape(rods, nodes, 3)
    settle, steps = np.max([bent.needed(dt, 2 * rods, 0.1), stretched.needed(dt, rods, 0.1)], axis=0)
    walk(simulation, settle)
    series = np.empty((steps, rods, nodes, 3))
    for k in range(steps):
        walk(simulation, 1)
        series[k] = simulation.shape.r.reshape(rods, nodes, 3) - rest
    series = series[:, :, free] / np.sqrt(energy)
    across = np.concatenate([series[..., 1], series[..., 2]], axis=1)
    bent.check(across @ bent.rows.T, dt)
    stretched.check(series[..., 0] @ stretched.rows.T, dt)


@pytest.mark.parametrize("lam_dt", [0.1, 10.0])
def test_twist_modes_have_half_kt_each(lam_dt):
    """Free ends: the twists between nodes are independent, of variance kT/(C ds)."""
    nodes, rods, energy, torsion = 9, 60, 1e-6, 0.7
    ds = 1.0 / (nodes - 1)
    volume = np.full(nodes, ds)
    volume[[0, -1]] /= 2
    modes = Modes(np.diff(np.eye(nodes), axis=0) * np.sqrt(torsion / ds), SPIN * volume)
    dt = lam_dt / modes.rates.min()
    simulation = many({**ROD, "nodes": nodes, "twisting": torsion}, rods, energy, dt)
    settle, steps = modes.needed(dt, rods, 0.05)
    walk(simulation, settle)
    series = np.empty((steps, rods, nodes - 1))
    for k in range(steps):
        walk(simulation, 1)
        series[k] = simulation.shape.twist.reshape(rods, nodes)[:, :-1]
    angles = np.concatenate([np.zeros((steps, rods, 1)), np.cumsum(series * ds, axis=2)], axis=2) / np.sqrt(energy)
    modes.check(angles @ modes.rows.T, dt)


def test_twist_is_left_out_where_it_is_asked():
    simulation = Simulation(scene({"rod": {**ROD, "twisting": 1.0}}, 1e-6, twist=False))
    assert np.all(simulation._noise.force(simulation.shape, 1e-3)[:, 3] == 0)


# --- curved and soft rods -----------------------------------------------------------------------------------------


def test_a_chiral_rod_neither_winds_up_nor_turns_on_average():
    """Free rods with preferred curvature and twist: the mean of O3 stays tau0, and no sense of turning is preferred.

    Errors are those of the mean of independent rods. <O3> is moved by kT tau0 ds^2/(C ds) as the sine in Eq. 39 bends.
    """
    rods, nodes, energy, steps, dt = 100, 9, 5e-4, 1000, 4e-5
    rod = {**BENT, "nodes": nodes}
    simulation = many(rod, rods, energy, dt)
    walk(simulation, 300)  # to the discrete equilibrium, and its spread
    turned, twist = np.zeros((rods, nodes)), np.zeros(rods)
    for _ in range(steps):
        walk(simulation, 1)
        turned += simulation.state_now.y_old[:, 3].reshape(rods, nodes)
        twist += simulation.shape.twist.reshape(rods, nodes)[:, :-1].mean(axis=1) / steps
    for values, expected in (
        (turned.mean(axis=1), 0.0),
        (turned[:, -1] - turned[:, 0], 0.0),
        (twist, 3.0 * (1 + energy / (0.7 * (nodes - 1)))),
    ):
        error = values.std(ddof=1) / np.sqrt(rods)
        assert abs(values.mean() - expected) < 3 * error


def chains(count: int, nodes: int, energy: float, seed: int) -> np.ndarray:
    """Worm-like chains (count, nodes, 3) from Boltzmann's law: angles between segments by exp(cos/(kT ds))."""
    random, ds = np.random.default_rng(seed), 1.0 / (nodes - 1)
    stiff = 1 / (energy * ds)
    uniform = random.random((count, nodes - 1))
    cos = 1 + np.log(uniform + (1 - uniform) * np.exp(-2 * stiff)) / stiff
    sin, about = np.sqrt(np.maximum(0, 1 - cos**2)), 2 * np.pi * random.random((count, nodes - 1))
    t = np.zeros((count, nodes - 1, 3))
    t[:, 0, 0] = 1
    for i in range(1, nodes - 1):
        b = np.cross(t[:, i - 1], [0.0, 0.0, 1.0])
        b /= np.linalg.norm(b, axis=1)[:, None]
        c = np.cross(t[:, i - 1], b)
        across = np.cos(about[:, i, None]) * b + np.sin(about[:, i, None]) * c
        t[:, i] = cos[:, i, None] * t[:, i - 1] + sin[:, i, None] * across
    return np.concatenate([np.zeros((count, 1, 3)), np.cumsum(ds * t, axis=1)], axis=1)


def mean_square_distance(nodes: int, energy: float, stretching: float) -> float:
    """<R^2> of segments with <cos> = coth b - 1/b, b = 1/(kT ds), and lengths by l^2 exp(-EA (l - ds)^2/(2 ds kT))."""
    ds, m = 1.0 / (nodes - 1), nodes - 1
    b = 1 / (energy * ds)
    cos = 1 / np.tanh(b) - 1 / b
    square = energy * ds / stretching
    length = np.linspace(ds - 8 * np.sqrt(square), ds + 8 * np.sqrt(square), 2001)
    weight = length**2 * np.exp(-((length - ds) ** 2) / (2 * square))
    first, second = (np.sum(weight * length**k) / np.sum(weight) for k in (1, 2))
    pairs = m * (1 + cos) / (1 - cos) - 2 * cos * (1 - cos**m) / (1 - cos) ** 2 - m
    return m * second + first**2 * pairs


def distances(nodes: int, rods: int, energy: float, stretching: float, dt: float, steps: int, drift: bool = True):
    """R^2 of each rod (rods,), averaged over a run that starts in equilibrium."""
    rod = {**ROD, "nodes": nodes, "stretching": stretching}
    simulation = many(rod, rods, energy, dt, drag={"perp": 1.0, "par": 0.5})
    if not drift:
        simulation._noise._drift[:] = 0
    r = chains(rods, nodes, energy, seed=1).reshape(-1, 3)
    start = simulation.mechanics.start(r, np.tile([0.0, 0.0, 1.0], (len(r), 1)))
    simulation.state_now = State(0.0, start, np.zeros_like(r), 0.0)
    out = np.zeros(rods)
    for _ in range(steps // 20):
        walk(simulation, 20)
        r = simulation.shape.r.reshape(rods, nodes, 3)
        out += np.sum((r[:, -1] - r[:, 0]) ** 2, axis=1) / (steps // 20)
    return out


def test_the_chains_made_here_are_worm_like():
    r = chains(20000, 16, 0.2, seed=2)
    square = np.sum(r[:, -1] ** 2, axis=1)
    assert abs(square.mean() - mean_square_distance(16, 0.2, 1e9)) < 3 * square.std() / np.sqrt(20000)


def test_the_ends_of_a_worm_like_chain_are_as_far_apart_as_boltzmann_says():
    """kT L/A = 0.2, 8 nodes, ten relaxation times of the slowest mode."""
    found = distances(8, 100, 0.2, 1400.0, 4e-6, 5000)
    error = found.std(ddof=1) / np.sqrt(len(found))
    assert error < 0.002
    assert abs(found.mean() - mean_square_distance(8, 0.2, 1400.0)) < 3 * error


@pytest.mark.slow
def test_and_without_the_drift_of_the_ends_they_are_nearer():
    """kT L/A = 0.2, 16 nodes: the same kicks with the drift, which Boltzmann's law needs, and without."""
    with_drift, without = (distances(16, 240, 0.2, 3000.0, 5e-7, 6000, drift) for drift in (True, False))
    error, of_difference = (x.std(ddof=1) / np.sqrt(240) for x in (with_drift, with_drift - without))
    assert error < 0.0022
    assert abs(with_drift.mean() - mean_square_distance(16, 0.2, 3000.0)) < 3 * error
    assert np.mean(with_drift - without) > 3 * of_difference


# --- runs ---------------------------------------------------------------------------------------------------------


def test_the_same_seed_gives_the_same_bits_and_another_seed_does_not():
    ends = []
    for seed in (1, 1, 2):
        simulation = Simulation(scene({"rod": BENT}, seed=seed))
        walk(simulation, 10)
        ends.append((simulation.shape.r.tobytes(), simulation.shape.e1.tobytes()))
    assert ends[0] == ends[1]
    assert ends[0][0] != ends[2][0]


def test_a_run_cut_twice_is_as_never_cut(tmp_path):
    case = scene({"rod": BENT}, time={"end": 0.003, "step": 1e-4})
    whole, path = tmp_path / "whole.h5", tmp_path / "run.h5"
    run(case, whole, build=real)
    interrupted(path, 2, case, real)
    interrupted_again = tmp_path / "again.h5"
    interrupted(interrupted_again, 11, case, real)
    for cut in (path, interrupted_again):
        go_on(cut, build=real)
        assert content(cut) == content(whole)


def test_no_random_numbers_are_made_or_kept_without_a_thermal_table():
    text = tomli_w.dumps(
        {
            "filament": {"rod": ROD},
            "fluid": {"model": "rft", "viscosity": 1.0},
            "time": {"end": 1.0, "step": 1e-3},
            "output": {"every": 1.0},
        }
    )
    simulation = Simulation(parse_case(text, "test.toml"))
    assert simulation._noise is None
    assert "random" not in simulation.state()
    assert "random" in Simulation(scene({"rod": ROD})).state()


def test_no_energy_no_kicks():
    simulation = Simulation(scene({"rod": ROD}, 0.0))
    before = simulation.shape.r.copy()
    walk(simulation, 10)
    assert np.array_equal(simulation.shape.r, before)
    assert "A/(kT L)" not in groups(simulation)


def test_kicks_in_the_plane_leave_a_rod_in_it():
    rod = {**ROD, "curvature": [0, 3.0], "normal": [0, 1, 0], "shape": {"kind": "relaxed"}}
    simulation = Simulation(scene({"rod": rod}, 1e-2, directions="xy"))
    start = simulation.shape.r.copy()
    walk(simulation, 100)
    moved = simulation.shape.r - start
    assert np.max(np.abs(moved[:, :2])) > 1e-2
    assert np.max(np.abs(moved[:, 2])) < 1e-12


def test_held_ends_stay_and_a_clamp_that_leaves_twist_free_turns():
    rod = {**ROD, "twisting": 1.0, "start": {"end": "clamped"}, "finish": {"end": "hinged"}}
    free = {**ROD, "twisting": 1.0, "start": {"end": "clamped", "twist": "free"}}
    simulation = Simulation(scene({"held": rod, "free": free}, 1e-3))
    before = simulation.shape
    walk(simulation, 50)
    after = simulation.shape
    for node in (0, 8, 9):
        np.testing.assert_allclose(after.r[node], before.r[node], atol=1e-15)
    for node in (0, 9):
        np.testing.assert_allclose(after.e3[node], before.e3[node], atol=1e-15)
    np.testing.assert_allclose(after.e1[0], before.e1[0], atol=1e-14)
    assert np.max(np.abs(after.e1[9] - before.e1[9])) > 1e-3
    assert np.min(np.linalg.norm(after.r - before.r, axis=1)[1:8]) > 1e-4


def test_a_rod_that_does_not_twist_beside_one_that_does_is_not_turned():
    simulation = Simulation(scene({"plain": ROD, "twisting": {**ROD, "twisting": 1.0}}))
    kicks = simulation._noise.force(simulation.shape, 1e-3)
    assert np.all(kicks[:9, 3] == 0)
    assert np.all(kicks[9:, 3] != 0)


def test_a_soft_round_rod_without_twist_may_turn_its_frame_at_will():
    """Its e1 is carried along as kicks turn the tangents, differently from node to node; that is no twist."""
    simulation = Simulation(scene({"rod": ROD}, 0.1))
    twisted = simulation.mechanics.measure(simulation.shape.r, np.tile([[0, 0, 1.0], [0, 1.0, 0]], (5, 1))[:9])
    simulation.state_now = simulation.state_now._replace(shape=twisted)
    walk(simulation, 1)
    assert np.max(np.abs(simulation.shape.twist)) > 0


def test_a_step_that_fails_is_not_tried_again_with_other_kicks():
    simulation = Simulation(scene({"rod": ROD}, time={"min_step": 1e-12}))
    assert not simulation.may_halve(1.0)


# --- what is told -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", ["implicit", "explicit"])
def test_other_schemes_are_refused(scheme):
    with pytest.raises(CaseError, match=r"time\.scheme: .*semi-implicit"):
        scene({"rod": ROD}, time={"scheme": scheme})


def test_a_grid_is_refused_with_a_sentence():
    grid = {"model": "stokes", "box": [2.0, 2.0, 2.0], "cells": [16, 16, 16]}
    with pytest.raises(CaseError) as refused:
        scene({"rod": ROD}, fluid=grid)
    (line,) = refused.value.faults
    assert 'thermal: found thermal forces and fluid.model = "stokes"' in line
    assert 'only fluid.model = "rft"' in line


def test_a_tolerance_is_refused():
    with pytest.raises(CaseError, match=r"time\.tolerance: found a tolerance with \[thermal\]"):
        scene({"rod": ROD}, time={"tolerance": 1e-3})


def test_check_says_what_is_kicked_and_how_stiff_the_rod_is_against_it():
    case = scene({"rod": {**ROD, "twisting": 1.0}}, 0.02)
    assert any("thermal forces and twist moments, kT = 0.02, seed 1" in line for line in report.modelled(case))
    assert not any("thermal" in line for line in report.absent(case))
    without = scene({"rod": {**ROD, "twisting": 1.0}}, 0.02, twist=False)
    assert any("thermal forces, kT" in line for line in report.modelled(without))
    assert "thermal twist moments" in report.absent(without)
    assert groups(Simulation(case))["A/(kT L)"] == pytest.approx(50)
    assert "linearised trapezoid" in report.report(case)


@pytest.mark.parametrize(
    ("rod", "energy", "more", "told"),
    [
        ({"derivative": 6}, 1e-4, {}, r"filament\.rod\.derivative: .* order 6"),
        ({"stretching": 10.0}, 0.1, {}, r"filament\.rod\.stretching: .* of their length"),
        ({"bending": [1.0, 0.1]}, 0.1, {}, r"filament\.rod\.bending: .* more nodes"),
        ({"twisting": 0.1}, 0.1, {}, r"filament\.rod\.twisting: .* more nodes"),
        ({}, 0.1, {"time": {"step": 1e-3}}, r"time\.step: .* % longer"),
        ({"stretching": 1e6}, 1e-6, {"time": {"step": 5e-2}}, r"time\.step: .* thermal spread only in"),
        ({"direction": [0, 0, 1], "normal": [1, 0, 0]}, 1e-4, {"directions": "xy"}, r"thermal\.directions: .* plane"),
    ],
)
def test_warnings(rod, energy, more, told):
    twisting = {"twisting": 1.0} if "bending" in rod else {}
    found = warnings(Simulation(scene({"rod": {**ROD, **twisting, **rod}}, energy, **more)))
    assert len(matching(found, told)) == 1
    assert not matching(warnings(Simulation(scene({"rod": ROD}, 1e-4))), told)


def matching(lines: list[str], pattern: str) -> list[str]:
    """The lines that match."""
    return [line for line in lines if re.search(pattern, line)]


def test_the_automatic_step_keeps_kicks_from_stretching_the_rod():
    cold, hot = (Simulation(scene({"rod": ROD}, energy, time={"step": "auto"})) for energy in (1e-6, 0.1))
    assert cold.step_length == pytest.approx(cold.bending_time() / timescales.POINTS_A_PERIOD)
    assert 0.8 * timescales.STRETCH < hot.thermal_stretch(hot.step_length) <= timescales.STRETCH
    # The stiffest motion of a rod, of rate 2/limit, is forgotten no later than its slowest bending.
    stiff = Simulation(scene({"rod": {**ROD, "stretching": 1e6}}, 1e-6, time={"step": "auto"}))
    assert stiff.step_length**2 / (2 * stiff.explicit_limit()) == pytest.approx(stiff.bending_time())


def test_the_stretch_that_kicks_leave_is_that_of_free_segments_while_steps_are_short():
    """A quarter of the angle squared; neighbours move apart by 2 kT dt (1/Z_i + 1/Z_j) in each of two directions."""
    energy, drag, nodes, dt = 0.1, 2.0, 11, 1e-12
    mobility = 1 / (drag * 0.1 * np.array([0.5, *np.ones(9), 0.5]))
    expected = 0.25 * 2 * np.mean(2 * energy * dt * (mobility[1:] + mobility[:-1])) / 0.1**2
    assert timescales.thermal_stretch(energy, drag, 1.0, 1.0, nodes, dt) == pytest.approx(expected, rel=1e-3)
