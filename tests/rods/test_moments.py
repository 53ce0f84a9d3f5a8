"""Moments at ends and along rods against exact answers: arcs, helices, clothoids, twists."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.rods_at_rest import CLAMPED, ROD, TWISTING, half, settled
from helpers.scenes import rms, run, scene, slopes
from scipy.spatial.transform import Rotation

from ibfil.simulation.simulation import Simulation

# Moments at ends


@pytest.mark.parametrize("derivative", [2, 6])
@pytest.mark.parametrize("frame", ["lab", "body"])
@pytest.mark.parametrize("about", [0, 1], ids=["e1", "e2"])
@pytest.mark.parametrize("end", ["start", "finish"])
def test_an_end_moment_bends_a_rod_into_a_circular_arc_of_curvature_m_over_a(
    end: str, about: int, frame: str, derivative: int
) -> None:
    """M(L) = +m and M(0) = -m all along, and no tension; a ribbon, so that e1 and e2 are not taken for one another."""
    m, bending = 2.0, (1.0, 0.8)
    curvature = (1 if end == "finish" else -1) * m / bending[about]
    other = {"start": "finish", "finish": "start"}[end]
    moment = [0.0, 0.0, 0.0]
    moment[about] = m
    if frame == "lab":  # e1 = z, e2 = e3 x e1 = -y
        moment = [0.0, -moment[1], moment[0]]
    errors, strains, tensions = [], [], []
    for nodes in (17, 33, 65):
        keys = {other: CLAMPED, end: {"moment": moment, "frame": frame}}
        simulation = settled({**ROD, **keys, "bending": list(bending), "nodes": nodes, "derivative": derivative})
        rod, s = simulation.snapshot().filaments["rod"], simulation.arclength - (0.0 if end == "finish" else 1.0)
        side = 1 - np.cos(curvature * s)
        exact = np.stack([np.sin(curvature * s), (1 - about) * side, about * side], axis=1) / curvature
        errors.append(rms(rod.position - simulation.start.r[0 if end == "finish" else -1] - exact))
        inside, loaded = (slice(0, -1), -1) if end == "finish" else (slice(1, None), 0)
        expected = np.zeros(3)
        expected[about] = m if end == "finish" else -m
        tensions.append(np.abs(rod.tension).max())
        assert rod.moment[loaded] == pytest.approx(expected, abs=1e-12)
        strains.append(np.abs(rod.strain[inside, about] - curvature).max())
    assert errors[-1] < 1e-4
    assert slopes(errors)[-1] > 1.9
    assert strains[-1] < 1e-5
    assert slopes(strains)[-1] > 1.9
    assert slopes(tensions)[-1] > 1.9


def test_a_moment_fixed_in_the_lab_winds_a_rod_into_a_helix_about_it() -> None:
    """No force, so the moment m is the same all along: e3 turns about m at |m|/A, the twist is m.e3/C."""
    m, errors, twists = np.array([2.5, 1.0, -1.5]), [], []
    for nodes in (17, 33, 65):
        rod = {**TWISTING, "nodes": nodes, "start": CLAMPED, "finish": {"moment": m.tolist()}}
        simulation = settled(rod)
        shape, s = simulation.configuration, simulation.arclength
        exact = Rotation.from_rotvec(m * s[:, None]).apply([1.0, 0.0, 0.0])
        errors.append(rms(shape.e3 - exact))
        twists.append(np.abs(shape.twist[:-1] - m[0] / 0.6).max())
    assert errors[-1] < 1e-3
    assert min(slopes(errors)) > 1.9
    assert twists[-1] < 1e-3 * m[0]
    assert min(slopes(twists)) > 1.9


@pytest.mark.parametrize("frame", ["lab", "body"])
@pytest.mark.parametrize("end", ["start", "finish"])
def test_a_twist_couple_twists_a_rod_by_m3_over_c(end: str, frame: str) -> None:
    """C varies along the rod; the twist is exact at every half node, and the clamp turns back with -m3."""
    other = {"start": "finish", "finish": "start"}[end]
    rod = {**TWISTING, "twisting": "1/(2 + s)", other: CLAMPED, end: {"moment": [0.3, 0, 0], "frame": frame}}
    if frame == "body":
        rod[end]["moment"] = [0, 0, 0.3]
    simulation = settled(rod)
    sign, s = (1 if end == "finish" else -1), simulation.arclength
    expected = sign * 0.3 / (0.5 * (1 / (2 + s[1:]) + 1 / (2 + s[:-1])))
    assert simulation.configuration.twist[:-1] == pytest.approx(expected, rel=1e-9)
    # At nodes: the mean of the half nodes beside them, at an end that of the one there is.
    nodal = np.concatenate([expected[:1], 0.5 * (expected[1:] + expected[:-1]), expected[-1:]])
    found = simulation.snapshot().filaments["rod"]
    assert found.strain[:, 2] == pytest.approx(nodal, rel=1e-9)
    assert found.moment[:, 2] == pytest.approx(np.full(33, sign * 0.3), rel=1e-9)
    assert np.abs(simulation.configuration.r[:, 1:]).max() < 1e-12


# Moments along the rod


def test_an_active_moment_bends_a_rod_into_a_clothoid() -> None:
    """M' = -m and M = 0 at the free end: M1 = m (L - s)."""
    errors = []
    for nodes in (17, 33, 65):
        simulation = settled({**ROD, "nodes": nodes, "start": CLAMPED, "loads": {"moment": [3.0, 0, 0]}})
        moment = simulation.snapshot().filaments["rod"].moment[:, 0]
        errors.append(np.abs(moment - 3.0 * (1 - simulation.arclength)).max())
    assert errors[-1] < 1e-3
    assert min(slopes(errors)) > 1.9


