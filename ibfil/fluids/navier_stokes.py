"""The immersed-boundary Navier-Stokes fluid: the statement of Stokes flow with another symbol, and a past.

    rho (u - b)/tau + N* = -grad p + eta Lap u + S F,    b, N* of the last two steps (history.py)

    u = u0 + M F,    u0 = J (alpha + eta k^2)^-1 P (alpha b - N*),    M = J (alpha + eta k^2)^-1 P S,    alpha = rho/tau

M is that of stokes.py with alpha in its symbol, by the same methods, made again only where alpha changes. A background
flow U is maintained by whatever drives it: the fluid's own velocity is u' = u - U, from rest, and its advection
N(U + u') - N(U).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple, Protocol

import numpy as np

from ..grid.fft import VectorTransform
from ..grid.periodic_grid import Grid
from ..grid.slab_fft import Block, SlabFFT
from ..grid.spectral import half_curl
from ..grid.spreading import Stencil, interpolate
from .advection import cross, cross_in
from .background_flow import FIELDS, Background
from .base import Response
from .coupling import Nodes
from .history import History, Weights, weights
from .immersed_boundary import Immersed
from .stokes import Tabulated

SAME = 1e-9  # steps that differ by less, as the differences of rounded times do, share their operator

KEPT = 2  # operators: Euler's first step has another alpha than BDF2's
COURANT = 1.0  # cells that the fastest fluid may cross in a step


class Workspace:
    """Where fields are transformed; what it holds does not outlive a call, so others may use ``flow`` too.

    ``flow`` has FIELDS components. ``vectors`` of a node go through the grid: its force, and with two its torque.
    """

    def __init__(self, grid: Grid, vectors: int = 1, threads: int = 1, number: type = np.float64) -> None:
        self.grid = grid
        nx, ny, nz = (int(n) for n in grid.cells)
        self.flow = VectorTransform((nx, ny, nz), threads, fields=FIELDS, number=number)
        self._slab = SlabFFT((nx, ny, nz), 3 * vectors, threads, number)
        self._couples_torque = vectors == 2
        (self._kx, self._ky, self._kz), _ = grid.wave_numbers()

    def _half_curl(self, block: Block, source: np.ndarray, target: np.ndarray) -> None:
        kx, ky = self._kx[block.i : block.i + source.shape[1]], self._ky[block.j : block.j + source.shape[2]]
        half_curl(source, kx, ky, self._kz, target)

    def scatter(self, nodes: Nodes, vectors: np.ndarray) -> Iterator[Block]:
        """The modes of what nodes put onto the grid, forces (n, 3), or forces and torques (n, 6): block by block."""
        for block in self._slab.scatter(nodes.stencil, vectors):
            if self._couples_torque:
                self._half_curl(block, block.modes[3:], block.modes[:3])
            yield block

    def gather(self, nodes: Nodes, velocity: Callable[[Block], None]) -> np.ndarray:
        """The values (n, 3) at nodes of the ``velocity`` put into each block, or with half its vorticity (n, 6)."""

        def modes(block: Block) -> None:
            velocity(block)
            if self._couples_torque:
                block.modes[3:] = 0.0
                self._half_curl(block, block.modes[:3], block.modes[3:])

        return self._slab.gather(nodes.stencil, modes)


class Asked(NamedTuple):
    """The response given last, the nodes that push in it, and how its step looks back."""

    response: Response
    nodes: Nodes
    weights: Weights


class Past(Protocol):
    """The past of a fluid with inertia (history.py)."""

    dt_old: float

    @property
    def now(self) -> np.ndarray:
        """The modes (3, nx, ny, nz//2 + 1) of the present velocity."""

    def memory(self) -> dict[str, np.ndarray | float]:
        """All of it; nothing before the first step."""

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""


class InertialFluid(ABC):
    """An immersed-boundary fluid of density rho on a grid: its steps, wherever the fields are.

    ``operator`` makes the Stokes fluid (stokes.py) with an alpha in its symbol, ``fastest`` is how fast it is at first.
    """

    history: Past

    def __init__(
        self,
        immersed: Immersed,
        density: float,
        operator: Callable[[float], Tabulated],
        grid: Grid,
        fastest: float,
    ) -> None:
        self.immersed, self.density, self.grid, self.fastest = immersed, density, grid, fastest
        self._make = operator
        self._operators: list[tuple[float, Tabulated]] = []  # alpha and what has it, the last used first
        self._asked: Asked | None = None
        self.time = 0.0

    @abstractmethod
    def _coast(self, nodes: Nodes, past: Weights) -> np.ndarray:
        """The velocity (n, 3), or with half its vorticity (n, 6), that nodes would feel after a step without forces."""

    @abstractmethod
    def _push(self, nodes: Nodes, past: Weights, vectors: np.ndarray) -> None:
        """The step asked about last is taken, with what nodes put onto the grid (n, 3 v); sets ``fastest``."""

    @abstractmethod
    def _felt(self, places: Stencil) -> np.ndarray:
        """The present velocity (k, 3) as nodes at ``places`` would feel it."""

    @abstractmethod
    def background(self) -> np.ndarray:
        """Velocity and vorticity (6, nx, ny, nz) of the maintained flow now, which there must be; filtered."""

    def _operator(self, alpha: float) -> tuple[float, Tabulated]:
        """The operator of alpha, or of one that is the same but for round-off."""
        kept = self._operators
        found = next((pair for pair in kept if abs(pair[0] - alpha) < SAME * alpha), None)
        found = found or (alpha, self._make(alpha))
        self._operators = [found, *(pair for pair in kept if pair is not found)][:KEPT]
        return found

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> Response:
        """The mobility over a step of effective length tau, and the velocity with which the fluid coasts into it."""
        alpha, operator = self._operator(self.density / tau)
        nodes, past = self.immersed.nodes(r, e3), weights(alpha, tau, w, self.history.dt_old)
        felt = self._coast(nodes, past)
        u0, flow = self.immersed.coupling.from_grid(nodes.axes, felt), self.immersed.advected(nodes, r, time)
        if flow is not None:
            u0 = np.column_stack([u0 + flow[:, : u0.shape[1]], flow[:, u0.shape[1] :]])
        response = operator.respond(nodes, u0, tau)
        self._asked = Asked(response, nodes, past)
        return response

    def advance(self, response: Response, velocity: np.ndarray, force: np.ndarray) -> None:
        """The velocity at the end of the step, and its advection. Raises ValueError for a step not asked for last."""
        if self._asked is None or response is not self._asked.response:
            raise ValueError("a step that is taken must be the one the fluid was asked for last")
        nodes, past = self._asked.nodes, self._asked.weights
        self.time += past.dt
        self._push(nodes, past, self.immersed.coupling.to_grid(nodes.axes, force))

    def longest_step(self) -> float:
        """That in which the fastest fluid crosses COURANT cells."""
        return COURANT * self.grid.spacing / self.fastest if self.fastest > 0 else np.inf

    def velocity_at(
        self, points: np.ndarray, r: np.ndarray, e3: np.ndarray, force: np.ndarray, time: float
    ) -> np.ndarray:
        """The velocity (k, 3) at ``points`` (k, 3), as a node there would feel it; it is the fluid's present one."""
        u = self._felt(self.immersed.stencil(points))
        return u if self.immersed.flow is None else u + self.immersed.flow(points, time)

    def memory(self) -> dict[str, np.ndarray | float]:
        """The past, and what the kept operators were made from."""
        if self.history.dt_old == 0.0:
            return {}
        out: dict[str, np.ndarray | float] = {"time": self.time, "fastest": self.fastest}
        out["alphas"] = np.array([alpha for alpha, _ in self._operators])
        out |= {f"past_{key}": value for key, value in self.history.memory().items()}
        for k, (_, operator) in enumerate(self._operators):
            out |= {f"operator{k}_{key}": value for key, value in operator.memory().items()}
        return out

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        """Takes up the past, and makes the operators again."""

        def part(prefix: str) -> dict[str, np.ndarray | float]:
            return {key.removeprefix(prefix): value for key, value in memory.items() if key.startswith(prefix)}

        self.time, self.fastest = float(memory["time"]), float(memory["fastest"])
        self.history.recall(part("past_"))
        self._operators = [(float(alpha), self._make(float(alpha))) for alpha in np.asarray(memory["alphas"])]
        for k, (_, operator) in enumerate(self._operators):
            known = part(f"operator{k}_")
            if known:
                operator.recall(known)


class NavierStokes(InertialFluid):
    """The fluid whose fields are all in the memory of this process."""

    history: History

    def __init__(
        self,
        immersed: Immersed,
        density: float,
        operator: Callable[[float], Tabulated],
        workspace: Workspace,
        background: Background | None = None,
    ) -> None:
        fastest = 0.0 if background is None else float(np.abs(background.at(0.0)[:3]).max())
        super().__init__(immersed, density, operator, workspace.grid, fastest)
        self.history = History(self.grid, density, immersed.viscosity, immersed.number)
        self.workspace, self._background = workspace, background

    def _coast(self, nodes: Nodes, past: Weights) -> np.ndarray:
        return self.workspace.gather(nodes, partial(self.history.predict, past))

    def _push(self, nodes: Nodes, past: Weights, vectors: np.ndarray) -> None:
        for block in self.workspace.scatter(nodes, vectors):
            self.history.apply_forces(past, block, self.workspace.flow.modes)
        self._advect(self.history.commit(past))

    def _advect(self, out: np.ndarray) -> None:
        """Into ``out``, the modes of omega x u, of the velocity and vorticity whose modes the transform holds."""
        t = self.workspace.flow
        t.backward(FIELDS)
        if self._background is None:
            self.fastest = cross(t.real, 0.0)
        else:
            self.fastest = cross_in(t.real, self.background(), 0.0)
        t.forward(into=out)

    def background(self) -> np.ndarray:
        """Velocity and vorticity (6, nx, ny, nz) of the maintained flow now, which there must be; filtered."""
        assert self._background is not None
        return self._background.at(self.time)

    def _felt(self, places: Stencil) -> np.ndarray:
        self.workspace.flow.modes[:3] = self.history.now
        return interpolate(*places, self.workspace.flow.backward())
