"""What in a scene makes its user look twice: a sentence each, and none where nothing is amiss."""

from __future__ import annotations

import pytest
from helpers.scenes import RFT, scene

from ibfil import parse_case
from ibfil.check.report import report
from ibfil.check.warnings import warnings
from ibfil.simulation.simulation import Simulation

SCENE = """
[filament.rod]
length = 1.0
nodes = 33
bending = 1.0
stretching = 100
loads = { weight = [0, 0, -1] }
[fluid]
model = "stokes"
viscosity = 1.0
box = [2, 2, 2]
cells = [64, 64, 64]
[time]
end = 0.1
step = 0.01
[output]
every = 0.1
"""
FORCE = "fluid.box: the rods push the fluid with a net force"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ([], ""),
        (["filament.rod.nodes=14"], ""),  # 2.46 cells apart
        (["filament.rod.nodes=13"], "filament.rod: nodes are 2.7 cells apart: beyond 2.5"),
        (["fluid.cells=[12, 12, 12]"], ""),  # a/L = 0.184
        (["fluid.cells=[10, 10, 10]"], "filament.rod: a/L = 0.22: on this grid"),
        (["fluid.slip=0"], ""),
        (["fluid.slip=0", "filament.rod.nodes=65"], "filament.rod: nodes are 0.5 cells apart and fluid.slip = 0"),
        (["observe.x={kind='speed', filament='rod', over=[0.05, 0.1]}"], ""),
        (
            ["observe.x={kind='speed', filament='rod', over=[0.05, 0.2]}"],
            "observe.x.over: it ends at 0.2, beyond time.end",
        ),
        (["observe.x={kind='speed', filament='rod', over=[0.1, 0.2]}"], "observe.x.over: it begins at 0.1, not before"),
        (["output.every=0.2"], "output.every: 0.2 is beyond time.end = 0.1"),
        (["filament.rod.mass=0.1"], ""),  # overdamped
        (["filament.rod.mass=10"], ""),  # omega = 7.1: dt = 0.01 takes 0.2 % of it
        (["filament.rod.mass=10", "time.step=0.05"], "time.step: filament rod oscillates at omega = 7.05"),
        (["fluid.model=rft", "fluid.drag=paper", "filament.rod.radius=0.3"], ""),  # a grid's matter
        (["fluid.thick=true"], ""),
        (["fluid.thick=true", "filament.rod.radius=0.03"], ""),  # the kernel's is 0.0346
        (["fluid.thick=true", "filament.rod.radius=0.02"], "filament.rod.radius: 0.02 makes the couple of the flow"),
        (["filament.rod.start={end='hinged', moves=['0.1*sin(t)', 0, '0.1*t']}", "time.step=1e-3"], ""),
        (
            ["filament.rod.start={end='hinged', moves=['0.1*cos(t)', 0, 0]}", "time.step=1e-3"],
            "filament.rod.start.moves: [0.1, 0.0, 0.0]",
        ),
    ],
)
def test_warnings(changes, said):
    told = warnings(Simulation(parse_case(SCENE, "s.toml", changes)))
    others = [line for line in told if not line.startswith(FORCE)]
    assert len(others) == bool(said), told
    assert all(line.startswith(said) for line in others), told


def test_a_back_pressure_that_is_a_rounding_error_is_zero():
    (line,) = warnings(Simulation(parse_case(SCENE, "s.toml", ["filament.rod.direction=[1, 0.3, 0]"])))
    assert line.startswith(FORCE)
    assert "(0, 0, -0.125)" in line


def test_check_says_whether_flows_turn_rods_by_their_thickness():
    """And how: the effective aspect ratio, and the period in a shear, of rods that are straight."""
    flow = ["fluid.model=rft", "fluid.drag=paper", "fluid.flow=['y', 0, 0]", "filament.rod.radius=0.05"]
    thin = report(parse_case(SCENE, "s.toml", flow))
    assert "turns towards a shear, never past it" in thin.split("not modelled:")[1]
    assert "r_e" not in thin
    thick = report(parse_case(SCENE, "s.toml", [*flow, "fluid.thick=true"]))
    assert "never past it" not in thick
    assert "straight ones tumble in a shear" in thick.split("not modelled:")[0]
    assert "r_e, effective aspect ratio = 11.56" in thick  # sqrt((1 + 2/32^2)/3)/a
    assert "shear x period of a turn = 73.17" in thick
    bent = report(
        parse_case(SCENE, "s.toml", [*flow, "fluid.thick=true", "filament.rod.shape={kind='circle', curvature=1}"])
    )
    assert "r_e" not in bent


def test_check_says_which_rods_have_inertia_and_what_the_step_makes_of_it():
    two = SCENE.replace(
        "[fluid]",
        """[filament.other]
length = 1.0
nodes = 33
bending = 1.0
stretching = 100
position = [0, 0, 0.5]
mass = 10.0
[fluid]""",
    )
    text = report(parse_case(two, "s.toml"))
    modelled, absent = text.split("not modelled:")
    assert "filament other, 33 nodes: bending, stretching, mass" in modelled
    assert "inertia of the rods, of rod; inertia of the fluid; walls" in absent
    assert "filament other oscillates in bending" in text
    assert "explicit scheme: not with mass" in text
    assert "other: m/(zeta T), inertia of the rod" in text
    whole = report(parse_case(two, "s.toml", ["filament.rod.mass=1", "fluid.model=navier-stokes", "fluid.density=1"]))
    assert "inertia" not in whole.split("not modelled:")[1].split("dimensionless")[0]
    light = report(parse_case(SCENE, "s.toml", ["fluid.model=navier-stokes", "fluid.density=1"]))
    assert "inertia of the rods beyond the fluid they displace; walls" in light


@pytest.mark.parametrize(("turn", "told"), [(2.0, True), (1.9, False)])
def test_ends_that_meet_ask_whether_the_filament_is_meant_to_be_closed(turn: float, told: bool) -> None:
    arc = {"kind": "expression", "r": [f"cos({turn}*pi*s)/({turn}*pi)", f"sin({turn}*pi*s)/({turn}*pi)", "0"]}
    rod = {"length": 1.0, "nodes": 41, "bending": 1.0, "stretching": 100.0, "shape": arc}
    lines = warnings(Simulation(scene({"rod": rod}, RFT)))
    assert any("filament.rod.closed: its ends meet" in line for line in lines) == told
