"""Known answers under resistive-force theory, derived or found by independent code: rates, thresholds, speeds.

Rates are eigenvalues of the linearised statement, in units of A/(zeta_perp L^4): no time step stands between the
scheme and the answer. Each is extrapolated from three grids, N, 2 N - 1, 4 N - 3, and held against the published
number to within what the extrapolation itself is uncertain by, and half a unit of the number's last digit. One
growth of each kind is then found again by stepping in time.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from helpers.scenes import rms, run, scene, slopes, swimmer, twisting_rod
from scipy.optimize import brentq

from ibfil.case.schema import Case
from ibfil.simulation.simulation import Simulation

GRIDS = (33, 65, 129)
DERIVATIVES = pytest.mark.parametrize("derivative", [2, 6])
L, A, ZETA = 2.0, 3.0, 0.7  # not ones: every power of them is tested
UNIT = ZETA * L**4 / A  # of time
RIGID = 1e9 * A / L**2
RADIUS = 0.1 * L
FLUID: dict[str, Any] = {"model": "rft", "drag": {"perp": ZETA, "par": 0.5 * ZETA, "spin": ZETA * 0.01 * L**2}}


def cantilever(nodes: int, derivative: int, *, end: float = 1.0, step: float = 1.0, **keys: Any) -> Case:
    """A straight rod along x, clamped at its start; times in units of zeta_perp L^4/A."""
    table = {
        "length": L,
        "nodes": nodes,
        "derivative": derivative,
        "bending": A,
        "stretching": RIGID,
        "direction": [1, 0, 0],
        "normal": [0, 1, 0],
        "anchor": "start",
        "start": {"end": "clamped"},
        **keys,
    }
    return scene({"rod": table}, FLUID, end=end * UNIT, step=step * UNIT)


def transverse(case: Case, strain: float = 0.0, turned: np.ndarray | None = None) -> np.ndarray:
    """Z^-1 K in y and z of the free nodes (2 k, 2 k), about a straight rod stretched and with e1 turned (n,).

    Displacements along such a rod, and its twist, do not couple to y and z at first order.
    """
    simulation = Simulation(case)
    rods, n = simulation.system, len(simulation.arclength)
    angle = np.zeros(n) if turned is None else turned
    r = np.outer(simulation.arclength * (1 + strain), [1.0, 0.0, 0.0])
    shape = rods.start(r, np.stack([np.zeros(n), np.cos(angle), np.sin(angle)], axis=1))
    _, moment = rods.forces(shape, 0.0)
    k = rods.stiffness(shape, shape, moment, 0.0).dense()[1:, 1:3, 1:, 1:3]
    k /= ZETA * rods.mesh.volume[1:, None, None, None]
    return k.reshape(2 * (n - 1), 2 * (n - 1))


def leading(matrix: np.ndarray) -> complex:
    """The eigenvalue of largest real part, in units of A/(zeta_perp L^4)."""
    values = np.linalg.eigvals(matrix)
    return complex(values[np.argmax(values.real)]) * UNIT


def assert_known(value: Callable[[int], float], known: float, digit: float) -> None:
    """``value`` of the number of nodes converges at second order, to ``known``, given to one ``digit``."""
    coarse, middle, fine = (value(n) for n in GRIDS)
    assert slopes([abs(coarse - middle), abs(middle - fine)])[0] == pytest.approx(2.0, abs=0.25)
    first, second = (4 * middle - coarse) / 3, (4 * fine - middle) / 3
    assert second == pytest.approx(known, abs=abs(second - first) + 0.5 * digit)


def assert_extrapolated(coarse: float, fine: float, known: float, digit: float) -> None:
    """The limit of N and 2 N - 1 is ``known`` to within the whole of what was extrapolated away."""
    left = (fine - coarse) / 3
    assert fine + left == pytest.approx(known, abs=abs(left) + 0.5 * digit)


# Bending


@DERIVATIVES
def test_a_clamped_rod_relaxes_at_12_36236(derivative: int) -> None:
    def rate(nodes: int) -> float:
        return -leading(transverse(cantilever(nodes, derivative))).real

    assert_known(rate, 12.36236, 1e-5)
    # The cubic through three nodes at the clamp: half a per cent needs 13 nodes, not the ghost node's 33.
    assert rate(17) == pytest.approx(12.36236, rel=5e-3)


def euler(force: float, nodes: int, derivative: int) -> float:
    """Growth under a force that keeps its direction: the rod is compressed, the load has no stiffness."""
    return leading(transverse(cantilever(nodes, derivative), strain=-force * A / L**2 / RIGID)).real


@DERIVATIVES
def test_a_clamped_rod_buckles_at_pi_squared_over_four(derivative: int) -> None:
    def threshold(nodes: int) -> float:
        return brentq(lambda force: euler(force, nodes, derivative), 2.3, 2.6, xtol=1e-10)

    assert_extrapolated(threshold(17), threshold(33), np.pi**2 / 4, 0.0)


def flutter(force: float, nodes: int, derivative: int) -> complex:
    """Growth and frequency under a follower force of that size, in A/L^2, compressive."""
    case = cantilever(nodes, derivative, finish={"follower": -force * A / L**2})
    return leading(transverse(case, strain=-force * A / L**2 / RIGID))


@pytest.mark.parametrize(("force", "growth"), [(37.5, -1.434), (38.0, 2.241)])
def test_a_follower_force_makes_a_clamped_rod_flutter(force: float, growth: float) -> None:
    assert_known(lambda nodes: flutter(force, nodes, 2).real, growth, 1e-3)
    # At order 6 errors of the clamp and of the inside cancel for the coarse grids: no slope to be had.
    assert_extrapolated(*(flutter(force, n, 6).real for n in GRIDS[1:]), growth, 1e-3)


def test_flutter_sets_in_at_37_695_with_frequency_191_26() -> None:
    def threshold(nodes: int) -> float:
        return brentq(lambda force: flutter(force, nodes, 2).real, 37.0, 38.5, xtol=1e-9)

    assert_known(threshold, 37.69543, 1e-5)

    def frequency(nodes: int) -> float:
        return abs(flutter(threshold(nodes), nodes, 2).imag)

    assert_extrapolated(frequency(33), frequency(65), 191.26, 0.01)


# Twist


@pytest.mark.parametrize("bending", [[1.0, 0.3], [7.0, 7.0]], ids=str)
@pytest.mark.parametrize(("clamped", "mode"), [(False, np.pi), (True, np.pi / 2)], ids=["free", "one end held"])
def test_twist_diffuses_at_c_pi_squared_whatever_the_bending(bending: list[float], clamped: bool, mode: float) -> None:
    """Eq. 36 on a straight rod is the heat equation in finite volumes: its rates are (2/ds sin(mode ds/2))^2."""
    nodes, c = 33, 1.7
    case = cantilever(nodes, 6, bending=bending, twisting=c, start={"end": "clamped" if clamped else "free"})
    rods = Simulation(case).system
    shape = Simulation(case).configuration
    _, moment = rods.forces(shape, 0.0)
    matrix = rods.stiffness(shape, shape, moment, 0.0).dense()
    k = matrix[:, 3, :, 3] / (ZETA * 0.01 * L**2 * rods.mesh.volume[:, None])
    k = k[1:, 1:] if clamped else k
    rates = np.sort(-np.linalg.eigvals(k).real) / (c / (ZETA * 0.01 * L**4))
    slowest = rates[0] if clamped else rates[1]
    ds = 1.0 / (nodes - 1)
    assert slowest == pytest.approx((2 / ds * np.sin(mode * ds / 2)) ** 2, rel=1e-9)
    assert slowest == pytest.approx(mode**2, rel=(mode * ds) ** 2 / 11)
    if not clamped:
        assert abs(rates[0]) < 1e-8
    # Twisted or not, a straight rod's bending and twist do not mix.
    assert np.abs(matrix[:, 3, :, :3]).max() == 0.0


def test_a_twisted_rod_untwists_in_time_at_that_rate() -> None:
    """One end held, Omega3 = eps cos(mode s): e1 turns back by exp(-rate t), at BDF2's own factor a step."""
    nodes, mode, eps, count = 33, np.pi / 2, 1e-4, 200
    ds = 1.0 / (nodes - 1)
    rate = (2 / ds * np.sin(mode * ds / 2)) ** 2 / 0.01
    dt = 1 / rate / count
    case = cantilever(
        nodes,
        6,
        end=count * dt,
        step=dt,
        twisting=A,
        shape={"kind": "straight", "twist": f"{eps}*cos(pi*s/{2 * L})"},
    )
    simulation = Simulation(case)
    before = np.arctan2(simulation.configuration.e1[:, 2], simulation.configuration.e1[:, 1])
    simulation.advance(case.time.end, lambda: None)
    after = np.arctan2(simulation.configuration.e1[:, 2], simulation.configuration.e1[:, 1])
    expected, older = 1 / (1 + rate * dt), 1.0
    for _ in range(count - 1):
        expected, older = (2 * expected - 0.5 * older) / (1.5 + rate * dt), expected
    assert expected == pytest.approx(np.exp(-1), rel=1e-4)
    assert after[1:] / before[1:] == pytest.approx(np.full(nodes - 1, expected), rel=1e-6)


