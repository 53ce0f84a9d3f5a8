"""Discrete delta kernels: how a node is spread over the grid points around it, one axis at a time.

A kernel of P points gives weights phi(x_k) at the grid points nearest to a node; the weights of the three axes
multiply. The physical radii of each kernel were measured with the Fourier Stokes operator of this package, and
tests/grid/test_kernels.py measures them again. In units of the grid spacing h, to a part in 1000:

point radius   of the sphere that moves like one node. The mean of the self mobility over 512 places of the node
               in a cell is U/F = (1 - 2.837297 a/L + 4.18879 (a/L)^3 - 27.4 (a/L)^6)/(6 pi eta a) in a periodic
               box of side L (Hasimoto 1959, J. Fluid Mech. 5, 317); the same a for L/h = 16, 32 and 64.
line radius    of the cylinder that moves like a straight row of nodes. A row along a grid axis, one node a cell,
               through the whole box; the mean of its mobility per length over 256 places across the row is
               [ln(L/a) - ln(Gamma(1/4)^2/(2 sqrt(pi)))]/(2 pi eta) along it and half that across it (a square
               array of cylinders), extrapolated in (h/L)^2 to a large box. So thick is a rod on the grid.
translation    largest less smallest self mobility over the places, times 6 pi eta a: how a node feels the grid.

The radii published for staggered finite differences (1.25 and 1.47 for peskin4 and bkp6) do not hold here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .spreading import Stencil


@dataclass(frozen=True)
class Kernel:
    """One kernel; ``weights(x)`` is phi at the distances x (..., P) of all P grid points from the node. Radii in h."""

    name: str
    points: int
    weights: Callable[[np.ndarray], np.ndarray]
    point_radius: float
    line_radius: float
    translation_error: float

    def stencil(self, position: np.ndarray) -> Stencil:
        """First grid index (n, 3) and weights (n, 3, P) of positions (n, 3) in units of the spacing."""
        shift = self.points // 2 - 1 if self.points % 2 == 0 else self.points // 2
        near = np.floor(position if self.points % 2 == 0 else position + 0.5)
        x = np.arange(self.points) - shift - (position - near)[..., None]
        return Stencil(near.astype(np.int64) - shift, self.weights(x))

    @property
    def twist_radius(self) -> float:
        """Radius of the cylinder that a spinning line feels like: 1/(C sqrt(pi)), C = mean of sum phi^2."""
        offsets = (np.arange(64) + 0.5) / 64
        _, w = self.stencil(np.stack([offsets] * 3, axis=1))
        return 1.0 / (float(np.mean(np.sum(w[:, 0] ** 2, axis=-1))) * float(np.sqrt(np.pi)))


def _roma3(x: np.ndarray) -> np.ndarray:
    """Roma, Peskin & Berger 1999, J. Comput. Phys. 153, 509, Eq. 22. Even and odd sums differ."""
    r = np.abs(x)
    near = (1 + np.sqrt(np.maximum(1 - 3 * r * r, 0))) / 3
    far = (5 - 3 * r - np.sqrt(np.maximum(1 - 3 * (1 - r) ** 2, 0))) / 6
    return np.where(r < 0.5, near, far)


def _peskin4(x: np.ndarray) -> np.ndarray:
    """Peskin 2002, Acta Numerica 11, 479, Eq. 6.27; beyond one, of r, the branch is the other one at 2 - r."""
    within = 1.0 - np.abs(x)
    r = 1.0 - np.abs(within)
    return 0.25 + np.copysign(0.125, within) * (1.0 - 2.0 * r + np.sqrt(1.0 + 4.0 * r * (1.0 - r)))


def _bspline4(x: np.ndarray) -> np.ndarray:
    """The cubic B-spline (Schoenberg 1946); as a kernel, Lee & Griffith 2022, J. Comput. Phys. 457, 111042."""
    r = np.abs(x)
    return np.where(r < 1, 2 / 3 - r * r + 0.5 * r**3, (2 - r) ** 3 / 6)


def _bspline6(x: np.ndarray) -> np.ndarray:
    """The quintic B-spline; sources as for the cubic one."""
    r = np.abs(x)
    value = (3 - r) ** 5
    value = value - np.where(r < 2, 6 * (2 - r) ** 5, 0)
    return (value + np.where(r < 1, 15 * (1 - r) ** 5, 0)) / 120


_K = 59 / 60 - np.sqrt(29) / 20  # the second moment that makes bkp6 three times differentiable


def _bkp6(x: np.ndarray) -> np.ndarray:
    """The Gaussian-like 6-point kernel of Bao, Kaye & Peskin 2016, J. Comput. Phys. 316, 139.

    Its conditions (even and odd sums 1/2, first and third moments 0, second moment K, sum of squares constant)
    leave a quadratic for the outermost value phi(r - 3), 0 <= r < 1; the others are linear in it.
    """
    cell = np.minimum(np.floor(np.abs(x)), 2)
    r = np.abs(x) - cell
    b = 9 / 4 - 1.5 * (_K + r * r) + (22 / 3 - 7 * _K) * r - 7 / 3 * r**3
    c = (161 / 36 - 59 / 6 * _K + 5 * _K**2) * r**2 / 8 + (5 * _K - 109 / 24) * r**4 / 12 + 5 / 72 * r**6
    outer = (np.sqrt(np.maximum(b * b - 112 * c, 0)) - b) / 56  # phi(r - 3)
    here = 2 * outer + 5 / 8 - (_K + r * r) / 4
    one = 1 / 4 - 3 * outer - ((4 - 3 * _K) * r - r**3) / 6
    two = outer - 1 / 16 + (_K + r * r) / 8 - ((3 * _K - 1) * r + r**3) / 12
    return np.where(cell == 0, here, np.where(cell == 1, one, two))


def _semicircle(beta: float) -> Callable[[np.ndarray], np.ndarray]:
    """Exponential of semicircle: exp(beta P sqrt(1 - (2 x/P)^2)) over the sum of these for the node's P points.

    Barnett, Magland & af Klinteberg 2019, SIAM J. Sci. Comput. 41, C479; the betas here are those of Hashemi et
    al. 2023, J. Chem. Phys. 158, 154101. They divide by the integral; dividing by the sum makes the weights add up
    to one, so that the grid gets the whole force. At its rim the kernel drops to zero from exp(-beta P).
    """

    def weights(x: np.ndarray) -> np.ndarray:
        points = x.shape[-1]
        value = np.exp(beta * points * (np.sqrt(np.maximum(1 - (2 * x / points) ** 2, 0)) - 1))
        return value / value.sum(axis=-1, keepdims=True)

    return weights


ROMA3 = Kernel("roma3", 3, _roma3, 0.987, 0.831, 5.3e-2)
PESKIN4 = Kernel("peskin4", 4, _peskin4, 1.313, 1.105, 1.5e-2)
BSPLINE4 = Kernel("bspline4", 4, _bspline4, 1.034, 0.873, 4.8e-2)
BSPLINE6 = Kernel("bspline6", 6, _bspline6, 1.263, 1.066, 5.0e-3)
BKP6 = Kernel("bkp6", 6, _bkp6, 1.520, 1.281, 5.8e-4)
ES4 = Kernel("es4", 4, _semicircle(1.785), 1.204, 1.015, 8.7e-3)
ES5 = Kernel("es5", 5, _semicircle(1.886), 1.343, 1.133, 1.6e-3)
ES6 = Kernel("es6", 6, _semicircle(1.714), 1.553, 1.311, 3.4e-4)

KERNELS = {k.name: k for k in (ROMA3, PESKIN4, BSPLINE4, BSPLINE6, BKP6, ES4, ES5, ES6)}
