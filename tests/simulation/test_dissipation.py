"""Power turned into heat: the grid's eta int |grad u|^2 against the nodes' F.u, and what drag turns into heat."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.scenes import slopes

from ibfil.case.reading import parse_case
from ibfil.fluids.fields import GridFields
from ibfil.grid.kernels import KERNELS
from ibfil.grid.periodic_grid import Grid
from ibfil.running.result import Result
from ibfil.running.run import run
from ibfil.simulation.simulation import Simulation

SCENE = """
[filament.rod]
length = 1.0
nodes = 11
bending = 1.0
stretching = 100.0
shape = { kind = "circle", curvature = 2.0 }
TWIST
[fluid]
model = "stokes"
viscosity = 0.7
box = [2.0, 2.0, 1.5]
cells = [16, 16, 12]
[time]
end = 0.01
step = 1e-3
[output]
every = 0.005
[observe.heat]
kind = "dissipation"
summary = "mean"
"""
TWISTED = 'twisting = 1.0\nradius = 0.02\ntwist_rate = 1.0\nstart = { end = "clamped", spin = 20.0 }'

SHEAR = "fluid.flow=['2*sin(y)', 0, 0]"


def ran(*overrides: str, twist: str = "") -> Result:
    case = parse_case(SCENE.replace("TWIST", twist), "scene.toml", overrides)
    return run(case, progress=False, log=lambda line: None)


@pytest.mark.parametrize("method", ["table", "fft", "krylov"])
def test_both_sides_are_one_number_in_stokes(method):
    """To 1e-10; and what slips is s F^2, s = eps (h/2 Lc)/(6 pi eta a) with the point radius a = 1.313 h."""
    snapshot = ran(f"fluid.method={method}").snapshot
    found, force = snapshot.diagnostics, snapshot.filaments["rod"].force
    assert found["flow_dissipation"] == pytest.approx(found["grid_power"], rel=1e-10)
    volume = 0.1 * np.array([0.5, *np.ones(9), 0.5])[:, None]
    slip = 0.01 * (0.125 / (2 * volume)) / (6 * np.pi * 0.7 * 1.313 * 0.125)
    assert found["slip_dissipation"] == pytest.approx(np.sum(slip * force**2), rel=1e-12)


@pytest.mark.parametrize(
    ("keys", "twist"),
    [
        ([], ""),
        (["fluid.rotation=grid"], TWISTED),
        ([], TWISTED),
        (["fluid.model=rft", SHEAR], TWISTED),
        ([SHEAR], TWISTED),
        (["fluid={model='stokes', viscosity=0.7, box='free', spacing=0.125}", "fluid.rotation=grid", SHEAR], TWISTED),
    ],
    ids=["plain", "torques", "local", "rft in shear", "local in shear", "torques in free space in shear"],
)
def test_it_is_all_that_the_nodes_do(keys, twist):
    """But for the places it is taken at, the mobility's of a step and those at its end: second order in the step."""
    left = []
    for step in (1e-3, 5e-4, 2.5e-4):
        found = ran(*keys, f"time.step={step}", twist=twist).snapshot.diagnostics
        left.append(found["power"] / (found["dissipation"] + found["background_power"]) - 1)
    assert max(np.abs(left)) < 1e-12 or min(slopes(left)) > 1.9


SPUN = """
[filament.rod]
length = 1.0
nodes = 11
bending = 1.0
stretching = 100.0
twisting = 1.0
radius = 0.05
shape = { kind = "straight" }
start = { end = "clamped", spin = 5.0 }
finish = { end = "clamped", spin = 5.0 }
[fluid]
model = "stokes"
viscosity = 1.0
box = [2.0, 2.0, 2.0]
cells = [16, 16, 16]
[time]
end = 0.4
step = 0.05
[output]
every = 0.2
[observe]
all = { kind = "dissipation" }
flow = { kind = "dissipation", part = "flow" }
spin = { kind = "dissipation", part = "spin" }
"""


