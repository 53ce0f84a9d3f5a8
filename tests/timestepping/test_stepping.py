"""Time steps: their orders by slope, in positions and in the frame, their limits, and how a run fails.

RFT throughout. Scenes for orders start smooth: from a state out of equilibrium any scheme shows a lower order.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers.scenes import rms, run, scene, slopes, swimmer, twisting_rod

from ibfil.assembly import drag as assembly_drag
from ibfil.assembly import rods as assembly_rods
from ibfil.assembly.fluids.models import fluid_model
from ibfil.case.schema import Case
from ibfil.errors import RunFailed
from ibfil.fluids import resistive_force
from ibfil.rods.geometry import Configuration
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping.base import NotConverged, State
from ibfil.timestepping.implicit import Implicit

Build = Callable[..., Case]
END = 0.4


def swimming(**time: Any) -> Case:
    return swimmer(smooth=True, stretching=400.0, rod={"nodes": 21}, **time)


def stiff_swimming(**time: Any) -> Case:
    return swimmer(smooth=True, rod={"nodes": 41}, **time)


def twisting(**time: Any) -> Case:
    return twisting_rod(**time)


SCENES = pytest.mark.parametrize("build", [swimming, twisting], ids=["swimmer", "twisting rod"])


# Orders


@cache
def reference(build: Build, end: float = END) -> Configuration:
    """The path by BDF2, 16 times finer than the finest step compared with it: 256 times closer, 2 % at order 1."""
    return run(build(end=end, step=end / 2560)).configuration


def errors(build: Build, counts: tuple[int, ...], end: float = END, **keys: Any) -> tuple[list, list]:
    """Errors at the end of positions and of e1, rms over nodes, in so many steps."""
    exact = reference(build, end)
    shapes = [run(build(end=end, step=end / count, **keys)).configuration for count in counts]
    return [rms(g.r - exact.r) for g in shapes], [rms(g.e1 - exact.e1) for g in shapes]


def assert_order(found: list[float], order: int) -> None:
    """Slopes at least 0.9 of the order, and no more than half an order above it."""
    assert np.all(slopes(found) > 0.9 * order)
    assert np.all(slopes(found) < order + 0.5)


@SCENES
@pytest.mark.parametrize(
    ("scheme", "order"), [("semi-implicit", 1), ("implicit", 1), ("implicit", 2)], ids=["semi", "Euler", "BDF2"]
)
def test_positions_and_frame_converge_at_the_order_of_the_scheme(build: Build, scheme: str, order: int) -> None:
    """And to one path: the errors are those from BDF2's. e1 too: a twist split off would be first order."""
    positions, directors = errors(build, (40, 80, 160), scheme=scheme, order=order)
    assert_order(positions, order)
    if build is twisting:
        assert_order(directors, order)
        assert max(positions[-1], directors[-1]) < (2e-2 if order == 1 else 1e-3)


def test_bdf2_is_second_order_where_the_rod_is_stiff_too() -> None:
    """At EA = 1.6e4 and 41 nodes the fastest mode decays a thousand times within each of these steps."""
    assert_order(errors(stiff_swimming, (40, 80, 160))[0], 2)


def soft_swimming(**time: Any) -> Case:
    return swimmer(smooth=True, stretching=50.0, rod={"nodes": 9}, **time)


def soft_twisting(**time: Any) -> Case:
    return twisting_rod(stretching=50.0, rod={"nodes": 9}, **time)


@pytest.mark.parametrize("build", [soft_swimming, soft_twisting], ids=["swimmer", "twisting rod"])
def test_the_explicit_scheme_is_first_order_and_finds_the_same_path(build: Build) -> None:
    positions, directors = errors(build, (1500, 3000), end=0.15, scheme="explicit")
    assert_order(positions, 1)
    if build is soft_twisting:
        assert_order(directors, 1)