def test_an_active_moment_about_the_tangent_twists_a_clamped_rod_and_spins_a_free_one() -> None:
    """M3 = m3 (L - s) at every half node; a free rod turns at m3/zeta_r, zeta_r = 4 pi eta a^2, and does not twist."""
    loads = {"loads": {"moment": [0, 0, 0.4]}}
    simulation = settled({**TWISTING, "start": CLAMPED, **loads})
    assert simulation.configuration.twist[:-1] == pytest.approx(0.4 * (1 - half(simulation.arclength)) / 0.6, rel=1e-9)
    free = run(scene({"rod": {**TWISTING, **loads}}, end=0.5, step=0.05))
    angle = 0.5 * 0.4 / (4 * np.pi * 0.1**2)
    assert free.configuration.e1 == pytest.approx(np.tile([0, -np.sin(angle), np.cos(angle)], (33, 1)), abs=1e-10)
    assert np.abs(free.configuration.twist).max() < 1e-10


def test_an_internal_moment_is_a_preferred_curvature_times_minus_the_modulus() -> None:
    """M = A O + m, so m = -A kappa: the same motion to round-off."""
    rod = {**ROD, "bending": [2.0, 0.5], "twisting": 0.6, "radius": 0.1, "anchor": "middle"}
    internal = {"loads": {"internal_moment": ["-2*sin(5*s - 3*t)", "-0.5*(1 + s)*t"]}}
    preferred = {"curvature": ["sin(5*s - 3*t)", "(1 + s)*t"]}
    ends = [run(scene({"rod": {**rod, **keys}}, end=0.5, step=0.05)).configuration for keys in (internal, preferred)]
    assert rms(ends[0].r - ends[1].r) < 1e-12
    assert rms(ends[0].e1 - ends[1].e1) < 1e-12
    assert np.abs(ends[0].bend).max() > 0.1


@pytest.mark.parametrize("frame", ["lab", "body"])
@pytest.mark.parametrize("end", ["start", "finish"])
@pytest.mark.parametrize("force", ["eq44", "torque-free"])
def test_a_rod_gets_the_moment_that_is_put_on_its_end(force: str, end: str, frame: str) -> None:
    """Eq. 44: to second order. Torque-free: to round-off, also on a stretched rod."""
    m, errors = np.array([0.3, 0.5, -0.7]), []
    for nodes in (17, 33, 65):
        shape = {"kind": "helix", "curvature": 2.0, "torsion": 1.0, "twist": "1 + s"}
        if force == "torque-free":
            shape["perturb"] = ["0.1*s**2", "0.05*s", 0]
        keys = {"nodes": nodes, "derivative": 2, "shape": shape, end: {"moment": m.tolist(), "frame": frame}}
        simulation = Simulation(scene({"rod": {**TWISTING, "force": force, **keys}}))
        given, g = np.zeros((nodes, 4)), simulation.configuration
        for load in simulation.system.loads:
            load.add_force(g, 0.0, given)
        torque = np.cross(g.r, given[:, :3]).sum(axis=0) + (given[:, 3:] * g.e3).sum(axis=0)
        i = 0 if end == "start" else -1
        wanted = m if frame == "lab" else m @ np.array([g.e1[i], g.e2[i], g.e3[i]])
        errors.append(float(np.abs(torque - wanted).max()))
    if force == "torque-free":
        assert max(errors) < 1e-13
    else:
        assert errors[-1] < 1e-3
        assert min(slopes(errors)) > 1.8
