"""What rods of nonlinear laws come to: states of rest, walls between two wells, fronts that a couple drives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from helpers.rods_at_rest import CLAMPED, ROD, STIFFENING, TWISTING, TWO_WELL, Cubic, half, settled
from helpers.scenes import scene, slopes

from ibfil.simulation.simulation import Simulation

# At rest


@pytest.mark.parametrize("twists", [False, True], ids=["no twist", "twist"])
def test_a_stiffening_rod_bends_less_into_an_arc_under_an_end_moment(twists: bool) -> None:
    """m = A k (1 + c k^p), the same all along."""
    rod = {**(TWISTING if twists else ROD), "law": STIFFENING, "start": CLAMPED, "finish": {"moment": [0, 0, 4]}}
    strain = settled(rod).snapshot().filaments["rod"].strain[:-1, 0]
    assert strain * (1 + 0.3 * strain**1.5) == pytest.approx(np.full(32, 4.0), rel=1e-5)
    assert strain[0] < 2.6


def test_a_stiffening_rod_twists_less_under_a_couple() -> None:
    """m = C t (1 + c |t|^p) with C = 0.6, either way round."""
    for sign in (1, -1):
        moment = {"moment": [0, 0, sign * 2.0], "frame": "body"}
        twist = (
            sign * settled({**TWISTING, "law": STIFFENING, "start": CLAMPED, "finish": moment}).configuration.twist[:-1]
        )
        assert 0.6 * twist * (1 + 0.3 * twist**1.5) == pytest.approx(np.full(32, 2.0), rel=1e-8)


def test_moduli_and_radius_may_vary_along_a_rod() -> None:
    """Bent by m/A(s), stretched by f/EA(s), twisted at a spinning clamp by the drag of what is beyond, over C(s)."""
    keys = {"bending": ["1 + s", "2 - s"], "stretching": "1e4*(1 + 3*s)", "start": CLAMPED}
    bent = settled({**ROD, **keys, "finish": {"moment": [0, 0, 2]}}).snapshot().filaments["rod"]
    s = np.linspace(0, 1, 33)
    assert bent.strain[:-1, 0] == pytest.approx((2 / (1 + s))[:-1], rel=1e-3)
    pulled = settled({**ROD, **keys, "finish": {"force": [30, 0, 0]}})
    stretch = pulled.configuration.length[:-1] * 32 - 1
    assert stretch == pytest.approx(30 / (1e4 * (1 + 3 * half(s))), rel=1e-8)
    errors = []
    for nodes in (21, 41):
        s = np.linspace(0, 1, nodes)
        clamp = {"end": "clamped", "spin": 2.0}
        rod = {**TWISTING, "nodes": nodes, "twisting": "1 + s", "radius": "0.1*(1 - 0.5*s)", "start": clamp}
        spun = settled(rod, end=200.0, step=0.5)
        # M3' = zeta_r w, zeta_r = 4 pi eta a^2, M3(L) = 0; a = 0.1 (1 - s/2)
        moment = -2.0 * 4 * np.pi * 0.01 * (2 / 3) * ((1 - 0.5 * half(s)) ** 3 - 0.125)
        errors.append(float(np.abs(spun.configuration.twist[:-1] - moment / (1 + half(s))).max()))
    assert errors[-1] < 1e-4
    assert slopes(errors)[-1] > 1.9


def test_filaments_with_laws_of_their_own_do_in_one_scene_what_they_do_alone() -> None:
    """The same motion, to what Newton leaves; one of them is driven by an internal moment besides."""
    lone = {
        "linear": {**TWISTING, "curvature": ["3*sin(2*t)", 0]},
        "stiff": {**TWISTING, "law": STIFFENING, "curvature": [4, 0], "loads": {"internal_moment": ["t", 0]}},
        "wells": {**TWISTING, "law": TWO_WELL, "shape": {"kind": "straight", "twist": "5*s - 2"}},
        "given": {**TWISTING, "finish": {"moment": [0, 0, 1]}},
        "flat": {**ROD, "law": STIFFENING, "curvature": [2, 0]},
    }
    placed = {name: {**rod, "position": [0, k, 0]} for k, (name, rod) in enumerate(lone.items())}

    def after(rods: Mapping[str, Any]) -> Simulation:
        laws = {"given": Cubic()} if "given" in rods else {}
        simulation = Simulation(scene(rods, end=0.2, step=0.02), laws=laws)
        simulation.advance(0.2, lambda: None)
        return simulation

    together = after(placed)
    for name, rod in placed.items():
        alone, where = after({name: rod}), together.nodes(name)
        assert together.configuration.r[where] == pytest.approx(alone.configuration.r, abs=1e-8)
        assert together.configuration.e1[where] == pytest.approx(alone.configuration.e1, abs=1e-8)
        moved = (
            np.abs(alone.configuration.r - alone.start.r).max() + np.abs(alone.configuration.e1 - alone.start.e1).max()
        )
        assert moved > 1e-3


# Two wells: walls and fronts
#
# A straight rod only twists: zeta_r dphi/dt = dM3/ds, O3 = dphi/ds, M3 = V'(O3) - g O3''. Its twist is conserved but
# for what goes through the ends, so a front does not run by itself (as in the Allen-Cahn equation): it waits for the
# rod beyond to turn.

XI, LONG = 0.2, 4.0


def wall(nodes: int, moment: float = 0.0, width: float = XI, **keys: Any) -> dict[str, Any]:
    """A long rod held at its start, with a wall between wells -1 and 1 near its middle; xi = (w2 - w1) sqrt(g/8b)."""
    return {
        **TWISTING,
        "length": LONG,
        "nodes": nodes,
        "derivative": 2,
        "law": {"kind": "two-well", "wells": [-1, 1], "barrier": 1.0, "gradient": 8 * XI**2 / 4},
        "shape": {"kind": "straight", "twist": f"tanh((s - 2)/{width})"},
        "start": CLAMPED,
        "finish": {"moment": [0, 0, moment], "frame": "body"},
        **keys,
    }


def crossing(simulation: Simulation) -> float:
    """Where the twist goes through zero."""
    return float(np.interp(0.0, simulation.configuration.twist[:-1], half(simulation.arclength)))


@pytest.mark.parametrize("spacing", ["even", "q + 0.1*sin(2*pi*q)/(2*pi)"], ids=["even", "uneven"])
def test_between_wells_as_deep_a_wall_stands_still_in_the_shape_of_a_hyperbolic_tangent(spacing: str) -> None:
    """O3 = tanh((s - s0)/xi); started too wide, it comes to that. Second order in ds, even where that varies."""
    errors = []
    for nodes in (31, 61, 121):
        simulation = settled(wall(nodes, width=1.5 * XI, spacing=spacing), end=120.0, step=4.0)
        exact = np.tanh((half(simulation.arclength) - crossing(simulation)) / XI)
        errors.append(float(np.abs(simulation.configuration.twist[:-1] - exact).max()))
    assert errors[-1] < 2e-3
    assert slopes(errors)[-1] > 1.9
    assert abs(crossing(simulation) - 2.0) < 0.05


def test_an_end_couple_drives_a_front_as_fast_as_the_rod_beyond_it_can_turn() -> None:
    """The rod beyond a wall at x turns as a whole at w = (w2 - w1) (-dx/dt), against its drag:

        m = zeta_r w l,   l = L - x - xi/2,   so   d(l^2)/dt = 2 m/(zeta_r (w2 - w1))

    where m is small against the wells' own moments. xi/2 is the drag within the wall: with O3 = tanh(z) in it, no net
    work of M3 on it (for wells as deep) means a moment -zeta_r w xi/2 on its held side.
    """
    drag, errors = 4 * np.pi * 0.1**2, []
    for moment in (0.2, 0.05):
        end = 0.16 / moment
        simulation = Simulation(scene({"rod": wall(61, moment)}, end=end, step=end / 50))
        times, squares = np.linspace(0.2 * end, end, 5), []
        for time in times:
            simulation.advance(time, lambda: None)
            squares.append((LONG - crossing(simulation) - XI / 2) ** 2)
        speed = np.polyfit(times, squares, 1)[0]
        errors.append(abs(speed / (2 * moment / (drag * 2.0)) - 1))
    assert errors[-1] < 3e-3
    assert errors[0] > 2 * errors[1]
