"""Observables against motions whose numbers are known exactly; stop rules are in test_running.py."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ibfil import fits
from ibfil.case import parse_case
from ibfil.errors import CaseError
from ibfil.expectations import check
from ibfil.frames import FilamentFrame, Frame
from ibfil.observe import KINDS, Summary, observers
from ibfil.place import Place
from ibfil.units import label

LENGTH, NODES = 2.0, 10  # an even number of nodes: the middle lies between two
S = np.linspace(0, LENGTH, NODES)
CASE = """
[units]
length = "um"
force = "pN"
time = "s"
[filament.rod]
length = 2.0
nodes = 10
bending = 1.0
stretching = 100.0
start = { end = "clamped" }
[fluid]
model = "rft"
viscosity = 0.5
[time]
end = 10.0
[output]
every = 0.1
"""


def observing(keys: str, more: str = ""):
    """The case with one observable, "o", and the observers of it."""
    text = CASE + f"[observe.o]\n{keys}\n" + more
    given = parse_case(text, "case.toml")
    return given, observers(given)


def frame(time: float, position: np.ndarray, **arrays) -> Frame:
    """A filament at ``position`` (10, 3) with everything else zero but ``arrays``."""
    zero = np.zeros((NODES, 3))
    held = {"velocity": zero, "force": zero, "e1": zero, "moment": zero, "strain": zero, "tension": np.zeros(NODES - 1)}
    held |= {"reaction_start": np.zeros(3), "reaction_finish": None} | arrays
    return Frame(time, {"rod": FilamentFrame(position=position, **held)}, {})


def seen(keys: str, motion, times) -> tuple[np.ndarray, Summary]:
    """Series and summary of an observable of ``motion``, a function of time to position or to (position, arrays)."""
    _, looking = observing(keys)
    for time in times:
        given = motion(time)
        position, arrays = given if isinstance(given, tuple) else (given, {})
        looking.take(frame(time, position, **arrays))
    return looking.series("o"), looking.summaries()["o"]


def value(keys: str, motion, times):
    return seen(keys, motion, times)[1].value


def straight(direction=(1, 0, 0)) -> np.ndarray:
    return S[:, None] * np.array(direction, float)


def tip_at(x: float, y: float, z: float) -> np.ndarray:
    """A straight line from the origin whose last node is at (x, y, z)."""
    return straight() * 0 + S[:, None] / LENGTH * np.array([x, y, z])


EVEN = np.arange(101) / 10
RNG = np.random.default_rng(11)
UNEVEN = np.sort(np.concatenate([[0.0, 10.0], RNG.uniform(0, 10, 150)]))


# --- places ---------------------------------------------------------------------------------------------------------


def cubic(s: np.ndarray) -> np.ndarray:
    """A curve that no quadratic passes through."""
    return np.stack([1 + s - s**3, 2 * s**2, s**3 - 4 * s], axis=-1)


@pytest.mark.parametrize(
    ("at", "s"), [("start", 0.0), ("finish", 2.0), ("middle", 1.0), (0.37, 0.37), (1.99, 1.99), (0.01, 0.01)]
)
@pytest.mark.parametrize("uneven", [False, True])
def test_points_of_a_cubic_are_exact(at, s, uneven):
    nodes = 2.0 * np.linspace(0, 1, NODES) ** 1.5 if uneven else S
    assert Place(nodes, at).values(cubic(nodes))[0] == pytest.approx(cubic(np.array(s)), abs=1e-12)


def test_a_node_is_itself_bit_for_bit():
    field = RNG.random((NODES, 3))
    for i, s in enumerate(S):
        assert np.array_equal(Place(S, float(s)).values(field)[0], field[i])


@pytest.mark.parametrize("at", ["centroid", (0.3, 1.7), (0.0, 2.0), (0.31, 0.33)])
@pytest.mark.parametrize("uneven", [False, True])
def test_means_of_a_straight_line_are_exact(at, uneven):
    nodes = 2.0 * np.linspace(0, 1, NODES) ** 1.5 if uneven else S
    place = Place(nodes, at)
    middle = 1.0 if at == "centroid" else 0.5 * (at[0] + at[1])
    assert place.reduced(place.values(3 * nodes - 1), "mean") == pytest.approx(3 * middle - 1, abs=1e-12)


def test_extremes_of_a_window_count_its_ends():
    place = Place(S, (0.3, 1.7))
    assert place.reduced(place.values(S), "min") == pytest.approx(0.3)
    assert place.reduced(place.values(S), "max") == pytest.approx(1.7)


# --- kinds that are read off each output ----------------------------------------------------------------------------


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
    assert value('kind = "speed"', motion, [0]) == pytest.approx(6.0)
    for space, expected in {"mean": 4.5, "max": 6.0, "min": 3.0}.items():
        assert value(f'kind = "speed"\nat = [1.0, 2.0]\nspace = "{space}"', motion, [0]) == pytest.approx(expected)


def test_displacement_is_from_the_first_output():
    def motion(t):
        return cubic(S) + np.array([5 * t, 0, -t])

    series, _ = seen('kind = "displacement"', motion, [2.0, 3.0])
    assert series == pytest.approx(np.array([[0, 0, 0], [5, 0, -1]]), abs=1e-12)
    assert value('kind = "displacement"\nat = "centroid"\nalong = [1, 0, 0]', motion, [2.0, 4.0]) == pytest.approx(10)


def test_displacement_does_not_hold_on_to_the_simulations_memory():
    memory = straight()
    _, looking = observing('kind = "displacement"\nalong = [1, 0, 0]')
    looking.take(frame(0.0, memory))
    memory += 1.0
    assert looking.take(frame(1.0, memory))["o"] == pytest.approx(1.0)


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
    found = looking.take(frame(0.0, straight(), e1=e1, moment=moment, reaction_finish=np.zeros(3)))
    assert found["b"] == pytest.approx(np.array([-0.5, -2.0, 0.1]), abs=1e-12)
    assert found["a"] == pytest.approx(-found["b"], abs=1e-12)


def test_power():
    force, velocity = RNG.random((NODES, 3)), RNG.random((NODES, 3))

    def motion(t):
        return straight(), {"force": force, "velocity": velocity}

    assert value('kind = "power"', motion, [0]) == pytest.approx(np.tensordot(force, velocity))
    assert value('kind = "power"\nat = [1.9, 2]', motion, [0]) == pytest.approx(force[-1] @ velocity[-1])


# --- kinds that need the whole run ----------------------------------------------------------------------------------


def test_drift_over_whole_periods_is_the_mean_speed():
    def motion(t):
        return straight() + np.array([0.3 * t + np.sin(np.pi * t), -0.1 * t, 0])

    keys = 'kind = "drift"\nat = "centroid"\nover = [2, 8]'
    assert value(keys, motion, EVEN) == pytest.approx(np.array([0.3, -0.1, 0]), abs=1e-12)
    assert value(keys + "\nalong = [0, -1, 0]", motion, EVEN) == pytest.approx(0.1)
    series, _ = seen(keys + "\nalong = [1, 0, 0]", motion, EVEN)
    assert series == pytest.approx(1 + 0.3 * EVEN + np.sin(np.pi * EVEN), abs=1e-12)


def test_drift_between_outputs_is_on_the_straight_line():
    def motion(t):
        return straight() + np.array([t**2, 0, 0])

    # From (0.25, its chord value) to (1.5, likewise), outputs at whole times.
    keys = 'kind = "drift"\nalong = [1, 0, 0]\nover = [0.25, 1.5]'
    assert value(keys, motion, [0.0, 1.0, 2.0]) == pytest.approx((2.5 - 0.25) / 1.25)


@pytest.mark.parametrize("times", [EVEN, UNEVEN])
def test_growth_of_an_exponential(times):
    def motion(t):
        return tip_at(2, 0.01 * np.exp(0.37 * t), 0)

    assert value('kind = "growth"\nover = [1, 9]', motion, times) == pytest.approx(0.37, rel=1e-10)


@pytest.mark.parametrize("rate", [0.37, -0.37])
def test_growth_of_a_spiral_and_of_an_oscillation(rate):
    def spiral(t):
        a = 0.01 * np.exp(rate * t)
        return tip_at(2, a * np.cos(4 * t), a * np.sin(4 * t))

    def planar(t):
        return tip_at(2, 0, 0.01 * np.exp(rate * t) * np.cos(4 * t + 0.3))

    assert value('kind = "growth"', spiral, EVEN) == pytest.approx(rate, rel=1e-10)
    assert value('kind = "growth"', planar, EVEN) == pytest.approx(rate, rel=2e-3)
    assert value('kind = "growth"', planar, np.linspace(0, 10, 1001)) == pytest.approx(rate, rel=1e-6)


def test_growth_of_nothing_is_no_number():
    assert np.isnan(value('kind = "growth"', lambda t: tip_at(2, 0, 0), EVEN))


def test_circularity_of_an_ellipse():
    def ellipse(b):
        return lambda t: tip_at(2 + t, 1 + 0.5 * np.cos(np.pi * t + 0.4), b * np.sin(np.pi * t + 0.4))

    for b in (0.5, 0.25, 0.0):
        found = value('kind = "circularity"\nover = [2, 8]', ellipse(b), EVEN)
        assert found == pytest.approx((b / 0.5) ** 2, abs=1e-12)
    # Seen along z the tip leaves on a line along x.
    along_z = value('kind = "circularity"\nalong = [0, 0, 1]', lambda t: tip_at(t, 0, np.sin(t)), EVEN)
    assert along_z == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("times", [EVEN, UNEVEN])
@pytest.mark.parametrize(("b", "grows"), [(1.0, 0.0), (0.6, 0.0), (0.1, 0.0), (1.0, 0.4), (0.6, -0.2)])
def test_frequency_of_rotation_has_a_sign(times, b, grows):
    for omega in (4.321, -4.321):

        def motion(t, omega=omega):
            a = 0.2 * np.exp(grows * t)
            return tip_at(2, a * np.cos(omega * t), b * a * np.sin(omega * t)) + np.array([0, 3, 3])

        assert value('kind = "frequency"', motion, times) == pytest.approx(omega, rel=1e-5)
        assert value('kind = "frequency"\nalong = [-1, 0, 0]', motion, times) == pytest.approx(-omega, rel=1e-5)


@settings(max_examples=30, deadline=None)
@given(
    axis=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    omega=st.floats(1.0, 12.0),
    sign=st.sampled_from([-1, 1]),
)
def test_frequency_about_any_axis(axis, omega, sign):
    n = np.array(axis) / np.linalg.norm(axis)
    first = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    first /= np.linalg.norm(first)

    def motion(t):
        turned = np.cos(omega * t) * first + sign * np.sin(omega * t) * np.cross(n, first)
        return tip_at(*(0.4 * turned + 1.5 * n))

    keys = f'kind = "frequency"\nalong = [{", ".join(map(repr, axis))}]'
    assert value(keys, motion, EVEN) == pytest.approx(sign * omega, rel=1e-9)


@pytest.mark.parametrize("times", [EVEN, UNEVEN, np.linspace(0, 10, 1001)])
def test_frequency_of_flailing_in_a_plane_is_positive(times):
    def motion(t):
        wave = 0.3 * np.cos(3.21 * t + 0.5) + 0.05 * np.cos(3 * 3.21 * t) + 0.1
        return tip_at(2, 0.8 * wave, -0.6 * wave)

    for along in ("[1, 0, 0]", "[-1, 0, 0]"):
        assert value(f'kind = "frequency"\nalong = {along}', motion, times) == pytest.approx(3.21, rel=1e-6)


def test_frequency_of_a_growing_oscillation():
    def motion(t):
        return tip_at(2, 0.01 * np.exp(0.4 * t) * np.cos(3.21 * t), 0)

    assert value('kind = "frequency"', motion, EVEN) == pytest.approx(3.21, rel=1e-6)


@pytest.mark.parametrize("tip", [lambda t: 0.0, lambda t: t, lambda t: np.exp(-t), lambda t: np.cos(0.3 * t)])
def test_frequency_without_a_period_is_no_number(tip):
    assert np.isnan(value('kind = "frequency"', lambda t: tip_at(2, tip(t), 0), EVEN))


def test_frequency_of_the_start_is_seen_from_the_centroid():
    def motion(t):  # the finish rests, the start goes round
        turned = np.array([0, np.cos(2 * t), np.sin(2 * t)])
        return straight() + (LENGTH - S[:, None]) * 0.1 * turned

    assert value('kind = "frequency"\nat = "start"', motion, EVEN) == pytest.approx(2.0, rel=1e-9)


def shuffled_walk(along: float, across: float, shape, count: int = 200):
    """A shape that moves, from output to output, by ``along`` its axis and ``across`` it, and turns meanwhile."""
    place, places, axes = np.zeros(3), [], []
    for k in range(count + 1):
        axis = np.array([np.cos(0.3 * k), np.sin(0.3 * k), 0.0])
        places.append(place.copy())
        axes.append(axis)
        normal = np.array([0.0, 0.0, 1.0]) if k % 2 else np.cross([0, 0, 1], axis)
        place = place + along * axis * (-1) ** k + across * normal
    return lambda t: shape(axes[round(10 * t)]) + places[round(10 * t)]


def rod_along(axis: np.ndarray) -> np.ndarray:
    return (S - 1)[:, None] * axis


def ring_about(axis: np.ndarray) -> np.ndarray:
    other = np.cross([0, 0, 1], axis)
    turn = np.linspace(0, 2 * np.pi, NODES)
    return np.cos(turn)[:, None] * other + np.sin(turn)[:, None] * np.array([0, 0, 1.0])


@pytest.mark.parametrize("shape", [rod_along, ring_about])
def test_diffusion_ratio_is_of_mean_squares_about_the_axis_at_each_start(shape):
    times = np.arange(101) / 10
    motion = shuffled_walk(0.5, 0.2, shape)
    # Across there are two directions: D_perp/D_par = (0.2^2/2) / 0.5^2.
    keys = 'kind = "diffusion_ratio"\ninterval = 0.1'
    series, summary = seen(keys, motion, times)
    assert np.isnan(series[0])
    assert series[1:] == pytest.approx(0.08)
    assert summary.value == pytest.approx(0.08)
    # An irregular last output is no interval.
    assert value(keys, lambda t: motion(round(10 * t) / 10), [*times, 10.03]) == pytest.approx(0.08)


def test_diffusion_ratio_over_a_longer_interval():
    """Steps along a fixed rod's axis x of 1 and across it of 1, in turn: over three outputs 2 and 1, or 1 and 2."""

    def motion(t):
        k = round(10 * t)
        return straight() + np.array([(k + 1) // 2, k // 2, 0])

    def expected(starts):
        moved = [((k + 4) // 2 - (k + 1) // 2, (k + 3) // 2 - k // 2) for k in starts]
        return 0.5 * sum(y * y for _, y in moved) / sum(x * x for x, _ in moved)

    keys = 'kind = "diffusion_ratio"\ninterval = 0.3'
    assert value(keys, motion, np.arange(21) / 10) == pytest.approx(expected(range(18)))
    found = value(keys + "\nover = [0.5, 1.2]", motion, np.arange(21) / 10)
    assert found == pytest.approx(expected(range(5, 10)))


def test_efficiency():
    force = np.tile([0.0, 1.0, 0.0], (NODES, 1))
    velocity = np.tile([9.0, 0.25, 0.0], (NODES, 1))  # the power is 2.5

    def motion(t):
        return straight() + np.array([0.4 * t, 0.3 * t, 0]), {"force": force, "velocity": velocity}

    drag = 2 * np.pi * 0.5 * LENGTH
    assert value('kind = "efficiency"', motion, EVEN) == pytest.approx(drag * 0.25 / 2.5)
    keys = 'kind = "efficiency"\nalong = [1, 0, 0]\nover = [2, 6]'
    assert value(keys, motion, EVEN) == pytest.approx(drag * 0.16 / 2.5)


# --- summaries ------------------------------------------------------------------------------------------------------


def test_summaries_over_a_window():
    def motion(t):
        return tip_at(np.where(t < 4, t, 8 - t), 0, 0)

    times = np.concatenate([np.arange(0, 4, 0.5), np.arange(4, 9.0)])  # twice as many outputs on the way up

    def summary(word, over):
        keys = f'kind = "position"\nalong = [1, 0, 0]\nsummary = "{word}"\nover = {over}'
        return value(keys, motion, times)

    assert summary("last", "[1, 7]") == pytest.approx(1.0)
    assert summary("max", "[1, 7]") == pytest.approx(4.0)
    assert summary("min", "[1, 6]") == pytest.approx(1.0)
    assert summary("median", "[0, 1]") == pytest.approx(0.5)
    # The mean is over time, not over outputs, and the window may begin and end between two.
    assert summary("mean", "[0, 8]") == pytest.approx(2.0)
    assert summary("mean", "[0.25, 1.25]") == pytest.approx(0.75)
    assert summary("mean", "[4.5, 7.5]") == pytest.approx(2.0)


def test_summaries_of_vectors_are_of_each_component():
    def motion(t):
        return tip_at(t, -t, t**2)

    for word, expected in {"max": (2, 0, 4), "min": (0, -2, 0), "median": (1, -1, 1), "mean": (1, -1, 1.5)}.items():
        found = value(f'kind = "position"\nsummary = "{word}"', motion, [0.0, 1.0, 2.0])
        assert found == pytest.approx(np.array(expected), abs=1e-12)


def test_a_window_that_the_run_did_not_finish_is_noted():
    keys = 'kind = "position"\nalong = [1, 0, 0]\nover = [2, 8]'
    _, summary = seen(keys, lambda t: tip_at(t, 0, 0), [0.0, 1.0, 2.0, 3.0])
    assert summary == Summary(3.0, "the run ended at 3, within `over` = [2, 8]")
    _, summary = seen(keys, lambda t: tip_at(t, 0, 0), [0.0, 1.0])
    assert np.isnan(summary.value)
    assert "ended at 1" in summary.note


def test_times_that_differ_by_rounding_are_in_the_window():
    keys = 'kind = "position"\nalong = [1, 0, 0]\nsummary = "max"\nover = [0, "3*0.1"]'
    assert value(keys, lambda t: tip_at(t, 0, 0), [0.0, 0.3, 0.6]) == 0.3  # 3*0.1 is more than 0.3


def test_descriptions_and_units():
    _, looking = observing('kind = "frequency"\nat = "middle"\nalong = [0, 1, 0]')
    observable = looking.observables["o"]
    assert observable.description == (
        'position seen from the start, of which the frequency is fitted, of rod, at = "middle", along = [0, 1, 0]'
    )
    units = parse_case(CASE, "case.toml").units
    assert label(units, observable.dimension) == "um"
    assert label(units, observable.summary_dimension) == "rad/s"
    assert label(units, "force length/time") == "pN um/s"
    assert label(units, "1/time") == "1/s"
    assert label(units, "force/length/length") == "pN/um/um"
    plain = parse_case(CASE.split("[filament.rod]")[1].join(["[filament.rod]", ""]), "case.toml").units
    assert label(plain, "force length/time") == "1"
    assert label(plain, "rad/time") == "rad"


def test_every_kind_of_the_schema_is_built():
    from typing import get_args

    from ibfil.case_schema import Observe

    observing('kind = "position"')
    assert set(KINDS) == set(get_args(Observe.model_fields["kind"].annotation))


# --- what a kind does not have --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ('kind = "end_to_end"\nat = "start"', r'observe\.o\.at: found "start"; allowed: nothing; end_to_end has over'),
        ('kind = "speed"\nalong = [1, 0, 0]', r"observe\.o\.along: found \[1, 0, 0\]; allowed: nothing"),
        ('kind = "drift"\nsummary = "max"', r"observe\.o\.summary"),
        ('kind = "twist"\nat = "centroid"', r'observe\.o\.at: found "centroid"; allowed: start, finish, middle'),
        ('kind = "speed"\nat = [0, 1]', r'observe\.o\.space: found "none"; allowed: "mean", "max" or "min"'),
        ('kind = "position"\nat = [0, 1]\nspace = "max"', r'observe\.o\.space: found "max"; .* with `along`'),
        ('kind = "drift"\nat = [0, 1]\nspace = "max"\nalong = [1, 0, 0]', r'observe\.o\.space: found "max"'),
        ('kind = "radius"\nat = [0, 1]', r'observe\.o\.space: found "none"'),
        ('kind = "power"\nat = "middle"', r"observe\.o\.at: .*a window"),
        ('kind = "force"\nat = "finish"', r"observe\.o\.at: .*a free end has no support"),
        ('kind = "stretch"\nat = [0.12, 0.2]\nspace = "max"', r"observe\.o\.at: .*middle of a segment"),
        ('kind = "diffusion_ratio"\ninterval = 0.15', r"observe\.o\.interval: .*multiple of output\.every = 0\.1"),
    ],
)
def test_what_a_kind_does_not_have_is_refused(keys, words):
    with pytest.raises(CaseError, match=words) as caught:
        observing(keys)
    assert len(caught.value.faults) == 1


def test_all_faults_are_told_at_once():
    more = '[observe.p]\nkind = "twist"\nat = "centroid"\n'
    with pytest.raises(CaseError) as caught:
        observing('kind = "speed"\nat = [0, 1]', more)
    assert len(caught.value.faults) == 2


def test_defaults_may_be_written_out():
    observing('kind = "end_to_end"\nat = "finish"\nspace = "none"\nsummary = "last"')


def test_a_stop_rule_needs_a_number_at_each_output():
    rule = '[[stop]]\nobserve = "o"\nbelow = 1.0\n'
    with pytest.raises(CaseError, match=r"stop\.0\.observe: found o, known at the end only"):
        observing('kind = "growth"', rule)
    with pytest.raises(CaseError, match=r"stop\.0\.observe"):
        observing('kind = "frequency"', rule)


# --- expectations ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("expect", "found", "passed", "error"),
    [
        ("value = 2.0", 2.019, True, 0.0095),
        ("value = 2.0", 2.021, False, 0.0105),
        ("value = -2.0\ntolerance = 0.1", -2.19, True, 0.095),
        ("value = -2.0\ntolerance = 0.1", 2.0, False, 2.0),
        ("value = 2.0\nabsolute = 0.5", 1.51, True, 0.49),
        ("value = 0.0\nabsolute = 0.5", -0.51, False, 0.51),
        ("range = [1, 2]", 1.0, True, 0.0),
        ("range = [1, 2]", 2.5, False, 0.5),
        ("range = [1, 2]", 0.25, False, 0.75),
        ("value = 2.0", float("nan"), False, float("nan")),
        ("range = [1, 2]", float("nan"), False, float("nan")),
        ("value = 2.0", float("inf"), False, float("nan")),
    ],
)
def test_expectations(expect, found, passed, error):
    more = f'[expect.e]\nobserve = "o"\nsource = "by hand"\n{expect}\n'
    given, _ = observing('kind = "end_to_end"', more)
    (held,) = check(given, {"o": Summary(found)})
    assert (held.name, held.observe, held.passed, held.source) == ("e", "o", passed, "by hand")
    assert held.error == pytest.approx(error, nan_ok=True)
    assert held.line().startswith("ok  " if passed else "FAIL")
    assert "by hand" in held.line()


def test_a_part_of_a_window_is_not_what_was_expected():
    given, _ = observing('kind = "end_to_end"', '[expect.e]\nobserve = "o"\nvalue = 2.0\n')
    (held,) = check(given, {"o": Summary(2.0, "the run ended early")})
    assert not held.passed
    assert "the run ended early" in held.line()
    (held,) = check(given, {"o": Summary(np.ones(3))})
    assert not held.passed
    assert "a vector" in held.note


# --- fits alone -----------------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    omega=st.floats(1.3, 10.0),
    phase=st.floats(0, 6.28),
    minor=st.floats(0.06, 1.0),
    tilt=st.floats(0, 3.1),
    sign=st.sampled_from([-1, 1]),
)
def test_rate_of_any_ellipse(omega, phase, minor, tilt, sign):
    t = EVEN
    along, across = np.cos(omega * t + phase), sign * minor * np.sin(omega * t + phase)
    xy = np.column_stack(
        [np.cos(tilt) * along - np.sin(tilt) * across, np.sin(tilt) * along + np.cos(tilt) * across]
    )
    assert fits.angular_rate(t, xy) == pytest.approx(sign * omega, rel=1e-4)