# Whirling


def whirl(ratio: float, nodes: int, derivative: int, ribbon: float = 1.0) -> complex:
    """Growth and frequency in the lab of a rod spun at ratio A+/(zeta_r L^2), A2 = ribbon A1, C = A1 = A, a = 0.1 L.

    About the straight rod in steady twist, M3 = -zeta_r omega (L - s). In the frame of the clamp it stands still, so
    that d/dt eta = (Z^-1 K - omega x) eta has constant coefficients.
    """
    mean = 0.5 * (1 + ribbon)
    s = np.linspace(0.0, 1.0, nodes)
    m3 = -ratio * mean * (1 - 0.5 * (s[1:] + s[:-1]))
    turned = np.append(0.0, np.cumsum(m3 / (nodes - 1)))
    case = cantilever(nodes, derivative, bending=[A, A * ribbon], twisting=A, radius=RADIUS)
    spin = ratio * mean / 0.01
    matrix = transverse(case, turned=turned)
    rotation = np.kron(np.eye(nodes - 1), [[0.0, -1.0], [1.0, 0.0]]) * spin / UNIT
    value = leading(matrix - rotation)
    # Of the conjugate pair the one that in the lab is slow: whirling turns with the clamp.
    return complex(value.real, spin - abs(value.imag))


@pytest.mark.parametrize(
    ("ratio", "growth", "digit"), [(8.0, -2.694, 1e-3), (8.8, -0.2204, 1e-4), (9.0, 0.4662, 1e-4), (10.0, 4.373, 1e-3)]
)
def test_a_spun_rod_whirls_at_its_known_growth(ratio: float, growth: float, digit: float) -> None:
    assert_known(lambda nodes: whirl(ratio, nodes, 6).real, growth, digit)


