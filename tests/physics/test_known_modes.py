"""Growth rates and thresholds about states of rest, held against theory: the known numbers of the field.

Units A/(zeta L^4) for rates unless said otherwise. Free rods: beta^4 of the free and the clamped beam. Twist: diffusion
with rate C q^2/(zeta_r L^2). Buckling and flutter: Chebyshev or shooting solutions of the continuum (the cases of these
names say which).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from helpers.rests import CLAMPED, ZETA, at_rest, rates, spun, straight
from scipy.optimize import brentq

from ibfil.studies.estimates import estimate

NODES = (17, 33, 65)
SIZES = tuple(1 / (n - 1) for n in NODES)


def converges(values: list[float], exact: float, tolerance: float) -> None:
    """Second order in the nodes, to the exact number within ``tolerance`` of it and within the bar of three levels."""
    found = estimate(values, SIZES, 2.0, level=2)
    corrected = values[2] - found.error
    assert corrected == pytest.approx(exact, rel=tolerance)
    assert abs(values[2] - exact) <= abs(found.error) + found.doubt + 1e-5 * abs(exact)
    assert 1.6 < np.log2(abs((values[0] - exact) / (values[1] - exact))) < 2.6


def decaying(values: np.ndarray) -> np.ndarray:
    """What decays, slowest first, double ones once."""
    values = np.sort(-values.real[values.real < -1e-3])
    return values[np.append(True, np.diff(values) > 1e-4 * values[1:])]


@pytest.mark.parametrize(
    ("ends", "number", "exact"),
    [({}, 0, 500.5639), ({}, 1, 3803.537), ({"start": CLAMPED}, 0, 12.36236), ({"start": CLAMPED}, 1, 485.5188)],
    ids=["free 1", "free 2", "clamped 1", "clamped 2"],
)
def test_a_rod_at_rest_relaxes_as_a_beam(ends, number, exact):
    found = [decaying(rates(straight(n, **ends)))[number] for n in NODES]
    converges(found, exact, 2e-4)


@pytest.mark.parametrize(
    ("ends", "exact"), [({}, np.pi**2), ({"start": {**CLAMPED, "twist": "held"}}, np.pi**2 / 4)], ids=["free", "held"]
)
def test_twist_diffuses(ends, exact):
    """The mode that is all turn, in units of C/(zeta_r L^2)."""
    found = []
    for n in NODES:
        scene = at_rest(straight(n, twisting=1.0, radius=0.1, stretching=1.6e4, **ends))
        motion = scene.motion(scene.next_rest().configuration)
        modes = scene.modes(motion, 20)
        turning = np.abs(modes.vectors[:, 3]).max(axis=0) > 100 * np.abs(modes.vectors[:, :3]).max(axis=(0, 1))
        slow = -modes.values.real[turning & (modes.values.real < -1e-3)].max()
        found.append(slow * 4 * np.pi * 0.1**2)
    converges(found, exact, 2e-4)


def test_growth_of_a_buckling_column():
    """F = 3 A/L^2 beyond Euler's pi^2/4."""
    rod = {"start": CLAMPED, "finish": {"force": [-3.0, 0, 0]}, "stretching": 1e6}
    converges([rates(straight(n, **rod))[0].real for n in NODES], 2.9587, 2e-4)


def growth_in_load(load: str) -> Callable[[float, int], complex]:
    """The leading rate of a clamped rod under a load, by size and nodes."""
    sized = {
        "force": lambda f: {"finish": {"force": [-f, 0, 0]}},
        "follower": lambda f: {"finish": {"follower": -f}},
        "body_force": lambda f: {"loads": {"body_force": [0, 0, -f]}},
    }[load]
    return lambda f, n: rates(straight(n, start=CLAMPED, stretching=1e6, **sized(f)))[0]


ONSETS = {
    "Euler": (growth_in_load("force"), np.pi**2 / 4, 0.0),
    "follower": (growth_in_load("follower"), 37.695, 191.26),
    "distributed follower": (growth_in_load("body_force"), 76.10, 196.6),
    "round": (lambda w, n: rates(spun(n, w))[0], 8.8651, None),
    "ribbon": (lambda w, n: rates(spun(n, w, bending=[1.0, 0.5]))[0], 8.941, None),
    "flat ribbon": (lambda w, n: rates(spun(n, w, bending=[1.0, 0.05]))[0], 9.203, None),
}


