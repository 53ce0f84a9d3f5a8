"""Timing a piece of a step against its floor, in the same run.

Piece and floor are timed in turn, so that a busy machine slows both, and the ratio is the median of the ratios of the
turns: ratios hold from machine to machine, seconds do not.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..grid.kernels import KERNELS
from ..grid.periodic_grid import Grid

_TURNS = 15  # at least


_BURST = 2e-4  # seconds a turn of each, well below a time slice of the system: both meet the same neighbours


_TOTAL = 1.5  # seconds for a row


SWIMMER = """
[filament.swimmer]
length = 1.0
nodes = {nodes}
bending = 1.0
stretching = {stretching}
curvature = ["8*sin(4*pi*s - 10*t)", 0]
shape = {{ kind = "relaxed" }}
anchor = "centroid"
[fluid]
model = "{model}"
viscosity = 1.0
box = [3.2, 3.2, 3.2]
cells = [64, 64, 64]
method = "{method}"
[time]
end = 1.2566370614359172
step = {step}
scheme = "{scheme}"
[output]
every = 1.2566370614359172
"""


@dataclass(frozen=True)
class Row:
    """One measurement: a piece's seconds, its floor's, their ratio, and the bar the ratio is held to (None: none).

    Where ``unit`` says so they are something else than seconds.
    """

    piece: str
    seconds: float
    floor: str
    floor_seconds: float
    ratio: float
    bar: float | None
    unit: str = "s"

    @property
    def verdict(self) -> str:
        """Whether the ratio is within the bar."""
        return "" if self.bar is None else "ok" if self.ratio <= self.bar else "over"


def of_children() -> float:
    """Processor time of all processes that were started and have ended."""
    import resource

    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def seconds_of(work: Callable[[], object], repeats: int) -> float:
    """Seconds of one call, the mean of ``repeats``."""
    began = time.perf_counter()
    for _ in range(repeats):
        work()
    return (time.perf_counter() - began) / repeats


def against(piece: str, work: Callable[[], object], floor: str, bare: Callable[[], object], bar: float | None) -> Row:
    """Times ``work`` and ``bare`` in turn, short bursts of each, after one call of each."""
    work()
    bare()
    a, b = seconds_of(work, 3), seconds_of(bare, 3)
    repeats = max(1, int(_BURST / max(a, b)))
    turns = max(_TURNS, int(_TOTAL / (repeats * (a + b))))
    times = [(seconds_of(work, repeats), seconds_of(bare, repeats)) for _ in range(turns)]
    a, b = (statistics.median(turn[k] for turn in times) for k in (0, 1))
    return Row(piece, a, floor, b, statistics.median(x / y for x, y in times), bar)


def case_text(nodes: int, model: str, method: str, scheme: str, step: float, stretching: float = 400.0) -> str:
    """The undulating swimmer of Sec. 7.1, two periods."""
    return SWIMMER.format(nodes=nodes, model=model, method=method, scheme=scheme, step=step, stretching=stretching)


def nodes_and_forces(grid: Grid, kernel: str, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stencils of a wavy line of nodes, and forces on them."""
    x = np.linspace(-0.45, 0.45, count)
    r = np.stack([x, 0.05 * np.sin(14 * x), np.zeros(count)], axis=1)
    base, weights = KERNELS[kernel].stencil(grid.coordinates(r))
    return base, weights, np.random.default_rng(0).standard_normal((count, 3))


def table(rows: list[Row]) -> str:
    """The rows for the eye."""
    lines = []
    for row in rows:
        bar = "" if row.bar is None else f"bar {row.bar:.3g} {row.verdict}"
        lines.append(
            f"{row.piece}\n    {row.seconds:.3g} {row.unit}; {row.floor} {row.floor_seconds:.3g} {row.unit}; "
            f"ratio {row.ratio:.3g}  {bar}"
        )
    return "\n".join(lines)
