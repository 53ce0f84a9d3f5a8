"""Roots of the mobility: random motions of nodes with the covariance M, for thermal forces.

    dense     M = L L^T,  xi = L w                       where a response has the exact matrix, or factors it anyway
    spectral  v = irfftn( rfftn(w) P/sqrt(eta K^2 h^3) ),  xi = J v + sqrt(own) w'            on a periodic grid

w is white, on the grid in the second, where P is the projection and K^2 the true square of the wave number
(grid/spectral.py): E v v^T = L^-1, as the symbol is real, even, and P is its own square. White noise transformed
forward gives the right modes everywhere, planes of the Nyquist wave numbers among them. The spin of nodes, where
torques go through the grid, is that of the same v.
"""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np

from ..errors import StepFailed
from ..grid.fft import VectorTransform
from ..grid.periodic_grid import Grid
from ..grid.spectral import half_curl, project_root
from ..grid.spreading import interpolate
from ..linalg.lapack import dpotrf
from ..linalg.normal_numbers import Draw, Purpose
from .coupling import Coupling, Nodes


class NoRoot(StepFailed):
    """The mobility is not positive definite: nodes are nearer to each other than the fluid can move them apart."""


class Root(Protocol):
    """A way to draw random motions."""

    def motion(self, nodes: Nodes, draw: Draw) -> np.ndarray:
        """Random motions (n, c) of mean zero and covariance M. Raises NoRoot."""


class DenseRoot:
    """The Cholesky factor of the exact matrix (c n, c n)."""

    def __init__(self, matrix: np.ndarray) -> None:
        self._matrix = matrix

    @cached_property
    def _factor(self) -> np.ndarray:
        factor, bad = dpotrf(self._matrix, lower=True, clean=True)
        if bad:
            raise NoRoot("the mobility of the nodes is not positive, so that thermal motion has no root of it", 0)
        return factor

    def motion(self, nodes: Nodes, draw: Draw) -> np.ndarray:
        """L w, w in the order of nodes."""
        return (self._factor @ draw(Purpose.MOTION, (len(self._factor),))).reshape(len(nodes.axes), -1)


class SpectralRoot:
    """White noise on a periodic grid, filtered by the root of the Stokes solve's symbol; ``own`` (n, c) is apart."""

    def __init__(self, grid: Grid, viscosity: float, coupling: Coupling, own: np.ndarray, threads: int = 1) -> None:
        nx, ny, nz = (int(n) for n in grid.cells)
        self._coupling, self._own, self._viscosity = coupling, np.sqrt(own), viscosity
        self._transform = VectorTransform((nx, ny, nz), threads, fields=3 * coupling.grid_vectors)
        self._k, (sx, sy, sz) = grid.wave_numbers()
        kx, ky, kz = self._k
        self._waves = (kx, ky, np.repeat(kz, 2), sx, sy, np.repeat(sz, 2))
        self._scale = 1.0 / (self._transform.size * grid.spacing**1.5)

    def motion(self, nodes: Nodes, draw: Draw) -> np.ndarray:
        """Off the grid, and each node's own."""
        t, vectors = self._transform, self._coupling.grid_vectors
        t.real[:3] = draw(Purpose.MOTION, t.real[:3].shape)
        t.forward()
        project_root(t.modes[:3].view(float), *self._waves, self._viscosity, self._scale)
        if vectors == 2:
            t.modes[3:] = 0.0
            half_curl(t.modes[:3], *self._k, t.modes[3:])
        t.backward(3 * vectors)
        fields = (t.real[3 * v : 3 * v + 3] for v in range(vectors))
        moved = np.hstack([interpolate(nodes.base, nodes.weights, field) for field in fields])
        return self._coupling.from_grid(nodes.axes, moved) + self._own * draw(Purpose.OWN, self._own.shape)
