"""Bodies free, held, moved, pushed and in flows; joints; forces and torques that sum to zero in every step."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.bodies import balance
from ibfil.case.reading import parse_case
from ibfil.check.bodies import of_body
from ibfil.errors import CaseError
from ibfil.simulation.simulation import Simulation

ROD = """
[filament.{name}]
length = {length}
nodes = 21
bending = 1.0
{twisting}
stretching = 1e3
radius = 0.01
{more}
"""
REST = """
{bodies}
[fluid]
model = "rft"
drag = "paper"
viscosity = 2.0
{flow}
[time]
end = 10.0
step = {step}
[output]
every = 1.0
"""
APART = ROD.format(name="apart", length=1, twisting="", more="position = [0, 9, 0]")
TWISTING = "twisting = 1.0"


def scene(bodies: str, rods: str = APART, flow: str = "", step: float = 0.01) -> Simulation:
    return Simulation(parse_case(rods + REST.format(bodies=bodies, flow=flow, step=step), "x.toml"))


def body(name: str = "b", shape: str = '{ kind = "sphere", radius = 0.3 }', more: str = "") -> str:
    return f"[body.{name}]\nshape = {shape}\n{more}\n"


def test_a_body_by_itself_moves_and_resists_as_stokes_says():
    """6 pi eta a and 8 pi eta a^3: pushed, and as the reactions of one that is moved."""
    push = "force = [0.1, 0, 0.2]\ntorque = [0, 0.1, 0]\nposition = [0, 3, 0]"
    moved = 'motion = { moves = ["t", 0, 0], turns = [0, 0, "t"] }\nposition = [0, 5, 0]'
    sim = scene(body(more=push) + body("c", more=moved))
    for until in (0.01, 0.5):
        sim.advance(until, lambda: None)
        now = sim.snapshot().bodies
        np.testing.assert_allclose(now["b"].velocity, np.array([0.1, 0, 0.2]) / (12 * np.pi * 0.3), atol=1e-12)
        np.testing.assert_allclose(now["b"].spin, np.array([0, 0.1, 0]) / (16 * np.pi * 0.027), atol=1e-12)
        np.testing.assert_allclose(now["c"].reaction, [12 * np.pi * 0.3, 0, 0], atol=1e-9)
        np.testing.assert_allclose(now["c"].reaction_torque, [0, 0, 16 * np.pi * 0.027], atol=1e-9)
    np.testing.assert_allclose(now["c"].position, [0.5, 5, 0], atol=1e-12)
    np.testing.assert_allclose(now["c"].e1, [np.cos(0.5), np.sin(0.5), 0], atol=1e-12)


def test_a_given_resistance_goes_before_that_of_the_shape():
    """Along and about the body's own axes."""
    given = "resistance = { translation = [2, 4, 8], rotation = [3, 6, 12] }\naxes = [[0, 1, 0], [-1, 0, 0]]\n"
    now = scene(body(more=given + "force = [1, 1, 1]\ntorque = [1, 1, 1]")).snapshot().bodies["b"]
    np.testing.assert_allclose(now.velocity, [1 / 4, 1 / 2, 1 / 8], atol=1e-12)
    np.testing.assert_allclose(now.spin, [1 / 6, 1 / 3, 1 / 12], rtol=0.05)  # over a step, in which it turns


def test_the_heat_of_drag_is_the_power_where_the_fluid_is_at_rest():
    """Of rods and bodies; and the efficiency counts the body."""
    observed = '[observe.d]\nkind = "dissipation"\n'
    sim = scene(ELLIPSOID + observed, SWIMMER)
    sim.advance(0.1, lambda: None)
    now = sim.snapshot()
    own = float(now.filaments["tail"].power.sum())
    assert now.diagnostics["dissipation"] == pytest.approx(now.diagnostics["power"], rel=1e-12)
    assert own + now.bodies["b"].power == pytest.approx(now.diagnostics["power"], rel=1e-12)
    assert now.bodies["b"].power > 0.01 * own


def test_in_a_flow_a_body_turns_part_of_its_power_into_heat():
    """That of its drag; the other is done upon the flow about it, a stream (1, 0, 0) that turns at 2."""
    flow = 'flow = ["where(y < 5, 1 - 2*y, 0)", "where(y < 5, 2*x, 0)", "0"]'  # none about the rod
    sim = scene(body(more="force = [2, 0, 0]\ntorque = [0, 0, 3]") + '[observe.d]\nkind = "dissipation"\n', flow=flow)
    found = sim.snapshot().diagnostics
    heat = 2**2 / (6 * np.pi * 2.0 * 0.3) + 3**2 / (8 * np.pi * 2.0 * 0.3**3)
    assert found["dissipation"] == pytest.approx(heat, rel=1e-9)
    assert found["background_power"] == pytest.approx(2 * 1 + 3 * 2, rel=1e-9)
    assert found["power"] == pytest.approx(heat + 8, rel=1e-9)


