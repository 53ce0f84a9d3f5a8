"""Advection: rho omega x u, projected and filtered, of flows alone and in a background that is maintained."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.inertial_fluid import FAR, ZERO, advection, begin, felt, fluid, places, smooth, waves

from ibfil.fluids.navier_stokes import NavierStokes


def omega_cross_u(it: NavierStokes, u: np.ndarray) -> np.ndarray:
    """P (omega x u) by modes, on a grid twice as fine, where no product is aliased onto those of u's grid."""
    cells, length = it.grid.cells, it.grid.box
    fine = [2 * int(n) for n in cells]
    wide = np.zeros((3, fine[0], fine[1], fine[2] // 2 + 1), complex)
    x, y, z = ((n - 1) // 2 for n in cells)
    pick = np.ix_(range(3), np.r_[0 : x + 1, -x:0], np.r_[0 : y + 1, -y:0], np.arange(z + 1))
    wide[pick] = (np.fft.rfftn(u, axes=(1, 2, 3)) / np.prod(cells))[pick]
    frequencies = (np.fft.fftfreq, np.fft.fftfreq, np.fft.rfftfreq)
    kx, ky, kz = (2 * np.pi * f(n, a / n) for f, n, a in zip(frequencies, fine, length, strict=True))
    k = np.stack(np.broadcast_arrays(kx[:, None, None], ky[:, None], kz))

    def real(m):
        return np.fft.irfftn(m, fine, axes=(1, 2, 3)) * np.prod(fine)

    product = np.cross(real(1j * np.cross(k, wide, axis=0)), real(wide), axis=0)
    there = np.fft.rfftn(product, axes=(1, 2, 3)) / np.prod(fine)
    square = np.sum(k * k, axis=0)
    there -= k * np.sum(k * there, axis=0) / np.where(square > 0, square, 1.0)
    out = np.zeros((3, *smooth(it).shape), complex)
    out[pick] = there[pick]
    return out


@pytest.mark.parametrize("cells", [(16, 16, 16), (15, 18, 12)])
def test_advection_is_omega_cross_u_projected_and_filtered(cells):
    it = fluid(cells, density=2.3)
    u = waves(it)
    begin(it, u)
    expected = 2.3 * smooth(it) * omega_cross_u(it, u)
    assert np.abs(expected).max() > 0.01
    assert np.abs(advection(it) - expected).max() < 1e-13
    assert not advection(it)[:, :, :, -1].any() or np.abs(advection(it)[:, :, :, -1]).max() < 1e-15


def test_aliases_of_a_field_as_rods_make_it_are_few():
    """Of a point force's flow, which has all modes: against the same without aliases."""
    it = fluid((32, 32, 32), viscosity=1.0)
    response = it.response(FAR, ZERO, 0.0, 1e6)
    it.advance(response, ZERO, np.array([[30.0, -10.0, 20.0]]))
    u = np.fft.irfftn(it.history.now * smooth(it), it.grid.cells, axes=(1, 2, 3)) * 32**3
    expected = smooth(it) * omega_cross_u(it, u)
    wrong, size = np.linalg.norm(advection(it) - expected), np.linalg.norm(expected)
    assert 1e-3 * size < wrong < 0.03 * size


def test_advection_does_no_work_and_moves_no_mean():
    it = fluid()
    u = waves(it)
    begin(it, u)
    n = np.fft.irfftn(advection(it), it.grid.cells, axes=(1, 2, 3)) * it.workspace.flow.size
    assert np.abs(np.sum(u * n)) < 1e-12 * np.sum(np.abs(u * n))
    assert np.abs(n.mean(axis=(1, 2, 3))).max() < 1e-17
    assert it.fastest == pytest.approx(np.abs(u).max(), rel=1e-12)
    assert it.longest_step() == pytest.approx(it.grid.spacing / np.abs(u).max(), rel=1e-12)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_background_flow_advects_and_is_advected(seed):
    """N(U + u) - N(U), each by the fluid that has no background."""
    flow = lambda r, t: np.stack([0.4 + np.sin(r[:, 1]), 0.2 + 0 * r[:, 0], np.cos(r[:, 0] - r[:, 1] + t)], axis=1)  # noqa: E731
    it, plain = fluid(flow=flow), fluid()
    x, y, _ = places(it)
    u, background = waves(it, seed), np.stack([0.4 + np.sin(y), 0.2 + 0 * x, np.cos(x - y)])
    begin(it, u)
    begin(plain, background, background + u)
    expected = felt(plain, 1.0, -1.0)
    assert np.abs(expected).max() > 0.01
    assert np.abs(advection(it) - expected).max() < 1e-14
    assert it.fastest == pytest.approx(np.abs(background + u).max())
