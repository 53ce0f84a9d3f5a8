"""Constitutive laws: moments and their derivatives, the exact Jacobian with them, and laws that come from Python."""

from __future__ import annotations

import doctest
from typing import Any

import numpy as np
import pytest
from helpers.jacobians import assert_exact_jacobian
from helpers.rods_at_rest import CLAMPED, ROD, STIFFENING, TWISTING, TWO_WELL, Cubic
from helpers.scenes import run, scene
from scipy.integrate import trapezoid

import ibfil.rods.constitutive
from ibfil.errors import CaseError
from ibfil.linalg import banded
from ibfil.rods.constitutive import DomainWalls, Field, Linear, Stiffening, TwoWell
from ibfil.rods.mesh import Segmented, stack
from ibfil.running.run import run as run_case
from ibfil.simulation.simulation import Simulation

KINDS = pytest.mark.parametrize("force", ["eq44", "torque-free"])


# The laws themselves

N = 7
S = np.linspace(0.0, 1.0, N) ** 1.3
BENDING = np.random.default_rng(0).uniform(1, 2, (N, 2))
TORSION = np.append(np.random.default_rng(1).uniform(1, 2, N - 1), 0.0)
PREFERRED = np.random.default_rng(2).standard_normal((3, N))


def rate(time: float) -> np.ndarray:
    return time * PREFERRED[2]


LINEAR = Linear(BENDING, TORSION, (lambda t: t * PREFERRED[0], lambda t: PREFERRED[1]), rate)
WELLS = TwoWell(LINEAR, rate, (-0.7, 1.1), 0.4)
LAWS = {
    "linear": LINEAR,
    "stiffening": Stiffening(LINEAR, BENDING, TORSION, 0.7, 1.5),
    "softening": Stiffening(LINEAR, BENDING, TORSION, -0.2, 3.0),
    "two-well": WELLS,
    "domain walls": DomainWalls(WELLS, stack([Segmented(S, 2, None, None)]), 1 + S, rate),
}


def none(count: int) -> Field:
    """No preferred strain at ``count`` nodes."""
    return lambda t: np.zeros(count)


def unstrained(count: int, bending: float = 1.0, torsion: float = 1.0) -> Linear:
    """The linear law without preferred strains."""
    zero = none(count)
    return Linear(np.full((count, 2), bending), np.full(count, torsion), (zero, zero), zero)


@pytest.mark.parametrize("name", LAWS)
def test_the_derivatives_of_a_law_are_those_of_its_moments(name: str) -> None:
    """Central differences, to 1e-8; the part that comes from half nodes beside is in ``nonlocal_twist``."""
    law, h, time = LAWS[name], 1e-6, 1.3
    bend, twist = (2 * np.random.default_rng(3).standard_normal(shape) for shape in ((N, 2), N))
    _, slope = law.bending(bend, time)
    for b in (0, 1):
        step = h * np.eye(2)[b]
        numerical = (law.bending(bend + step, time)[0] - law.bending(bend - step, time)[0]) / (2 * h)
        assert slope[:, :, b] == pytest.approx(numerical, rel=1e-7, abs=1e-8)
    assert slope == pytest.approx(np.swapaxes(slope, 1, 2), rel=1e-13)  # there is an energy
    _, slope3 = law.twisting(twist, time)
    exact = np.diag(slope3[:-1])
    if law.nonlocal_twist is not None:
        exact = exact + np.diag(law.nonlocal_twist[1:-1, 0], -1) + np.diag(law.nonlocal_twist[:-2, 1], 1)
    for j in range(N - 1):
        step = h * np.eye(N)[j]
        numerical = (law.twisting(twist + step, time)[0] - law.twisting(twist - step, time)[0])[:-1] / (2 * h)
        assert exact[:, j] == pytest.approx(numerical, rel=1e-7, abs=1e-7)


def test_a_stiffening_round_rod_is_as_stiff_in_all_directions() -> None:
    """M = A e (1 + c |e|^p) along e, whatever its direction; without any strain it is linear."""
    law = Stiffening(unstrained(3, bending=2.0), np.full((3, 2), 2.0), np.ones(3), 0.7, 1.5)
    angle = np.array([0.0, 1.0, 2.5])
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    moment, _ = law.bending(3.0 * direction, 0.0)
    assert moment == pytest.approx(2 * 3 * (1 + 0.7 * 3**1.5) * direction, rel=1e-13)
    moment, slope = law.bending(np.zeros((3, 2)), 0.0)
    assert np.all(moment == 0.0)
    assert slope == pytest.approx(np.tile(2 * np.eye(2), (3, 1, 1)))