def test_an_ellipsoid_in_a_shear_turns_as_jeffery_says():
    """Half of the period 2 pi (r + 1/r)/rate later it points the other way, and half way it did not in between."""
    period = 2 * np.pi * (3 + 1 / 3)
    sim = scene(body(shape='{ kind = "ellipsoid", axes = [0.3, 0.1, 0.1] }'), flow='flow = ["y", 0, 0]', step=0.05)
    sim.advance(period / 4, lambda: None)
    np.testing.assert_allclose(sim.snapshot().bodies["b"].e1, [0, -1, 0], atol=5e-3)
    sim = scene(body(shape='{ kind = "ellipsoid", axes = [0.3, 0.1, 0.1] }'), flow='flow = ["y", 0, 0]', step=0.05)
    sim.advance(1.0, lambda: None)
    angle = np.arctan(np.tan(2 * np.pi / period) / 3)  # tan(angle) = tan(2 pi t/T)/r, from along the flow
    np.testing.assert_allclose(sim.snapshot().bodies["b"].e1, [np.cos(angle), -np.sin(angle), 0], atol=1e-3)


def test_a_sphere_in_a_curved_flow_moves_by_faxens_law():
    sim = scene(body(more="position = [0, 0, 0.2]"), flow='flow = ["z**2", 0, 0]')
    np.testing.assert_allclose(sim.snapshot().bodies["b"].velocity, [0.04 + 0.09 / 3, 0, 0], atol=1e-8)
    np.testing.assert_allclose(sim.snapshot().bodies["b"].spin, [0, 0.2, 0], atol=1e-8)


SWIMMER = ROD.format(
    name="tail",
    length=1.0,
    twisting=TWISTING,
    more="""curvature = ["5*sin(5*s - 9*t)", "2*s"]
loads = { internal_moment = ["0.3*sin(9*t)", 0] }
damping = 0.01
start = { end = "body", body = "b", motor = { torque = 0.02, axis = [1, 1, 0] } }""",
)
PAIR = ROD.format(
    name="other",
    length=0.7,
    twisting=TWISTING,
    more='position = [0, 0.3, 0]\ndirection = [0, 1, 0]\nnormal = [1, 0, 0]\nfinish = { end = "body", body = "b", '
    'hinged = true }\ncurvature = ["4*sin(7*t)", 0]\nanchor = "start"',
)
LINK = '[link.x]\nbetween = [{ filament = "tail" }, { filament = "other", at = "start" }]\nstiffness = 2.0\n'
ELLIPSOID = body(shape='{ kind = "ellipsoid", axes = [0.3, 0.2, 0.1] }')


def largest_imbalance(rods: str, bodies: str) -> tuple[float, float]:
    """The largest total force and torque of a swimmer in twenty steps, over its largest force."""
    sim, force, torque = scene(bodies, rods), 0.0, 0.0
    for k in range(1, 21):
        sim.advance(0.01 * k, lambda: None)
        now = sim.snapshot()
        size = max(float(np.abs(f.force).max()) for f in now.filaments.values())
        force = max(force, float(np.abs(now.diagnostics["net_force"]).max()) / size)
        torque = max(torque, float(np.abs(now.diagnostics["net_torque"]).max()) / size)
    return force, torque


def test_a_swimmer_has_no_total_force_and_torque_in_any_step():
    two = PAIR.replace("position = [0, 0.3, 0]", "position = [0.3, 0.9, 0]")
    two = two.replace("direction = [0, 1, 0]", "direction = [0, -1, 0]")
    placed = ELLIPSOID + "position = [0.3, 0, 0]\n"
    tail = SWIMMER + 'position = [0.6, 0, 0]\nanchor = "start"\n'
    for rods, bodies in ((SWIMMER, ELLIPSOID), (tail + two, placed + LINK)):
        force, torque = largest_imbalance(rods, bodies)
        assert force < 1e-12
        assert torque < 1e-12


@pytest.mark.parametrize("component", [0, 3])
def test_a_wrong_sign_in_the_balance_would_be_seen(monkeypatch, component):
    def wrong(*given):
        out = right(*given)
        out[:, :, component] *= -1.0
        return out

    right = balance.torques
    monkeypatch.setattr(balance, "torques", wrong)
    assert largest_imbalance(SWIMMER, ELLIPSOID)[1] > 1e-4


def test_the_power_of_a_motor_is_that_of_the_fluid_once_the_shape_is_steady():
    sim = scene(body(), SWIMMER.replace("5*sin(5*s - 9*t)", "5*s").replace("0.3*sin(9*t)", "0.1"))
    sim.advance(6.0, lambda: None)
    now = sim.snapshot()
    assert now.motors["tail_start"].power == pytest.approx(now.diagnostics["power"], rel=1e-3)
    assert now.motors["tail_start"].power > 5e-4


def half(name: str, at: float, end: str, more: str) -> str:
    place = f'position = [{at}, 0, 0]\nanchor = "start"\n{end} = {{ end = "body", body = "j" }}\n'
    return ROD.format(name=name, length=0.5, twisting=TWISTING, more=place + more)


