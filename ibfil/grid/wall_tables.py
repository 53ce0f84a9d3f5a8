"""The image that a no-slip plane makes of a force, as tables that stencils are summed over, and in closed form.

Above the plane z = 0 the response to a force is that of free space and Blake's image C (1971, Proc. Camb. Phil. Soc.
70, 303). With a, b horizontal and (X, Y, Z) = R = (x - x', y - y', z + z'), h = eta = 1, it may be written so that
heights stand outside of functions of R,

    C_ab = T0_ab + z z' T2_ab          T0 = -(1/R + R R/R^3)/(8 pi)       T2_ab = -2 (d_ab/R^3 - 3 R_a R_b/R^5)/(8 pi)
    C_zz = T0_zz + z z' T2_zz                                             T2_zz = T2_xx + T2_yy
    C_za = (z' - z) T1_a + z z' t_a    T1_a = R_a/R^3/(8 pi)              t_a = 6 R_a Z/R^5/(8 pi)
    C_az = (z' - z) T1_a - z z' t_a

so that pairs of stencils, and convolutions, need tables of R alone. Each is even or odd in X and in Y. G + C is zero on
the plane as far as G is Oseen's tensor; a stencil is folded there (fluids/spaces/wall.py).
"""

from __future__ import annotations

import numpy as np

from ..linalg.compiled import njit
from .free_space import REACH, RIM

# The parts are T0 xx yy zz xy, T1 x y, T2 xx yy xy, t x y; and these are the axes along which each is odd.
ODD = ((), (), (), (0, 1), (0,), (1,), (), (), (0, 1), (0,), (1,))
HIGH = 2 * REACH  # sums of heights 0 .. HIGH - 1 are in the octant


def images(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """The parts (11, ...) at (X, Y, Z), which broadcast; zero for Z < 2, where folded stencils have no weights."""
    square = np.where(z < 2, np.inf, x * x + y * y + z * z)
    one = 1.0 / (8 * np.pi * np.sqrt(square))
    three = one / square
    five = three / square
    parts = (
        -(one + x * x * three),
        -(one + y * y * three),
        -(one + z * z * three),
        -x * y * three,
        x * three,
        y * three,
        -2 * (three - 3 * x * x * five),
        -2 * (three - 3 * y * y * five),
        6 * x * y * five,
        6 * x * z * five,
        6 * y * z * five,
    )
    return np.stack(np.broadcast_arrays(*parts))


def octant(rim: int, scale: float = 1.0, number: type = np.float64) -> np.ndarray:
    """The octant (x, y, z, part) of distances below REACH, with a rim on both sides, and sums of heights below HIGH.

    Times ``scale``. Plane by plane, as getting fresh memory for the whole takes longer than all that is done with it.
    """
    j, z = np.arange(-rim, REACH + rim, dtype=float), np.arange(HIGH + 2 * RIM, dtype=float)
    out: np.ndarray = np.empty((len(j), len(j), len(z), len(ODD)), number)
    for plane, x in zip(out, j[:, None, None], strict=True):
        plane[:] = scale * np.moveaxis(images(x, j[:, None], z), 0, 2)
    return out


@njit(cache=True, inline="always")
def image(x, y, p, q, weight, sums):
    """Adds to ``sums`` (8,) the image of a force at height q seen at height p: xx yy zz xy zx zy xz yz."""
    z, both, apart = p + q, p * q, q - p
    square = x * x + y * y + z * z
    one = weight / (8 * np.pi * np.sqrt(square))
    three = one / square
    five = 6 * both * three / square
    two = 2 * both * three
    sums[0] += five * x * x - one - x * x * three - two
    sums[1] += five * y * y - one - y * y * three - two
    sums[2] += two - five * z * z - one - z * z * three
    sums[3] += (five - three) * x * y
    sums[4] += (apart * three + five * z) * x
    sums[5] += (apart * three + five * z) * y
    sums[6] += (apart * three - five * z) * x
    sums[7] += (apart * three - five * z) * y


@njit(cache=True, inline="always")
def oseen(x, y, z, weight, sums):
    """Adds to ``sums`` (8,), in that order, ``weight`` times Oseen's tensor."""
    square = x * x + y * y + z * z
    one = weight / (8 * np.pi * np.sqrt(square))
    three = one / square
    sums[0] += one + x * x * three
    sums[1] += one + y * y * three
    sums[2] += one + z * z * three
    sums[3] += x * y * three
    for k in (4, 6):
        sums[k] += x * z * three
        sums[k + 1] += y * z * three