FREE = ["fluid={model='stokes', viscosity=1.0, box='free', spacing=0.125, flow=[0, '-2*z', '2*y']}"]
TURNING = ["fluid.flow=[0, '-2*z', '2*y']"]  # about x, at 2
INERTIA = ["fluid.model=navier-stokes", "fluid.density=0.1"]


def spun(keys: list[str]) -> tuple[dict, dict[str, float]]:
    """The diagnostics and the observables of the rod that spins."""
    result = run(parse_case(SPUN, "spun.toml", keys), progress=False, log=lambda line: None)
    return result.snapshot.diagnostics, {name: float(one.value) for name, one in result.summaries.items()}


@pytest.mark.parametrize(
    ("keys", "against"),
    [
        (["fluid.model=rft"], 5.0),
        ([], 5.0),
        (INERTIA, 5.0),
        (["fluid.model=rft", *TURNING], 3.0),
        (TURNING, 3.0),
        (FREE, 3.0),
    ],
    ids=["rft", "stokes", "navier-stokes", "rft in a flow", "stokes in a flow", "free space in a flow"],
)
def test_a_rod_that_spins_turns_4_pi_eta_a2_w2_L_into_heat_in_every_fluid(keys, against):
    """By itself, where its spin stirs nothing; and does so much upon the flow about it that its power is T 5."""
    found, parts = spun(keys)
    heat = 4 * np.pi * 0.05**2 * against**2
    assert found["dissipation"] == found["spin_dissipation"] == pytest.approx(heat, rel=1e-5)
    assert abs(found["flow_dissipation"]) < 1e-20
    assert found["background_power"] == pytest.approx(heat / against * (5.0 - against), rel=1e-5)
    assert found["power"] == pytest.approx(heat / against * 5.0, rel=1e-5)
    assert parts == {"all": found["dissipation"], "flow": found["flow_dissipation"], "spin": found["spin_dissipation"]}


@pytest.mark.parametrize("inertia", [[], INERTIA], ids=["stokes", "navier-stokes"])
def test_where_the_spin_stirs_the_grid_the_flow_has_its_share_of_the_heat(inertia):
    """The share of a cylinder of the kernel's twist radius b, a^2/b^2, b of 1.5 h or, at a bad place, 2 h."""
    found, _ = spun([*inertia, "fluid.rotation=grid"])
    whole = found["flow_dissipation"] + found["spin_dissipation"] + found["slip_dissipation"]
    assert found["dissipation"] == pytest.approx(whole, rel=1e-14)  # added up in another order
    assert whole == pytest.approx(4 * np.pi * 0.05**2 * 25, rel=0.02)
    assert 0.05**2 / (2 * 0.125) ** 2 < found["flow_dissipation"] / whole < 0.05**2 / (1.5 * 0.125) ** 2
    moving = found["grid_power"] - found["flow_dissipation"]  # into the fluid's motion, which is steady by now
    assert found["power"] == pytest.approx(whole + moving, rel=1e-10)
    assert abs(moving) < 1e-6 * whole


def test_without_slip_it_has_no_share():
    found = ran("fluid.slip=0").snapshot.diagnostics
    assert found["slip_dissipation"] == 0.0
    assert found["dissipation"] == pytest.approx(found["grid_power"], rel=1e-10)


def test_torques_on_the_grid_do_work_too():
    found = ran("fluid.rotation=grid", twist=TWISTED).snapshot.diagnostics
    assert found["flow_dissipation"] == pytest.approx(found["grid_power"], rel=1e-10)


