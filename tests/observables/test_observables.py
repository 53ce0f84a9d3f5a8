"""Places, and observables read off each output, against motions known exactly."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.motions import CASE, LENGTH, NODES, RNG, S, observing, seen, snapshot, straight, tip_at, value

from ibfil.case.reading import parse_case
from ibfil.observables.factory import observers
from ibfil.observables.location import Location

# --- places ----------------------------------------------------------------------------------------------------------


def cubic(s: np.ndarray) -> np.ndarray:
    """A curve that no quadratic passes through."""
    return np.stack([1 + s - s**3, 2 * s**2, s**3 - 4 * s], axis=-1)


@pytest.mark.parametrize(
    ("at", "s"), [("start", 0.0), ("finish", 2.0), ("middle", 1.0), (0.37, 0.37), (1.99, 1.99), (0.01, 0.01)]
)
@pytest.mark.parametrize("uneven", [False, True])
def test_points_of_a_cubic_are_exact(at, s, uneven):
    nodes = 2.0 * np.linspace(0, 1, NODES) ** 1.5 if uneven else S
    assert Location(nodes, at).values(cubic(nodes))[0] == pytest.approx(cubic(np.array(s)), abs=1e-12)


def test_a_node_is_itself_bit_for_bit():
    field = RNG.random((NODES, 3))
    for i, s in enumerate(S):
        assert np.array_equal(Location(S, float(s)).values(field)[0], field[i])


@pytest.mark.parametrize("at", ["centroid", (0.3, 1.7), (0.0, 2.0), (0.31, 0.33)])
@pytest.mark.parametrize("uneven", [False, True])
def test_means_of_a_straight_line_are_exact(at, uneven):
    nodes = 2.0 * np.linspace(0, 1, NODES) ** 1.5 if uneven else S
    location = Location(nodes, at)
    middle = 1.0 if at == "centroid" else 0.5 * (at[0] + at[1])
    assert location.reduced(location.values(3 * nodes - 1), "mean") == pytest.approx(3 * middle - 1, abs=1e-12)


def test_extremes_of_a_window_count_its_ends():
    location = Location(S, (0.3, 1.7))
    assert location.reduced(location.values(S), "min") == pytest.approx(0.3)
    assert location.reduced(location.values(S), "max") == pytest.approx(1.7)


# --- kinds that are read off each output -----------------------------------------------------------------------------


def test_position_and_its_component():
    def motion(t):
        return cubic(S) + np.array([0, t, 0])

    series, summary = seen('kind = "position"\nat = "middle"', motion, [0.0, 1.0])
    assert series == pytest.approx(np.array([[1, 2, -3], [1, 3, -3]]), abs=1e-12)
    assert summary.value == pytest.approx(np.array([1, 3, -3]), abs=1e-12)
    assert value('kind = "position"\nat = "middle"\nalong = [0, 3, -4]', motion, [0.0]) == pytest.approx((6 + 12) / 5)
    keys = 'kind = "position"\nat = [0.5, 1.0]\nspace = "max"\nalong = [0, 1, 0]'
    assert value(keys, motion, [0.0]) == pytest.approx(2.0)


def test_velocity_and_speed_of_a_turning_rod():
    omega = np.array([0.0, 0.0, 3.0])

    def motion(t):
        return straight(), {"velocity": np.cross(omega, straight())}

    assert value('kind = "velocity"\nat = 1.5', motion, [0]) == pytest.approx(np.array([0, 4.5, 0]), abs=1e-12)
    assert value('kind = "velocity"\nat = "centroid"\nalong = [0, -2, 0]', motion, [0]) == pytest.approx(-3.0)
    assert value('kind = "speed"\nat = "finish"', motion, [0]) == pytest.approx(6.0)
    for space, expected in {"mean": 4.5, "max": 6.0, "min": 3.0}.items():
        assert value(f'kind = "speed"\nat = [1.0, 2.0]\nspace = "{space}"', motion, [0]) == pytest.approx(expected)


def test_what_is_said_of_a_filament_is_said_of_its_centroid_and_where_is_told():
    """A tail end of a swimmer beats at 62 where it swims at 2.4."""

    def motion(t):
        return straight() + np.array([5 * t, 0, 0]), {
            "velocity": np.array([5.0, 0, 0]) + np.cross([0, 0, 3.0], straight())
        }

    means = {"position": [1, 0, 0], "velocity": [5, 3, 0], "displacement": [0, 0, 0], "speed": np.hypot(5, 3)}
    for kind, expected in means.items():
        assert value(f'kind = "{kind}"', motion, [0.0]) == pytest.approx(np.array(expected), abs=1e-12)
        _, looking = observing(f'kind = "{kind}"')
        assert 'at = "centroid"' in looking.observables["o"].words
        assert 'at = "centroid"' in looking.observables["o"].description
    assert value('kind = "drift"\nalong = [1, 0, 0]', motion, [0.0, 2.0]) == pytest.approx(5.0)
    _, looking = observing('kind = "amplitude"')
    assert 'at = "finish"' in looking.observables["o"].words


def test_displacement_is_from_the_first_output():
    def motion(t):
        return cubic(S) + np.array([5 * t, 0, -t])

    series, _ = seen('kind = "displacement"', motion, [2.0, 3.0])
    assert series == pytest.approx(np.array([[0, 0, 0], [5, 0, -1]]), abs=1e-12)
    assert value('kind = "displacement"\nat = "centroid"\nalong = [1, 0, 0]', motion, [2.0, 4.0]) == pytest.approx(10)


def test_displacement_does_not_hold_on_to_the_simulations_memory():
    memory = straight()
    _, looking = observing('kind = "displacement"\nalong = [1, 0, 0]')
    looking.record(snapshot(0.0, memory))
    memory += 1.0
    assert looking.record(snapshot(1.0, memory))["o"] == pytest.approx(1.0)


def test_end_to_end():
    bent = np.column_stack([np.cos(S), np.sin(S), 0 * S])  # an arc of 2 rad
    assert value('kind = "end_to_end"', lambda t: bent, [0]) == pytest.approx(2 * np.sin(1.0))


def test_amplitude_is_the_distance_from_the_line_through_the_start():
    def motion(t):
        return tip_at(7, 3, 4) + np.array([1, 2, 3])

    assert value('kind = "amplitude"', motion, [0]) == pytest.approx(5.0)
    assert value('kind = "amplitude"\nalong = [0, 0, -2]', motion, [0]) == pytest.approx(np.hypot(7, 3))
    assert value('kind = "amplitude"\nat = [0, 2]\nspace = "mean"', motion, [0]) == pytest.approx(2.5)


def test_radius_of_a_helix_is_its_radius():
    turn = np.pi * S[:, None]  # one turn
    helix = np.hstack([S[:, None], 0.3 * np.cos(turn), 0.3 * np.sin(turn)]) + np.array([0, 5, 6])
    for space in ("mean", "max", "min"):
        found = value(f'kind = "radius"\nat = [0, 2]\nspace = "{space}"\nalong = [1, 0, 0]', lambda t: helix, [0])
        assert found == pytest.approx(0.3)


def test_turn_angle_counts_whole_turns_about_an_axis():
    times = np.linspace(0, 3, 31)

    def motion(t):
        return straight((np.cos(5 * t), np.sin(5 * t), 0.5)) + t

    series, _ = seen('kind = "turn_angle"\nalong = [0, 0, 1]', motion, times)
    assert series == pytest.approx(5 * times, abs=1e-12)
    series, _ = seen('kind = "turn_angle"\nalong = [0, 0, -1]', motion, times)
    assert series == pytest.approx(-5 * times, abs=1e-12)
    series, _ = seen('kind = "turn_angle"', motion, times)
    assert series == pytest.approx(np.arccos((np.cos(5 * times) + 0.25) / 1.25), abs=1e-7)


def test_stretch_of_the_segments():
    ds = LENGTH / (NODES - 1)
    stretched = straight() * np.array([1.02, 0, 0]) + 0.01 * S[:, None] ** 2 * np.array([1, 0, 0])
    middles = S[:-1] + ds / 2
    exact = 0.02 + 0.02 * middles  # the difference of s^2 over a segment is 2 s ds of its middle

    def measured(keys):
        return value(f'kind = "stretch"\n{keys}', lambda t: stretched, [0])

    assert measured('at = "start"') == pytest.approx(exact[0])
    assert measured('at = "finish"') == pytest.approx(exact[-1])
    assert measured('at = "middle"') == pytest.approx(exact[4])
    assert measured("at = 0.3") == pytest.approx(exact[1])
    assert measured('at = [0, 2]\nspace = "max"') == pytest.approx(exact[-1])
    assert measured('at = [0, 2]\nspace = "min"') == pytest.approx(exact[0])
    assert measured('at = [0, 2]\nspace = "mean"') == pytest.approx(0.04)
    assert measured('at = [1.0, 2]\nspace = "min"') == pytest.approx(exact[4])  # its middle is at 1.0


def test_twist_is_the_third_strain():
    strain = np.column_stack([S + 9, S - 9, 2 - S**2])
    keys = 'kind = "twist"\nat = 0.7'
    assert value(keys, lambda t: (straight(), {"strain": strain}), [0]) == pytest.approx(2 - 0.49)


def test_force_on_the_fluid_and_of_a_support():
    force = RNG.random((NODES, 3))

    def motion(t):
        return straight(), {"force": force, "reaction_start": np.array([1.0, 2.0, 3.0])}

    assert value('kind = "force"', motion, [0]) == pytest.approx(force.sum(axis=0))
    assert value('kind = "force"\nat = [0, 0.5]\nalong = [0, 1, 0]', motion, [0]) == pytest.approx(force[:3, 1].sum())
    assert value('kind = "force"\nat = "start"', motion, [0]) == pytest.approx(np.array([1, 2, 3]))


def test_torque_on_the_fluid_is_about_the_centroid():
    force = np.zeros((NODES, 3))
    force[0], force[-1] = [0, -1.5, 0], [0, 1.5, 0]

    def motion(t):
        return straight() + np.array([4, 5, 6]), {"force": force}

    assert value('kind = "torque"\nalong = [0, 0, 1]', motion, [0]) == pytest.approx(1.5 * LENGTH)
    assert value('kind = "torque"\nat = [1, 2]', motion, [0]) == pytest.approx(np.array([0, 0, 1.5]), abs=1e-12)


def test_couples_of_the_supports_hold_a_bent_and_twisted_rod():
    """A rod clamped at both ends with the same moment all along: the two couples cancel, and turn as M(L) says."""
    e1 = np.tile([0.0, 0.0, 1.0], (NODES, 1))  # along x: e2 = e3 x e1 = -y
    moment = np.tile([0.1, 2.0, -0.5], (NODES, 1))
    text = CASE.replace("[fluid]", 'finish = { end = "clamped" }\n[fluid]')
    text += '[observe.a]\nkind = "torque"\nat = "start"\n[observe.b]\nkind = "torque"\nat = "finish"\n'
    looking = observers(parse_case(text, "case.toml"))
    found = looking.record(snapshot(0.0, straight(), e1=e1, moment=moment, reaction_finish=np.zeros(3)))
    assert found["b"] == pytest.approx(np.array([-0.5, -2.0, 0.1]), abs=1e-12)
    assert found["a"] == pytest.approx(-found["b"], abs=1e-12)


def test_power():
    force, velocity = RNG.random((NODES, 3)), RNG.random((NODES, 3))

    def motion(t):
        return straight(), {"force": force, "velocity": velocity}

    assert value('kind = "power"', motion, [0]) == pytest.approx(np.tensordot(force, velocity))
    assert value('kind = "power"\nat = [1.9, 2]', motion, [0]) == pytest.approx(force[-1] @ velocity[-1])
