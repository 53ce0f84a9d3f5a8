"""The material frame: carried by Eq. 41 and turned by an angle, exactly; a spun clamp holds it as told."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.scenes import RFT, STOKES, run, scene, slopes
from scipy.spatial.transform import Rotation

from ibfil.rods.base import TangentReversed
from ibfil.rods.frame import transport
from ibfil.simulation.simulation import Simulation

X, Y, Z = np.eye(3)


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def frames(n: int, largest: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Random e1 and old tangents (n, 3), new ones at up to ``largest`` radians from them, the angles (n,)."""
    rng = np.random.default_rng(seed)
    old = unit(rng.standard_normal((n, 3)))
    e1 = unit(np.cross(old, rng.standard_normal((n, 3))))
    aside = unit(np.cross(old, rng.standard_normal((n, 3))))
    turned = rng.uniform(0.0, largest, n)
    new = np.cos(turned)[:, None] * old + np.sin(turned)[:, None] * aside
    return e1, old, new, turned


def test_carried_directors_are_unit_and_normal_to_the_new_tangent() -> None:
    e1, old, new, _ = frames(200, 3.0)
    out, _ = transport(e1, old, new, np.random.default_rng(1).uniform(-3.0, 3.0, 200))
    assert np.linalg.norm(out, axis=1) == pytest.approx(np.ones(200), abs=1e-14)
    assert np.abs(np.sum(out * new, axis=1)).max() < 1e-14


def test_carrying_is_the_smallest_rotation_that_takes_the_old_tangent_to_the_new() -> None:
    e1, old, new, turned = frames(200, 3.0)
    axis = unit(np.cross(old, new))
    expected = Rotation.from_rotvec(turned[:, None] * axis).apply(e1)
    out, _ = transport(e1, old, new, np.zeros(200))
    # Eq. 41 divides by 1 + old.new, about 0.01 at 3 radians: two digits of sixteen are lost.
    assert np.abs(out - expected).max() < 1e-13


def test_turning_is_the_rotation_about_the_new_tangent_by_the_angle_itself() -> None:
    e1, old, new, _ = frames(200, 2.0)
    angle = np.random.default_rng(2).uniform(-np.pi, np.pi, 200)
    transported, _ = transport(e1, old, new, np.zeros(200))
    turned, _ = transport(e1, old, new, angle)
    assert np.abs(turned - Rotation.from_rotvec(angle[:, None] * new).apply(transported)).max() < 1e-14


def test_round_off_does_not_build_up_over_many_steps() -> None:
    e1, old, _, _ = frames(1, 1.0)
    for k in range(20000):
        new = unit(old + 0.01 * np.array([[np.sin(k), np.cos(2 * k), np.sin(3 * k)]]))
        e1, _ = transport(e1, old, new, np.full(1, 0.1))
        old = new
    assert abs(np.linalg.norm(e1) - 1) < 1e-15
    assert abs(np.sum(e1 * old)) < 1e-15


def test_carried_round_a_circle_the_director_turns_by_the_solid_angle_to_second_order() -> None:
    """Parallel transport round a cone of half angle c: 2 pi (1 - cos c), the holonomy of the sphere."""
    c = 0.7

    def error(steps: int) -> float:
        at = np.linspace(0.0, 2 * np.pi, steps + 1)
        e3 = np.stack([np.sin(c) * np.cos(at), np.sin(c) * np.sin(at), np.full(at.shape, np.cos(c))], axis=1)
        start = np.array([[np.cos(c), 0.0, -np.sin(c)]])
        e1 = start
        for k in range(steps):
            e1, _ = transport(e1, e3[k : k + 1], e3[k + 1 : k + 2], np.zeros(1))
        e2 = np.cross(e3[0], start[0])
        turned = np.arctan2(e1[0] @ e2, e1[0] @ start[0])
        return abs((turned - 2 * np.pi * (1 - np.cos(c)) + np.pi) % (2 * np.pi) - np.pi)

    assert slopes([error(n) for n in (20, 40, 80)]) == pytest.approx(2.0, abs=0.05)


def test_the_smallest_one_plus_cosine_is_told_so_that_reversals_are_noticed() -> None:
    e1, old, new, turned = frames(50, 3.0)
    _, least = transport(e1, old, new, np.zeros(50))
    assert least == pytest.approx(1 + np.cos(turned.max()), rel=1e-10)


def test_a_tangent_that_reverses_within_a_step_is_refused_with_its_node() -> None:
    rod = {"length": 1.0, "nodes": 9, "derivative": 2, "bending": 1.0, "stretching": 100.0}
    rods = Simulation(scene({"rod": rod}))
    back = np.zeros((9, 3))
    back[8, 0] = -1.5 / 8  # the last node to half a segment behind the one before it
    with pytest.raises(TangentReversed) as caught:
        rods.system.move(rods.configuration, back)
    assert caught.value.node == 8


