"""Steps between outputs: equal ones, and those a tolerance chooses."""

import numpy as np
import pytest
from helpers.scenes import swimmer

from ibfil.assembly.fluids.navier_stokes import CELLS, crossing
from ibfil.case.reading import parse_case
from ibfil.errors import RunFailed
from ibfil.fluids import mobility_table
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping.base import NotConverged

SWIMMER = """
[filament.rod]
length = 1.0
nodes = 41
bending = 1.0
stretching = 1.6e4
curvature = ["8*sin(4*pi*s - 10*t)", 0]
shape = { kind = "relaxed" }
"""
WHIRLING = """
[filament.rod]
length = 1.0
nodes = 25
bending = 1.0
twisting = 1.0
stretching = 1.6e4
radius = 0.1
anchor = "start"
normal = [0, 1, 0]
shape = { kind = "straight", perturb = ["0", "0.1*s**2", "0.1*s**2*(1 - s/3)"] }
start = { end = "clamped", spin = "10/(4*pi*0.01)" }
"""
FLAILING = """
[parameters]
k = 1.8751040687119611
c = "(cos(k) + cosh(k))/(sin(k) - sinh(k))"
[filament.rod]
length = 1.0
nodes = 25
bending = 1.0
stretching = 2e4
anchor = "start"
normal = [0, 1, 0]
start = { end = "clamped" }
finish = { follower = -60 }
[filament.rod.shape]
kind = "straight"
perturb = ["0", "0", "0.02*(sin(k*s) - sinh(k*s) + c*(cos(k*s) - cosh(k*s)))"]
"""
REST = """
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = {end}
{time}
[output]
every = {end}
"""


def _simulation(rod, end, time=""):
    return Simulation(parse_case(rod + REST.format(end=end, time=time), "test.toml"))


def _path(rod, end, time, outputs=4):
    """Positions at equal times up to ``end``, and the simulation."""
    simulation, out = _simulation(rod, end, time), []
    for k in range(outputs):
        simulation.advance(end * (k + 1) / outputs, lambda: None)
        assert simulation.time == end * (k + 1) / outputs
        out.append(simulation.configuration.r.copy())
    return np.array(out), simulation


@pytest.mark.parametrize(
    ("rod", "end", "tolerances"),
    [
        (SWIMMER, 0.6, (1e-2, 1e-3, 1e-4, 1e-5)),
        (WHIRLING, 2.0, (1e-2, 1e-3, 1e-4, 1e-5)),
        (FLAILING, 0.6, (1e-2, 1e-3, 1e-4)),
        pytest.param(FLAILING, 2.0, (1e-2, 1e-3, 1e-4, 1e-5), marks=pytest.mark.slow),
    ],
)
def test_the_error_is_the_tolerance_within_a_factor_of_three(rod, end, tolerances):
    """rms node error over length and time, at its largest output, over the decades; against 0.1 of the least."""
    reference, _ = _path(rod, end, f"tolerance = {0.1 * min(tolerances)}\nmin_step = 1e-13")
    times = end * np.arange(1, 5) / 4
    for tolerance in tolerances:
        found, _ = _path(rod, end, f"tolerance = {tolerance}\nmin_step = 1e-13")
        error = np.sqrt(np.mean(np.sum((found - reference) ** 2, axis=2), axis=1))
        ratio = float(np.max(error / times)) / tolerance
        assert 1 / 3 < ratio < 3, f"tolerance {tolerance:g}: {ratio:.2g} of it"


def test_explicit_steps_follow_a_tolerance(monkeypatch):
    """Errors are as much below it at a tolerance as at four times of it, as long as it asks for less than stability.

    Above that limit errors grow until a step is not taken, so that some half of it is the most on average.
    """
    monkeypatch.setattr("ibfil.shapes.initial.at_rest", lambda filament: False)  # nodes of the curve, far from rest
    bent = SWIMMER.replace("nodes = 41", "nodes = 21").replace("1.6e4", "400")
    end, explicit, steps, shares = 5e-4, "scheme = 'explicit'\n", [], []
    fine, _ = _path(bent, end, "tolerance = 1e-4")
    limit = _simulation(bent, end, explicit).explicit_limit()
    for tolerance in (2.5e-3, 1e-2, 10.0):
        found, simulation = _path(bent, end, f"{explicit}tolerance = {tolerance}")
        shares.append(float(np.sqrt(np.mean(np.sum((found[-1] - fine[-1]) ** 2, axis=1)))) / (tolerance * end))
        steps.append(simulation.steps)
    assert 1 / 6 < shares[0] < 1
    assert shares[0] == pytest.approx(shares[1], rel=0.25)
    assert shares[2] < 1
    assert 0.4 * end / limit < steps[2] < 2 * end / limit


