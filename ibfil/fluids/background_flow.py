"""A background flow that is maintained on the grid of a fluid with inertia."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..grid.fft import ESTIMATED, VectorTransform
from ..grid.periodic_grid import Grid
from ..grid.spectral import curl
from .advection import filters
from .base import Flow, Part

FIELDS = 6  # that are transformed together: velocity and vorticity


def factors_of(parts: Sequence[Part], time: float) -> tuple[float, ...]:
    """Those of the parts at ``time``."""
    return tuple(1.0 if part.factor is None else float(part.factor(time)) for part in parts)


def combined(factors: Sequence[float], fields: Sequence[np.ndarray], out: np.ndarray) -> np.ndarray:
    """The sum of ``fields`` (6, ..), each times its factor, in ``out``: component by component, as memory is slow."""
    for x in range(FIELDS):
        np.multiply(fields[0][x], factors[0], out=out[x])
        for factor, field in zip(factors[1:], fields[1:], strict=True):
            out[x] += factor * field[x]
    return out


class Background:
    """A maintained flow on the grid, filtered like what it is multiplied with.

    Where ``parts`` are known that it is the sum of, each is put on the grid once; else it is at each step.
    """

    def __init__(self, grid: Grid, flow: Flow, parts: Sequence[Part] | None, threads: int = 1) -> None:
        self._grid, self._flow, self._threads, self._parts = grid, flow, threads, parts
        self._fields = [self._filtered(part.place(grid.points())) for part in parts or ()]
        self._known: tuple[float, np.ndarray] | None = None

    def at(self, time: float) -> np.ndarray:
        """Velocity and vorticity (6, nx, ny, nz) at ``time``; overwritten by the next call."""
        if self._known is None or self._known[0] != time:
            self._known = time, self._sum(time)
        return self._known[1]

    def _sum(self, time: float) -> np.ndarray:
        if self._parts is None:
            return self._filtered(self._flow(self._grid.points(), time))
        if len(self._parts) == 1 and self._parts[0].factor is None:
            return self._fields[0]
        out = np.empty_like(self._fields[0]) if self._known is None else self._known[1]
        return combined(factors_of(self._parts, time), self._fields, out)

    def _filtered(self, velocity: np.ndarray) -> np.ndarray:
        """Velocity and vorticity of a velocity at the grid's points (k, 3)."""
        nx, ny, nz = (int(n) for n in self._grid.cells)
        transform = VectorTransform((nx, ny, nz), self._threads, ESTIMATED, FIELDS)
        transform.real[:3] = velocity.T.reshape(3, nx, ny, nz)
        fx, fy, fz = filters(self._grid)
        modes = transform.forward()
        modes[:3] *= fx[:, None, None] * fy[:, None] * fz
        curl(modes, *self._grid.wave_numbers()[0])
        return transform.backward(FIELDS) / transform.size