@pytest.mark.parametrize(("leading", "onset", "frequency"), ONSETS.values(), ids=ONSETS)
def test_what_grows_does_so_beyond_its_onset(leading, onset, frequency):
    """Seen from the lab where a spun rod is round, from its clamp where it is not: 33 nodes are within 1 %."""
    below, above = leading(0.994 * onset, 33), leading(1.011 * onset, 33)
    assert below.real < 0 < above.real
    if frequency is not None:
        assert abs(above.imag) == pytest.approx(frequency, rel=0.02, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("leading", "onset", "frequency"), ONSETS.values(), ids=ONSETS)
def test_onsets_converge(leading, onset, frequency):
    """To the theory's within the bar of three levels, and 1e-3 of it."""
    found = [
        brentq(lambda load, n=n: leading(load, n).real, 0.98 * onset, 1.05 * onset, xtol=1e-7) for n in (33, 65, 129)
    ]
    values = estimate(found, [1 / 32, 1 / 64, 1 / 128], 2.0, level=2)
    assert found[2] - values.error == pytest.approx(onset, rel=1e-3)
    assert abs(found[2] - onset) < abs(values.error) + values.doubt + 2e-4 * onset  # digits of the theory's numbers
    if frequency is not None:
        assert abs(leading(found[2], 129).imag) == pytest.approx(frequency, rel=1e-3, abs=1e-6)


def test_growth_and_frequency_of_whirling():
    """+0.4662 at 9; the rod turns with the spin at 22.846 at onset, a little faster beyond."""
    found = [rates(spun(n, 9.0))[0] for n in NODES]
    converges([value.real for value in found], 0.4662, 0.01)
    assert 22.846 < abs(found[2].imag) < 1.03 * 22.846


def test_a_ribbon_seen_from_the_lab_turns_as_fast_as_its_frequency_and_its_spin():
    """The nearly round ribbon: the lab's frequency of a round rod, less the spin of the frame."""
    round_rod = rates(spun(33, 8.5))[0]
    ribbon = rates(spun(33, 8.5, bending=[1.0, 0.999]))
    spin = 8.5 * 0.9995 / 0.1**2
    assert min(abs(abs(value.imag) - (spin - abs(round_rod.imag))) for value in ribbon[:4]) < 1e-3 * spin
    assert ribbon[0].real == pytest.approx(round_rod.real, rel=0.02)


def test_a_rod_at_a_stagnation_point():
    """In units of the flow's rate: it turns at 2, drifts at 1, buckles at 1.59094 for zeta gamma L^4/A = 300."""
    gamma = 300 / ZETA
    flow = {"model": "rft", "flow": [f"-{gamma}*x", f"{gamma}*y", "0"]}
    found = []
    for n in NODES:
        rod = straight(n, stretching=1e6, anchor="middle", normal=[0, 0, 1])
        values = np.sort(rates(rod, flow).real)[::-1] / 300
        assert values[0] == pytest.approx(2.0, abs=1e-5)
        assert values[2] == pytest.approx(1.0, abs=1e-5)
        found.append(values[1])
    converges(found, 1.59094, 1e-3)


def test_a_rod_that_stirs_its_fluid_whirls_earlier():
    """The eigenvalue that cases/rotation/whirling_stirred.toml expects, found there by another way."""
    from pathlib import Path

    from ibfil.case.reading import read_case
    from ibfil.simulation.at_rest import SceneAtRest
    from ibfil.simulation.simulation import Simulation

    case = read_case(Path(__file__).parents[2] / "cases" / "rotation" / "whirling_stirred.toml")
    scene = SceneAtRest(Simulation(case))
    motion = scene.motion(scene.next_rest().configuration)
    assert motion.carried
    leading = scene.modes(motion, 8).values[0]
    assert leading.real == pytest.approx(1.3768, rel=1e-3)
    assert abs(leading.imag) == pytest.approx(3.6774, rel=1e-3)
