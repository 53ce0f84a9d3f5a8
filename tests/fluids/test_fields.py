"""Fields for output: against the table, against differences, and against each other."""

import numpy as np
import pytest

from ibfil.fluids.fields import GridFields
from ibfil.fluids.spaces.periodic import PeriodicSpace
from ibfil.grid.kernels import PESKIN4
from ibfil.grid.periodic_grid import Grid

CELLS, BOX = (20, 24, 18), (2.0, 2.4, 1.8)


@pytest.fixture
def pushed():
    rng = np.random.default_rng(3)
    grid = Grid(BOX, CELLS)
    r, force = rng.uniform(-0.8, 0.8, (6, 3)), rng.standard_normal((6, 3))
    return grid, r, force, PESKIN4.stencil(grid.coordinates(r))


def _slope(field, axis, spacing):
    """The exact derivative of a periodic field along one axis, by an FFT of that axis alone."""
    n = field.shape[axis]
    k = 2 * np.pi * np.fft.fftfreq(n, spacing)
    k[n // 2] = 0.0
    shape = [1] * field.ndim
    shape[axis] = n
    return np.fft.ifft(1j * k.reshape(shape) * np.fft.fft(field, axis=axis), axis=axis).real


def test_fields_do_not_depend_on_what_else_is_asked_for(pushed):
    grid, _, force, stencil = pushed
    names = ["pressure", "vorticity", "velocity"]
    together = GridFields(grid, 0.7, None).evaluate(*stencil, force, 0.0, names)
    for name in names:
        alone = GridFields(grid, 0.7, None).evaluate(*stencil, force, 0.0, [name])
        assert list(alone) == [name]
        assert np.array_equal(alone[name], together[name])


def test_the_fields_satisfy_stokes_equation(pushed):
    """eta Lap u - grad p + f = mean f, div u = 0, omega = curl u, all with spectral derivatives."""
    grid, _, force, (base, weights) = pushed
    fields = GridFields(grid, 0.7, None).evaluate(base, weights, force, 0.0, ["velocity", "vorticity", "pressure"])
    u, w, p = (np.asarray(fields[k], float) for k in ("velocity", "vorticity", "pressure"))
    h, single = grid.spacing, 1e-5
    grad = np.stack([[_slope(u[..., c], a, h) for a in range(3)] for c in range(3)])
    size = np.abs(grad).max()
    assert np.abs(grad[0, 0] + grad[1, 1] + grad[2, 2]).max() < single * size
    curl = np.stack([grad[2, 1] - grad[1, 2], grad[0, 2] - grad[2, 0], grad[1, 0] - grad[0, 1]], axis=-1)
    assert np.abs(curl - w).max() < single * size
    density = np.zeros((3, *CELLS))
    for q in range(len(base)):
        for i in range(4):
            for j in range(4):
                for k in range(4):
                    at = tuple((base[q] + (i, j, k)) % CELLS)
                    density[(slice(None), *at)] += weights[q, 0, i] * weights[q, 1, j] * weights[q, 2, k] * force[q]
    density /= h**3
    for c in range(3):
        laplacian = np.zeros(CELLS)
        for axis in range(3):
            n = CELLS[axis]
            k = 2 * np.pi * np.fft.fftfreq(n, h)
            shape = [1, 1, 1]
            shape[axis] = n
            laplacian += np.fft.ifft(-(k.reshape(shape) ** 2) * np.fft.fft(u[..., c], axis=axis), axis=axis).real
        residual = 0.7 * laplacian - _slope(p, c, h) + density[c] - density[c].mean()
        assert np.abs(residual).max() < 1e-4 * np.abs(density).max()


def test_a_background_flow_is_added_to_velocity_and_vorticity(pushed):
    grid, _, force, stencil = pushed

    def shear(r, t):
        return np.stack([2.0 * r[:, 1] + t, np.zeros(len(r)), np.zeros(len(r))], axis=1)

    names = ["velocity", "vorticity"]
    still = GridFields(grid, 0.7, None).evaluate(*stencil, force, 1.5, names)
    moving = GridFields(grid, 0.7, shear).evaluate(*stencil, force, 1.5, names)
    y = grid.origin[1] + grid.spacing * np.arange(CELLS[1])
    assert np.allclose((moving["velocity"] - still["velocity"])[..., 0], (2 * y + 1.5)[None, :, None], atol=1e-5)
    assert np.allclose((moving["vorticity"] - still["vorticity"])[..., 2], -2.0, atol=1e-4)


def test_probes_see_what_a_node_there_would_feel(pushed):
    """The table's velocity at a probe is the field interpolated with the same kernel."""
    from ibfil.fluids.immersed_boundary import Immersed
    from ibfil.fluids.stokes import StokesByTable
    from ibfil.grid.spreading import interpolate

    grid, r, force, stencil = pushed
    points = np.array([[0.0, 0.1, 0.0], [0.9, -1.1, 0.7]])
    fluid = StokesByTable(Immersed(PeriodicSpace.of(grid), PESKIN4, 0.7, np.full(len(r), 0.3), None))
    found = fluid.velocity_at(points, r, np.zeros_like(r), force, 0.0)
    u = GridFields(grid, 0.7, None).evaluate(*stencil, force, 0.0, ["velocity"])["velocity"]
    expected = interpolate(*PESKIN4.stencil(grid.coordinates(points)), np.moveaxis(u, -1, 0).astype(float))
    assert np.allclose(found, expected, atol=1e-6 * np.abs(u).max())
