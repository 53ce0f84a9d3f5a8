"""Shells of markers: their points, and the radius that they have by exact and published answers."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.bodies.markers import area, markers
from ibfil.bodies.resistance import ellipsoid
from ibfil.bodies.rotation import rotation
from ibfil.fluids.coupling import TRANSLATION, Nodes
from ibfil.fluids.shells.calibration import fitted
from ibfil.fluids.shells.shell import Shells
from ibfil.fluids.spaces.free import FreeSpace
from ibfil.fluids.spaces.periodic import PeriodicSpace
from ibfil.fluids.spaces.wall import NoSlipWall
from ibfil.grid.kernels import KERNELS

SPACING = 1.75
PLACE = np.array([0.23, 0.41, 0.07])  # in a cell: none of those by which shells are fitted


@pytest.mark.parametrize("axes", [(4.0, 4.0, 4.0), (6.0, 3.0, 3.0), (5.0, 4.0, 3.0)])
def test_markers_lie_evenly_on_their_ellipsoid(axes):
    size = np.array(axes)
    points = markers(size, round(area(size) / SPACING**2))
    np.testing.assert_allclose(np.linalg.norm(points / size, axis=1), 1.0, rtol=1e-12)
    between = np.linalg.norm(points[:, None] - points, axis=2) + 9 * np.eye(len(points))
    nearest = between.min(axis=1)
    assert nearest.min() > 0.85 * SPACING  # of 1.07, were they all at the corners of even triangles
    assert nearest.max() < 1.25 * SPACING
    np.testing.assert_array_equal(points, markers(size, len(points)))


def resistance(space, kernel: str, points: np.ndarray, place: np.ndarray = PLACE) -> np.ndarray:
    """The 6 x 6 of a rigid shell of points (k, 3) about the origin of the body, at a place of its own in a cell."""
    levers = Shells(0, (points,), 1.0).levers(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]), 6)
    nodes = Nodes(*space.stencil(KERNELS[kernel], points + place), np.zeros_like(points))
    mobility = space.mobility(TRANSLATION, KERNELS[kernel].points, 1.0).matrix(nodes, np.zeros_like(points))
    return levers.T @ np.linalg.solve(mobility, levers)


@pytest.mark.parametrize("kernel", ["peskin4", "bspline4"])
def test_a_sphere_is_dragged_with_the_radius_that_is_asked_for(kernel):
    """Stokes' 6 pi eta a in free space, at a place in the cell and an orientation that were not used to find it."""
    a = 4.3
    points = fitted((a, a, a), kernel, SPACING, False).markers @ rotation(np.array([0.4, -0.2, 0.9])).T
    found = resistance(FreeSpace(1.0), kernel, points)
    np.testing.assert_allclose(np.diag(found)[:3], 6 * np.pi * a, rtol=1.5e-3)
    turning = fitted((a, a, a), kernel, SPACING, True).markers
    np.testing.assert_allclose(np.diag(resistance(FreeSpace(1.0), kernel, turning))[3:], 8 * np.pi * a**3, rtol=3e-3)


def test_a_sphere_in_a_box_is_slowed_by_its_images():
    """Hasimoto's series at a/L = 0.1; its turning by 1 - (4 pi/3) x^3, with the radius of turning that it has."""
    a, side = 3.2, 32
    fit = fitted((a, a, a), "bspline4", SPACING, False)
    space = PeriodicSpace((float(side),) * 3, (side,) * 3)
    mobility = np.linalg.inv(resistance(space, "bspline4", fit.markers))
    x = a / side
    slowed = 1 - 2.837297 * x + 4.18879 * x**3 - 27.4 * x**6
    np.testing.assert_allclose(np.diag(mobility)[:3] * 6 * np.pi * a, slowed, rtol=1.5e-3)
    own = (8 * np.pi * np.diag(mobility)[3:] / (1 - 4 * np.pi / 3 * x**3)) ** (-1 / 3)
    np.testing.assert_allclose(own, a * fit.rotation ** (-1 / 3), rtol=1e-3)


def brenner(a: float, height: float) -> float:
    """The mobility towards a no-slip wall over that far from it (Brenner 1961): an exact series."""
    angle, n = np.arccosh(height / a), np.arange(1, 60)
    above = 2 * np.sinh((2 * n + 1) * angle) + (2 * n + 1) * np.sinh(2 * angle)
    below = 4 * np.sinh((n + 0.5) * angle) ** 2 - (2 * n + 1) ** 2 * np.sinh(angle) ** 2
    terms = n * (n + 1) / ((2 * n - 1) * (2 * n + 3)) * (above / below - 1)
    return 1.0 / float(4 / 3 * np.sinh(angle) * terms.sum())


def test_a_sphere_near_a_wall():
    """Towards a no-slip wall by Brenner's series, along it by Faxen's; its surface is three cells from the wall."""
    a, height = 4.0, 7.0
    points = fitted((a, a, a), "bspline4", SPACING, False).markers
    found = resistance(NoSlipWall(1.0), "bspline4", points, np.array([0.3, 0.1, height]))
    mobility, x = np.diag(np.linalg.inv(found))[:3] * 6 * np.pi * a, a / height
    assert mobility[2] == pytest.approx(brenner(a, height), rel=0.01)
    along = 1 - 9 / 16 * x + x**3 / 8 - 45 / 256 * x**4 - x**5 / 16
    np.testing.assert_allclose(mobility[:2], along, rtol=0.01)


def test_an_ellipsoid_has_its_mean_mobility():
    """And each axis to a percent; turning about the long one is off by what the fit tells."""
    axes = np.array([6.0, 4.0, 3.0])
    fit = fitted((6.0, 4.0, 3.0), "bspline4", SPACING, False)
    found, known = np.linalg.inv(resistance(FreeSpace(1.0), "bspline4", fit.markers)), ellipsoid(axes, 1.0)
    ratio = np.diag(found)[:3] * known.translation
    assert np.sum(np.diag(found)[:3]) == pytest.approx(np.sum(1 / known.translation), rel=1e-3)
    np.testing.assert_allclose(ratio, 1.0, atol=0.01)
    np.testing.assert_allclose(np.diag(found)[3:] * known.rotation, fit.rotation, rtol=5e-3)
