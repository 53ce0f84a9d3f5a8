"""Fields of free space in a window of it, for output: convolutions with the exact response, whatever is asked of it.

    u = G f + R x T,      1/2 curl u = R x f + W T,      p = -2 eta R.f

of the forces f and torques T that nodes put on the points around them. Nodes whose points are all beyond the reach of
the octant from every point of the window act on it by Oseen's tensor (grid/far_pairs.py): so no table is much larger
than the window, wherever the nodes go.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import fft

from ...grid.far_pairs import far_pair, moments
from ...grid.free_space import ODD, PAIRS, PARTS, REACH, response
from ...grid.periodic_grid import Lattice
from ...grid.spreading import spread
from ...linalg.compiled import njit
from ..base import Flow
from ..velocity_gradient import curl

_ROOM = 16  # distances of the response's table are rounded up to this, so that one serves while the nodes move
_CURL = ((1, 2), (2, 0), (0, 1))  # the axes b, c of the component a of a product R x f: R_b f_c - R_c f_b


class FreeFields:
    """Evaluates velocity, vorticity (nx, ny, nz, 3) and pressure (nx, ny, nz) in a window, all single precision."""

    def __init__(self, window: Lattice, viscosity: float, flow: Flow | None, threads: int = 1) -> None:
        self._window, self._viscosity, self._flow, self._threads = window, viscosity, flow, threads
        self._first = np.rint(window.origin / window.spacing).astype(np.int64)
        self._scales = 1.0 / (viscosity * window.spacing ** np.arange(1.0, 4.0))  # of G, R and W
        self._table: tuple[tuple[int, ...], np.ndarray] | None = None  # the response last used, and its sizes

    def evaluate(
        self, base: np.ndarray, weights: np.ndarray, force: np.ndarray, time: float, names: Sequence[str]
    ) -> dict[str, np.ndarray]:
        """The fields in ``names`` that nodal forces (n, 3), or forces and torques (n, 6), drive.

        The nodes have the stencils (base, weights).
        """
        spins = "vorticity" in names or "pressure" in names
        parts = PARTS[2] if spins or force.shape[1] == 6 else PARTS[1]
        far = self._far(base, weights.shape[2])
        shape = tuple(int(n) for n in self._window.cells)
        total = np.zeros((7, *shape))  # velocity, half the vorticity, pressure over -2 eta
        if not far.all():
            total += self._convolved(base[~far], weights[~far], force[~far], parts)
        if far.any():
            centres, variances = moments(base[far], weights[far])
            first = np.concatenate([self._window.points() / self._window.spacing, centres])
            second = np.concatenate([np.zeros((len(first) - len(centres), 3)), variances])
            total += _far_flow(first, second, force[far], self._scales, np.empty(parts)).T.reshape(total.shape)
        return self._named(total, time, names)

    def _named(self, total: np.ndarray, time: float, names: Sequence[str]) -> dict[str, np.ndarray]:
        """The fields by their names, with the background flow."""
        window, flow, out = self._window, self._flow, {}
        shape = (*(int(n) for n in window.cells), 3)
        if "pressure" in names:
            out["pressure"] = (-2 * self._viscosity * total[6]).astype(np.float32)
        if "velocity" in names:
            u = np.moveaxis(total[:3], 0, -1)
            out["velocity"] = (u if flow is None else u + flow(window.points(), time).reshape(shape)).astype(np.float32)
        if "vorticity" in names:
            w = 2 * np.moveaxis(total[3:6], 0, -1)
            around = 0.0 if flow is None else curl(flow, window.points(), time, window.spacing).reshape(shape)
            out["vorticity"] = (w + around).astype(np.float32)
        return {name: np.ascontiguousarray(out[name]) for name in names}

    def _far(self, base: np.ndarray, points: int) -> np.ndarray:
        """Which nodes (n,) are REACH or more from all of the window along some axis."""
        below = self._first - (base + points - 1)
        above = base - (self._first + self._window.cells - 1)
        return np.any(np.maximum(below, above) >= REACH, axis=1)

    def _convolved(self, base: np.ndarray, weights: np.ndarray, force: np.ndarray, parts: int) -> np.ndarray:
        """Velocity, half the vorticity and R.f (7, nx, ny, nz), of nodes by a convolution from their box to the window.

        Only those made of ``parts`` of the response; the others are zero.
        """
        start = base.min(axis=0)
        extents = base.max(axis=0) - start + weights.shape[2]
        cells = [fft.next_fast_len(int(n), real=True) for n in self._window.cells + extents - 1]
        vectors = []
        for v in range(0, force.shape[1], 3):
            real = np.zeros((3, *cells))
            spread(base - start, weights, np.ascontiguousarray(force[:, v : v + 3]), real)
            vectors.append(fft.rfftn(real, axes=(1, 2, 3), workers=self._threads))
        axes = [self._distances(axis, int(start[axis]), int(extents[axis]), cells[axis]) for axis in range(3)]
        table = self._response(parts, [int(np.abs(d).max()) + 1 for d, _ in axes])
        out, scales = np.zeros((7, *vectors[0].shape[1:]), complex), np.repeat(self._scales, (6, 3, 6))
        for part in range(parts):
            # Outside of what is wanted distances mean nothing, and their mask is zero.
            kernel = scales[part] * table[part][np.ix_(*(np.abs(d) for d, _ in axes))]
            for axis, (d, inside) in enumerate(axes):
                sign = np.sign(d) if axis in ODD[part] else 1.0
                kernel *= np.expand_dims(sign * inside, tuple(a for a in range(3) if a != axis))
            _add(out, fft.rfftn(kernel, workers=self._threads), part, vectors)
        x, y, z = self._window.cells
        return fft.irfftn(out, s=cells, axes=(1, 2, 3), workers=self._threads)[:, :x, :y, :z]

    def _distances(self, axis: int, start: int, extent: int, cells: int) -> tuple[np.ndarray, np.ndarray]:
        """Distances (cells,) from the nodes' box to the window, in the order of a convolution, and which are used."""
        width = int(self._window.cells[axis])
        step = np.arange(cells)
        step = np.where(step < width, step, step - cells)
        inside = (step > -extent) & (step < width)
        return np.where(inside, int(self._first[axis]) - start + step, 0), inside

    def _response(self, parts: int, sizes: Sequence[int]) -> np.ndarray:
        """The response at distances up to ``sizes``, the one last used where it serves."""
        rounded = (parts, *(-(-n // _ROOM) * _ROOM for n in sizes))
        if self._table is None or self._table[0] != rounded:
            self._table = None  # two of them at a time would be the most of a run's memory
            self._table = rounded, response(parts, rounded[1:])
        return self._table[1]


def _add(out: np.ndarray, kernel: np.ndarray, part: int, vectors: list[np.ndarray]) -> None:
    """Adds to ``out`` (7, modes) the share of one part of the response."""
    force = vectors[0]
    if part < 6:
        a, b = PAIRS[part]
        out[a] += kernel * force[b]
        if a != b:
            out[b] += kernel * force[a]
    elif part < 9:
        r = part - 6
        out[6] += kernel * force[r]
        for a, (b, c) in enumerate(_CURL):
            if r in (b, c):
                sign, other = (1.0, c) if r == b else (-1.0, b)
                out[3 + a] += sign * kernel * force[other]
                if len(vectors) > 1:
                    out[a] += sign * kernel * vectors[1][other]
    elif len(vectors) > 1:
        a, b = PAIRS[part - 9]
        out[3 + a] += kernel * vectors[1][b]
        if a != b:
            out[3 + b] += kernel * vectors[1][a]


@njit(cache=True)
def _far_flow(first, second, force, scales, sums):
    """The same (k, 7) at the first k of places ``first`` that the others, nodes with variances ``second``, drive."""
    n, vectors = force.shape[0], force.shape[1] // 3
    out = np.zeros((first.shape[0] - n, 7))
    for i in range(out.shape[0]):
        for q in range(n):
            far_pair(first, second, i, out.shape[0] + q, scales, sums)
            f = force[q, :3]
            out[i, 0] += sums[0] * f[0] + sums[3] * f[1] + sums[4] * f[2]
            out[i, 1] += sums[3] * f[0] + sums[1] * f[1] + sums[5] * f[2]
            out[i, 2] += sums[4] * f[0] + sums[5] * f[1] + sums[2] * f[2]
            if len(sums) > 6:
                x, y, z = sums[6], sums[7], sums[8]
                out[i, 3] += y * f[2] - z * f[1]
                out[i, 4] += z * f[0] - x * f[2]
                out[i, 5] += x * f[1] - y * f[0]
                out[i, 6] += x * f[0] + y * f[1] + z * f[2]
            if vectors > 1:
                t = force[q, 3:]
                out[i, 0] += y * t[2] - z * t[1]
                out[i, 1] += z * t[0] - x * t[2]
                out[i, 2] += x * t[1] - y * t[0]
                out[i, 3] += sums[9] * t[0] + sums[12] * t[1] + sums[13] * t[2]
                out[i, 4] += sums[12] * t[0] + sums[10] * t[1] + sums[14] * t[2]
                out[i, 5] += sums[13] * t[0] + sums[14] * t[1] + sums[11] * t[2]
    return out