@SCENES
def test_the_scene_moves_and_bends_and_twists_enough_to_tell(build: Build) -> None:
    start, end = Simulation(build(end=END, step=END)).configuration, reference(build)
    assert rms(end.r - start.r) > 0.05
    assert np.abs(end.bend[:, 0]).max() > 1.0
    if build is twisting:
        assert np.abs(end.bend[:, 1]).max() > 0.4
        assert np.abs(end.twist).max() > 1.0
        assert rms(end.e1 - start.e1) > 0.5


@SCENES
def test_bdf2_is_second_order_at_steps_that_change_all_the_time(build: Build) -> None:
    """Each second step is half as long: the formula for a constant step would be first order."""
    exact = reference(build)
    rods = assembly_rods.rods(build(end=END, step=END))
    fluid = fluid_model(build(end=END, step=END)).build(rods)
    shape = rods.start
    positions, directors = [], []
    for count in (40, 80, 160):
        state = State(0.0, shape, np.zeros((len(shape.r), rods.system.unknowns)), 0.0)
        long = END / (0.75 * count)
        for k in range(count):
            state = Implicit(2).step(rods.system, fluid, state, long if k % 2 == 0 else 0.5 * long).state
        assert state.time == pytest.approx(END, rel=1e-12)
        positions.append(rms(state.configuration.r - exact.r))
        directors.append(rms(state.configuration.e1 - exact.e1))
    assert_order(positions, 2)
    if build is twisting:
        assert_order(directors, 2)


@pytest.mark.parametrize("build", [swimmer, twisting_rod], ids=["swimmer", "twisting rod"])
@pytest.mark.parametrize("scheme", ["explicit", "semi-implicit", "implicit"])
def test_size_and_viscosity_and_stiffness_drop_out(build: Build, scheme: str) -> None:
    """In units of L, eta L^4/A and A/L^2 the motion is the same number for number: no length or drag stands alone."""
    rod = {"nodes": 9}
    keys: dict[str, Any] = {"end": 0.1, "step": 0.01, "scheme": scheme, "rod": rod, "stretching": 100.0}
    if scheme == "explicit":
        keys |= {"end": 0.02, "step": 5e-5}
    one = run(build(**keys))
    two = run(build(length=2.5, viscosity=0.3, bending=1.7, **keys))
    assert two.configuration.r / 2.5 == pytest.approx(one.configuration.r, abs=1e-10)
    assert two.configuration.e1 == pytest.approx(one.configuration.e1, abs=1e-10)
    assert one.steps == two.steps
    unit = 0.3 * 2.5**4 / 1.7
    assert two.snapshot().filaments["rod"].force * 2.5**2 / 1.7 == pytest.approx(
        one.snapshot().filaments["rod"].force, abs=1e-6
    )
    assert two.snapshot().filaments["rod"].velocity * unit / 2.5 == pytest.approx(
        one.snapshot().filaments["rod"].velocity, abs=1e-7
    )


# Newton


def test_newtons_iteration_is_bounded_and_says_so() -> None:
    case = swimming(end=END, step=END / 40)
    rods = assembly_rods.rods(case)
    fluid = fluid_model(case).build(rods)
    state = State(0.0, rods.start, np.zeros((21, 3)), 0.0)
    with pytest.raises(NotConverged, match="1 iteration"):
        Implicit(2, most=1).step(rods.system, fluid, state, 0.3)


def straight_spinning(**time: Any) -> Case:
    """Nothing but twist: positions never move, so they cannot tell whether the turn has converged."""
    rod = {"length": 1.0, "nodes": 9, "bending": 1.0, "twisting": 1.0, "stretching": 1e3, "radius": 0.1}
    return scene({"rod": {**rod, "start": {"end": "clamped", "spin": 20.0}}}, **time)


