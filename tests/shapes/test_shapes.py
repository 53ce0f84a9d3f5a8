"""Start shapes against closed forms, quadrature and an independent integration of the frame equations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.shape_scene import KEY, SPATIAL, X, Y, Z, helix, rod
from scipy.integrate import quad, solve_ivp
from scipy.special import j0

from ibfil.case.expressions import parse
from ibfil.case.filament import Filament
from ibfil.case.spacing import node_arclength
from ibfil.errors import CaseError
from ibfil.shapes.initial import end_tangents, initial_shape


def test_nodes_are_evenly_spaced_from_zero_to_the_length() -> None:
    s = node_arclength(rod(length=2.5, nodes=11))
    assert (s[0], s[-1]) == (0.0, 2.5)
    np.testing.assert_allclose(s, 0.25 * np.arange(11), rtol=1e-15)


def uneven(text: str) -> Filament:
    return rod(length=2.0, nodes=9).model_copy(update={"spacing": parse(text, ("q",), {})})


def test_spacing_gives_the_nodes_as_fractions_of_the_length() -> None:
    np.testing.assert_allclose(node_arclength(uneven("q**2")), 2.0 * (np.arange(9) / 8) ** 2, rtol=1e-15)
    assert node_arclength(uneven("q + 1e-12*q"))[-1] == 2.0


@pytest.mark.parametrize(
    ("text", "part"),
    [("q/2", "runs from 0 to 0.5"), ("q + 3*q*(1 - q)*(1/2 - q)*8", "q = 0.25"), ("1/(q - q)", "q = 0:")],
)
def test_spacing_must_rise_from_nought_to_one(text: str, part: str) -> None:
    with pytest.raises(CaseError) as caught:
        node_arclength(uneven(text), KEY)
    assert caught.value.faults[0].startswith("filament.rod.spacing: ")
    assert part in caught.value.faults[0]


def test_straight_rod_lies_along_direction_with_e1_along_normal() -> None:
    r, e1 = initial_shape(rod(nodes=21, position=[1.0, 2.0, 3.0], direction=[0.0, 2.0, 0.0], normal=[0, 1, 4]))
    np.testing.assert_allclose(r - [1.0, 2.0, 3.0], np.outer(np.linspace(-0.5, 0.5, 21), Y), atol=5e-16)
    assert np.all(e1 == Z)


def test_swimmer_is_the_integral_of_its_angle() -> None:
    # Sec. 7.1 at t = 0: theta' = 8 sin(4 pi s), whose mean tangent lies along x with theta as here.
    filament = rod(curvature=["8*sin(4*pi*s - 10*t)", 0], shape={"kind": "relaxed"}, anchor="centroid", align="axis")
    r, e1 = initial_shape(filament)
    s = node_arclength(filament)

    def angle(at: float) -> float:
        return -8.0 / (4.0 * np.pi) * np.cos(4.0 * np.pi * at)

    x = [quad(lambda u: np.cos(angle(u)), 0.0, end, epsabs=1e-13)[0] for end in s]
    y = [quad(lambda u: np.sin(angle(u)), 0.0, end, epsabs=1e-13)[0] for end in s]
    np.testing.assert_allclose(r[:, 0] - r[0, 0], x, atol=1e-12)
    np.testing.assert_allclose(r[:, 1] - r[0, 1], y, atol=1e-12)
    assert np.all(r[:, 2] == 0.0)
    assert np.all(e1 == Z)
    # Two whole waves: the chord is Bessel's function of the largest angle.
    np.testing.assert_allclose(r[-1] - r[0], j0(2.0 / np.pi) * X, atol=1e-12)
    weight = np.full(41, 1.0 / 40.0)
    weight[[0, -1]] /= 2.0
    np.testing.assert_allclose(weight @ r, 0.0, atol=1e-15)


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("given", ["curvature", "radius"])
def test_helix_from_either_pair_of_numbers_winds_as_it_should(hand: str, given: str) -> None:
    k, t = 3.0, 1.0
    numbers = {"radius": 0.3, "pitch": 0.2 * np.pi} if given == "radius" else {"curvature": k, "torsion": t}
    shape = {"kind": "helix", "hand": hand} | numbers
    filament = rod(length=5.0, nodes=201, anchor="start", shape=shape, **SPATIAL)
    s = node_arclength(filament)
    r, e1 = initial_shape(filament)
    exact = helix(s, k, t if hand == "right" else -t)
    np.testing.assert_allclose(r, exact, atol=1e-13)
    # Its frame has O1 = k > 0, so e2 points away from the axis, which runs through y = R.
    outwards = (r - [0.0, 0.3, 0.0]) * [0.0, 1.0, 1.0] / 0.3
    tangent = np.stack((np.full(201, 0.1), 0.3 * np.sin(s * 10**0.5), 0.0 * s), axis=1) * 10**0.5
    tangent[:, 2] = (-1.0 if hand == "right" else 1.0) * 0.3 * 10**0.5 * np.cos(s * 10**0.5)
    np.testing.assert_allclose(np.cross(tangent, e1), outwards, atol=1e-12)


@pytest.mark.parametrize("twist_rate", [1.0, -1.0])
def test_relaxed_rod_with_constant_strains_is_that_helix(twist_rate: float) -> None:
    filament = rod(
        length=5.0,
        anchor="start",
        curvature=[3, 0],
        twist_rate=twist_rate,
        shape={"kind": "relaxed"},
        **SPATIAL,
    )
    r, e1 = initial_shape(filament)
    np.testing.assert_allclose(r, helix(node_arclength(filament), 3.0, twist_rate), atol=1e-13)
    shape = {"kind": "helix", "curvature": 3.0, "torsion": 1.0, "hand": "right" if twist_rate > 0 else "left"}
    same = initial_shape(rod(length=5.0, anchor="start", shape=shape, **SPATIAL))
    np.testing.assert_allclose(r, same[0], atol=1e-14)
    np.testing.assert_allclose(e1, same[1], atol=1e-14)


def test_axis_of_curvature_about_both_directors_is_the_axis_of_the_helix() -> None:
    filament = rod(
        length=4.0,
        nodes=101,
        anchor="start",
        curvature=[2, -1.5],
        twist_rate=2,
        shape={"kind": "relaxed"},
        **SPATIAL,
    )
    s = node_arclength(filament)
    r, _ = initial_shape(filament)
    rate = np.hypot(2.5, 2.0)
    np.testing.assert_allclose(r[:, 0], 2.0 / rate * s, atol=1e-13)
    # Chords between nodes equally far apart are as long as on a helix of curvature 2.5, torsion 2.
    for step in (1, 7, 50):
        chord = np.hypot(2.0 / rate * s[step], 2.0 * 2.5 / rate**2 * np.sin(0.5 * rate * s[step]))
        np.testing.assert_allclose(np.linalg.norm(r[step:] - r[:-step], axis=1), chord, atol=1e-13)


def test_varying_strains_agree_with_the_frame_equations_integrated_another_way() -> None:
    def strains(s: float) -> np.ndarray:
        return np.array([4.0 * np.sin(5.0 * s), 1.0 + s**2, 3.0 * np.cos(2.0 * s)])

    def rates(s: float, y: np.ndarray) -> np.ndarray:
        snapshot = y[3:].reshape(3, 3)  # rows e1, e2, e3
        return np.concatenate((snapshot[2], np.cross(strains(s) @ snapshot, snapshot).ravel()))

    filament = rod(
        length=2.0,
        curvature=["4*sin(5*s) + t", "1 + s**2"],
        twist_rate="3*cos(2*s)",
        shape={"kind": "relaxed"},
        align="tangent",
        anchor="start",
        direction=[0, 0, 1],
        normal=[1, 0, 0],
        **SPATIAL,
    )
    s = node_arclength(filament)
    start = np.concatenate((np.zeros(3), np.eye(3).ravel()))
    exact = solve_ivp(rates, (0.0, 2.0), start, "DOP853", s, rtol=1e-13, atol=1e-14).y.T
    r, e1 = initial_shape(filament)
    np.testing.assert_allclose(r, exact[:, :3], atol=1e-11)
    np.testing.assert_allclose(e1, exact[:, 3:6], atol=1e-11)
    tangents = end_tangents(filament)
    np.testing.assert_allclose(tangents, exact[[0, -1], 9:], atol=1e-11)
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=1), 1.0, atol=1e-13)


def test_a_jump_in_curvature_joins_two_arcs() -> None:
    filament = rod(curvature=["step(s - 1/3)*pi", 0], shape={"kind": "relaxed"}, align="tangent", anchor="start")
    r, _ = initial_shape(filament)
    s = node_arclength(filament)
    angle = np.pi * np.maximum(s - 1.0 / 3.0, 0.0)
    exact = np.stack((np.minimum(s, 1.0 / 3.0) + np.sin(angle) / np.pi, (1.0 - np.cos(angle)) / np.pi), axis=1)
    # The jump falls inside one of at least 32768 pieces, so the angle is off by no more than pi/32768.
    np.testing.assert_allclose(r[:, :2], exact, atol=np.pi / 32768)


def test_arc_bends_to_the_left_seen_from_the_tip_of_e1() -> None:
    filament = rod(length=3.0, anchor="start", shape={"kind": "circle", "curvature": 0.5})
    s = node_arclength(filament)
    r, e1 = initial_shape(filament)
    exact = np.stack((2.0 * np.sin(0.5 * s), 2.0 * (1.0 - np.cos(0.5 * s)), 0.0 * s), axis=1)
    np.testing.assert_allclose(r, exact, atol=1e-14)
    assert np.all(e1 == Z)
    right, _ = initial_shape(rod(length=3.0, anchor="start", shape={"kind": "circle", "curvature": -0.5}))
    np.testing.assert_allclose(right, exact * [1.0, -1.0, 1.0], atol=1e-14)


def test_ends_of_a_whole_turn_meet() -> None:
    ring = {"kind": "circle", "curvature": 2.0 * np.pi}
    r, _ = initial_shape(rod(shape=ring))
    np.testing.assert_allclose(r[-1], r[0], atol=1e-14)


def test_twist_turns_e1_by_its_integral() -> None:
    filament = rod(shape={"twist": "0.1*cos(pi*s/2) + 7"}, normal=[0, 1, 0], **SPATIAL)
    s = node_arclength(filament)
    _, e1 = initial_shape(filament)
    angle = 0.2 / np.pi * np.sin(0.5 * np.pi * s) + 7.0 * s
    # e1' = O3 e2, and e2 = x cross y = z at s = 0.
    np.testing.assert_allclose(e1, np.cos(angle)[:, None] * Y + np.sin(angle)[:, None] * Z, atol=1e-12)


def test_twist_is_added_to_the_twist_of_the_shape() -> None:
    keys = {"align": "tangent", "anchor": "start", **SPATIAL}
    helical = {"kind": "helix", "curvature": 2.0, "torsion": 3.0}
    r, _ = initial_shape(rod(shape=helical, **keys))
    twisted = initial_shape(rod(shape=helical | {"twist": "-s"}, **keys))
    np.testing.assert_array_equal(twisted[0], r)
    # The same rod, by its strains: the curvature turns in the frame as the frame turns in the rod.
    curvature = ["2*cos(-s**2/2)", "-2*sin(-s**2/2)"]
    strained = rod(curvature=curvature, twist_rate="3 - s", shape={"kind": "relaxed"}, **keys)
    np.testing.assert_allclose(initial_shape(strained)[0], r, atol=1e-12)
    np.testing.assert_allclose(initial_shape(strained)[1], twisted[1], atol=1e-12)


def test_perturbation_is_added_in_the_lab_frame_after_placing() -> None:
    keys = {"direction": [0, 1, 0], "position": [1, 1, 1], "anchor": "start"}
    r, e1 = initial_shape(rod(**keys))
    moved, same = initial_shape(rod(shape={"perturb": [0.5, "0.1*s", "1e-3*s**2*(1 - s/3)"]}, **keys))
    s = np.linspace(0.0, 1.0, 41)
    np.testing.assert_allclose(moved - r, np.stack((0 * s + 0.5, 0.1 * s, 1e-3 * s**2 * (1 - s / 3)), axis=1))
    np.testing.assert_array_equal(same, e1)


def test_end_tangents_are_those_of_the_perturbed_curve() -> None:
    filament = rod(shape={"perturb": [0, 0, "s - s**2/4"]}, anchor="start")
    start, finish = end_tangents(filament)
    np.testing.assert_allclose(start, np.array([1, 0, 1]) / 2**0.5, atol=1e-9)
    np.testing.assert_allclose(finish, np.array([1, 0, 0.5]) / 1.25**0.5, atol=1e-9)


def noisy(seed: int = 1, **keys: Any) -> np.ndarray:
    noise = {"amplitude": 1e-3, "modes": 6, "seed": seed}
    shape = keys.pop("shape", {"kind": "straight"})
    return initial_shape(rod(shape=shape | {"noise": noise}, **keys))[0] - initial_shape(rod(shape=shape, **keys))[0]


def test_noise_is_the_same_curve_for_a_seed_at_any_number_of_nodes() -> None:
    moved = noisy(nodes=21, **SPATIAL)
    np.testing.assert_array_equal(moved, noisy(nodes=21, **SPATIAL))
    np.testing.assert_allclose(noisy(nodes=41, **SPATIAL)[::2], moved, atol=1e-15)
    assert np.max(np.abs(moved - noisy(seed=2, nodes=21, **SPATIAL))) > 1e-4


def test_noise_lies_across_the_rod_and_within_its_amplitude() -> None:
    sizes = []
    for seed in range(20):
        moved = noisy(seed, **SPATIAL)
        assert np.all(moved[:, 0] == 0.0)
        assert np.all(np.max(np.abs(moved[:, 1:]), axis=0) > 0.0)
        sizes.append(np.max(np.linalg.norm(moved, axis=1)))
    assert max(sizes) <= 1e-3 * (1 + 1e-12)
    assert np.median(sizes) > 3e-4  # two of three directions are left of a field as large as the amplitude


def test_noise_of_a_filament_without_twist_stays_in_its_plane() -> None:
    assert np.all(noisy(direction=[1, 1, 0])[:, 2] == 0.0)
    bent = noisy(curvature=["6*sin(7*s)", 0], shape={"kind": "relaxed"})
    assert np.all(bent[:, 2] == 0.0)
    assert np.max(np.abs(bent)) > 1e-4
    sideways = noisy(curvature=[0, "6*sin(7*s)"], shape={"kind": "relaxed"}, normal=[0, 1, 0])
    assert np.max(np.abs(sideways[:, 2])) < 1e-15
    assert np.max(np.abs(sideways)) > 1e-4


def test_noise_leaves_held_ends_in_place_and_clamped_ones_flat() -> None:
    fine = 3001
    h = 1.0 / (fine - 1)
    moved = noisy(nodes=fine, start={"end": "clamped"}, finish={"end": "hinged"}, **SPATIAL)
    assert np.max(np.abs(moved[0])) == 0.0
    assert np.max(np.abs(moved[-1])) < 1e-18
    size = np.linalg.norm(moved, axis=1)
    # Quadratic at the clamp, linear at the hinge.
    assert size[2] / size[1] == pytest.approx(4.0, rel=20 * h)
    assert size[-3] / size[-2] == pytest.approx(2.0, rel=20 * h)
    assert np.max(np.abs(noisy(nodes=fine, **SPATIAL)[0])) > 1e-5
