"""Fields above a wall in a window, for output.

Above a plane that the fluid sticks to the velocity alone: that of free space, of folded stencils, and that of images,
whose sums over heights are convolutions with the nodes' box turned upside down (formulas: grid/wall_fft.py). Along a
plane without friction all that free space has, of the nodes and of their images.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import fft

from ...grid.spreading import Stencil, mirrored, spread
from ...grid.wall_tables import ODD, images
from .free_fields import FreeFields


class MirrorFields(FreeFields):
    """Those of free space, of nodes and of their images."""

    def evaluate(
        self, base: np.ndarray, weights: np.ndarray, force: np.ndarray, time: float, names: Sequence[str]
    ) -> dict[str, np.ndarray]:
        """The fields in ``names`` that nodal forces (n, 3) drive."""
        image = mirrored(Stencil(base, weights))
        both = np.concatenate([base, image.base]), np.concatenate([weights, image.weights])
        return super().evaluate(*both, np.concatenate([force, force * [1.0, 1.0, -1.0]]), time, names)


class WallFields(FreeFields):
    """The velocity above a plane that the fluid sticks to."""

    def _far(self, base: np.ndarray, points: int) -> np.ndarray:
        """None: images have a closed form at any distance, and folded stencils are no clouds about a place."""
        return np.zeros(len(base), bool)

    def _convolved(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray, parts: int) -> np.ndarray:
        """That of free space, and images by the same kind of convolution."""
        out = super()._convolved(base, weights, force, parts)
        start = base.min(axis=0)
        extents = base.max(axis=0) - start + weights.shape[2]
        cells = [fft.next_fast_len(int(n), real=True) for n in self._window.cells + extents - 1]
        raised = weights.copy()
        raised[:, 2] *= base[:, 2:] + np.arange(weights.shape[2])
        plain, lifted = (self._turned(base - start, w, force, cells, int(extents[2])) for w in (weights, raised))
        start[2] = -(start[2] + extents[2] - 1)  # distances along z are sums of heights then
        axes = [self._distances(axis, int(start[axis]), int(extents[axis]), cells[axis]) for axis in range(3)]
        (x, in_x), (y, in_y), (z, in_z) = axes
        table = images(x[:, None, None].astype(float), y[:, None].astype(float), z.astype(float))
        table *= self._scales[0] * (in_x[:, None, None] & in_y[:, None] & in_z)
        flows = np.zeros((6, *plain.shape[1:]), complex)
        for part in range(len(ODD)):
            _reflect(flows, fft.rfftn(table[part], workers=self._threads), part, plain, lifted)
        nx, ny, nz = self._window.cells
        real = fft.irfftn(flows, s=cells, axes=(1, 2, 3), workers=self._threads)[:, :nx, :ny, :nz]
        z = self._first[2] + np.arange(nz)
        out[:3] += real[:3] + z * real[3:]
        out[..., z == 0] = 0.0  # a folded stencil drops its points there
        return out

    def _turned(
        self, local: np.ndarray, weights: np.ndarray, force: np.ndarray, cells: Sequence[int], height: int
    ) -> np.ndarray:
        """The modes of forces that are spread and turned upside down in the box of so much height."""
        real = np.zeros((3, *cells))
        spread(local, weights, np.ascontiguousarray(force), real)
        real[..., :height] = real[..., :height][..., ::-1].copy()
        return fft.rfftn(real, axes=(1, 2, 3), workers=self._threads)


def _reflect(flows: np.ndarray, kernel: np.ndarray, part: int, f: np.ndarray, g: np.ndarray) -> None:
    """Adds the share of one part to ``flows`` (6, modes), P and Q; f are turned forces, g those times their heights."""
    p, q = flows[:3], flows[3:]
    if part < 3:
        p[part] += kernel * f[part]
    elif part == 3:
        p[0] += kernel * f[1]
        p[1] += kernel * f[0]
    elif part < 6:
        a = part - 4
        p[a] += kernel * g[2]
        p[2] += kernel * g[a]
        q[a] -= kernel * f[2]
        q[2] -= kernel * f[a]
    elif part < 8:
        a = part - 6
        q[a] += kernel * g[a]
        q[2] += kernel * g[2]
    elif part == 8:
        q[0] += kernel * g[1]
        q[1] += kernel * g[0]
    else:
        a = part - 9
        q[a] -= kernel * g[2]
        q[2] += kernel * g[a]
