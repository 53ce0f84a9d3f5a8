"""Swimmers against rigid solves by quadrature, as nodes become many: independent of rods, stepping and balances."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.case.reading import parse_case
from ibfil.simulation.simulation import Simulation

R, C = 0.1, 0.6 / (2 * np.pi)
LENGTH, SQUARE = float(6 * np.pi * np.hypot(R, C)), R * R + C * C
HELIX = f"""
[filament.{{name}}]
length = {LENGTH}
nodes = {{nodes}}
bending = 1e7
twisting = 1e7
stretching = 1e9
radius = 0.02
shape = {{{{ kind = "helix", radius = 0.1, pitch = 0.6 }}}}
curvature = [{R / SQUARE}, 0]
twist_rate = {C / SQUARE}
anchor = "start"
{{place}}
start = {{{{ end = "body", body = "head", motor = {{motor}} }}}}
"""
REST = """
[body.head]
shape = { kind = "sphere", radius = 0.2 }
position = [0, 0, 0]
BODY
[fluid]
model = "rft"
drag = "paper"
viscosity = 1.0
[time]
end = 1.0
step = 1e-3
[output]
every = 1.0
"""
PLACE = "position = [0.2, 0.1, 0]\nnormal = [0, 0, -1]"
AXIS = "{ MOTION, axis = [1, 0, 0] }"


def swimmer(nodes: int, motor: str = "spin = 1.0", body: str = "", more: str = ""):
    """The first output of the sphere and the helix."""
    rod = HELIX.format(name="tail", nodes=nodes, place=PLACE + more, motor=AXIS.replace("MOTION", motor))
    return Simulation(parse_case(rod + REST.replace("BODY", body), "x.toml")).snapshot()


def limit(of) -> np.ndarray:
    """The limit of many nodes: errors of a clamp go with the square of their spacing."""
    coarse, fine = (np.asarray(of(nodes)) for nodes in (97, 193))
    return (4 * fine - coarse) / 3


def numbers(now) -> np.ndarray:
    head = now.bodies["head"]
    return np.array([head.velocity[0], head.spin[0], now.motors["tail_start"].torque])


def test_a_bacterium_has_the_speed_counter_rotation_and_torque_of_a_rigid_one():
    np.testing.assert_allclose(limit(lambda n: numbers(swimmer(n))), [0.01334065, -0.52385676, 0.10532765], rtol=1e-4)


@pytest.mark.parametrize("motor", ["torque = {t}", "stall = {twice}, free = 2.0"])
def test_a_given_torque_and_a_line_turn_at_the_rate_of_that_torque(motor):
    torque = swimmer(49).motors["tail_start"].torque
    found = swimmer(49, motor.format(t=torque, twice=2 * torque))
    assert found.motors["tail_start"].rate == pytest.approx(1.0, rel=1e-6)
    assert found.motors["tail_start"].torque == pytest.approx(torque, rel=1e-6)


def test_pushed_by_weight_force_and_torque_with_its_motor_held():
    """The six numbers of a rigid one; the fluid feels what pushes it from outside, to round-off."""

    def motion(nodes: int):
        now = swimmer(
            nodes,
            "spin = 0.0",
            "force = [0.2, 0.1, -0.4]\ntorque = [0.05, -0.02, 0.03]",
            "\nloads = { weight = [0.1, -0.3, 0.2] }",
        )
        pushed = np.array([0.2, 0.1, -0.4]) + LENGTH * np.array([0.1, -0.3, 0.2])
        np.testing.assert_allclose(now.diagnostics["net_force"], pushed, atol=1e-12)
        return np.concatenate([now.bodies["head"].velocity, now.bodies["head"].spin])

    rigid = [0.0200616, -0.0054260, -0.0336046, 0.1557812, -0.0385681, -0.0154331]
    np.testing.assert_allclose(limit(motion), rigid, rtol=1e-3)


def test_two_flagella_on_one_body():
    """Turned by 0.4 rad each way about z, motors about their tangents: one of given torque, one of given rate."""
    c, s = np.cos(0.4), np.sin(0.4)

    def motion(nodes: int):
        text = ""
        for name, sign, motor in (("one", 1, "{ torque = 0.1 }"), ("two", -1, "{ spin = -1.0 }")):
            x, y = 0.2 * c - sign * 0.1 * s, 0.2 * sign * s + 0.1 * c
            place = f"position = [{x}, {y}, 0]\ndirection = [{c}, {sign * s}, 0]\nnormal = [0, 0, -1]"
            text += HELIX.format(name=name, nodes=nodes, place=place, motor=motor)
        now = Simulation(parse_case(text + REST.replace("BODY", ""), "x.toml")).snapshot()
        head = now.bodies["head"]
        return np.array([*head.velocity, *head.spin, now.motors["one_start"].rate, now.motors["two_start"].torque])

    rigid = [0.050667, -0.071808, -0.050947, 0.027015, 0.011193, 0.639457, -0.912293, -0.539915]
    np.testing.assert_allclose(limit(motion), rigid, rtol=1e-3, atol=4e-4)


SPERM = """
[filament.tail]
length = 1.0
nodes = {nodes}
bending = 1e4
stretching = 1e6
shape = {{ kind = "relaxed" }}
curvature = ["6*sin(2*pi*s - 2*pi*t)", 0]
position = [0.1, 0, 0]
anchor = "start"
align = "tangent"
normal = [0, 0, 1]
start = {{ end = "body", body = "head" }}
[body.head]
shape = {{ kind = "sphere", radius = 0.1 }}
[fluid]
model = "rft"
drag = "paper"
viscosity = 1.0
[time]
end = 1.0
step = {step}
[output]
every = 1.0
"""


def test_a_sperm_cell_swims_as_the_rigid_wave_does():
    """The place of the head after a beat, by an ODE of the shape of given curvature; it has not turned then."""
    sim = Simulation(parse_case(SPERM.format(nodes=41, step=1 / 128), "x.toml"))
    sim.advance(1.0, lambda: None)
    head = sim.snapshot().bodies["head"]
    np.testing.assert_allclose(head.position, [-0.086927, -0.137110, 0.0], atol=4e-4)
    assert abs(np.arctan2(head.e1[1], head.e1[0])) < 5e-3
