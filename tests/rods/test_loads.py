"""Forces and held ends against exact answers: each through a case, run to its equilibrium or along an exact motion."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.rods_at_rest import CLAMPED, PAR, PERP, ROD, TWISTING, half, settled
from helpers.scenes import RFT, STOKES, run, scene, slopes
from scipy.integrate import solve_bvp, trapezoid
from scipy.linalg import eigvals
from scipy.optimize import brentq

from ibfil.simulation.simulation import Simulation

# Forces


@pytest.mark.parametrize("keys", [{"weight": [0, 0, -2]}, {"force": [0, 0, "-2 + 0*s"]}], ids=["weight", "force"])
@pytest.mark.parametrize("end", ["clamped", "hinged"])
def test_a_hanging_rod_carries_its_weight_below(end: str, keys: dict[str, Any]) -> None:
    """T(s) = w (L - s) at every half node, so the tip comes down by w L^2/(2 EA); the support holds w L."""
    rod = {
        **ROD,
        "stretching": 50.0,
        "direction": [0, 0, -1],
        "normal": [1, 0, 0],
        "start": {"end": end},
        "loads": keys,
    }
    simulation = settled(rod)
    found = simulation.snapshot().filaments["rod"]
    assert found.tension == pytest.approx(2 * (1 - half(simulation.arclength)), rel=1e-8)
    assert found.position[-1, 2] == pytest.approx(-1 - 2 / (2 * 50.0), rel=1e-10)
    assert found.reaction_start == pytest.approx([0, 0, 2], abs=1e-8)


def elastica(force: float) -> tuple[float, float]:
    """Tip of a clamped rod along x with A = L = 1 under a dead force along y: theta'' = -F cos(theta)."""
    s = np.linspace(0, 1, 101)
    found = solve_bvp(
        lambda s, y: np.array([y[1], -force * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])]),
        lambda a, b: np.array([a[0], b[1], a[2], a[3]]),
        s,
        np.zeros((4, s.size)),
        tol=1e-10,
        max_nodes=100000,
    )
    assert found.success
    return float(found.y[2, -1]), float(found.y[3, -1])


@pytest.mark.parametrize("derivative", [2, 6])
def test_a_cantilever_under_a_dead_force_is_the_elastica(derivative: int) -> None:
    """To second order; the axial stiffness 1e7 leaves 1e-7."""
    exact, errors = elastica(8.0), []
    for nodes in (17, 33, 65):
        rod = {**ROD, "nodes": nodes, "stretching": 1e7, "derivative": derivative, "start": CLAMPED}
        tip = settled({**rod, "finish": {"force": [0, 8.0, 0]}}).configuration.r[-1]
        errors.append(float(np.hypot(tip[0] - exact[0], tip[1] - exact[1])))
        assert tip[2] == 0.0
    assert errors[-1] < 1e-3
    assert min(slopes(errors)) > 1.8


def growth(force: float, nodes: int, follower: bool) -> float:
    """The largest growth rate of a clamped straight rod under a compressive end force: eigenvalue of Z^-1 K."""
    finish = {"follower": -force} if follower else {"force": [-force, 0, 0]}
    rod = {**ROD, "nodes": nodes, "stretching": 1e7, "start": CLAMPED, "finish": finish}
    simulation = settled({**rod, "derivative": 2})
    system, shape = simulation.system, simulation.configuration
    _, moment = system.forces(shape, 0.0)
    k = system.stiffness(shape, shape, moment, 0.0).dense()[1:, 1, 1:, 1]
    z = np.diag(PERP * system.mesh.volume[1:])
    return float(np.max(eigvals(k, z).real))


def test_a_compressive_dead_force_buckles_a_clamped_rod_at_the_euler_load() -> None:
    """pi^2 A/(4 L^2), where the largest growth rate changes sign; second order in ds. A follower force does not."""
    euler, errors = np.pi**2 / 4, []
    for nodes in (17, 33, 65):
        assert growth(2.0, nodes, False) < 0 < growth(3.0, nodes, False)
        errors.append(abs(brentq(growth, 2.0, 3.0, args=(nodes, False), xtol=1e-9) - euler) / euler)
    assert errors[-1] < 1e-4
    assert slopes(errors)[-1] > 1.9
    assert growth(3.0, 33, True) < 0


def test_a_spring_at_the_end_and_a_cantilever_find_their_balance() -> None:
    """k (to - y) = 3 A y/L^3 where small: the clamp is exact for cubics, what is left is of the order of the square."""
    rod = {**ROD, "stretching": 1e8, "start": CLAMPED, "finish": {"spring": {"stiffness": 5, "to": [1, 1e-4, 0]}}}
    assert settled(rod).configuration.r[-1, 1] == pytest.approx(1e-4 * 5 / (5 + 3), rel=1e-6)


def test_springs_at_both_ends_hold_a_free_rod_stretched() -> None:
    """EA stretch = k (0.25 - stretch/2) on either side."""
    at = {side: {"spring": {"stiffness": 4, "to": [x, 0, 0]}} for side, x in (("start", -0.25), ("finish", 1.25))}
    r = settled({**ROD, "stretching": 10.0, **at}).configuration.r
    stretch = 4 * 0.25 / (10 + 4 / 2)
    assert r[:, 0] == pytest.approx(-stretch / 2 + (1 + stretch) * np.linspace(0, 1, 33), abs=1e-9)


def test_tethers_along_a_rod_give_way_to_a_force_by_f_over_k() -> None:
    """Uniform, so the rod stays as it is, though it is a curve."""
    rod = {**ROD, "curvature": ["2*sin(3*s)", 0], "shape": {"kind": "relaxed"}}
    tethered = {"tether": {"stiffness": 20}}
    before, after = (
        settled({**rod, "loads": {**tethered, **more}}).configuration.r for more in ({}, {"force": [1, -2, 0]})
    )
    assert after - before == pytest.approx(np.tile([0.05, -0.1, 0], (33, 1)), abs=1e-9)


def test_moving_tethers_drag_a_rod_behind_them_by_zeta_v_over_k() -> None:
    """Across and along: zeta_perp V = k (to - r), and likewise zeta_par."""
    to = ["s + 0.3*t", "0.2*t", 0]
    simulation = run(scene({"rod": {**ROD, "loads": {"tether": {"stiffness": 50, "to": to}}}}, end=20.0, step=0.5))
    lag = np.stack([simulation.arclength + 6.0, np.full(33, 4.0), np.zeros(33)], axis=1) - simulation.configuration.r
    assert lag == pytest.approx(np.tile([PAR * 0.3 / 50, PERP * 0.2 / 50, 0], (33, 1)), abs=1e-8)


@pytest.mark.parametrize("model", ["place", "tether"])
def test_a_force_that_depends_on_place_pulls_a_rod_to_where_it_vanishes(model: str) -> None:
    """y - 0.1 falls off at k/zeta_perp, z at none: second order in the step. A tether to that line does the same."""
    loads = {"force": [0, "-40*(y - 0.1)", "0*x*z*s"]}
    if model == "tether":
        loads = {"tether": {"stiffness": 40, "to": ["s", 0.1, 0.3]}}
    errors = []
    for step in (0.1, 0.05, 0.025):
        rod = {**ROD, "position": [0, 0.6, 0.3], "loads": loads}
        r = run(scene({"rod": rod}, end=0.5, step=step)).configuration.r
        assert np.abs(r[:, 2] - 0.3).max() < 1e-12
        assert np.ptp(r[:, 1]) < 1e-9
        errors.append(abs(r[0, 1] - 0.1 - 0.5 * np.exp(-40 / PERP * 0.5)))
    assert min(slopes(errors)) > 1.9


def test_a_force_along_the_directors_drives_a_spinning_rod_in_a_circle() -> None:
    """b1/zeta_perp across it along e1, which turns at m3/zeta_r; b3/zeta_par along it."""
    metric, rate = 0.5, 6.0
    body, moment = [metric * PERP, 0, 0.25 * PAR], [0, 0, rate * 4 * np.pi * 0.1**2]
    rod = {**TWISTING, "loads": {"body_force": body, "moment": moment}}
    errors = []
    for step in (0.02, 0.01, 0.005):
        r = run(scene({"rod": rod}, end=0.5, step=step)).configuration.r
        angle = rate * 0.5  # about e3 = x, from e1 = z towards e2 = -y
        exact = np.array([0.125, -metric / rate * (1 - np.cos(angle)), metric / rate * np.sin(angle)])
        errors.append(float(np.abs(r - [[s, 0, 0] for s in np.linspace(0, 1, 33)] - exact).max()))
    assert errors[-1] < 1e-4
    assert min(slopes(errors)) > 1.9


def test_a_force_that_changes_in_time_moves_a_free_rod_by_its_integral() -> None:
    """Total drag PERP across, PAR along; forces of all the nodes, or of half of them at either end."""
    wave = "5*t**2*cos(3*t)"
    ends = {side: {"force": [f"0.5*{wave}", 0, f"0.5*{wave}"]} for side in ("start", "finish")}
    errors = []
    for keys in (ends, {"loads": {"force": [wave, 0, wave]}}):
        for step in (0.04, 0.02, 0.01):
            rod = {**ROD, "bending": 1e6, "stretching": 1e9, **keys}
            moved = run(scene({"rod": rod}, end=1.0, step=step)).configuration.r.mean(axis=0) - [0.5, 0, 0]
            exact = 5 * (6 * np.cos(3) + 7 * np.sin(3)) / 27  # of t^2 cos 3t from 0 to 1
            errors.append(float(np.abs(moved - [exact / PAR, 0, exact / PERP]).max()))
    assert min(slopes(errors[:3])) > 1.9
    assert min(slopes(errors[3:])) > 1.9


# Held ends that move


@pytest.mark.parametrize("end", ["clamped", "hinged"])
def test_a_moving_end_drags_a_rod_along_and_feels_its_drag(end: str) -> None:
    """Pulled along itself it follows at the same velocity, stretched by zeta_par V (L - s)/EA."""
    rod = {**ROD, "stretching": 100.0, "start": {"end": end, "moves": ["-0.4*t", 0, 0]}}
    simulation = run(scene({"rod": rod}, end=4.0, step=0.1))
    found = simulation.snapshot().filaments["rod"]
    assert found.position[0] == pytest.approx([-1.6, 0, 0], abs=1e-13)
    assert found.velocity == pytest.approx(np.tile([-0.4, 0, 0], (33, 1)), abs=1e-9)
    assert found.reaction_start == pytest.approx([-PAR * 0.4, 0, 0], abs=1e-7)
    assert found.tension == pytest.approx(PAR * 0.4 * (1 - half(simulation.arclength)), abs=1e-7)


def test_two_moving_ends_carry_a_rod_and_share_its_drag() -> None:
    """Stiff and carried across: each support bears half of zeta_perp V L, up to what a rod bends."""
    ends = {side: {"end": "hinged", "moves": [0, "0.1*sin(t)", 0]} for side in ("start", "finish")}
    simulation = run(scene({"rod": {**ROD, "bending": 1e6, "stretching": 1e8, **ends}}, end=1.0, step=0.01))
    found, v = simulation.snapshot().filaments["rod"], 0.1 * np.cos(1.0)
    assert found.velocity[:, 1] == pytest.approx(v, rel=1e-4)
    for reaction in (found.reaction_start, found.reaction_finish):
        assert reaction[1] == pytest.approx(PERP * v / 2, rel=1e-3)


def test_a_clamp_turns_a_rod_into_its_tangent() -> None:
    """Started along x, held along another direction: at rest it is straight along that."""
    direction = np.array([0.6, 0.8, 0.0])
    simulation = settled({**ROD, "start": {"end": "clamped", "tangent": (2 * direction).tolist()}})
    assert simulation.configuration.r == pytest.approx(simulation.arclength[:, None] * direction, abs=1e-9)


# Balance


BALANCED = {
    "clamped": {
        "start": CLAMPED,
        "finish": {"force": [1, 2, "3*t"], "moment": [1, 0.3, 0.5], "spring": {"stiffness": 2, "to": [1, 1, 1]}},
    },
    "hinged": {
        "start": {"end": "hinged", "moment": [0.4, 0.2, 0.1], "frame": "body"},
        "finish": {"end": "hinged", "moves": ["-0.1*t", 0, 0]},
    },
    "free": {"start": {"follower": 2}, "finish": {"moment": [0, 1, 1]}, "loads": {"weight": [0, 0, -1]}},
}


@pytest.mark.parametrize("force", ["eq44", "torque-free"])
@pytest.mark.parametrize("ends", BALANCED)
def test_loads_and_reactions_are_what_the_fluid_feels(ends: str, force: str) -> None:
    """Elastic forces sum to zero; of the force on the fluid nothing is left but what came from outside."""
    rod = {**TWISTING, "force": force, "loads": {"force": [0, "s", "x"], "moment": [0.1, 0.2, 0.3]}, **BALANCED[ends]}
    simulation = run(scene({"rod": rod}, end=0.2, step=0.01))
    system, snapshot = simulation.system, simulation.snapshot()
    given = np.zeros((33, 4))
    for load in system.loads:
        load.add_force(simulation.configuration, simulation.time, given)
    found = snapshot.filaments["rod"]
    reactions = [r for r in (found.reaction_start, found.reaction_finish) if r is not None]
    total = given[:, :3].sum(axis=0) + np.sum(reactions, axis=0)
    scale = np.abs(given).sum() + np.abs(reactions).sum()
    assert snapshot.diagnostics["net_force"] == pytest.approx(total, abs=1e-6 * scale)
    assert np.linalg.norm(total) > 0.1


def test_the_work_of_a_load_is_stored_in_the_rod_or_lost_in_the_fluid() -> None:
    """A force that grows smoothly at the end of a cantilever; what is left is of the order of dt^2 and ds^2."""
    times, work, lost = [0.0], [0.0], [0.0]
    rod = {**ROD, "stretching": 1e4, "start": CLAMPED, "finish": {"force": [0, "8*t**3", 0]}}
    simulation = Simulation(scene({"rod": rod}, end=1.0, step=0.01))

    def look() -> None:
        snapshot = simulation.snapshot()
        times.append(simulation.time)
        work.append(8 * simulation.time**3 * snapshot.filaments["rod"].velocity[-1, 1])
        lost.append(snapshot.diagnostics["power"])

    simulation.advance(1.0, look)
    mesh, shape = simulation.system.mesh, simulation.configuration
    bent = 0.5 * np.sum((mesh.volume * shape.bend[:, 0] ** 2)[:-1])
    stretched = 0.5 * np.sum((1e4 * mesh.ds * (shape.length / mesh.ds - 1) ** 2)[:-1])
    done, dissipated = trapezoid(work, times), trapezoid(lost, times)
    assert dissipated > 0.5 * done
    assert bent > 0.2 * done
    assert done == pytest.approx(dissipated + bent + stretched, rel=1e-3)


AT_REST = {
    "moment and force": {"finish": {"moment": [0.5, 1, -1.5], "force": [0, 1, 0.5]}},
    "spring": {"finish": {"spring": {"stiffness": 5, "to": [0.2, 0.4, 0.3]}}},
    "couple": {"finish": {"moment": [0, 0.5, 0.3], "frame": "body"}},
    "along": {"loads": {"weight": [0, 0, -2], "moment": [1, 0.5, 0.3], "tether": {"stiffness": 2}}},
}


@pytest.mark.parametrize("name", AT_REST)
def test_a_rod_at_rest_is_the_same_in_whatever_fluid(name: str) -> None:
    """Clamped and loaded in three dimensions, under resistive-force theory and on a grid."""
    rod = {**TWISTING, "nodes": 13, "position": [-0.5, 0, 0], "start": CLAMPED, **AT_REST[name]}
    shapes = [settled(rod, fluid=fluid).configuration for fluid in (RFT, STOKES)]
    assert shapes[0].r == pytest.approx(shapes[1].r, abs=1e-8)
    assert shapes[0].e1 == pytest.approx(shapes[1].e1, abs=1e-8)
    assert np.abs(shapes[0].r[-1] - [0.5, 0, 0]).max() > 0.05
