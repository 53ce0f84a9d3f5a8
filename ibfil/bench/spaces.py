"""Spaces other than the periodic box: steps, pairs, tables and transforms against the box or against floors."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from ..case.reading import parse_case
from ..fluids.coupling import TRANSLATION, Nodes
from ..fluids.spaces.free import FreeSpace
from ..fluids.spaces.wall import NoSlipWall
from ..grid.fft import VectorTransform
from ..grid.free_fft import FreeSolve
from ..grid.kernels import KERNELS
from ..grid.wall_fft import WallSolve
from ..simulation.simulation import Simulation
from .timing import Row, against, case_text

FREE = ("fluid.box=free", "fluid.cells=absent", "fluid.spacing=0.05")
WALL = (*FREE, "fluid.wall=no-slip", "filament.swimmer.position=[0, 0, 0.3]")


def _stepping(nodes: int, *changes: str) -> Callable[[], object]:
    """Steps of the swimmer by the table."""
    simulation = Simulation(parse_case(case_text(nodes, "stokes", "table", "implicit", 1e-2), "bench", changes))
    simulation.advance(0.05, lambda: None)
    return lambda: simulation.attempt(1e-2)


def steps(nodes: int = 41) -> list[Row]:
    """One implicit step by the table in free space and above a wall, against the same in the periodic box."""
    boxed, floor = _stepping(nodes), "in the periodic box"
    return [
        against(f"step by table, N = {nodes}, free space", _stepping(nodes, *FREE), floor, boxed, 1.1),
        against(f"step by table, N = {nodes}, above a wall", _stepping(nodes, *WALL), floor, boxed, None),
    ]


def wall_pairs(kernel: str, bar: float, count: int = 41) -> Row:
    """All pairs of a wavy line of nodes above a no-slip wall, against those in free space."""
    s, own, points = np.linspace(0, 1, count), np.zeros((count, 3)), KERNELS[kernel].points
    r = np.stack([count * (s - 0.5), 2 * np.sin(14 * s), 8 + 0 * s], axis=1)

    def matrix(space: FreeSpace) -> Callable[[], object]:
        mobility, nodes = space.mobility(TRANSLATION, points, 1.0), Nodes(*space.stencil(KERNELS[kernel], r), own)
        return lambda: mobility.matrix(nodes, own)

    piece = f"mobility of {count} nodes above a wall, {kernel}"
    return against(piece, matrix(NoSlipWall(1.0)), "in free space", matrix(FreeSpace(1.0)), bar)


def tables() -> list[Row]:
    """Seconds to the tables, against 0.3 s: that of free space may be in the cache, that of a wall is always made."""
    rows = []
    for name, space in (("free space", FreeSpace(1.0)), ("a wall", NoSlipWall(1.0))):
        began = time.perf_counter()
        space.mobility(TRANSLATION, 4, 1.0)
        seconds = time.perf_counter() - began
        rows.append(Row(f"table of {name}, made", seconds, "0.3 s", 0.3, seconds / 0.3, 1.0))
    return rows


def transforms(extents: tuple[int, int, int] = (60, 20, 20), count: int = 400) -> list[Row]:
    """One velocity evaluation by FFTs of the nodes' box, against the bare padded transforms."""
    r = np.random.default_rng(0).uniform(0, 1, (count, 3)) * np.array(extents)
    force, rows = np.random.default_rng(1).standard_normal((count, 3)), []
    pairs: list[tuple[str, Any, FreeSpace, int]] = [
        ("free space", FreeSolve(1.0, 1.0), FreeSpace(1.0), 3),
        ("above a wall", WallSolve(1.0, 1.0), NoSlipWall(1.0), 6),
    ]
    for name, solve, space, fields in pairs:
        stencil = space.stencil(KERNELS["peskin4"], r)
        solve.velocity(*stencil, force)

        whole = VectorTransform(solve.cells, fields=fields)

        def bare(transform: VectorTransform = whole, fields: int = fields) -> None:
            transform.forward(fields)
            transform.backward(fields)

        def work(solve: Any = solve, stencil: Any = stencil) -> None:
            solve.velocity(*stencil, force)

        cells = " x ".join(str(n) for n in solve.cells)
        rows.append(against(f"velocity by FFT, {name}, {count} nodes", work, f"r2c and c2r at {cells}", bare, 1.3))
    return rows