def test_the_gradient_is_that_of_the_field_itself():
    """In real space: nine derivatives of the velocity that is put out (single precision), squared and summed."""
    n = 15
    grid = Grid([1.0, 1.0, 1.0], [n, n, n])  # odd: every wave has a derivative
    fields = GridFields(grid, 0.7, None)
    base, weights = KERNELS["peskin4"].stencil(grid.coordinates(np.array([[0.1, 0.02, -0.3], [-0.2, 0.1, 0.1]])))
    force = np.array([[1.0, 2.0, -0.5], [-1.0, 0.3, 0.5]])
    heat, power = fields.dissipation(base, weights, force)
    u = fields.evaluate(base, weights, force, 0.0, ["velocity"])["velocity"].astype(float)
    k = 2 * np.pi * np.fft.fftfreq(n, grid.spacing)
    total = 0.0
    for axis in range(3):
        wave = k.reshape([-1 if a == axis else 1 for a in range(3)] + [1])
        slope = np.fft.ifft(1j * wave * np.fft.fft(u, axis=axis), axis=axis).real
        total += 0.7 * float(np.sum(slope**2)) * grid.spacing**3
    assert heat == pytest.approx(power, rel=1e-12)
    assert heat == pytest.approx(total, rel=1e-5)


def test_drag_turns_into_heat_what_the_flow_does_not_carry():
    assert ran("fluid.model=rft").snapshot.diagnostics["dissipation"] == pytest.approx(
        ran("fluid.model=rft").snapshot.diagnostics["power"]
    )
    stream = ran("fluid.model=rft", "fluid.flow=[3, 0, 0]").snapshot.diagnostics
    still = ran("fluid.model=rft").snapshot.diagnostics
    assert stream["dissipation"] == pytest.approx(still["dissipation"], rel=1e-6)  # Galileo


def test_a_rod_that_does_not_give_way_heats_the_flow_along_it():
    """zeta_par (gamma x)^2 per length of a straight rod held by its stiffness in u = gamma (-x, y, 0)."""
    straight = ["filament.rod.shape={kind='straight'}", "filament.rod.stretching=1e6"]
    snapshot = ran("fluid.model=rft", "fluid.flow=['-2*x', '2*y', 0]", *straight).snapshot
    s, lc = np.linspace(-0.5, 0.5, 11), 0.1 * np.array([0.5, *np.ones(9), 0.5])
    expected = np.sum(lc * 2 * np.pi * 0.7 * (2 * s) ** 2)
    # It is shortened by the drag of half of it over EA, zeta_par gamma L^2/8 EA, and moves until it is.
    assert snapshot.diagnostics["dissipation"] == pytest.approx(expected, rel=1e-5)
    assert abs(snapshot.diagnostics["power"]) < 1e-5 * expected


def test_inertia_keeps_the_rest_as_the_energy_of_the_flow():
    """From rest: the work of the nodes less what is dissipated is rho/2 int u^2, to the order of the steps."""
    left = []
    for step in (5e-4, 2.5e-4, 1.25e-4):
        overrides = ["fluid.model=navier-stokes", "fluid.density=10", f"time.step={step}"]
        simulation = Simulation(parse_case(SCENE.replace("TWIST", ""), "scene.toml", overrides))
        times, gained = [0.0], [0.0]

        def look(simulation=simulation, times=times, gained=gained) -> None:
            found = simulation.snapshot().diagnostics
            times.append(simulation.time)
            gained.append(found["grid_power"] - found["flow_dissipation"])

        simulation.advance(0.01, look)
        flow = simulation.snapshot(("velocity",)).grid["velocity"].astype(float)
        energy = 0.5 * 10 * np.sum(flow**2) * 0.125**3
        left.append(abs(np.trapezoid(gained, times) / energy - 1))
    assert min(slopes(left)) > 1.8
    assert left[-1] < 1e-3  # what the Euler step at the start leaves: dt of the whole, and no more


def test_it_is_an_observable_and_costs_nothing_where_it_is_not_named():
    result = ran()
    assert float(result.summaries["heat"].value) > 0
    silent = parse_case(SCENE.replace("TWIST", "").split("[observe")[0], "scene.toml")
    assert "dissipation" not in run(silent, progress=False, log=lambda line: None).snapshot.diagnostics
