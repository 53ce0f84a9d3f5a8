"""How long steps are: by what drives, and up to the explicit limit. RFT throughout."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.scenes import scene, swimmer, twisting_rod

from ibfil.assembly import drag as assembly_drag
from ibfil.assembly import rods as assembly_rods
from ibfil.case.schema import Case
from ibfil.simulation.simulation import Simulation

PERIOD = 2 * np.pi / 10


def rod(**keys: Any) -> dict[str, Any]:
    return {"length": 2.0, "nodes": 17, "bending": 3.0, "stretching": 1e4, "normal": [0, 0, 1], **keys}


@pytest.mark.parametrize(
    ("keys", "step"),
    [
        ({"curvature": ["8*sin(4*pi*s - 10*t)", 0]}, PERIOD / 25),
        ({"curvature": ["8*sin(4*pi*s)*cos(3*t)", 0]}, 2 * np.pi / 3 / 25),
        (
            {"twisting": 1.0, "radius": 0.1, "start": {"end": "clamped", "spin": 71.6}},
            2 * np.pi / 71.6 / 25,
        ),
        ({"start": {"end": "clamped"}, "finish": {"follower": -38}}, 4 * np.pi * 0.7 * 2.0**2 / 38 / 25),
        # Nothing drives it: the slowest bending mode, zeta L^4/(A beta^4).
        ({}, 4 * np.pi * 0.7 * 2.0**4 / (3.0 * 500.564) / 25),
        ({"start": {"end": "clamped"}}, 4 * np.pi * 0.7 * 2.0**4 / (3.0 * 12.36236) / 25),
    ],
    ids=["swimmer", "standing wave", "whirling", "flailing", "free", "clamped"],
)
def test_the_automatic_step_is_a_25th_of_the_shortest_time_of_what_drives_the_rod(keys, step: float) -> None:
    """Sampled at 400 times, a sinusoid's amplitude is short by at most (pi/20)^2/2 of the swimmer's ten periods."""
    case = scene({"rod": rod(**keys)}, viscosity=0.7, end=2 * np.pi)
    assert Simulation(case).step_length == pytest.approx(step, rel=0.0124)


def test_the_automatic_step_of_several_filaments_is_that_of_the_fastest() -> None:
    slow, fast = rod(curvature=["sin(s - t)", 0]), rod(curvature=["sin(s - 5*t)", 0], position=[0, 9, 0])
    case = scene({"slow": slow, "fast": fast}, end=2 * np.pi)
    assert Simulation(case).step_length == pytest.approx(2 * np.pi / 5 / 25, rel=0.0124)


# The explicit limit


def dense_limit(simulation: Simulation) -> float:
    """2 over the largest eigenvalue of Z^-1 K, by LAPACK, held unknowns struck out."""
    system, shape = simulation.system, simulation.configuration
    _, moment = system.forces(shape, simulation.time)
    k = system.stiffness(shape, shape, moment, simulation.time).dense()
    n, m = k.shape[:2]
    drag = assembly_drag.drag(simulation.case, assembly_rods.rods(simulation.case))
    for i in range(n):
        z = np.eye(m)
        e3 = shape.e3[i]
        z[:3, :3] = drag.perp[i] * np.eye(3) + (drag.par[i] - drag.perp[i]) * np.outer(e3, e3)
        z[3:, 3:] *= drag.spin[i]
        k[i] = np.einsum("ab,bjc->ajc", np.linalg.inv(z), k[i])
    free = np.setdiff1d(np.arange(n * m), system.ends.index)
    matrix = k.reshape(n * m, n * m)[np.ix_(free, free)]
    return float(2.0 / np.abs(np.linalg.eigvals(matrix)).max())


LIMITED = {
    "swimmer": swimmer(),
    "bending": swimmer(stretching=100.0, rod={"nodes": 41, "derivative": 2}),
    "spun": twisting_rod(),
    "two": scene(
        {
            "helix": {
                **rod(bending=[1.0, 0.5], twisting=0.7, radius=0.02, curvature=[3, 0], twist_rate=1),
                "shape": {"kind": "relaxed"},
                "start": {"end": "clamped"},
                "finish": {"end": "hinged"},
            },
            "planar": rod(position=[0, 9, 0]),
        }
    ),
}


@pytest.mark.parametrize("case", LIMITED.values(), ids=LIMITED)
def test_the_explicit_limit_is_two_over_the_largest_eigenvalue(case: Case) -> None:
    simulation = Simulation(case)
    assert simulation.explicit_limit() == pytest.approx(dense_limit(simulation), rel=0.01)


@pytest.mark.parametrize(("factor", "stable"), [(0.95, True), (1.05, False)])
@pytest.mark.parametrize("stretching", [5.0, 1e4], ids=["bending", "stretching"])
def test_just_below_the_explicit_limit_is_stable_and_just_above_is_not(
    factor: float, stable: bool, stretching: float
) -> None:
    """Per step the stiffest mode is multiplied by 1 - 2 factor: in 100 steps, by 0.9^100 or 1.1^100 = 1.4e4."""
    keys = {
        "length": 1.0,
        "nodes": 9,
        "derivative": 2,
        "bending": 1.0,
        "stretching": stretching,
        "shape": {"kind": "straight", "perturb": ["1e-9*cos(8*pi*s)", "1e-9*cos(8*pi*s)", 0]},
    }
    limit = Simulation(scene({"rod": keys})).explicit_limit()
    simulation = Simulation(scene({"rod": keys}, end=100 * factor * limit, step=factor * limit, scheme="explicit"))
    before = simulation.configuration.r.copy()
    simulation.advance(simulation.case.time.end, lambda: None)
    assert simulation.steps == 100
    moved = np.abs(simulation.configuration.r - before).max()
    assert moved < 1e-8 if stable else moved > 1e-6


def test_the_automatic_explicit_step_is_half_the_limit_and_runs() -> None:
    soft = swimmer(smooth=True, stretching=50.0, rod={"nodes": 9}, end=0.05, scheme="explicit", step="auto")
    simulation = Simulation(soft)
    assert simulation.step_length == pytest.approx(0.5 * simulation.explicit_limit(), rel=1e-12)
    simulation.advance(0.05, lambda: None)