def test_the_shortest_step_is_in_the_units_of_the_case():
    """The same swimmer in micrometres and microseconds takes the same steps: none is too short for being small."""
    steps = []
    for length, unit in ((1.0, 1.0), (1e-6, 1e-6)):
        case = swimmer(length=length, viscosity=1e-3 if length < 1 else 1.0, bending=1e-21 if length < 1 else 1.0,
                       end=0.05, tolerance=1e-3 / unit)  # fmt: skip
        simulation = Simulation(case)
        simulation.advance(case.time.end, lambda: None)
        steps.append(simulation.steps)
    assert steps[0] == steps[1]
    assert 5 < steps[0] < 200


def test_steps_follow_the_square_root_of_the_tolerance():
    steps = [_path(SWIMMER, 0.6, f"tolerance = {tolerance}")[1].steps for tolerance in (1e-3, 1e-5)]
    assert 7 < steps[1] / steps[0] < 13


def test_steps_end_where_what_drives_the_rod_jumps():
    rod = SWIMMER.replace("8*sin(4*pi*s - 10*t)", "8*sin(4*pi*s)*step(t - 0.1)").replace(
        'kind = "relaxed"', 'kind = "straight"'
    )
    times = []
    simulation = _simulation(rod, 0.2, "tolerance = 1e-3")
    simulation.advance(0.2, lambda: times.append(simulation.time))
    found = [simulation.configuration.r]
    fine, _ = _path(rod, 0.2, "tolerance = 3e-5\nmin_step = 1e-14")
    assert min(abs(t - 0.1) for t in times) < 1e-15
    assert np.sqrt(np.mean(np.sum((found[-1] - fine[-1]) ** 2, axis=1))) < 3e-3 * 0.2


@pytest.mark.parametrize("time", ["step = 0.007", "tolerance = 1e-3"])
def test_outputs_are_hit_exactly_and_a_cut_run_goes_on_with_the_same_steps(time):
    whole, cut = _simulation(SWIMMER, 0.1, time), _simulation(SWIMMER, 0.1, time)

    class Cut(Exception):
        pass

    def after_five_steps():
        if cut.steps == 5:
            raise Cut

    with pytest.raises(Cut):
        cut.advance(0.05, after_five_steps)
    again = _simulation(SWIMMER, 0.1, time)
    again.restore(cut.state())
    for goal in (0.05, 0.1):
        whole.advance(goal, lambda: None)
        again.advance(goal, lambda: None)
        assert whole.time == again.time == goal
        assert np.array_equal(whole.configuration.r, again.configuration.r)
    assert whole.steps == again.steps


def test_equal_steps_are_never_longer_than_asked():
    simulation, times = _simulation(SWIMMER, 0.1, "step = 0.007"), [0.0]
    simulation.advance(0.05, lambda: times.append(simulation.time))
    lengths = np.diff(times)
    assert len(lengths) == 8
    assert np.allclose(lengths, 0.05 / 8, rtol=1e-12)


NAVIER_STOKES = """
[fluid]
model = "navier-stokes"
viscosity = 1.0
density = 10.0
box = [1.6, 1.6, 1.6]
cells = [32, 32, 32]
[time]
end = 1.0
tolerance = {tolerance}
[output]
every = 0.05
"""


def _in_a_heavy_fluid(tolerance, end=0.6):
    """Positions at each output of the swimmer of 21 nodes, and the lengths of the steps."""
    rod = SWIMMER.replace("nodes = 41", "nodes = 21")
    simulation = Simulation(parse_case(rod + NAVIER_STOKES.format(tolerance=tolerance), "test.toml"))
    found, lengths = [], []
    for k in range(1, round(end / 0.05) + 1):
        simulation.advance(0.05 * k, lambda: lengths.append(simulation.state_now.dt_old))
        found.append(simulation.configuration.r)
    return np.array(found), np.array(lengths)


def test_steps_are_held_so_that_a_fluid_with_inertia_keeps_its_operator(monkeypatch):
    """Each length costs it two tables: one for the step that changes to it, one for those that follow."""
    monkeypatch.setattr("ibfil.shapes.initial.at_rest", lambda filament: False)  # nodes of the curve, far from rest
    made, octant = [], mobility_table.octant
    monkeypatch.setattr(mobility_table, "octant", lambda *given: made.append(1) or octant(*given))
    _, lengths = _in_a_heavy_fluid(1e-3)
    changes = int(np.sum(np.abs(np.diff(lengths)) > 1e-9 * lengths[1:]))
    assert len(lengths) > 200
    assert changes < 0.25 * len(lengths)  # where steps took every length they could it was 211 of 224
    assert len(made) <= 2 * changes + 10  # those of rejected steps, and of the automatic step
    assert np.allclose(lengths[-40:], lengths[-1], rtol=1e-9)