def test_a_rod_may_turn_by_up_to_168_degrees_within_a_step() -> None:
    """1 + cos of it is 0.022, of 169 degrees 0.018; at 0.02 Eq. 41 magnifies rounding by sqrt(2/0.02) = 10."""
    rod = {"length": 1.0, "nodes": 9, "derivative": 2, "bending": 1.0, "stretching": 100.0}
    rods = Simulation(scene({"rod": rod}))
    straight = rods.configuration.r

    def turned(degrees: float) -> np.ndarray:
        return Rotation.from_euler("z", degrees, degrees=True).apply(straight)

    there = rods.system.move(rods.configuration, turned(168) - straight)
    assert there.e3 == pytest.approx(np.tile(turned(168)[-1] / 0.5, (9, 1)), abs=1e-13)
    with pytest.raises(TangentReversed, match=r"0\.018 \(allowed 0\.02\)"):
        rods.system.move(rods.configuration, turned(169) - straight)


# A clamp that turns. C and the drag are such that nothing but the clamp matters: e1 there is prescribed.


def spun(end: dict[str, object], *, at: str = "start", scheme: str = "implicit", fluid=RFT) -> Simulation:
    rod = {
        "length": 1.0,
        "nodes": 9,
        "bending": 1.0,
        "twisting": 1.0,
        "stretching": 100.0,
        "radius": 0.05,
        "direction": [1, 0, 0],
        "normal": [0, 1, 0],
        at: {"end": "clamped", **end},
    }
    return run(scene({"rod": rod}, fluid, end=0.35, step=0.05, scheme=scheme))


@pytest.mark.parametrize("scheme", ["semi-implicit", "implicit"])
@pytest.mark.parametrize("fluid", [RFT, STOKES, {**STOKES, "rotation": "grid"}], ids=["rft", "stokes", "stirred"])
@pytest.mark.parametrize(("at", "node"), [("start", 0), ("finish", -1)])
def test_a_spun_clamp_holds_e1_at_cos_wt_y_plus_sin_wt_z(scheme: str, fluid: dict, at: str, node: int) -> None:
    """Sec. 7.6, corrected: the printed cos x + sin y is not normal to a rod along x. One linear solve is enough."""
    w = 5.0
    simulation = spun({"spin": w}, scheme=scheme, fluid=fluid, at=at)
    t = simulation.time
    assert simulation.configuration.e1[node] == pytest.approx(np.cos(w * t) * Y + np.sin(w * t) * Z, abs=1e-14)
    assert np.array_equal(simulation.configuration.r[node], Simulation(simulation.case).configuration.r[node])


@pytest.mark.parametrize("fluid", [RFT, STOKES], ids=["rft", "stokes"])
@pytest.mark.parametrize(("at", "node"), [("start", 0), ("finish", -1)])
def test_a_spun_clamp_gives_the_fluid_the_torque_of_its_own_drag(fluid: dict, at: str, node: int) -> None:
    """4 pi eta a^2 w over half a segment, by BDF2 in steps of any length."""
    simulation = spun({"spin": 5.0}, fluid=fluid, at=at)
    simulation.advance(0.36, lambda: None)
    torque = simulation.snapshot().filaments["rod"].torque[node]
    assert torque == pytest.approx(4 * np.pi * 0.05**2 * 5.0 / 16 * X, rel=1e-9)


@pytest.mark.parametrize(
    ("end", "angle"),
    [
        ({"spin": "40*t**3"}, lambda t: 10 * t**4),
        ({"spin": "9*cos(20*t)"}, lambda t: 0.45 * np.sin(20 * t)),
        ({"angle": "t + 3*t**2"}, lambda t: t + 3 * t**2),
        ({}, lambda t: 0.0),
    ],
    ids=["polynomial", "oscillating", "angle", "held"],
)
@pytest.mark.parametrize("at", ["start", "finish"])
def test_a_spin_that_varies_is_integrated_exactly_over_long_steps(end, angle, at: str) -> None:
    simulation = spun(end, at=at)
    turned = angle(simulation.time)
    node = 0 if at == "start" else -1
    assert simulation.configuration.e1[node] == pytest.approx(np.cos(turned) * Y + np.sin(turned) * Z, abs=1e-13)


def test_a_clamp_that_leaves_twist_free_does_not_hold_e1() -> None:
    simulation = spun({"twist": "free"})
    assert 3 not in simulation.system.ends.index
    assert list(simulation.system.ends.index) == [0, 1, 2]