@pytest.mark.parametrize("build", [swimming, twisting, straight_spinning])
def test_a_step_solves_its_own_equation_to_the_tolerance(build: Build) -> None:
    """Z (y - target)/tau = f(y) + R at each unknown, up to a change of 1e-8 in positions and turns."""
    case = build(end=END, step=END / 20)
    rods = assembly_rods.rods(case)
    system, n = rods.system, len(rods.start.r)
    fluid = fluid_model(case).build(rods)
    drag = assembly_drag.drag(case, rods)
    state = State(0.0, rods.start, np.zeros((n, system.unknowns)), 0.0)
    for _ in range(15):
        before, step = state, Implicit(1).step(system, fluid, state, END / 20)
        state = step.state
        force, moment = system.forces(state.configuration, state.time)
        residual = (
            resistive_force.resist(drag, before.configuration.e3, state.y_old) / (END / 20) - force - step.reaction
        )
        matrix = system.stiffness(state.configuration, before.configuration, moment, state.time)
        largest = np.abs(matrix.band).sum(axis=2) + max(drag.perp.max(), drag.spin.max()) / (END / 20)
        assert np.all(np.abs(residual) <= 1e-8 * largest)
        assert step.iterations <= 4


# Steps and times


def test_outputs_are_hit_exactly_in_equal_steps_no_longer_than_asked() -> None:
    simulation = Simulation(swimming(end=1.0, step=0.03))
    times: list[float] = []
    for until in (0.1, 0.2, 1.0 / 3.0):
        simulation.advance(until, lambda: times.append(simulation.time))
        assert simulation.time == until
    steps = np.diff([0.0, *times])
    assert len(times) == simulation.steps == 4 + 4 + 5
    assert steps[:8] == pytest.approx(np.full(8, 0.025), rel=1e-12)
    assert steps[8:] == pytest.approx(np.full(5, (1.0 / 3.0 - 0.2) / 5), rel=1e-12)


@SCENES
def test_a_restored_state_goes_on_bit_for_bit(build: Build) -> None:
    """Also when taken up between two outputs."""
    case = build(end=END, step=END / 20)
    whole = run(case)
    kept: dict[str, Any] = {}

    class Cut(Exception):
        pass

    def cut() -> None:
        if first.steps == 7:
            kept.update(first.state())
            raise Cut

    first = Simulation(case)
    with pytest.raises(Cut):
        first.advance(END, cut)
    second = Simulation(case)
    second.restore(kept)
    second.advance(END, lambda: None)
    assert np.array_equal(second.configuration.r, whole.configuration.r)
    assert np.array_equal(second.configuration.e1, whole.configuration.e1)
    assert second.steps == whole.steps


PERIOD = 2 * np.pi / 10


def rod(**keys: Any) -> dict[str, Any]:
    return {"length": 2.0, "nodes": 17, "bending": 3.0, "stretching": 1e4, "normal": [0, 0, 1], **keys}


@pytest.mark.parametrize(
    ("keys", "step"),
    [
        ({"curvature": ["8*sin(4*pi*s - 10*t)", 0]}, PERIOD / 25),
        ({"curvature": ["8*sin(4*pi*s)*cos(3*t)", 0]}, 2 * np.pi / 3 / 25),
        (
            {"twisting": 1.0, "radius": 0.1, "start": {"end": "clamped", "spin": 71.6}},
            2 * np.pi / 71.6 / 25,
        ),
        ({"start": {"end": "clamped"}, "finish": {"follower": -38}}, 4 * np.pi * 0.7 * 2.0**2 / 38 / 25),
        # Nothing drives it: the slowest bending mode, zeta L^4/(A beta^4).
        ({}, 4 * np.pi * 0.7 * 2.0**4 / (3.0 * 500.564) / 25),
        ({"start": {"end": "clamped"}}, 4 * np.pi * 0.7 * 2.0**4 / (3.0 * 12.36236) / 25),
    ],
    ids=["swimmer", "standing wave", "whirling", "flailing", "free", "clamped"],
)
def test_the_automatic_step_is_a_25th_of_the_shortest_time_of_what_drives_the_rod(keys, step: float) -> None:
    """Sampled at 400 times, a sinusoid's amplitude is short by at most (pi/20)^2/2 of the swimmer's ten periods."""
    case = scene({"rod": rod(**keys)}, viscosity=0.7, end=2 * np.pi)
    assert Simulation(case).step_length == pytest.approx(step, rel=0.0124)