@pytest.mark.slow
def test_the_error_is_at_most_three_times_the_tolerance_in_a_fluid_with_inertia():
    """It may be a tenth: most of it is made at the start, where the fluid is set in motion at once, and fades."""
    reference, _ = _in_a_heavy_fluid(1e-6)
    times = 0.05 * np.arange(1, len(reference) + 1)
    for tolerance in (1e-2, 1e-3, 1e-4, 1e-5):
        found, _ = _in_a_heavy_fluid(tolerance)
        error = np.sqrt(np.mean(np.sum((found - reference) ** 2, axis=2), axis=1))
        ratio = float(np.max(error / times)) / tolerance
        assert 0.1 < ratio < 3, f"tolerance {tolerance:g}: {ratio:.2g} of it"


def test_automatic_steps_follow_a_rod_from_cell_to_cell_where_the_fluid_is_heavy():
    """Twenty-five steps a period, in which a node crosses 0.4 cells, err by 3e-3 L in two periods at Re 88."""
    rod = SWIMMER.replace("nodes = 41", "nodes = 21").replace("1.6e4", "400")

    def ends(step):
        text = rod + NAVIER_STOKES.format(tolerance=1).replace("tolerance = 1", f"step = {step}")
        simulation = Simulation(parse_case(text.replace("density = 10.0", "density = 100.0"), "test.toml"))
        simulation.advance(1.25, lambda: None)
        return simulation.configuration.r, simulation.steps

    (best, _), (given, few), (found, more) = ends(np.pi / 1000), ends(np.pi / 125), ends('"auto"')
    error, coarse = (float(np.sqrt(np.mean(np.sum((r - best) ** 2, axis=1)))) for r in (found, given))
    assert few == 50
    assert coarse > 2.5e-3
    assert error < 1.2e-3
    assert more < 4 * few


def test_automatic_steps_are_the_drivers_alone_in_a_light_fluid():
    rod = SWIMMER.replace("nodes = 41", "nodes = 21")
    text = rod + NAVIER_STOKES.format(tolerance=1).replace("tolerance = 1", 'step = "auto"')
    simulation = Simulation(parse_case(text.replace("density = 10.0", "density = 0.01"), "test.toml"))
    simulation.advance(0.6, lambda: None)
    assert simulation.steps == 24
    assert crossing(0.0) == 1.0
    assert crossing(1e9) == pytest.approx(CELLS)


def test_too_many_steps_are_a_clear_failure():
    with pytest.raises(RunFailed, match="max_steps") as failure:
        _simulation(SWIMMER, 0.1, "step = 1e-3\nmax_steps = 7").advance(0.1, lambda: None)
    assert failure.value.time == pytest.approx(8e-3)
    assert "max_steps" in failure.value.advice


def test_a_step_that_cannot_be_solved_is_halved_and_told_and_given_up_at_the_floor():
    """A straight rod that is told to coil up at once: Newton needs short steps at first."""
    rod = SWIMMER.replace('"8*sin(4*pi*s - 10*t)"', "40").replace('kind = "relaxed"', 'kind = "straight"')
    simulation = _simulation(rod, 0.2, "step = 0.2")
    simulation.advance(0.2, lambda: None)
    assert simulation.shortened > 0
    assert simulation.snapshot().diagnostics["steps_shortened"] == simulation.shortened
    with pytest.raises(RunFailed, match=r"dt = 0\.2") as failure:
        _simulation(rod, 0.2, "step = 0.2\nmin_step = 0.15").advance(0.2, lambda: None)
    assert failure.value.advice


class Failing(Simulation):
    """Steps longer than ``most`` fail until ``until``; ``taken`` are those that did not."""

    most, until = 0.003, 0.045
    taken: tuple[float, ...] = ()

    def attempt(self, dt):
        if self.time < self.until and dt > self.most:
            raise NotConverged("as asked", 0)
        return super().attempt(dt)

    def accept(self, step, time):
        self.taken = (*self.taken, step.state.dt_old)
        super().accept(step, time)


def test_a_step_is_at_most_twice_the_one_before():
    """After halved steps, and after two outputs close to each other: with dt/dt_old > 2.41 BDF2 is unstable."""
    simulation = Failing(parse_case(SWIMMER + REST.format(end=0.4, time="step = 0.02"), "test.toml"))
    for until in (0.2, 0.201, 0.4):
        simulation.advance(until, lambda: None)
        assert simulation.time == until
    taken = np.array(simulation.taken)
    assert simulation.shortened > 0
    assert taken.max() == pytest.approx(0.02, rel=0.02)
    assert (taken[1:] / taken[:-1]).max() < 2 + 1e-9
    assert (taken[1:] / taken[:-1]).max() > 1.9
    assert taken.sum() == pytest.approx(0.4)
    assert len(taken) < 60


def test_schemes_of_order_1_need_no_such_bound():
    time = 'step = 0.02\nscheme = "semi-implicit"'
    simulation = Failing(parse_case(SWIMMER + REST.format(end=0.4, time=time), "test.toml"))
    simulation.until = 0.0
    for until in (0.2, 0.201, 0.4):
        simulation.advance(until, lambda: None)
    assert simulation.steps == 10 + 1 + 10
