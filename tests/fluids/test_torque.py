"""Moment balance: which total torque the nodal forces and the twist torque of a free rod leave, and which not.

The curve is a ribbon A = (1, 0.3), C = 0.7 without preferred strains whose curvatures and twist vanish at both ends,
so that no moment does work there. It has |r'| = 1 exactly: its frame equations are integrated by an independent
solver, to 1e-12.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from helpers.scenes import bare, run, slopes, twisting_rod
from scipy.integrate import solve_ivp

from ibfil.rods.elastic_force import nodal_force
from ibfil.rods.geometry import Configuration
from ibfil.rods.mesh import Segmented
from ibfil.rods.system import RodSystem
from ibfil.rods.torque_free.mechanics import TorqueFree

A1, A2, C, EA = 1.0, 0.3, 0.7, 50.0
SIZES = (33, 65, 129)
STRETCH = 0.05
START = np.concatenate([np.zeros(3), np.eye(3).ravel()])
DERIVATIVES = pytest.mark.parametrize("derivative", [2, 6])


def strains(s: float) -> np.ndarray:
    """O1, O2, O3 of the curve."""
    fade = np.sin(np.pi * s) ** 2
    return fade * np.array([4.0 * np.cos(3 * s), 3.0 * np.sin(2 * s + 0.4), 5.0 * np.cos(s)])


def _slope(s: float, y: np.ndarray) -> np.ndarray:
    """r' = e3, e_a' = (O1 e1 + O2 e2 + O3 e3) x e_a."""
    e1, e2, e3 = y[3:6], y[6:9], y[9:12]
    o1, o2, o3 = strains(s)
    turn = o1 * e1 + o2 * e2 + o3 * e3
    return np.concatenate([e3, np.cross(turn, e1), np.cross(turn, e2), np.cross(turn, e3)])


@cache
def curve(nodes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arclength (n,), positions and first directors (n, 3)."""
    s = np.linspace(0.0, 1.0, nodes)
    y = solve_ivp(_slope, (0.0, 1.0), START, "DOP853", t_eval=s, rtol=1e-12, atol=1e-13).y
    return s, y[:3].T.copy(), y[3:6].T.copy()


def material(s: np.ndarray) -> np.ndarray:
    """Where on the curve the material point s lies: stretched by 1 + q1(s), unevenly."""
    return s + STRETCH / (2 * np.pi) * np.sin(2 * np.pi * s)