def test_two_wells_are_free_of_moment_and_the_barrier_is_as_high_as_it_says() -> None:
    """M3 = dV/dO3 from well to well, through zero half way; its integral from a well to half way is the barrier."""
    law = TwoWell(unstrained(2001), none(2001), (-2.0, 3.0), 1.5)
    twist = np.linspace(-2.0, 0.5, 2001)
    moment, slope = law.twisting(twist, 0.0)
    assert moment[[0, -1]] == pytest.approx(0.0, abs=1e-13)
    assert np.all(moment[1:-1] > 0)
    assert trapezoid(moment, twist) == pytest.approx(1.5, rel=1e-6)
    assert slope[0] == pytest.approx(32 * 1.5 / 5**2)


def test_a_change_of_the_twist_along_a_rod_has_the_energy_g_over_2_times_its_square() -> None:
    """The moments times the rest lengths are its derivatives: they sum to zero, and vanish where twist is uniform."""
    mesh, g = stack([Segmented(S, 2, None, None)]), 1 + S
    law, twist = DomainWalls(unstrained(N, torsion=0.0), mesh, g, none(N)), np.random.default_rng(3).standard_normal(N)

    def energy(twist: np.ndarray) -> float:
        change = np.diff(twist[:-1]) / mesh.volume[1:-1]
        return float(np.sum(0.5 * g[1:-1] * change**2 * mesh.volume[1:-1]))

    moment, _ = law.twisting(twist, 0.0)
    h = 1e-5
    numerical = [(energy(twist + h * unit) - energy(twist - h * unit)) / (2 * h) for unit in np.eye(N)]
    assert (moment * mesh.ds)[:-1] == pytest.approx(numerical[:-1], rel=1e-8, abs=1e-8)
    assert abs(np.sum((moment * mesh.ds)[:-1])) < 1e-12
    assert np.abs(law.twisting(np.full(N, 0.7), 0.0)[0]).max() < 1e-13


# In a rod: the exact Jacobian, in a band that holds it


@KINDS
@pytest.mark.parametrize("derivative", [2, 6])
@pytest.mark.parametrize("laws", [(STIFFENING, {}), (TWO_WELL, {}), (STIFFENING, TWO_WELL)], ids=str)
def test_nonlinear_laws_are_in_the_exact_jacobian(laws: tuple, derivative: int, force: str) -> None:
    """Two clamped ribbons, curved, twisted and noisy, each with a law of its own; one spins."""
    common = {**TWISTING, "length": 1.3, "nodes": 9, "spacing": "q**1.2", "derivative": derivative, "force": force}
    common |= {"bending": [1.0, 0.4], "stretching": 50.0, "curvature": ["2*s", 1], "twist_rate": "1 + s"}
    rods = {
        "a": {**common, "law": laws[0] or {"kind": "linear"}, "start": CLAMPED},
        "b": {**common, "law": laws[1] or {"kind": "linear"}, "position": [0, 1, 0], "finish": CLAMPED},
    }
    system = Simulation(scene(rods)).system
    s = np.linspace(0, 1.3, 9) ** 1.1
    curve = np.stack([s, 0.2 * np.sin(3 * s), 0.3 * np.cos(4 * s) - 0.3], axis=1)
    rng = np.random.default_rng(3)
    r = np.concatenate([curve, curve + np.array([0, 1, 0])]) + 1e-3 * rng.standard_normal((18, 3))
    start = system.start(r, np.array([0.1, 1.0, 0.3]) + 0.4 * rng.standard_normal((18, 3)))
    y = 0.02 * rng.standard_normal((18, 4))
    y[:, :3] *= 0.1
    assert_exact_jacobian(system, start, y)


def test_the_solver_knows_how_far_a_domain_wall_reaches() -> None:
    """The step's matrix by bands, where its profile says it is not zero, has the inverse of the whole matrix."""
    rod = {**TWISTING, "nodes": 15, "twist_rate": "3*s", "curvature": ["s", 1], "law": TWO_WELL, "start": CLAMPED}
    system = Simulation(scene({"rod": {**rod, "shape": {"kind": "relaxed"}}})).system
    shape = system.start(*(np.random.default_rng(k).standard_normal((15, 3)) for k in (0, 1)))
    _, moment = system.forces(shape, 0.0)
    matrix = system.stiffness(shape, shape, moment, 0.0)
    whole = matrix.dense().reshape(60, 60)
    rows, width = np.arange(15), system.profile.width
    assert np.all(system.profile.first >= rows - width)
    nodes = np.abs(matrix.dense()).max(axis=(1, 3)) > 0
    assert all(not nodes[i, : system.profile.first[i]].any() for i in rows)
    right = np.random.default_rng(2).standard_normal((15, 4))
    shifted = matrix.band.copy()
    size = np.abs(shifted).max()
    for k in range(4):
        shifted[:, k, width * 4 + k] -= 10 * size
    exact = np.linalg.solve(whole - 10 * size * np.eye(60), right.ravel()).reshape(15, 4)
    assert banded.solve(shifted, right, system.profile) == pytest.approx(exact, rel=1e-10, abs=1e-12 / size)