def test_the_automatic_step_of_several_filaments_is_that_of_the_fastest() -> None:
    slow, fast = rod(curvature=["sin(s - t)", 0]), rod(curvature=["sin(s - 5*t)", 0], position=[0, 9, 0])
    case = scene({"slow": slow, "fast": fast}, end=2 * np.pi)
    assert Simulation(case).step_length == pytest.approx(2 * np.pi / 5 / 25, rel=0.0124)


# The explicit limit


def dense_limit(simulation: Simulation) -> float:
    """2 over the largest eigenvalue of Z^-1 K, by LAPACK, held unknowns struck out."""
    system, shape = simulation.system, simulation.configuration
    _, moment = system.forces(shape, simulation.time)
    k = system.stiffness(shape, shape, moment, simulation.time).dense()
    n, m = k.shape[:2]
    drag = assembly_drag.drag(simulation.case, assembly_rods.rods(simulation.case))
    for i in range(n):
        z = np.eye(m)
        e3 = shape.e3[i]
        z[:3, :3] = drag.perp[i] * np.eye(3) + (drag.par[i] - drag.perp[i]) * np.outer(e3, e3)
        z[3:, 3:] *= drag.spin[i]
        k[i] = np.einsum("ab,bjc->ajc", np.linalg.inv(z), k[i])
    free = np.setdiff1d(np.arange(n * m), system.ends.index)
    matrix = k.reshape(n * m, n * m)[np.ix_(free, free)]
    return float(2.0 / np.abs(np.linalg.eigvals(matrix)).max())


LIMITED = {
    "swimmer": swimmer(),
    "bending": swimmer(stretching=100.0, rod={"nodes": 41, "derivative": 2}),
    "spun": twisting_rod(),
    "two": scene(
        {
            "helix": {
                **rod(bending=[1.0, 0.5], twisting=0.7, radius=0.02, curvature=[3, 0], twist_rate=1),
                "shape": {"kind": "relaxed"},
                "start": {"end": "clamped"},
                "finish": {"end": "hinged"},
            },
            "planar": rod(position=[0, 9, 0]),
        }
    ),
}


@pytest.mark.parametrize("case", LIMITED.values(), ids=LIMITED)
def test_the_explicit_limit_is_two_over_the_largest_eigenvalue(case: Case) -> None:
    simulation = Simulation(case)
    assert simulation.explicit_limit() == pytest.approx(dense_limit(simulation), rel=0.01)


@pytest.mark.parametrize(("factor", "stable"), [(0.95, True), (1.05, False)])
@pytest.mark.parametrize("stretching", [5.0, 1e4], ids=["bending", "stretching"])
def test_just_below_the_explicit_limit_is_stable_and_just_above_is_not(
    factor: float, stable: bool, stretching: float
) -> None:
    """Per step the stiffest mode is multiplied by 1 - 2 factor: in 100 steps, by 0.9^100 or 1.1^100 = 1.4e4."""
    keys = {
        "length": 1.0,
        "nodes": 9,
        "derivative": 2,
        "bending": 1.0,
        "stretching": stretching,
        "shape": {"kind": "straight", "perturb": ["1e-9*cos(8*pi*s)", "1e-9*cos(8*pi*s)", 0]},
    }
    limit = Simulation(scene({"rod": keys})).explicit_limit()
    simulation = Simulation(scene({"rod": keys}, end=100 * factor * limit, step=factor * limit, scheme="explicit"))
    before = simulation.configuration.r.copy()
    simulation.advance(simulation.case.time.end, lambda: None)
    assert simulation.steps == 100
    moved = np.abs(simulation.configuration.r - before).max()
    assert moved < 1e-8 if stable else moved > 1e-6


