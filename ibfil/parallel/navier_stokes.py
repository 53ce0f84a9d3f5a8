"""A fluid with inertia whose grid processes share: process 0's side of its past, its background flow and its steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ..fluids.background_flow import factors_of
from ..fluids.base import Flow, Part
from ..fluids.coupling import Nodes
from ..fluids.history import Weights
from ..fluids.immersed_boundary import Immersed
from ..fluids.navier_stokes import InertialFluid
from ..fluids.stokes import Tabulated
from ..grid.fft import modes_of
from ..grid.periodic_grid import Grid
from ..grid.spreading import Stencil
from .inertia import InertialPart
from .ranks import Ranks, Shared
from .stokes import Placed, share

_FIELDS = ("now", "old", "n_now", "n_old")


class SharedWorkspace:
    """Process 0's handle on a fluid that processes share, and on the nodes that they were given last."""

    def __init__(self, ranks: Ranks, immersed: Immersed, grid: Grid, density: float, threads: int) -> None:
        self.grid, self.number = grid, immersed.number
        box, cells = tuple(map(float, grid.box)), tuple(map(int, grid.cells))
        of_fluid = (immersed.coupling.grid_vectors, threads, immersed.number, density, immersed.viscosity)
        self.shared: Shared = ranks.make(InertialPart, box, cells, *of_fluid)
        self.placed = Placed(self.shared)
        self._threads = threads
        self._double: tuple[Shared, Placed] | None = None

    def solves(self, ranks: Ranks, immersed: Immersed) -> tuple[Shared, Placed]:
        """The grid on which forces are answered, in double precision: this one, or one without a past."""
        if self.number is np.float64:
            return self.shared, self.placed
        if self._double is None:
            shared = share(ranks, self.grid, immersed.coupling.grid_vectors, self._threads)
            self._double = shared, Placed(shared)
        return self._double


class SharedHistory:
    """The past (fluids/history.py), whose fields come together on process 0 when they are asked for."""

    def __init__(self, workspace: SharedWorkspace) -> None:
        self._shared, self._number, self.dt_old = workspace.shared, workspace.number, 0.0

    @property
    def now(self) -> np.ndarray:
        """The modes (3, nx, ny, nz//2 + 1) of the present velocity."""
        found: np.ndarray = self._shared.call("past", "now")
        return found

    def memory(self) -> dict[str, np.ndarray | float]:
        """All of it; nothing before the first step."""
        if self.dt_old == 0.0:
            return {}
        kept = {name: self._shared.call("past", name).view(self._number) for name in _FIELDS}
        return {**kept, "dt_old": self.dt_old}

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave, of any number of processes."""
        for name in _FIELDS:
            whole = np.ascontiguousarray(memory[name]).view(modes_of(self._number))
            self._shared.call("recall", name, own=(whole,))
        self.dt_old = float(memory["dt_old"])


class SharedBackground:
    """A maintained flow (fluids/background_flow.py) on a grid that is shared."""

    def __init__(self, workspace: SharedWorkspace, flow: Flow, parts: Sequence[Part] | None) -> None:
        self._shared, self._flow, self._parts = workspace.shared, flow, parts
        self._known: float | None = None
        for k, part in enumerate(parts or ()):
            self._shared.call("maintain", k, own=(part.place,))

    def factors(self, time: float) -> tuple[float, ...]:
        """Those of the parts at ``time``; where none are known the whole flow is put on the grid for it."""
        if self._parts is not None:
            return factors_of(self._parts, time)
        if self._known != time:
            self._shared.call("maintain", 0, own=(partial(_at, self._flow, time),))
            self._known = time
        return (1.0,)

    def at(self, time: float) -> np.ndarray:
        """Velocity and vorticity (6, nx, ny, nz) at ``time``."""
        found: np.ndarray = self._shared.call("background", self.factors(time))
        return found

    def fastest(self, time: float) -> float:
        """The largest component of its velocity."""
        return float(self._shared.call("fastest", self.factors(time)))


def _at(flow: Flow, time: float, points: np.ndarray) -> np.ndarray:
    return flow(points, time)


class SharedNavierStokes(InertialFluid):
    """The fluid whose fields are shared by all processes."""

    history: SharedHistory

    def __init__(
        self,
        immersed: Immersed,
        density: float,
        operator: Callable[[float], Tabulated],
        workspace: SharedWorkspace,
        background: SharedBackground | None = None,
    ) -> None:
        fastest = 0.0 if background is None else background.fastest(0.0)
        super().__init__(immersed, density, operator, workspace.grid, fastest)
        self.history = SharedHistory(workspace)
        self._shared, self._placed, self._background = workspace.shared, workspace.placed, background

    def _coast(self, nodes: Nodes, past: Weights) -> np.ndarray:
        self._placed.at(nodes.base, nodes.weights)
        felt: np.ndarray = self._shared.call("coast", past)
        return felt

    def _push(self, nodes: Nodes, past: Weights, vectors: np.ndarray) -> None:
        self._placed.at(nodes.base, nodes.weights)
        factors = () if self._background is None else self._background.factors(self.time)
        self.fastest = self._shared.call("push", past, factors, own=(vectors,))
        self.history.dt_old = past.dt

    def background(self) -> np.ndarray:
        """Velocity and vorticity (6, nx, ny, nz) of the maintained flow now, which there must be; filtered."""
        assert self._background is not None
        return self._background.at(self.time)

    def _felt(self, places: Stencil) -> np.ndarray:
        self._placed.at(*places)
        felt: np.ndarray = self._shared.call("felt")
        return felt
