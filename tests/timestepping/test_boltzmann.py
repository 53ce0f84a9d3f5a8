"""Rods with thermal forces obey Boltzmann's law, for what of it can be known exactly: linear modes and soft chains."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.thermal_scenes import BENT, ROD, SPIN, USUAL, chains, many, walk
from scipy import stats

from ibfil.timestepping.base import State

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
    rest = simulation.configuration.r.reshape(rods, nodes, 3)
    settle, steps = np.max([bent.needed(dt, 2 * rods, 0.1), stretched.needed(dt, rods, 0.1)], axis=0)
    walk(simulation, settle)
    series = np.empty((steps, rods, nodes, 3))
    for k in range(steps):
        walk(simulation, 1)
        series[k] = simulation.configuration.r.reshape(rods, nodes, 3) - rest
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
        series[k] = simulation.configuration.twist.reshape(rods, nodes)[:, :-1]
    angles = np.concatenate([np.zeros((steps, rods, 1)), np.cumsum(series * ds, axis=2)], axis=2) / np.sqrt(energy)
    modes.check(angles @ modes.rows.T, dt)


# --- curved and soft rods -----------------------------------------------------------------------------------------


def test_a_chiral_rod_neither_winds_up_nor_turns_on_average():
    """Free rods with preferred curvature and twist: the mean of O3 stays tau0, and no sense of turning is preferred.

    Errors are those of the mean of independent rods.
    """
    rods, nodes, energy, steps, dt = 100, 9, 5e-4, 1000, 4e-5
    rod = {**BENT, "nodes": nodes}
    simulation = many(rod, rods, energy, dt)
    walk(simulation, 300)  # to the discrete equilibrium, and its spread
    turned, twist = np.zeros((rods, nodes)), np.zeros(rods)
    for _ in range(steps):
        walk(simulation, 1)
        turned += simulation.state_now.y_old[:, 3].reshape(rods, nodes)
        twist += simulation.configuration.twist.reshape(rods, nodes)[:, :-1].mean(axis=1) / steps
    for values, expected in (
        (turned.mean(axis=1), 0.0),
        (turned[:, -1] - turned[:, 0], 0.0),
        (twist, 3.0),
    ):
        error = values.std(ddof=1) / np.sqrt(rods)
        assert abs(values.mean() - expected) < 3 * error


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
        simulation.model.noise._drift._size[:] = 0
    r = chains(rods, nodes, energy, seed=1).reshape(-1, 3)
    start = simulation.system.start(r, np.tile([0.0, 0.0, 1.0], (len(r), 1)))
    simulation.state_now = State(0.0, start, np.zeros_like(r), 0.0)
    out = np.zeros(rods)
    for _ in range(steps // 20):
        walk(simulation, 20)
        r = simulation.configuration.r.reshape(rods, nodes, 3)
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