def test_the_automatic_explicit_step_is_half_the_limit_and_runs() -> None:
    simulation = Simulation(soft_swimming(end=0.05, scheme="explicit", step="auto"))
    assert simulation.step_length == pytest.approx(0.5 * simulation.explicit_limit(), rel=1e-12)
    simulation.advance(0.05, lambda: None)


# Failure


def test_a_run_that_diverges_says_when_where_and_what_to_change() -> None:
    """Two filaments, the second too stiff for the step: it is named, its node counted from its own start."""
    soft = {"length": 1.0, "nodes": 9, "bending": 1e-3, "stretching": 1.0}
    wave = {"kind": "expression", "r": ["s", "0.02*sin(6*pi*s)", 0]}
    stiff = {**soft, "bending": 1.0, "stretching": 1e4, "position": [0, 5, 0], "shape": wave}
    limit = Simulation(scene({"a": soft, "b": stiff})).explicit_limit()
    simulation = Simulation(scene({"a": soft, "b": stiff}, end=1.0, step=3 * limit, scheme="explicit"))
    with pytest.raises(RunFailed) as caught:
        simulation.advance(1.0, lambda: None)
    failed = caught.value
    assert failed.filament == "b"
    assert 0 <= failed.node < 9
    assert 0 < failed.time < 300 * limit
    assert failed.time == simulation.time
    assert "time.scheme=implicit" in failed.advice
    # The limit it advises is that of the start, and stable.
    assert f"{limit:.3g}" in failed.advice
    for part in ("filament b", f"node {failed.node}", f"t = {failed.time:.6g}", failed.advice):
        assert part in str(failed)


def test_a_step_that_cannot_be_solved_is_halved_down_to_min_step_and_then_refused_with_its_node() -> None:
    """A force of 1e7 along a straight rod folds its end over at once, however short the step."""
    keys = {"length": 1.0, "nodes": 9, "bending": 1.0, "stretching": 100.0}
    keys |= {"start": {"end": "clamped"}, "finish": {"follower": -1e7}}
    simulation = Simulation(scene({"rod": keys}, end=1.0, step=0.1, min_step=1e-3))
    with pytest.raises(RunFailed) as caught:
        simulation.advance(1.0, lambda: None)
    assert simulation.shortened == 6  # 0.1/2^6 > 1e-3 > 0.1/2^7
    assert caught.value.time == 0.0
    assert caught.value.filament == "rod"
    assert 0 < caught.value.node < 9
    assert "time.step" in caught.value.advice


def test_halved_steps_are_counted_and_grow_again_and_the_output_is_still_hit() -> None:
    """A straight rod is told all at once to be an arc of 10 radians: too far for Newton in one step.

    Four halvings make a 16th of a step; without growing again, the step in question would be a dozen.
    """
    rod = {"length": 1.0, "nodes": 21, "bending": 1.0, "stretching": 1e3}
    simulation = run(scene({"rod": {**rod, "curvature": ["10*step(t - 0.15)", 0]}}, end=0.4, step=0.1))
    assert simulation.shortened >= 4
    assert simulation.time == 0.4
    assert 4 < simulation.steps < 14


def test_a_twist_that_nears_half_a_turn_between_nodes_is_refused_with_its_node() -> None:
    """Beyond that the twist comes back from the other side, and a rod would wind up without end."""
    keys = {"length": 1.0, "nodes": 9, "bending": 1.0, "stretching": 1e3, "twisting": 1.0, "radius": 0.5}
    keys |= {"start": {"end": "clamped", "spin": 10.0}}
    with pytest.raises(RunFailed, match="half a turn") as caught:
        run(scene({"rod": keys}, end=10.0, step=0.01))
    assert caught.value.filament == "rod"
    assert caught.value.node == 0
    assert "more nodes" in caught.value.advice
