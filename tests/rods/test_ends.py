"""Ends: what is held stays as told, what holds it pushes back by exactly what is missing, and no moment leaks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from helpers.scenes import run, scene, slopes, twisting_rod

from ibfil.assembly import rods as assembly_rods
from ibfil.assembly.fluids.models import fluid_model
from ibfil.case.schema import Case
from ibfil.fluids import resistive_force
from ibfil.linalg.constraints import Prescribed
from ibfil.rods import mesh
from ibfil.rods.boundary_conditions import PrescribedEnd, PrescribedEnds, spinning, steady, turned
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping import base as timestepping_base
from ibfil.timestepping import explicit, implicit, semi_implicit
from ibfil.timestepping.base import State, Step
from ibfil.timestepping.implicit import Implicit

EPS = np.finfo(float).eps
ROD: dict[str, Any] = {
    "length": 1.0,
    "nodes": 17,
    "bending": 1.0,
    "stretching": 1e3,
    "anchor": "start",
    "direction": [1, 0, 0],
    "normal": [0, 0, 1],
}
TWIST: dict[str, Any] = {"twisting": 1.0, "radius": 0.05}
CLAMPED, HINGED = {"end": "clamped"}, {"end": "hinged"}
SCHEMES = {
    "explicit": explicit.Explicit(),
    "semi-implicit": semi_implicit.SemiImplicit(),
    "Euler": implicit.Implicit(1),
    "BDF2": implicit.Implicit(2),
}


# Which unknowns are held


@pytest.mark.parametrize(
    ("keys", "held"),
    [
        ({}, []),
        ({"start": HINGED}, [0, 1, 2]),
        ({"start": CLAMPED}, [0, 1, 2]),
        ({"start": CLAMPED, "finish": HINGED}, [0, 1, 2, 48, 49, 50]),
        ({**TWIST, "start": HINGED}, [0, 1, 2]),
        ({**TWIST, "start": CLAMPED}, [0, 1, 2, 3]),
        ({**TWIST, "start": {**CLAMPED, "twist": "free"}}, [0, 1, 2]),
        ({**TWIST, "start": CLAMPED, "finish": CLAMPED}, [0, 1, 2, 3, 64, 65, 66, 67]),
    ],
    ids=str,
)
def test_positions_of_hinged_and_clamped_ends_are_held_and_e1_at_clamps_that_hold_it(keys, held) -> None:
    simulation = Simulation(scene({"rod": {**ROD, **keys}}))
    assert sorted(simulation.system.ends.index) == held


@pytest.mark.parametrize("keys", [{}, TWIST], ids=["planar", "twisting"])
def test_only_clamps_carry_a_moment(keys) -> None:
    """On a curved rod that would rather be straight."""
    arc = {"kind": "circle", "curvature": 1.0}
    for start, finish in ((CLAMPED, {}), (HINGED, CLAMPED), ({}, HINGED)):
        rod = {**ROD, **keys, "shape": arc, "start": start, "finish": finish}
        simulation = Simulation(scene({"rod": rod}))
        moment = simulation.system.moment(simulation.configuration, 0.0).bend
        assert [bool(np.any(moment[i])) for i in (0, -1)] == [start == CLAMPED, finish == CLAMPED]


def test_prescribed_motion_is_turn_and_displacement_between_two_times() -> None:
    def place(t: float) -> np.ndarray:
        return np.array([t, t**2, 0.0])

    ends = PrescribedEnds(
        [PrescribedEnd(0, steady(2.0)), PrescribedEnd(5, turned(lambda t: t**3), place)], 4, np.array([7])
    )
    assert list(ends.index) == [0, 1, 2, 3, 20, 21, 22, 23, 31]
    expected = [0, 0, 0, 1.0, 0.5, 1.25, 0, 3.375 - 1.0, 0]
    assert ends.motion(1.0, 1.5) == pytest.approx(expected, abs=4 * EPS)
    assert PrescribedEnds([PrescribedEnd(0, spinning(lambda t: 3 * t**2))], 4, np.array([], int)).motion(1.0, 1.5)[
        3
    ] == pytest.approx(3.375 - 1.0, rel=4 * EPS)
    # Without twist unknowns e1 has no turn of its own.
    assert list(PrescribedEnds([PrescribedEnd(2, steady(0.0))], 3, np.array([], int)).index) == [6, 7, 8]


# Held ends stay where they are


def waving(**keys: Any) -> dict[str, Any]:
    return {**ROD, "curvature": ["4*sin(2*pi*s - 10*t)", 0], **keys}


@pytest.mark.parametrize("scheme", ["semi-implicit", "implicit"])
def test_held_nodes_stay_put_to_the_last_bit_while_the_rod_waves(scheme: str) -> None:
    simulation = Simulation(scene({"rod": waving(start=HINGED, finish=CLAMPED)}, step=0.01, scheme=scheme))
    before = simulation.configuration.r.copy()
    simulation.advance(0.3, lambda: None)
    moved = np.linalg.norm(simulation.configuration.r - before, axis=1)
    assert moved[0] == moved[-1] == 0.0
    assert moved[1:-1].min() > 0.0
    velocity = simulation.snapshot().filaments["rod"].velocity
    assert np.all(velocity[[0, -1]] == 0.0)
    assert np.abs(simulation.configuration.e3[-1] - [1, 0, 0]).max() == 0.0


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_a_spun_clamp_turns_at_its_rate_and_its_node_does_not_move(scheme) -> None:
    case = scene({"rod": {**ROD, **TWIST, "nodes": 9, "start": {**CLAMPED, "spin": 3.0}}})
    for _, step in steps(case, scheme, 1e-4, 5):
        assert step.velocity[0] == pytest.approx([0.0, 0.0, 0.0, 3.0], abs=3 * 8 * EPS)


# Reactions


def steps(case: Case, scheme: timestepping_base.Stepper, dt: float, count: int) -> Iterator[tuple[State, Step]]:
    """The steps of a case, each with the state it starts from."""
    rods = assembly_rods.rods(case)
    fluid = fluid_model(case).build(rods)
    shape = rods.start
    state = State(0.0, shape, np.zeros((len(shape.r), rods.system.unknowns)), 0.0)
    for _ in range(count):
        step = scheme.step(rods.system, fluid, state, dt)
        yield state, step
        state = step.state


def loaded(**keys: Any) -> Case:
    """A curved cantilever with a load that follows its tip; it moves, and its clamp is spun."""
    rod = {
        **ROD,
        **TWIST,
        "nodes": 9,
        "bending": [1.0, 0.5],
        "stretching": 100.0,
        "curvature": ["2*cos(3*s)", "s"],
        "start": {**CLAMPED, "spin": 3.0},
        "finish": {"follower": -2.0},
        **keys,
    }
    return scene({"rod": rod}, viscosity=0.7)


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_the_force_on_the_fluid_is_the_drag_of_the_velocity(scheme: timestepping_base.Stepper) -> None:
    """Z = Lc [zeta_perp (1 - e3 e3) + zeta_par e3 e3], e3 where the scheme freezes it; Lc zeta_r for the spin."""
    case = loaded()
    system, eta, a, dt = assembly_rods.rods(case).system, 0.7, 0.05, 2e-4
    for state, step in steps(case, scheme, dt, 4):
        extrapolated = scheme.order == 2 and state.dt_old > 0
        e3 = system.move(state.configuration, state.y_old).e3 if extrapolated else state.configuration.e3
        y = step.state.y_old
        rate = (1.5 * y - 0.5 * state.y_old) / dt if extrapolated else y / dt
        along = np.sum(rate[:, :3] * e3, axis=1)[:, None] * e3
        drag = system.mesh.volume[:, None] * 4 * np.pi * eta * (rate[:, :3] - 0.5 * along)
        torque = system.mesh.volume * 4 * np.pi * eta * a**2 * rate[:, 3]
        assert step.velocity == pytest.approx(rate, abs=1e-12 * np.abs(rate).max())
        assert step.force[:, :3] == pytest.approx(drag, abs=1e-12 * np.abs(drag).max())
        assert step.force[:, 3] == pytest.approx(torque, abs=1e-12 * np.abs(torque).max())


@pytest.mark.parametrize("scheme", ["Euler", "BDF2"])
@pytest.mark.parametrize("spun_only", [False, True], ids=["loaded", "spun only"])
def test_reactions_and_loads_balance_the_drag(scheme: str, spun_only: bool) -> None:
    """Eq. 44 adds nothing to the sum, so the support gives what the load and the drag leave, at every step.

    Newton leaves positions to 1e-8 of the length, and with them the direction of the load: the drag of moving
    the whole rod by that in a step. Without a load nothing is left but round-off.
    """
    case, dt = loaded(finish={}) if spun_only else loaded(), 0.02
    left = 1e-12 if spun_only else 4 * np.pi * 0.7 * 1e-8 / dt
    for _, step in steps(case, SCHEMES[scheme], dt, 6):
        load = np.zeros(3) if spun_only else -2.0 * step.state.configuration.e3[-1]
        drag, reaction = step.force[:, :3].sum(axis=0), step.reaction[:, :3].sum(axis=0)
        assert np.linalg.norm(reaction) > 0.1
        assert drag == pytest.approx(reaction + load, abs=left)


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_reactions_act_at_held_unknowns_and_nowhere_else(scheme: timestepping_base.Stepper) -> None:
    for _, step in steps(loaded(), scheme, 2e-4, 3):
        assert np.all(step.reaction[1:] == 0.0)
        assert np.all(step.reaction[0, 1:] != 0.0)


def test_the_clamp_of_a_twirling_rod_gives_the_torque_that_turns_all_of_it() -> None:
    """zeta_r omega L, once the twist has settled: after 30 relaxation times, exp(-30) short of it."""
    spin, zeta = 2.0, 4 * np.pi * 0.05**2
    case = scene({"rod": {**ROD, **TWIST, "start": {**CLAMPED, "spin": spin}}})
    settle = 30 * zeta / (np.pi / 2) ** 2
    *_, (_, step) = steps(case, implicit.Implicit(1), settle / 100, 400)
    assert step.reaction[0, 3] == pytest.approx(zeta * spin, rel=1e-6)
    assert step.force[:, 3].sum() == pytest.approx(zeta * spin, rel=1e-6)


def settled(nodes: int, derivative: int) -> Simulation:
    """A cantilever that is curved by itself, under a follower force, at rest: a hundred relaxation times."""
    rod = {
        **ROD,
        "nodes": nodes,
        "derivative": derivative,
        "stretching": 1e6,
        "curvature": [2.0, 0],
        "start": CLAMPED,
        "finish": {"follower": -1.5},
    }
    return run(scene({"rod": rod}, end=200.0, step=2.0, order=1))


def test_a_cantilever_at_rest_hands_its_whole_load_to_the_clamp() -> None:
    simulation = settled(17, 6)
    snapshot = simulation.snapshot().filaments["rod"]
    load = -1.5 * simulation.configuration.e3[-1]
    assert snapshot.reaction_start == pytest.approx(-load, abs=1e-9)
    assert snapshot.reaction_finish is None
    assert np.abs(snapshot.force.sum(axis=0)).max() < 1e-9
    assert np.abs(snapshot.velocity).max() < 1e-9


@pytest.mark.parametrize("derivative", [2, 6])
def test_its_clamp_carries_the_moment_of_the_load_to_second_order(derivative: int) -> None:
    """M(0) = (r_tip - r_0) x F, the moment equation integrated; the rod is stretched by 1e-6 only."""
    errors = []
    for nodes in (17, 33, 65):
        simulation = settled(nodes, derivative)
        shape = simulation.configuration
        lever = np.cross(shape.r[-1] - shape.r[0], -1.5 * shape.e3[-1])
        moment = simulation.system.moment(shape, 0.0).bend[0]
        clamp = moment[0] * shape.e1[0] + moment[1] * shape.e2[0]
        errors.append(float(np.linalg.norm(clamp - lever)))
    assert min(slopes(errors)) >= 1.9
    assert errors[-1] < 1e-3


@pytest.mark.parametrize("m", [3, 4])
@pytest.mark.parametrize("seed", range(3))
def test_moves_and_reactions_are_those_of_lagranges_multipliers(m: int, seed: int) -> None:
    """The implicit answer of RFT against one dense solve with a multiplier for each held unknown."""
    keys = {} if m == 3 else {**TWIST, "bending": [1.0, 0.5]}
    rods = assembly_rods.rods(scene({"rod": {**ROD, **keys, "nodes": 9, "shape": {"kind": "circle", "curvature": 1}}}))
    system, shape = rods.system, rods.start
    rng = np.random.default_rng(seed)
    n = 9
    drag = resistive_force.Drag(*(rng.uniform(1.0, 2.0, n) for _ in range(3)))
    held = Prescribed(np.sort(rng.choice(n * m, 5, replace=False)), rng.standard_normal(5))
    force, y, target = rng.standard_normal((3, n, m))
    _, moment = system.forces(shape, 0.0)
    matrix = system.stiffness(shape, shape, moment, 0.0)
    k = matrix.dense().reshape(n * m, n * m)
    tau = 0.03
    answer = (
        resistive_force.ResistiveForce(drag, system.profile)
        .response(shape.r, shape.e3, 0.0, tau)
        .implicit(force, matrix, held, y, target)
    )
    z = np.zeros((n, m, n, m))
    for i in range(n):
        e3 = shape.e3[i]
        z[i, :3, i, :3] = drag.perp[i] * np.eye(3) + (drag.par[i] - drag.perp[i]) * np.outer(e3, e3)
        if m == 4:
            z[i, 3, i, 3] = drag.spin[i]
    z = z.reshape(n * m, n * m)
    # Z (y + d - target)/tau = f + K d + E R,   (y + d) at held unknowns = prescribed
    pick = np.eye(n * m)[held.at]
    system = np.block([[z / tau - k, -pick.T], [pick, np.zeros((5, 5))]])
    right = np.concatenate([force.ravel() - z @ (y - target).ravel() / tau, held.value - y.ravel()[held.at]])
    solution = np.linalg.solve(system, right)
    d, reaction = solution[: n * m], solution[n * m :]
    rounding = 100 * EPS * np.linalg.cond(z / tau - k)
    assert answer.move.ravel() == pytest.approx(d, abs=rounding * np.abs(d).max())
    felt = force.ravel() + k @ d + pick.T @ reaction
    size = np.abs(k @ d).max() + np.abs(reaction).max()
    assert answer.reaction.ravel()[held.at] == pytest.approx(reaction, abs=rounding * size)
    assert np.all(np.delete(answer.reaction.ravel(), held.at) == 0.0)
    assert answer.force.ravel() == pytest.approx(felt, abs=rounding * size)


@pytest.mark.parametrize("m", [3, 4])
def test_without_stiffness_the_reaction_is_what_the_prescribed_velocity_needs(m: int) -> None:
    n, tau = 6, 0.1
    rng = np.random.default_rng(m)
    drag = resistive_force.Drag(*(rng.uniform(1.0, 2.0, n) for _ in range(3)))
    e3 = np.tile([0.6, 0.8, 0.0], (n, 1))
    force = rng.standard_normal((n, m))
    held = Prescribed(np.arange(m), rng.standard_normal(m))
    where = mesh.profile(assembly_rods.rods(scene({"rod": {**ROD, "nodes": 8}})).system.mesh)
    response = resistive_force.ResistiveForce(drag, where).response(np.zeros((n, 3)), e3, 0.0, tau)
    answer = response.forced(force, held, np.zeros((n, m)))
    z = np.zeros((m, m))
    z[:3, :3] = drag.perp[0] * np.eye(3) + (drag.par[0] - drag.perp[0]) * np.outer(e3[0], e3[0])
    z[3:, 3:] = drag.spin[0]
    assert np.array_equal(answer.move[0], held.value)
    assert answer.force[0] == pytest.approx(z @ held.value / tau, rel=1e-13)
    assert answer.force - answer.reaction == pytest.approx(force, abs=1e-13)
    assert np.all(answer.reaction[1:] == 0.0)


# Symmetries


@pytest.mark.parametrize("scheme", ["explicit", "semi-implicit", "implicit"])
def test_a_rod_described_from_its_other_end_moves_the_same(scheme: str) -> None:
    """s -> L - s turns e2 and e3 round: kappa1, the spin and the follower force change sign, kappa2 and tau0 stay."""
    step = {"explicit": 5e-5}.get(scheme, 2e-3)
    time = {"end": 0.1, "step": step, "scheme": scheme}
    fade = "(1 - s/L)**2"
    ahead = {
        "curvature": [f"30*t/T*{fade}/L", f"20*t/T*{fade}/L"],
        "twist_rate": f"20*t/T*{fade}/L",
        "start": {**CLAMPED, "spin": "300*t/T/T"},
        "finish": {"follower": "-3*A/L**2"},
    }
    fade = "(s/L)**2"
    back = {
        "curvature": [f"-30*t/T*{fade}/L", f"20*t/T*{fade}/L"],
        "twist_rate": f"20*t/T*{fade}/L",
        "finish": {**CLAMPED, "spin": "-300*t/T/T"},
        "start": {"follower": "3*A/L**2"},
        "anchor": "start",
        "position": [1, 0, 0],
        "direction": [-1, 0, 0],
    }
    one = run(twisting_rod(rod=ahead, **time)).configuration
    two = run(twisting_rod(rod=back, **time)).configuration
    assert np.ptp(one.r[:, 1]) > 1e-3
    # The same arithmetic in another order; Newton stops at 1e-8 of the length, and squares its error.
    assert np.abs(one.r - two.r[::-1]).max() < 1e-10
    assert np.abs(one.e1 - two.e1[::-1]).max() < 1e-9


def test_a_filament_that_does_not_twist_is_not_changed_by_one_that_does() -> None:
    planar, spatial = waving(position=[0, 5, 0]), {**ROD, **TWIST, "start": {**CLAMPED, "spin": 5.0}}
    alone = run(scene({"a": planar}, end=0.2, step=0.01))
    both = run(scene({"b": spatial, "a": planar}, end=0.2, step=0.01))
    where = both.nodes("a")
    assert both.system.unknowns == 4
    # Filaments are corrected together until the slowest has converged to Newton's 1e-8 of the length.
    assert np.abs(both.configuration.r[where] - alone.configuration.r).max() < Implicit().tolerance
    assert np.abs(both.configuration.e1[where] - alone.configuration.e1).max() < Implicit().tolerance