def test_two_rods_welded_in_a_joint_are_one_rod():
    """A load on one half bends the pair as it bends a rod of their length."""
    load = 'loads = { force = [0, "800*(s - 0.5)", "400*(0.5 - s)"] }'
    joint = body("j", '{ kind = "joint" }')
    pair = scene(joint, half("a", 0.0, "finish", load) + half("b", 0.5, "start", ""), step=2e-3)
    forces = '[0, "where(s < 0.5, 800*(s - 0.5), 0)", "where(s < 0.5, 400*(0.5 - s), 0)"]'
    one = f'anchor = "start"\nposition = [0, 0, 0]\nloads = {{ force = {forces} }}'
    whole = scene("", ROD.format(name="rod", length=1.0, twisting=TWISTING, more=one).replace("21", "41"), step=2e-3)
    for sim in (pair, whole):
        sim.advance(0.1, lambda: None)
    now, rod = pair.snapshot(), whole.snapshot().filaments["rod"].position
    found = np.concatenate([now.filaments["a"].position, now.filaments["b"].position[1:]])
    bent = np.abs(rod - np.linspace(rod[0], rod[-1], 41)).max()
    assert bent > 0.005
    assert np.abs(found - rod).max() < 0.03 * bent
    np.testing.assert_allclose(now.diagnostics["net_force"], [0, -100, 50], atol=1e-9)


def test_a_joint_of_hinges_lets_its_rods_turn():
    """Pushed at the joint the rods fold: each stays straight, the joint ahead of them."""
    rods = "".join(
        half(name, at, end, "").replace('body = "j"', 'body = "j", hinged = true')
        for name, at, end in (("a", 0.0, "finish"), ("b", 0.5, "start"))
    )
    sim = scene(body("j", '{ kind = "joint" }', "force = [0, 3, 0]"), rods)
    assert "free to move, while its rods turn about it" in of_body(sim.case, "j")
    sim.advance(0.5, lambda: None)
    now = sim.snapshot()
    a, b = now.filaments["a"].position, now.filaments["b"].position
    np.testing.assert_allclose(a[-1], b[0], atol=1e-12)
    np.testing.assert_allclose(now.bodies["j"].position, b[0], atol=1e-12)
    assert b[0, 1] - b[-1, 1] > 0.1
    np.testing.assert_allclose(now.diagnostics["net_force"], [0, 3, 0], atol=1e-11)


@pytest.mark.parametrize(
    ("more", "line"),
    [
        ("position = [0, 0, 0.2]", "found nodes up to 0.1 inside b; allowed: at most half a segment, 0.025"),
        ("position = [0, 2, 0]", "found an end 1.7 off the surface of b; allowed: at most its size, 0.3"),
    ],
)
def test_ends_are_on_their_bodies(more, line):
    with pytest.raises(CaseError) as caught:
        scene(body(more=more), SWIMMER + 'position = [0, 0, 0]\nanchor = "start"')
    assert caught.value.faults == [f"x.toml: filament.tail.start.body: {line}"]


def test_a_joint_that_nothing_keeps_from_turning_is_refused():
    rods = (half("a", 0.0, "finish", "") + half("b", 0.5, "start", "")).replace(TWISTING, "")
    with pytest.raises(CaseError, match="leave a joint along one line, and may turn about it"):
        scene(body("j", '{ kind = "joint" }'), rods)


def test_rests_and_modes_are_not_of_scenes_with_bodies():
    from ibfil.simulation.at_rest import refuse_driven

    case = parse_case(
        SWIMMER.replace("curvature", "#").replace("loads", "#") + REST.format(bodies=body(), flow="", step=0.1),
        "x.toml",
    )
    with pytest.raises(CaseError, match=r"body\.b: found a body; allowed: none; rests and modes"):
        refuse_driven(case)


@pytest.mark.parametrize("hinged", ["", ", hinged = true"])
@pytest.mark.parametrize("shape", ["joint", "ellipsoid"])
def test_nothing_pulls_at_a_swimmer_in_a_flow(shape, hinged):
    """Force and torque of rods and body are zero in a shear as in a fluid at rest, with hinges and with clamps."""
    ends = (("a", 0.0, "finish"), ("b", 0.5, "start"))
    size = 0.1 if shape == "ellipsoid" else 0.0
    rods = "".join(
        half(name, at + (size if end == "start" else -size), end, 'curvature = ["4*sin(7*t)", 0]')
        for name, at, end in ends
    ).replace('body = "j"', f'body = "j"{hinged}')
    more = ", axes = [0.1, 0.05, 0.05]" if size else ""
    middle = body("j", f'{{ kind = "{shape}"{more} }}', "position = [0.5, 0, 0]")
    sim = scene(middle, rods, flow='flow = ["2*y", "sin(3*t)", "x"]')
    sim.advance(0.3, lambda: None)
    now = sim.snapshot()
    assert np.linalg.norm(now.bodies["j"].velocity) > 0.1
    np.testing.assert_allclose(now.diagnostics["net_force"], 0, atol=1e-12)
    if size or not hinged:  # a joint of hinges has no balance of torque
        np.testing.assert_allclose(now.diagnostics["net_torque"], 0, atol=1e-12)