@DERIVATIVES
def test_whirling_sets_in_at_8_8651_with_frequency_22_846(derivative: int) -> None:
    grids = (33, 65)
    thresholds = [brentq(lambda w, n=n: whirl(w, n, derivative).real, 8.5, 9.2, xtol=1e-8) for n in grids]
    frequencies = [whirl(w, n, derivative).imag for w, n in zip(thresholds, grids, strict=True)]
    assert_extrapolated(*thresholds, 8.86514, 1e-5)
    assert_extrapolated(*frequencies, 22.8456, 1e-4)


@pytest.mark.parametrize(
    ("ribbon", "threshold", "frequency"), [(0.5, 8.941, 23.67), (0.2, 9.216, None), (0.05, 9.203, 23.10)]
)
def test_ribbons_whirl_later_than_round_rods(ribbon: float, threshold: float, frequency: float | None) -> None:
    grids = (33, 65)
    found = [brentq(lambda w, n=n: whirl(w, n, 6, ribbon).real, 8.5, 9.6, xtol=1e-8) for n in grids]
    assert_extrapolated(*found, threshold, 1e-3)
    if frequency is not None:
        hopf = [whirl(w, n, 6, ribbon).imag / (0.5 * (1 + ribbon)) for w, n in zip(found, grids, strict=True)]
        assert_extrapolated(*hopf, frequency, 1e-2)


# The same by stepping in time


def fitted(z: np.ndarray, dt: float) -> complex:
    """The rate of z(t) = Re(c exp(rate t)), or of a complex z = c exp(rate t), from equidistant samples."""
    if np.iscomplexobj(z):
        return complex(np.log(np.vdot(z[:-1], z[1:]) / np.vdot(z[:-1], z[:-1])) / dt)
    (a, b), *_ = np.linalg.lstsq(np.stack([z[1:-1], z[:-2]], axis=1), z[2:], rcond=None)
    return complex(np.log(np.roots([1.0, -a, -b]).astype(complex))[0] / dt)


def stepped(rate: complex, dt: float) -> complex:
    """What BDF2 makes of a rate: ln(xi)/dt with 3/2 xi^2 - 2 xi + 1/2 = rate dt xi^2."""
    roots = np.roots([1.5 - rate * dt, -2.0, 0.5])
    return complex(np.log(roots[np.argmax(np.abs(roots))]) / dt)


def test_flutter_grows_in_time_as_its_eigenvalue_says() -> None:
    """F0 = 38, N = 17: a third of a unit is ten periods; the growth is that of this N, not the known 2.241."""
    nodes, dt = 17, 4e-4
    rate = flutter(38.0, nodes, 2)
    bump = ["0", "0", f"1e-6*(s/{L})**2"]
    case = cantilever(
        nodes,
        2,
        end=0.35,
        step=dt,
        stretching=1e6 * A / L**2,
        finish={"follower": -38.0 * A / L**2},
        shape={"kind": "straight", "perturb": bump},
    )
    tip: list[float] = []
    simulation = Simulation(case)
    simulation.advance(case.time.end, lambda: tip.append(simulation.configuration.r[-1, 2]))
    found, expected = fitted(np.array(tip[200:]), dt), stepped(rate, dt)
    assert abs(found.imag) == pytest.approx(abs(expected.imag), rel=1e-4)
    # EA = 1e6 moves the threshold by F0/EA: 1e-3 of the force times a slope of 7.4 a unit of it.
    assert found.real == pytest.approx(expected.real, abs=0.02)


