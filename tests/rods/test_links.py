"""Links between rods: their stiffness, their balance, what they remember, and known answers."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.linked_scenes import ASKEW, DISTANCE, GRID, LINKS, ROD, SHEAR, linked, pair, pair_mode

from ibfil.errors import CaseError
from ibfil.rods.linearization import Linearization
from ibfil.simulation.simulation import Simulation

EACH_LINK = pytest.mark.parametrize("name", LINKS)
TIME = 0.3


def at_work(name: str) -> tuple[Simulation, np.ndarray]:
    """Rods with a link after some steps, with another one begun; displacements (n, m) in it."""
    simulation = Simulation(linked(ASKEW, {name: LINKS[name]}))
    simulation.advance(0.05, lambda: None)
    simulation.system.begin(0.013, 0.6)
    n = len(simulation.configuration.r)
    return simulation, 0.01 * np.random.default_rng(0).standard_normal((n, 4))


def force_of(simulation: Simulation, y: np.ndarray) -> np.ndarray:
    """The force (n, 4) of the link at displacements y."""
    (link,), force = simulation.rods.links, np.zeros_like(y)
    link.add_force(simulation.system.move(simulation.configuration, y), TIME, force)
    return force


def stiffness_of(simulation: Simulation, y: np.ndarray, definite: bool = False) -> np.ndarray:
    """Its stiffness (4 n, 4 n) there."""
    (link,), system, start = simulation.rods.links, simulation.system, simulation.configuration
    band = np.zeros((len(y), 4, (2 * system.profile.width + 1) * 4))
    linearization = Linearization(system.mesh, system.move(start, y), start, band, definite)
    link.add_stiffness(TIME, linearization)
    return linearization.stiffness.dense().reshape(y.size, y.size)


@EACH_LINK
def test_the_stiffness_of_a_link_is_the_derivative_of_its_force(name):
    """Central differences with h = 1e-6 err by some 1e-9 of the largest entry; rates within the step are in it."""
    simulation, y = at_work(name)
    exact, numerical, h = stiffness_of(simulation, y), np.zeros((y.size, y.size)), 1e-6
    for k in range(y.size):
        step = np.zeros(y.size)
        step[k] = h
        ahead, behind = (force_of(simulation, y + sign * step.reshape(y.shape)) for sign in (1, -1))
        numerical[:, k] = ((ahead - behind) / (2 * h)).ravel()
    assert np.abs(numerical).max() > 1.0
    assert np.abs(exact - numerical).max() < 2e-8 * np.abs(numerical).max()
    assert np.abs(exact - exact.T).max() < 1e-13 * np.abs(exact).max()


@EACH_LINK
def test_a_definite_stiffness_draws_back_only(name):
    simulation, y = at_work(name)
    definite = stiffness_of(simulation, y, definite=True)
    values = np.linalg.eigvalsh(definite)
    assert values.max() < 1e-11 * abs(values.min())
    exact = stiffness_of(simulation, y)
    if name == "compressed spring":
        assert np.linalg.eigvalsh(exact).max() > 1.0  # which it is not
    assert np.linalg.norm(definite - exact) < np.linalg.norm(exact)


@pytest.mark.parametrize("name", [name for name in LINKS if name != "spring to the lab"])
def test_a_link_between_rods_adds_no_force_and_no_torque(name):
    simulation, y = at_work(name)
    force, r = force_of(simulation, y)[:, :3], simulation.system.move(simulation.configuration, y).r
    scale = np.abs(force).sum()
    assert scale > 0.1
    assert np.abs(force.sum(axis=0)).max() < 1e-14 * scale
    assert np.abs(np.cross(r, force).sum(axis=0)).max() < 1e-14 * scale


def test_a_hinge_turns_its_segments_towards_each_other():
    simulation, y = at_work("hinge")
    shape = simulation.system.move(simulation.configuration, y)
    force, (link,) = force_of(simulation, y)[:, :3], simulation.rods.links
    i, j, p, q = link.elements.nodes[0]
    u, v = (d / np.linalg.norm(d) for d in (shape.r[j] - shape.r[i], shape.r[q] - shape.r[p]))
    torque = np.cross(shape.r[[i, j]], force[[i, j]]).sum(axis=0)
    assert torque == pytest.approx(3.0 * np.cross(u, v), abs=1e-13)


def test_a_spring_of_no_length_has_a_force_and_a_stiffness():
    """Both points are one: no direction, and no division by it."""
    rods = {"a": ROD, "b": {**ROD, "direction": [0, 1, 0]}}
    simulation = Simulation(
        linked(rods, {"pin": {**LINKS["spring of no rest length"], "between": [{"filament": "a"}, {"filament": "b"}]}})
    )
    (link,), system, shape = simulation.rods.links, simulation.system, simulation.configuration
    force = np.zeros_like(shape.r)
    link.add_force(shape, 0.0, force)
    assert np.all(np.abs(force) < 1e-13)
    _, moment = system.forces(shape, 0.0)
    k = system.stiffness(shape, shape, moment, 0.0).dense()
    assert k[5, 0, 16, 0] == pytest.approx(40.0)
    simulation.advance(0.1, lambda: None)
    assert np.linalg.norm(simulation.configuration.r[5] - simulation.configuration.r[16]) < 1e-9


def test_rods_drawn_together_by_a_damped_spring():
    """Stiff rods side by side: zeta L d'/2 = -k (d - l0) - c d', d - l0 goes by exp(-2 k t/(zeta L + 2 c))."""
    stiff = {**ROD, "bending": 1e5, "stretching": 1e7}
    rods = {"a": stiff, "b": {**stiff, "position": [0, 0.5, 0]}}
    spring = {"between": [{"filament": "a"}, {"filament": "b"}], "stiffness": 3.0, "rest": 0.2, "damping": 4.0}
    simulation = Simulation(linked(rods, {"spring": spring}, end=2.0))
    apart = []
    simulation.advance(2.0, lambda: apart.append(simulation.snapshot().links["spring"].length[0] - 0.2))
    rate = -np.polyfit(np.linspace(0.01, 2.0, 200)[100:], np.log(apart[100:]), 1)[0]
    assert rate == pytest.approx(2 * 3.0 / (4 * np.pi + 2 * 4.0), rel=1e-3)


# --- bound rods, against the theory of a pair that slides ------------------------------------------------------------


def test_a_bound_pair_bends_as_two_rods_that_shear():
    """2 A y'''' = kt D^2 y'', tip F/(2 A q^3) (q - tanh q), q^2 = kt D^2/(2 A); the rods are as if inextensible."""
    q = np.sqrt(SHEAR * DISTANCE**2 / 2)
    exact, errors = 0.01 / (2 * q**3) * (q - np.tanh(q)), []
    for nodes in (11, 21):
        simulation = Simulation(pair(nodes, force=0.01, stretching=1e8, end=200.0, step=5.0))
        simulation.advance(200.0, lambda: None)
        tips = simulation.configuration.r[[nodes - 1, 2 * nodes - 1], 1]
        errors.append(tips.mean() / exact - 1)
    assert abs(errors[1]) < 2e-4
    assert errors[0] / errors[1] > 3  # of second order in the nodes


@pytest.mark.parametrize(("share", "guess"), [(0.95, -0.16 + 2.77j), (1.05, 0.17 + 2.9j)])
def test_a_bound_pair_beats_by_itself_as_its_characteristic_equation_says(share, guess):
    """On either side of the friction at which it does. Fitted: y_{n+1} = a y_n + b y_{n-1}."""
    friction, nodes, dt = share * 5537.93, 21, 0.02
    simulation = Simulation(pair(nodes, friction=friction, perturb=1e-4, end=5.0, step=dt))
    tip = []
    simulation.advance(5.0, lambda: tip.append(simulation.configuration.r[nodes - 1, 1] + DISTANCE / 2))
    y = np.array(tip)[100:]
    (a, b), *_ = np.linalg.lstsq(np.column_stack([y[1:-1], y[:-2]]), y[2:], rcond=None)
    root = np.roots([1, -a, -b])
    found = np.log(root[np.argmax(root.imag)]) / dt
    assert abs(found - pair_mode(friction, guess)) < 0.01 * abs(found)


def test_the_pair_begins_to_beat_where_the_shipped_case_says():
    """Growth crosses zero at gamma = 5537.9, at 2.833 radians a time."""
    assert pair_mode(5537.93, 2.83j) == pytest.approx(2.83308j, abs=2e-5)


def test_motors_follow_their_rate_of_slide_with_a_lag():
    """T df/dt + f = S tanh(gamma x/S): the memory of a run against an integration of its own slides."""
    simulation = Simulation(linked(ASKEW, {"m": LINKS["motors that stall"]}, step=0.002))
    slides, forces = [], []

    def look() -> None:
        seen = simulation.snapshot().links["m"]
        slides.append(seen.slide)
        forces.append(seen.active)

    simulation.advance(0.4, look)
    rate = np.gradient(np.array(slides), 0.002, axis=0)
    f = np.array(forces[50])
    for k in range(50, len(rate) - 2):
        half = 1.5 * np.tanh(5.0 * 0.5 * (rate[k] + rate[k + 1]) / 1.5)
        f = half + (f - half) * np.exp(-0.002 / 0.2)
    assert np.abs(f).max() > 0.05
    assert f == pytest.approx(forces[-2], abs=0.02 * np.abs(f).max())


# --- memory, copies, fluids ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fluid", [None, GRID], ids=["rft", "stokes"])
def test_what_links_remember_is_part_of_the_state(fluid):
    links = {name: LINKS[name] for name in ("damped spring", "motors that stall")}
    more = {} if fluid is None else {"fluid": fluid}
    one, other = (Simulation(linked(ASKEW, links, **more)) for _ in range(2))
    one.advance(0.05, lambda: None)
    other.restore(one.state())
    assert not np.array_equal(other.rods.links[1]._pushed.now, np.zeros(10))
    for simulation in (one, other):
        simulation.advance(0.1, lambda: None)
    assert np.array_equal(one.configuration.table, other.configuration.table)
    for link in one.snapshot().links:
        for a, b in zip(
            vars(one.snapshot().links[link]).values(), vars(other.snapshot().links[link]).values(), strict=True
        ):
            assert (a is None and b is None) or np.array_equal(a, b)


def test_a_step_that_is_tried_twice_is_taken_once():
    """A failed or rejected step leaves no trace in what links remember."""
    links = {name: LINKS[name] for name in ("damped spring", "motors")}
    one, other = (Simulation(linked(ASKEW, links)) for _ in range(2))
    for simulation in (one, other):
        simulation.advance(0.05, lambda: None)
    other.attempt(0.004)
    other.attempt(0.01)
    for simulation in (one, other):
        simulation.advance(0.1, lambda: None)
    assert np.array_equal(one.configuration.table, other.configuration.table)


def test_linked_filaments_are_copied_as_one():
    """Each pair as far apart as the first, turned as a whole, with a link of its own."""
    copies = {"count": 3, "seed": 4, "region": [[-2, -2, -2], [2, 2, 2]]}
    straight = {**ROD, "copies": copies, "position": [0.1, 0, 0]}
    rods = {"a": straight, "b": {**straight, "position": [0.1, 0.06, 0.01]}}
    simulation = Simulation(linked(rods, {"pair": {"kind": "bind", "filaments": ["a", "b"], "normal": 1e3}}))
    assert [link.name for link in simulation.rods.links] == ["pair_000", "pair_001", "pair_002"]
    for k, link in enumerate(simulation.rods.links):
        assert link.filaments == (k, k + 3)
        assert link.binding.distance == pytest.approx(np.hypot(0.06, 0.01), rel=1e-12)
    assert simulation.rods.groups == tuple((simulation.rods.nodes[k], simulation.rods.nodes[k + 3]) for k in range(3))


def test_the_ways_to_the_grid_agree_on_linked_rods():
    """Two pairs and a rod alone; by Krylov each pair is one block, and what links the pairs is in the product."""
    rods = {name: {**ROD, "position": [0.0, 0.06 * k, 0.3 * (k // 2)]} for k, name in enumerate("abcd")}
    rods["alone"] = {**ROD, "position": [0, -0.3, 0]}
    bind = {"kind": "bind", "shear": 50.0, "normal": 1e4, "force": "20*sin(20*t)"}
    links = {"one": {**bind, "filaments": ["a", "b"]}, "two": {**bind, "filaments": ["c", "d"]}}
    paths = {}
    for method in ("table", "fft", "krylov"):
        simulation = Simulation(linked(rods, links, {**GRID, "method": method}))
        simulation.advance(0.05, lambda: None)
        paths[method] = simulation.configuration.r
        net = simulation.snapshot().diagnostics["net_force"]
        assert np.abs(net).max() < 1e-11 * np.abs(simulation._last[1]).max()
    moved = np.abs(paths["table"] - simulation.start.r).max()
    assert moved > 1e-3
    for method in ("fft", "krylov"):
        assert np.abs(paths[method] - paths["table"]).max() < 1e-6 * moved


# --- what cannot be --------------------------------------------------------------------------------------------------

BESIDE = {"a": ROD, "b": {**ROD, "position": [0, 0.1, 0]}}
BIND = {"kind": "bind", "filaments": ["a", "b"], "normal": 1.0}
MIDDLES = [{"filament": "a"}, {"filament": "b"}]


@pytest.mark.parametrize(
    ("rods", "link", "line"),
    [
        (
            {"a": ROD, "b": ROD},
            {"between": MIDDLES, "stiffness": 1.0, "rest": 0.1},
            "link.x.rest: found 0.1 between places that are one; allowed: 0, or places apart",
        ),
        ({"a": ROD, "b": ROD}, BIND, "link.x.distance: found 0 at the start, at s = 0.05; allowed: apart"),
        (
            {"a": ROD, "b": {**BESIDE["b"], "direction": [-1, 0, 0]}},
            BIND,
            "link.x.filaments: found two that run against each other; allowed: alike, start by start",
        ),
        (BESIDE, {**BIND, "range": [0.21, 0.24]}, "link.x.range: found 0.21 to 0.24, between the middles of segments"),
        (BESIDE, {**BIND, "shear": "0.1 - s"}, "link.x.shear: found -0.85 at s = 0.95; allowed: >= 0"),
        (
            BESIDE,
            {
                "kind": "hinge",
                "between": [{"filament": "a", "at": 0.21}, {"filament": "a", "at": 0.22}],
                "stiffness": 1,
            },
            "link.x.between: found one segment twice; allowed: two different segments",
        ),
        (
            {"a": {**ROD, "curvature": [1, 0]}, "b": {**ROD, "position": [0, 0, 0.1]}},
            {"between": MIDDLES, "stiffness": 1.0},
            "link.x: found a, of A1 != A2 or preferred curvature and no twisting, linked to what leaves its plane",
        ),
    ],
)
def test_links_that_cannot_be_made_are_told(rods, link, line):
    with pytest.raises(CaseError) as told:
        Simulation(linked(rods, {"x": link}))
    assert str(told.value).startswith(f"test.toml: {line}")