def stretched(nodes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same curve with its material points moved along it."""
    s = np.linspace(0.0, 1.0, nodes)
    places = solve_ivp(_slope, (0.0, 1.0), START, "DOP853", t_eval=material(s), rtol=1e-12, atol=1e-13).y
    return s, places[:3].T.copy(), places[3:6].T.copy()


@cache
def continuum_torque() -> np.ndarray:
    """The torque that Eq. 44 leaves on the stretched curve as N grows (3,), by Simpson's rule on 4001 points.

    With r' = q e3 and F = Q' + M3 r' x r'' + F'3 r', the integral of F x r' + tau e3 over a rod without end moments is

        integral of [ -q' (M1 e1 + M2 e2) + M3 (q^2 - 1/q) (O2 e1 - O1 e2) ] ds
    """
    s = np.linspace(0.0, 1.0, 4001)
    y = solve_ivp(_slope, (0.0, 1.0), START, "DOP853", t_eval=material(s), rtol=1e-12, atol=1e-13).y
    e1, e2 = y[3:6].T, y[6:9].T
    q = 1 + STRETCH * np.cos(2 * np.pi * s)
    dq = -2 * np.pi * STRETCH * np.sin(2 * np.pi * s)
    curvature = np.stack([strains(at) for at in material(s)])
    # r'' = q' e3 + q^2 (k2 e1 - k1 e2), so O_a = q^2 k_a; e1' is per material length, so O3 = q k3.
    o1, o2, o3 = q**2 * curvature[:, 0], q**2 * curvature[:, 1], q * curvature[:, 2]
    m1, m2, m3 = A1 * o1, A2 * o2, C * o3
    values = -dq[:, None] * (m1[:, None] * e1 + m2[:, None] * e2)
    values += (m3 * (q**2 - 1 / q))[:, None] * (o2[:, None] * e1 - o1[:, None] * e2)
    weights = np.ones(len(s))
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    return (weights[:, None] * values).sum(axis=0) * (s[1] - s[0]) / 3


def rods(s: np.ndarray, derivative: int, kind: type[RodSystem] = RodSystem) -> RodSystem:
    part = Segmented(s, derivative, None, None)
    return bare([part], kind=kind, bending=(A1, A2), torsion=C, stretching=EA)


def total(r: np.ndarray, shape: Configuration, force: np.ndarray) -> np.ndarray:
    """Sum of r x f and of the twist torque about the tangent (3,)."""
    return np.cross(r, force[:, :3]).sum(axis=0) + (force[:, 3:] * shape.e3).sum(axis=0)


def size(v: np.ndarray) -> float:
    return float(np.linalg.norm(v))


@DERIVATIVES
def test_the_torque_of_eq_44_and_eq_36_vanishes_at_second_order(derivative: int) -> None:
    torques = []
    for nodes in SIZES:
        s, r, e1 = curve(nodes)
        rod = rods(s, derivative)
        shape = rod.start(r, e1)
        torques.append(size(total(r, shape, rod.forces(shape, 0.0)[0])))
    assert min(slopes(torques)) >= 1.9
    assert torques[-1] < 1e-2


@DERIVATIVES
def test_with_the_printed_sign_of_the_twist_term_it_does_not_vanish(derivative: int) -> None:
    """Eq. 44 as printed has -O1 (M3 r' x r''): the twist term of the force taken with the other sign."""
    torques = []
    for nodes in SIZES:
        s, r, e1 = curve(nodes)
        rod = rods(s, derivative)
        shape = rod.start(r, e1)
        force, moment = rod.forces(shape, 0.0)
        untwisted = np.zeros((nodes, 3))
        none = moment._replace(twist=np.zeros(nodes))
        nodal_force(rod.mesh, shape, none, rod.stretching, untwisted)
        printed = force.copy()
        printed[:, :3] = 2 * untwisted - force[:, :3]
        torques.append(size(total(r, shape, printed)))
    assert min(torques) > 1.0
    # The same at every spacing: it does not converge.
    assert torques == pytest.approx([torques[-1]] * 3, rel=0.02)


@DERIVATIVES
def test_with_the_printed_source_of_the_twist_equation_it_does_not_vanish(derivative: int) -> None:
    """Eq. 36 as printed has A1 kappa1 O2 - A2 kappa2 O1, which is zero here: (A2 - A1) O1 O2 is missing."""
    torques = []
    for nodes in SIZES:
        s, r, e1 = curve(nodes)
        rod = rods(s, derivative)
        shape = rod.start(r, e1)
        force, _ = rod.forces(shape, 0.0)
        bend = shape.bend[1:-1]
        force[1:-1, 3] -= rod.mesh.volume[1:-1] * (A2 - A1) * bend[:, 0] * bend[:, 1]
        torques.append(size(total(r, shape, force)))
    assert min(torques) > 0.1
    assert torques == pytest.approx([torques[-1]] * 3, rel=0.02)


@DERIVATIVES
def test_on_an_unevenly_stretched_rod_eq_44_keeps_the_torque_of_its_continuum(derivative: int) -> None:
    """First order in the stretch, whatever the spacing: the flux lacks factors of |r'|."""
    errors, torques = [], []
    for nodes in SIZES:
        s, r, e1 = stretched(nodes)
        rod = rods(s, derivative)
        shape = rod.start(r, e1)
        torque = total(r, shape, rod.forces(shape, 0.0)[0])
        torques.append(size(torque))
        errors.append(size(torque - continuum_torque()))
    assert min(torques) > 0.05
    assert min(slopes(errors)) >= 1.9


# The torque-free variant


@DERIVATIVES
@pytest.mark.parametrize("case", ["unit speed", "stretched", "noisy", "uneven"])
def test_the_torque_free_variant_has_none_at_any_spacing_and_any_stretch(derivative: int, case: str) -> None:
    s, r, e1 = curve(33) if case != "stretched" else stretched(33)
    if case == "noisy":
        r = r + 5e-3 * np.random.default_rng(0).standard_normal(r.shape)
    if case == "uneven":
        keep = np.unique((32 * np.linspace(0, 1, 24) ** 1.3).astype(int))
        s, r, e1 = s[keep], r[keep], e1[keep]
    rod = rods(s, derivative, TorqueFree)
    shape = rod.start(r, e1)
    force, _ = rod.forces(shape, 0.0)
    scale = np.linalg.norm(np.cross(r, force[:, :3]), axis=1).sum() + np.abs(force[:, 3]).sum()
    assert size(total(r, shape, force)) < 1e-12 * scale
    assert size(force[:, :3].sum(axis=0)) < 1e-12 * np.linalg.norm(force[:, :3], axis=1).sum()


@DERIVATIVES
def test_the_torque_free_variant_is_eq_44_to_second_order_on_an_unstretched_rod(derivative: int) -> None:
    """Forces per length at the nodes where neither touches an end, and twist torques per length."""
    forces, torques = [], []
    for nodes in SIZES:
        s, r, e1 = curve(nodes)
        both = []
        for kind in (RodSystem, TorqueFree):
            rod = rods(s, derivative, kind)
            both.append(rod.forces(rod.start(r, e1), 0.0)[0] / rod.mesh.volume[:, None])
        difference = (both[1] - both[0])[nodes // 8 : -(nodes // 8)]
        forces.append(np.abs(difference[:, :3]).max())
        torques.append(np.abs(difference[:, 3]).max())
    assert min(slopes(forces)) >= 1.9
    assert min(slopes(torques)) >= 1.9


@pytest.mark.parametrize("scheme", ["semi-implicit", "implicit"])
def test_a_free_rod_in_motion_feels_no_net_force_and_by_the_variant_no_net_torque(scheme: str) -> None:
    """About the nodes where the step ends. Newton leaves them to 1e-8: the drag of moving that far in a step."""
    keys = {"start": {}, "finish": {}, "shape": {"kind": "straight", "noise": {"amplitude": 0.02}}}
    torque = {}
    for kind in ("eq44", "torque-free"):
        rod = {**keys, "force": kind}
        simulation = run(twisting_rod(rod=rod, end=0.4, step=0.004, scheme=scheme))
        snapshot = simulation.snapshot()
        force = snapshot.filaments["rod"].force
        scale = np.linalg.norm(force, axis=1).sum()
        assert size(snapshot.diagnostics["net_force"]) < 1e-12 * scale
        torque[kind] = size(snapshot.diagnostics["net_torque"]) / scale
    if scheme == "implicit":
        left = 4 * np.pi * 1e-8 / (0.004 * 2 / 3) / scale
        assert torque["torque-free"] < left
        assert torque["eq44"] > 100 * left