def test_whirling_grows_in_time_as_its_eigenvalue_says_and_turns_with_the_clamp() -> None:
    """Ratio 10, N = 33, from steady twist: positions do not care how far e1 turns in a step."""
    nodes, dt, ratio = 33, 3e-4, 10.0
    rate = whirl(ratio, nodes, 6)
    case = cantilever(
        nodes,
        6,
        end=0.5,
        step=dt,
        stretching=1e6 * A / L**2,
        twisting=A,
        radius=RADIUS,
        start={"end": "clamped", "spin": ratio / 0.01 / UNIT},
        shape={"kind": "straight", "twist": f"-{ratio / L}*(1 - s/{L})", "perturb": ["0", f"1e-5*(s/{L})**2", "0"]},
    )
    tip: list[complex] = []
    simulation = Simulation(case)
    simulation.advance(case.time.end, lambda: tip.append(complex(*simulation.configuration.r[-1, 1:])))
    found, expected = fitted(np.array(tip[len(tip) // 2 :]), dt), stepped(rate, dt)
    assert found.imag == pytest.approx(expected.imag, rel=2e-3)
    assert found.real == pytest.approx(expected.real, rel=1e-2)
    assert found.imag > 0


def test_a_follower_force_of_200_flails_at_amplitude_0_58_and_compresses_by_one_per_cent() -> None:
    """Two digits of the amplitude, and 0.0014 for the step. Eq. 20 as printed would compress by 12 to 23 %.

    The segment beside the load bears nearly all of it: F0/EA = 1 %.
    """
    force = 200.0 * A / L**2
    case = cantilever(
        41,
        6,
        end=0.2,
        step=1e-4,
        stretching=100 * force,
        finish={"follower": -force},
        shape={"kind": "straight", "perturb": [0, 0, f"{0.01 * L}*(s/{L})**2"]},
    )
    tip, shortest = [], []
    simulation = Simulation(case)

    def watch() -> None:
        tip.append(simulation.configuration.r[-1, 2] / L)
        shortest.append(float(np.min(simulation.configuration.length[:-1])) * 40 / L - 1)

    simulation.advance(case.time.end, watch)
    last = slice(len(tip) // 2, None)
    assert np.max(tip[last]) == pytest.approx(0.58, abs=0.0064)
    assert np.min(tip[last]) == pytest.approx(-0.58, abs=0.0064)
    assert -np.min(shortest[last]) == pytest.approx(0.0097, abs=3e-4)


# The swimmer


def speed(viscosity: float) -> np.ndarray:
    """Velocity of the centroid, mean over periods 2 and 3, in P/240 steps; omega = 10 whatever the viscosity."""
    period = 2 * np.pi / (10 * viscosity)  # in units of eta L^4/A
    case = swimmer(viscosity=viscosity, rate=10 * viscosity, end=3 * period, step=period / 240, rod={"nodes": 64})
    simulation = Simulation(case)
    volume, places = simulation.system.mesh.volume, []
    for until in (case.time.end / 3, case.time.end):
        simulation.advance(until, lambda: None)
        places.append(volume @ simulation.configuration.r / volume.sum())
    return (places[1] - places[0]) / (2 * case.time.end / 3)


@pytest.mark.parametrize(("viscosity", "known"), [(1.0, 0.1035), (1e-3, 0.1034)])
def test_the_swimmer_swims_at_its_known_speed_and_drifts(viscosity: float, known: float) -> None:
    """Half a per cent is the published numbers' own spread; without the frame's variation in K it is 4 % off."""
    velocity = speed(viscosity)
    assert velocity[0] == pytest.approx(-known, rel=5e-3)
    assert velocity[1] == pytest.approx(-0.0047, abs=1e-4)
    assert velocity[2] == 0.0


# Order in space


@DERIVATIVES
@pytest.mark.parametrize("build", [swimmer, twisting_rod], ids=["swimmer", "twisting rod"])
def test_motion_converges_at_second_order_in_space(build: Callable[..., Case], derivative: int) -> None:
    """RMS at the nodes of nested grids, N and 2 N - 1: Eq. 46 as a sum would show 1.5."""
    shapes = [run(build(end=0.4, step=0.01, rod={"nodes": n, "derivative": derivative})).configuration for n in GRIDS]
    positions = [rms(a.r - b.r[::2]) for a, b in pairwise(shapes)]
    assert slopes(positions)[0] == pytest.approx(2.0, abs=0.1)
    if build is twisting_rod:
        directors = [rms(a.e1 - b.e1[::2]) for a, b in pairwise(shapes)]
        assert slopes(directors)[0] == pytest.approx(2.0, abs=0.1)
