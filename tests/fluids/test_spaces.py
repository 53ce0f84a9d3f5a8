"""The contract of a space (fluids/spaces/base.py), held against every one: a new space is one line of SPACES."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.fluids.coupling import TRANSLATION, Coupling, Nodes
from ibfil.fluids.spaces.base import Space
from ibfil.fluids.spaces.free import FreeSpace
from ibfil.fluids.spaces.periodic import PeriodicSpace
from ibfil.fluids.spaces.wall import FreeSlipWall, NoSlipWall
from ibfil.fluids.torque_coupling import TorqueCoupling
from ibfil.grid.kernels import KERNELS

COUNT = 7
SPACES: dict[str, Space] = {
    "periodic": PeriodicSpace((1.2, 1.4, 1.6), (12, 14, 16)),
    "free": FreeSpace(0.1),
    "no-slip wall": NoSlipWall(0.1),
    "free-slip wall": FreeSlipWall(0.1),
}
EACH = pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)


def couplings(space: Space) -> list[Coupling]:
    """Those that a space has responses to: torques have no image in a wall."""
    torques = [] if isinstance(space, (NoSlipWall, FreeSlipWall)) else [TorqueCoupling(np.ones(COUNT), np.ones(COUNT))]
    return [TRANSLATION, *torques]


def nodes_in(space: Space, kernel: str = "peskin4", seed: int = 0, spread: float = 0.4) -> Nodes:
    """Nodes that lie anywhere above the plane z = 0, with unit axes."""
    rng = np.random.default_rng(seed)
    axes = rng.standard_normal((COUNT, 3))
    r = rng.uniform(-spread, spread, (COUNT, 3)) + np.array([0, 0, spread])
    return Nodes(*space.stencil(KERNELS[kernel], r), axes / np.linalg.norm(axes, axis=1)[:, None])


@EACH
def test_the_matrix_is_symmetric_to_the_last_bit_and_positive_with_own_on_its_diagonal(space):
    for coupling in couplings(space):
        own = coupling.own(np.linspace(0.5, 1.0, COUNT))
        mobility, nodes = space.mobility(coupling, 4, 0.7, 0.0, np.float64), nodes_in(space)
        bare = mobility.matrix(nodes, np.zeros_like(own))
        assert np.array_equal(bare, bare.T)
        assert np.linalg.eigvalsh(bare).min() > 0
        assert mobility.matrix(nodes, own) == pytest.approx(bare + np.diag(own.ravel()), rel=1e-14, abs=0)


@EACH
def test_blocks_are_parts_of_the_matrix(space):
    rows, columns = np.array([5, 0, 3]), np.array([3, 6])
    for coupling in couplings(space):
        c, own = coupling.components, coupling.own(np.linspace(0.5, 1.0, COUNT))
        mobility, nodes = space.mobility(coupling, 6, 0.7, 0.0, np.float64), nodes_in(space, "bkp6", 1)
        part = mobility.matrix(nodes, own).reshape(COUNT, c, COUNT, c)[rows][:, :, columns].reshape(3 * c, 2 * c)
        assert np.abs(mobility.block(nodes, own, rows, columns) - part).max() < 1e-14 * part.max()


@EACH
def test_coordinates_are_in_spacings_and_stencils_add_up_to_one(space):
    r = np.array([[0.1, 0.2, 0.4], [-0.1, 0.3, 0.35]])
    away = space.coordinates(r[1:]) - space.coordinates(r[:1])
    assert away * space.spacing == pytest.approx(r[1:] - r[:1], abs=1e-13)
    base, weights = space.stencil(KERNELS["es6"], r)
    assert weights.sum(axis=2) == pytest.approx(np.ones((2, 3)), abs=1e-14)
    assert base.dtype == np.int64


@EACH
def test_half_the_viscosity_doubles_and_single_precision_rounds(space):
    nodes, own = nodes_in(space), np.zeros((COUNT, 3))
    one = space.mobility(TRANSLATION, 4, 1.0, 0.0, np.float64).matrix(nodes, own)
    assert space.mobility(TRANSLATION, 4, 0.5, 0.0, np.float64).matrix(nodes, own) == pytest.approx(2 * one, rel=1e-13)
    rounded = space.mobility(TRANSLATION, 4, 1.0, 0.0, np.float32).matrix(nodes, own)
    assert 0 < np.abs(rounded - one).max() < 1e-6 * one.max()
