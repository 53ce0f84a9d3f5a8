"""The numbers that cases of free swimmers expect, by cells whose shape is given: no rod, no time step of this code.

    M F = B V + w,  B^T F = 0,   V: velocity and rate of the cell (6,),  w: how its shape changes

with M the mobility of the case's nodes and markers; the pose of the cell goes on by Runge and Kutta's fourth order.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from ibfil.bodies.rotation import rotation
from ibfil.case import library
from ibfil.case.reading import read_case
from ibfil.fluids.coupling import Nodes
from ibfil.simulation.simulation import Simulation

Pose = tuple[np.ndarray, np.ndarray]  # place (3,), and axes (3, 3) in columns


def loaded(name: str) -> tuple[Simulation, dict[str, float]]:
    """A shipped case as it begins, and the values that it expects."""
    case = read_case(library.paths()[name])
    return Simulation(case), {key: expect.value for key, expect in case.expect.items()}


def pushes(sim: Simulation, r: np.ndarray, motions: np.ndarray) -> np.ndarray:
    """The forces (3 k, p) of nodes and markers at r (k, 3) that give them the motions (3 k, p)."""
    immersed = sim.fluid.immersed
    matrix = immersed.exact.matrix(Nodes(*immersed.stencil(r), np.zeros_like(r)), immersed.own)
    return np.linalg.solve(matrix, motions)


def rigid_motions(arm: np.ndarray) -> np.ndarray:
    """B (3 k, 6)."""
    out = np.zeros((len(arm), 3, 6))
    out[:, :, :3] = np.eye(3)
    for k, axis in enumerate(np.eye(3)):
        out[:, :, 3 + k] = np.cross(axis, arm)
    return out.reshape(-1, 6)


def poses(rates: Callable[[Pose, float], np.ndarray], place: np.ndarray, end: float, steps: int) -> list[Pose]:
    """Those of a cell at all steps, the first along the axes of the lab."""
    out, dt = [(place, np.eye(3))], end / steps
    for k in range(steps):
        (x, axes), t = out[-1], k * dt

        def moved(by: np.ndarray, x=x, axes=axes) -> Pose:
            return x + by[:3], rotation(by[3:]) @ axes

        one = rates(out[-1], t)
        two = rates(moved(dt / 2 * one), t + dt / 2)
        three = rates(moved(dt / 2 * two), t + dt / 2)
        four = rates(moved(dt * three), t + dt)
        out.append(moved(dt / 6 * (one + 2 * two + 2 * three + four)))
    return out


def turned_by_motors(name: str, motors: dict[float, float], steps: int) -> dict[str, float]:
    """The numbers of a cell whose rigid flagella turn about its rigid head, and against the drag on their spin.

    ``motors``: the height y of the axis of each filament's motor, which is along x, and its rate. One turn of them.
    """
    sim, _ = loaded(name)
    start, axis, immersed = sim.start, np.array([1.0, 0.0, 0.0]), sim.fluid.immersed
    n, each = sim.system.rows.n, sim.system.rows.n // len(motors)
    centre, marks = start.r[n], immersed.shells.markers[0]

    def solved(pose: Pose, t: float) -> tuple[np.ndarray, float]:
        """V, and the torque of the first motor."""
        (x, axes), along = pose, pose[1] @ axis
        arm, e3 = np.empty((n + len(marks), 3)), np.empty((n, 3))
        arm[n:], moved, spun = marks @ axes.T, np.zeros((n + len(marks), 3)), np.zeros(n)
        first, first_spun = np.zeros_like(moved), np.zeros(n)
        for k, (height, rate) in enumerate(motors.items()):
            rod, turned, point = slice(k * each, (k + 1) * each), rotation(rate * t * axis), np.array([0, height, 0])
            arm[rod] = (point + (start.r[rod] - centre - point) @ turned.T) @ axes.T
            e3[rod] = start.e3[rod] @ turned.T @ axes.T
            about = np.cross(along, arm[rod] - axes @ point)
            moved[rod], spun[rod] = rate * about, rate * (e3[rod] @ along)
            if k == 0:
                first[rod], first_spun[rod] = about, e3[rod] @ along
        motions = np.column_stack([rigid_motions(arm), moved.ravel(), first.ravel()])
        spins = np.column_stack([np.zeros((n, 3)), e3, spun, first_spun])
        drag = motions.T @ pushes(sim, x + arm, motions) + spins.T @ (immersed.spin_drag[:, None] * spins)
        v = np.linalg.solve(drag[:6, :6], -drag[:6, 6])
        return v, float(drag[7, :7] @ np.append(v, 1.0))

    path = poses(lambda pose, t: solved(pose, t)[0], centre, 2 * np.pi, steps)
    instants = [solved(pose, 2 * np.pi * k / steps) for k, pose in enumerate(path[:-1])]
    return {
        "U": (path[-1][0] - centre)[0] / (2 * np.pi),
        "counter_rotation": np.mean([v[3] for v, _ in instants]),
        "torque": np.mean([torque for _, torque in instants]),
    }


def test_the_free_bacterium():
    """One flagellum, on the axis."""
    found, (_, expected) = turned_by_motors("bacterium_free", {0.0: 1.0}, 16), loaded("bacterium_free")
    assert {key: found[key] for key in expected} == pytest.approx(expected, rel=1e-5)


def test_two_free_flagella():
    """Two that turn in opposite senses, off the axis."""
    name = "two_flagella_free"
    found, (_, expected) = turned_by_motors(name, {0.15: 1.0, -0.15: -1.0}, 16), loaded(name)
    assert [found["U"], found["torque"]] == pytest.approx([expected["U"], expected["torque"]], rel=1e-5)
    assert found["counter_rotation"] == pytest.approx(expected["turning"], abs=1e-3)  # in what the case allows


@pytest.mark.parametrize("name", ["sperm_free", "sperm_box"])
def test_the_sperm(name):
    """A tail whose curvature is 6 sin 2 pi (s - t), from the surface of its head: one beat."""
    sim, expected = loaded(name)
    n, wave, fine = sim.system.rows.n, 6.0, np.linspace(0, 1, 1601)
    marks, every = sim.fluid.immersed.shells.markers[0], 1600 // (n - 1)

    def tail(t: float) -> tuple[np.ndarray, np.ndarray]:
        """Places and velocities (n, 3) of its nodes, seen from the head."""
        turn = wave / (2 * np.pi) * (np.cos(2 * np.pi * t) - np.cos(2 * np.pi * (fine - t)))
        rate = -wave * (np.sin(2 * np.pi * t) + np.sin(2 * np.pi * (fine - t)))
        tangent = np.exp(1j * turn)
        both = cumulative_simpson(np.stack([tangent, 1j * rate * tangent]), x=fine, initial=0)[:, ::every]
        place, moved = np.stack([both.real, both.imag, np.zeros(both.shape)], axis=2)
        return place + np.array([0.1, 0.0, 0.0]), moved

    def rates(pose: Pose, t: float) -> np.ndarray:
        (x, axes), (place, moved) = pose, tail(t)
        arm = np.concatenate([place, marks]) @ axes.T
        changing = np.concatenate([moved @ axes.T, np.zeros_like(marks)]).ravel()
        rigid = rigid_motions(arm)
        drag = rigid.T @ pushes(sim, x + arm, np.column_stack([rigid, changing]))
        return np.linalg.solve(drag[:, :6], -drag[:, 6])

    x, axes = poses(rates, np.zeros(3), 1.0, 64)[-1]
    assert x[:2] == pytest.approx([expected["along"], expected["across"]], rel=2e-5)
    assert axes[1, 0] == pytest.approx(expected["points"], abs=2e-3)  # its angle, in what the case allows
