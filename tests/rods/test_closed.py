"""Closed rods: their stiffness, their modes, the ring that buckles under twist, and numbers that cannot change."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import tomli_w

from ibfil.case.reading import parse_case
from ibfil.errors import CaseError
from ibfil.rods.linking import linked, linking, writhe
from ibfil.simulation.simulation import Simulation

TURN = 2 * np.pi
DRAG: dict[str, Any] = {"model": "rft", "viscosity": 1.0, "drag": {"perp": 1.0, "par": 0.5, "spin": 1e-4}}
GRID: dict[str, Any] = {"model": "stokes", "viscosity": 1.0, "box": [6.0, 6.0, 6.0], "cells": [32, 32, 32]}


def ring(
    segments: int,
    linking: int | None = None,
    twisting: float | None = None,
    perturb: Any = (0, 0, 0),
    fluid: Any = None,
    order: int = 2,
    more: str = "",
    **rod: Any,
) -> Simulation:
    """A ring of radius 1, A = 1."""
    rod = {
        "length": TURN,
        "nodes": segments + 1,
        "bending": 1.0,
        "stretching": 1e6,
        "derivative": order,
        "closed": True,
        "anchor": "centroid",
        "shape": {"kind": "circle", "curvature": 1.0, "perturb": list(perturb)},
        **rod,
    }
    if twisting is not None:
        rod |= {"twisting": twisting, "radius": 0.01}
    if linking is not None:
        rod["linking"] = linking
    case = {"filament": {"ring": rod}, "fluid": fluid or DRAG, "time": {"end": 100.0, "step": 0.01}}
    return Simulation(parse_case(tomli_w.dumps({**case, "output": {"every": 1.0}}) + more, "ring.toml"))


def nodes(simulation: Simulation) -> np.ndarray:
    """Positions (N, 3), each node once."""
    return simulation.configuration.r[simulation.rods.nodes[0]][:-1]


def growth(simulation: Simulation, part: Any, dt: float, steps: int) -> float:
    """The rate at which the size of a mode grows, over the last half of some steps."""
    sizes = []
    for _ in range(steps):
        simulation.accept(simulation.attempt(dt), simulation.time + dt)
        sizes.append(abs(part(nodes(simulation))))
    # A step of BDF2 takes exp(rate dt) to third order.
    return float(np.diff(np.log(sizes))[steps // 2 :].mean()) / dt


def oval(r: np.ndarray) -> complex:
    r = r - r.mean(axis=0)
    return complex(np.mean(np.hypot(r[:, 0], r[:, 1]) * np.exp(2j * np.arctan2(r[:, 1], r[:, 0]))))


def lifted(r: np.ndarray) -> complex:
    return complex(np.mean(r[:, 2] * np.exp(2j * np.arctan2(r[:, 1], r[:, 0]))))


# --- discretisation --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [2, 6])
@pytest.mark.parametrize("twisting", [None, 0.7])
def test_the_stiffness_is_the_derivative_of_the_force_round_the_corner_too(order, twisting):
    """Central differences; copies of nodes have neither force nor stiffness."""
    simulation = ring(13, None if twisting is None else 1, twisting, order=order, stretching=50.0)
    system, start, h = simulation.system, simulation.configuration, 1e-6
    y = 0.02 * np.random.default_rng(1).standard_normal((len(start.r), system.unknowns))
    moved = system.move(start, y)
    force, moment = system.forces(moved, 0.0)
    exact = system.stiffness(moved, start, moment, 0.0).dense().reshape(y.size, y.size)
    numerical = np.zeros_like(exact)
    for k in range(y.size):
        step = np.zeros(y.size)
        step[k] = h
        ahead, behind = (system.forces(system.move(start, y + a * step.reshape(y.shape)), 0.0)[0] for a in (1, -1))
        numerical[:, k] = ((ahead - behind) / (2 * h)).ravel()
    assert np.abs(exact - numerical).max() < 2e-8 * np.abs(numerical).max()
    assert np.abs(force[:, :3].sum(axis=0)).max() < 1e-13 * np.abs(force).max()
    copies = system.source != np.arange(len(system.source))
    assert copies.sum() == order + 1
    assert not force[copies].any()


@pytest.mark.parametrize(("mode", "exact"), [(2, 8.0), (3, 60.6316)])
def test_an_oval_ring_becomes_round_at_its_rate(mode, exact):
    """A m^2 (m^2 - 1)^2/(R^4 (m^2 zp + zl)), of second order in the spacing."""
    bent = [f"1e-4*(cos({mode}*s)*cos(s) + sin({mode}*s)*sin(s)/{mode})"]
    bent += [f"1e-4*(cos({mode}*s)*sin(s) - sin({mode}*s)*cos(s)/{mode})", 0]

    def size(r: np.ndarray) -> complex:
        r = r - r.mean(axis=0)
        return complex(np.mean(np.hypot(r[:, 0], r[:, 1]) * np.exp(1j * mode * np.arctan2(r[:, 1], r[:, 0]))))

    errors = []
    for segments in (26, 52):
        simulation = ring(segments, perturb=bent)
        radius = np.linalg.norm(nodes(simulation)[0])
        errors.append(-growth(simulation, size, 0.02 / exact, 60) * radius**4 / exact - 1)
    assert abs(errors[1]) < 0.03
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.5)


def test_a_twisted_ring_buckles_at_the_threshold_of_michell_and_zajac():
    """Lk C/A = sqrt(3): where the growth of the mode of two waves changes its sign, extrapolated in the spacing."""
    found = []
    for segments in (26, 52):
        rates = []
        for ratio in (1.7, 1.9):
            simulation = ring(segments, 2, ratio / 2, [0, 0, "1e-5*cos(2*s)"])
            rates.append(growth(simulation, lifted, 0.02, 60))
        found.append(1.7 + 0.2 * rates[0] / (rates[0] - rates[1]))
        assert rates[0] < rates[1]
    assert (4 * found[1] - found[0]) / 3 == pytest.approx(np.sqrt(3), rel=0.01)


# --- linking, writhe, twist ------------------------------------------------------------------------------------------


def _trefoil() -> list[str]:
    a = f"({TURN}*s/12)"
    return [f"sin{a} + 2*sin(2*{a})", f"cos{a} - 2*cos(2*{a})", f"-sin(3*{a})"]


def test_gauss_integrals_of_known_curves():
    """Two linked circles; the writhe of a figure on a sphere 1 - A/2 pi mod 2, with the area A it encloses (Fuller)."""
    a = np.linspace(0.0, TURN, 41)
    flat = np.stack([np.cos(a), np.sin(a), 0 * a], axis=1)
    across = np.stack([1 + np.cos(a), 0 * a, np.sin(a)], axis=1)
    flat[-1], across[-1] = flat[0], across[0]
    assert abs(linked(flat, across)) == pytest.approx(1.0, abs=1e-7)
    assert linked(flat, across) == pytest.approx(-linked(flat[::-1], across), abs=1e-7)
    assert linked(flat, across + np.array([3, 0, 0])) == pytest.approx(0.0, abs=1e-7)
    assert writhe(flat) == 0.0
    saddle = np.stack([np.cos(a), np.sin(a), 0.3 * np.cos(2 * a)], axis=1)
    assert writhe(saddle) == pytest.approx(-writhe(saddle * [1, 1, -1]), abs=1e-12)


def test_e1_that_turns_to_the_right_has_a_positive_linking_number():
    """A ring seen from +z, e1 turned about e3 by 2 pi 3 s/L from e_z."""
    a = np.linspace(0.0, TURN, 61)
    r, e3 = np.stack([np.cos(a), np.sin(a), 0 * a], axis=1), np.stack([-np.sin(a), np.cos(a), 0 * a], axis=1)
    up = np.tile([0.0, 0.0, 1.0], (61, 1))
    e1 = np.cos(3 * a)[:, None] * up + np.sin(3 * a)[:, None] * np.cross(e3, up)
    r[-1], e1[-1] = r[0], e1[0]
    assert linking(r, e1).linking == 3
    assert linking(r, e1).twist == pytest.approx(3.0)


@pytest.mark.parametrize("wanted", [None, 2, -6])
def test_a_rod_starts_with_the_linking_number_that_is_asked_for(wanted):
    """On a trefoil; where none is asked for with the least twist. Its chords are equal, and as long as wanted."""
    shape = {"kind": "expression", "r": _trefoil()}
    simulation = ring(120, wanted, 1.0, length=12.0, shape=shape)
    where = simulation.rods.nodes[0]
    start = simulation.start
    found = linking(start.r[where], start.e1[where])
    assert found.linking == wanted if wanted is not None else abs(found.twist) <= 0.5
    chords = np.linalg.norm(np.diff(start.r[where], axis=0), axis=1)
    assert chords == pytest.approx(np.full(120, 0.1), rel=1e-10)
    turn = start.twist[where][:-1].sum() * 0.1 / TURN  # Eq. 39 is of second order
    assert turn == pytest.approx(found.twist, abs=0.02 * max(1.0, abs(found.twist)))


REPEL = '\n[contact]\naction = "repel"\ndistance = 0.1\nstrength = 20.0\n'


def test_a_ring_supercoils_and_its_linking_number_stays():
    """Wr takes up twist; e1 of the copy is that of the node to the last bit; resumed it takes the same way."""
    made = [ring(52, 4, 1.0, [0, 0, "1e-2*cos(2*s)"], more=REPEL, stretching=1e4) for _ in range(2)]
    simulation, other = made
    where = simulation.rods.nodes[0]
    simulation.advance(0.2, lambda: None)
    other.restore(simulation.state())
    for one in made:
        one.advance(1.0, lambda: None)
    now = simulation.configuration
    assert np.array_equal(now.table, other.configuration.table)
    found = linking(now.r[where], now.e1[where])
    assert found.linking == 4
    assert found.writhe > 1.0
    assert np.array_equal(now.e1[where][0], now.e1[where][-1])
    assert np.array_equal(now.r[where][0], now.r[where][-1])
    snapshot = simulation.snapshot()
    force = snapshot.filaments["ring"].force
    assert np.abs(snapshot.diagnostics["net_force"]).max() < 1e-13  # contact pushes with up to 20
    assert not force[-1].any() or np.abs(force[-1]).max() < 1e-12
    assert np.array_equal(snapshot.filaments["ring"].velocity[0], snapshot.filaments["ring"].velocity[-1])
    assert snapshot.filaments["ring"].tension.shape == (52,)


def test_neighbours_across_the_closure_do_not_touch():
    simulation = ring(40, 0, 1.0, more='\n[contact]\naction = "stop"\ndistance = 0.3\n')
    assert simulation.snapshot().diagnostics["contacts"] == 0


def test_the_ways_to_the_grid_agree_on_a_ring():
    paths = {}
    for method in ("table", "fft", "krylov"):
        simulation = ring(26, 2, 1.5, [0, 0, "0.1*cos(2*s)"], {**GRID, "method": method}, stretching=1e3)
        simulation.advance(0.05, lambda: None)
        paths[method] = nodes(simulation)
    moved = np.abs(paths["table"] - simulation.start.r[simulation.rods.nodes[0]][:-1]).max()
    assert moved > 1e-3
    for method in ("fft", "krylov"):
        assert np.abs(paths[method] - paths["table"]).max() < 1e-6 * moved


# --- what cannot be --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rod", "line"),
    [
        ({"shape": {"kind": "straight"}}, "ring.shape: found a shape that does not close: its ends are 6.28 apart"),
        ({"linking": 30, "twisting": 1.0, "radius": 0.01}, "ring.linking: found a turn by 4.7 from node to node"),
    ],
)
def test_shapes_that_cannot_be_closed_are_told(rod, line):
    with pytest.raises(CaseError) as told:
        ring(40, **rod)
    assert line in str(told.value)
