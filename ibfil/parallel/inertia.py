"""The share of a process in a fluid with inertia: its past by rows of modes, its background flow by planes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..fluids.advection import cross, cross_in, filters
from ..fluids.background_flow import FIELDS, combined
from ..fluids.history import History, Weights
from ..grid.slab_fft import Block
from ..grid.spectral import curl
from .moving import dealt, gathered
from .part import GridPart

Place = Callable[[np.ndarray], np.ndarray]  # points (k, 3) -> velocities (k, 3)


class InertialPart(GridPart):
    """The part of one process in a fluid of some density and viscosity, from rest (fluids/navier_stokes.py)."""

    def __init__(
        self,
        comm: Any,
        box: tuple[float, ...],
        cells: tuple[int, int, int],
        vectors: int,
        threads: int,
        number: type,
        density: float,
        viscosity: float,
    ) -> None:
        super().__init__(comm, box, cells, vectors, threads, FIELDS, number)
        self.history = History(self.grid, density, viscosity, number, self.rows)
        self._background: list[np.ndarray] = []  # of each of its parts, velocity and vorticity
        self._sum: np.ndarray | None = None

    # -- a step

    def coast(self, past: Weights) -> np.ndarray:
        """The velocity, and half vorticity, of placed nodes (n, 3 v) after a step without forces, on process 0."""
        fields = 3 * self.vectors

        def fill(block: Block) -> None:
            self.history.predict(past, block)
            if self.vectors == 2:
                block.modes[3:] = 0.0
                self.half_curl(block, block.modes[:3], block.modes[3:])

        return self.nodes.felt(fields, self.transform.from_blocks(fields, fill, self.nodes.touched))

    def push(self, past: Weights, factors: Sequence[float], vectors: np.ndarray | None) -> float:
        """The step is taken with what nodes put onto the grid; ``factors`` of the background's parts at its end.

        The fastest component of the flow then, on every process.
        """
        t, fields = self.transform, 3 * self.vectors
        self.nodes.spread(vectors, fields, t.real)
        for block in t.blocks(fields, self.nodes.touched):
            if self.vectors == 2:
                self.half_curl(block, block.modes[3:], block.modes[:3])
            self.history.apply_forces(past, block, t.modes)
        t.backward(FIELDS)
        fastest = cross_in(t.real, self._flow(factors), 0.0) if self._background else cross(t.real, 0.0)
        t.forward(3, self.history.commit(past))
        return self._largest(fastest)

    def felt(self) -> np.ndarray:
        """The present velocity (k, 3) at the nodes that were placed, on process 0."""
        self.transform.modes[:3] = self.history.now
        return self.nodes.felt(3, self.transform.backward(3, self.nodes.touched))

    def _largest(self, value: float) -> float:
        return float(max(self._comm.allgather(float(value))))

    # -- the background flow

    def maintain(self, k: int, place: Place | None) -> None:
        """The part ``k`` of the background flow, which process 0 knows at any place: filtered, kept."""
        t = self.transform
        t.real[:3] = self._at_points(place).T.reshape(3, *t.real.shape[1:])
        modes = t.forward(3)
        fx, fy, fz = filters(self.grid)
        modes[:3] *= fx[:, None, None] * fy[self.rows][:, None] * fz
        curl(modes, *self._k)
        found = t.backward(FIELDS) / t.size
        self._background[k : k + 1] = [found]
        self._sum = None

    def _at_points(self, place: Place | None) -> np.ndarray:
        """Its velocity (k, 3) at the points of this process, which process 0 finds for one process after the other."""
        comm, planes = self._comm, self.transform.planes
        if comm.rank:
            out = np.empty((int(np.prod(self.transform.real.shape[1:])), 3))
            comm.Recv(out, 0)
            return out
        assert place is not None
        for rank in range(1, comm.size):
            comm.Send(np.ascontiguousarray(place(self._points(planes.rows(rank))), float), rank)
        return np.asarray(place(self._points(planes.rows(0))), float)

    def _points(self, planes: slice) -> np.ndarray:
        grid = self.grid
        x, y, z = (o + grid.spacing * np.arange(n) for o, n in zip(grid.origin, grid.cells, strict=True))
        return np.stack(np.meshgrid(x[planes], y, z, indexing="ij"), axis=-1).reshape(-1, 3)

    def _flow(self, factors: Sequence[float]) -> np.ndarray:
        """Velocity and vorticity of the background on the planes of this process."""
        if len(self._background) == 1 and factors[0] == 1.0:
            return self._background[0]
        out = np.empty_like(self._background[0]) if self._sum is None else self._sum
        self._sum = combined(factors, self._background, out)
        return self._sum

    def background(self, factors: Sequence[float]) -> np.ndarray | None:
        """The whole of it (6, nx, ny, nz) on process 0."""
        return gathered(self._comm, self._flow(factors), self.transform.planes, 1)

    def fastest(self, factors: Sequence[float]) -> float:
        """The largest component of its velocity."""
        return self._largest(float(np.abs(self._flow(factors)[:3]).max()))

    # -- the past

    def past(self, name: str) -> np.ndarray | None:
        """A field of the past, whole, on process 0: modes (3, nx, ny, nz//2 + 1)."""
        return gathered(self._comm, getattr(self.history, name), self.transform.rows, 2)

    def recall(self, name: str, whole: np.ndarray | None) -> None:
        """Takes it up from process 0."""
        dealt(self._comm, whole, getattr(self.history, name), self.transform.rows, 2)