class Varying(Cubic):
    """Preferred curvature and twist that vary along s and in time: it sees where and when it is asked."""

    def bending(self, strain: np.ndarray, s: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        moment = strain.copy()
        moment[:, 0] -= np.sin(3 * s) * time
        return moment, np.tile(np.eye(2), (len(s), 1, 1))

    def twisting(self, strain: np.ndarray, s: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        return 0.6 * (strain - 2 * s * time), np.full(len(s), 0.6)


def test_a_law_from_python_is_the_one_of_the_case_that_says_the_same() -> None:
    """Cubic is "stiffening" with coefficient 1 and exponent 2, in three dimensions; Varying has strains of s and t."""
    keys = {**TWISTING, "start": CLAMPED, "finish": {"moment": [1, 2, 3]}}
    ends = []
    for law, laws in (({"kind": "stiffening", "coefficient": 1, "exponent": 2}, {}), ({}, {"rod": Cubic()})):
        simulation = Simulation(
            scene({"rod": {**keys, "law": law or {"kind": "linear"}}}, end=1.0, step=0.1), laws=laws
        )
        simulation.advance(1.0, lambda: None)
        ends.append(simulation.configuration)
    assert ends[0].r == pytest.approx(ends[1].r, abs=1e-11)
    assert ends[0].e1 == pytest.approx(ends[1].e1, abs=1e-11)
    assert np.abs(ends[0].bend).max() > 0.5
    varying = Simulation(scene({"rod": TWISTING}, end=1.0, step=0.1), laws={"rod": Varying()})
    varying.advance(1.0, lambda: None)
    strains = {"curvature": ["sin(3*s)*t", 0], "twist_rate": "2*s*t"}
    plain = run(scene({"rod": {**TWISTING, **strains}}, end=1.0, step=0.1))
    assert varying.configuration.r == pytest.approx(plain.configuration.r, abs=1e-12)
    assert varying.configuration.e1 == pytest.approx(plain.configuration.e1, abs=1e-12)


def test_a_law_for_a_filament_there_is_not_is_refused() -> None:
    with pytest.raises(CaseError, match="laws: found road; allowed: one of rod"):
        Simulation(scene({"rod": ROD}), laws={"road": Cubic()})


def test_a_law_that_gives_arrays_of_other_shapes_is_told_so() -> None:
    class Flat(Cubic):
        def bending(self, strain: np.ndarray, s: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
            return strain, np.eye(2)

    with pytest.raises(TypeError, match=r"law .*Flat: found an array \(2, 2\); wanted \(33, 2, 2\)"):
        Simulation(scene({"rod": ROD}), laws={"rod": Flat()}).snapshot()


def test_a_run_goes_on_only_with_the_laws_it_began_with(tmp_path) -> None:
    case = scene({"rod": {**ROD, "curvature": [1, 0]}}, end=0.2, step=0.05)
    laws = {"rod": Cubic()}
    whole, cut = (Simulation(case, laws=laws) for _ in range(2))
    whole.advance(0.2, lambda: None)
    cut.advance(0.1, lambda: None)
    with pytest.raises(CaseError, match="laws: found none; the run began with rod: Cubic"):
        Simulation(case).restore(cut.state())
    with pytest.raises(CaseError, match="laws: found rod: Cubic; the run began with none"):
        cut.restore(Simulation(case).state())
    again = Simulation(case, laws=laws)
    again.restore(cut.state())
    again.advance(0.2, lambda: None)
    assert again.configuration.r == pytest.approx(whole.configuration.r, abs=1e-8)
    quiet = {"progress": False, "log": lambda line: None}
    path = tmp_path / "run.h5"
    result = run_case(case, path, laws=laws, **quiet)
    assert result.snapshot.filaments["rod"].position == pytest.approx(whole.configuration.r, abs=1e-8)


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"law": TWO_WELL}, 'law.kind: found "two-well" and no twisting; allowed: two preferred twists only with'),
        (
            {"law": {**TWO_WELL, "wells": [1, 1]}, "twisting": 1, "radius": 0.1},
            r"law.wells: found \[1.0, 1.0\]; allowed",
        ),
        (
            {"law": {**TWO_WELL, "wells": [3, -2]}, "twisting": 1, "radius": 0.1},
            r"law.wells: found \[3.0, -2.0\]; allowed",
        ),
    ],
)
def test_two_wells_have_to_be_two_and_of_the_twist(keys: dict[str, Any], told: str) -> None:
    with pytest.raises(CaseError, match=told):
        scene({"rod": {**ROD, **keys}})


def test_the_example_in_the_module_holds() -> None:
    assert doctest.testmod(ibfil.rods.constitutive).attempted > 5
    assert doctest.testmod(ibfil.rods.constitutive).failed == 0
