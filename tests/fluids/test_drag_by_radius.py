"""Drag of straight rods by their radius, held against exact bounds, an asymptotic theory, and the old default."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.scenes import STOKES, scene

from ibfil.check.report import report
from ibfil.errors import CaseError
from ibfil.simulation.simulation import Simulation

ROD: dict[str, Any] = {"length": 1.0, "nodes": 11, "bending": 1.0, "stretching": 1e3}


def coefficients(aspect: float, viscosity: float = 1.0, length: float = 1.0, **fluid: Any) -> tuple[float, float]:
    """Drag per length and viscosity across and along a rod of p = L/2a, from the nodes of a scene."""
    rod = {**ROD, "length": length, "radius": length / (2 * aspect)}
    found = Simulation(scene({"rod": rod}, {"model": "rft", **fluid}, viscosity=viscosity)).fluid.drag
    return found.perp.sum() / (viscosity * length), found.par.sum() / (viscosity * length)


def spheroid(a: float, b: float) -> tuple[float, float]:
    """Exact drag over eta of a prolate spheroid with half axes a > b, across and along (Oberbeck 1876)."""
    e = np.sqrt(1 - (b / a) ** 2)
    log = np.log((1 + e) / (1 - e))
    across = 32 * np.pi * a * e**3 / (2 * e + (3 * e**2 - 1) * log)
    return across, 16 * np.pi * a * e**3 / ((1 + e**2) * log - 2 * e)


def test_the_spheroid_is_a_sphere_when_it_is_round() -> None:
    assert spheroid(1.0, 0.999) == pytest.approx((6 * np.pi, 6 * np.pi), rel=2e-3)


@pytest.mark.parametrize("aspect", [2.01, 3, 5, 10, 30, 100, 1e4])
def test_a_cylinder_drags_more_than_what_is_in_it_and_less_than_what_it_is_in(aspect: float) -> None:
    """Of two bodies one within the other the outer has more drag (Hill & Power 1956)."""
    radius = 0.5 / aspect
    inside, around = spheroid(0.5, radius), spheroid(0.5 * np.sqrt(2), radius * np.sqrt(2))
    for least, found, most in zip(inside, coefficients(aspect), around, strict=True):
        assert least < found < most


def test_a_thin_one_has_the_drag_of_slender_body_theory() -> None:
    """4 pi/(ln(L/a) + 0.193) across, 2 pi/(ln(L/a) - 0.807) along (Batchelor 1970), to the next power of 1/ln."""
    log = np.log(2e4)
    assert coefficients(1e4) == pytest.approx((4 * np.pi / (log + 0.193), 2 * np.pi / (log - 0.807)), rel=0.012)


def test_coefficients_are_per_length_and_viscosity() -> None:
    assert coefficients(10, viscosity=3e-3, length=7.0) == pytest.approx(coefficients(10), rel=1e-12)


def test_by_default_the_radius_decides_where_there_is_one() -> None:
    """The default of 0.1.0 gave a rod 1000 times as thick the same drag."""
    assert coefficients(2500)[0] < 0.4 * coefficients(2.5)[0]
    assert coefficients(10) == coefficients(10, drag="cylinder")
    bare = Simulation(scene({"rod": ROD}, {"model": "rft"})).fluid.drag
    assert (bare.perp.sum(), bare.par.sum()) == pytest.approx((4 * np.pi, 2 * np.pi), rel=1e-12)
    assert coefficients(10, drag="paper") == pytest.approx((4 * np.pi, 2 * np.pi), rel=1e-12)


def test_a_rod_on_a_grid_may_be_thicker() -> None:
    """There the default is not asked for the drag of a cylinder, which such a rod has not."""
    Simulation(scene({"rod": {**ROD, "radius": 0.4}}, STOKES))


def test_check_says_the_coefficients_and_that_a_radius_is_not_used() -> None:
    rod = {**ROD, "radius": 0.05}
    told = report(scene({"rod": rod}, {"model": "rft"}))
    assert 'drag of rod: 3.974 eta across, 2.866 eta along (drag = "cylinder")' in told
    assert "zeta_perp/eta = 3.974" in told
    told = report(scene({"rod": rod}, {"model": "rft", "drag": "paper"}))
    assert '12.57 eta across, 6.283 eta along (drag = "paper", which does not use the radius)' in told


@pytest.mark.parametrize(("drag", "radius"), [("cylinder", "0.2*(1 + s)"), ("slender", "0.3*(1 + s)")])
def test_a_radius_that_varies_may_be_too_thick_as_well(drag: str, radius: str) -> None:
    with pytest.raises(CaseError, match=rf'too thick for drag = "{drag}"'):
        Simulation(scene({"rod": {**ROD, "radius": radius}}, {"model": "rft", "drag": drag}))
