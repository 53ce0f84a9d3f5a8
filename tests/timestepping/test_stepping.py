"""Time steps: their orders by slope, in positions and in the frame, and what a step solves.

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
