"""`ibfil bench`: the pieces of a step against floors measured in the same run.

Piece and floor are timed in turn, so that a busy machine slows both, and the ratio is the median of the ratios of the
turns: ratios hold from machine to machine, seconds do not.
"""

from __future__ import annotations

import json as json_format
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from scipy.linalg import get_lapack_funcs

from . import banded, bench_many, bench_threads, stepping
from .case import parse_case
from .errors import CaseError
from .grid import Grid
from .kernels import KERNELS
from .mobility import mobility, octant, point_response
from .pruned import PrunedSolve
from .rft import _system
from .simulation import Simulation
from .stokes import StokesSolve
from .transforms import VectorTransform

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


def _seconds(work: Callable[[], object], repeats: int) -> float:
    began = time.perf_counter()
    for _ in range(repeats):
        work()
    return (time.perf_counter() - began) / repeats


def against(piece: str, work: Callable[[], object], floor: str, bare: Callable[[], object], bar: float | None) -> Row:
    """Times ``work`` and ``bare`` in turn, short bursts of each, after one call of each."""
    work()
    bare()
    a, b = _seconds(work, 3), _seconds(bare, 3)
    repeats = max(1, int(_BURST / max(a, b)))
    turns = max(_TURNS, int(_TOTAL / (repeats * (a + b))))
    times = [(_seconds(work, repeats), _seconds(bare, repeats)) for _ in range(turns)]
    a, b = (statistics.median(turn[k] for turn in times) for k in (0, 1))
    return Row(piece, a, floor, b, statistics.median(x / y for x, y in times), bar)


def case_text(nodes: int, model: str, method: str, scheme: str, step: float, stretching: float = 400.0) -> str:
    """The undulating swimmer of Sec. 7.1, two periods."""
    return SWIMMER.format(nodes=nodes, model=model, method=method, scheme=scheme, step=step, stretching=stretching)


def rft_step(nodes: int = 128) -> Row:
    """One semi-implicit step in RFT, its preferred curvature evaluated, against one dgbsv of the same matrix."""
    simulation = Simulation(parse_case(case_text(nodes, "rft", "auto", "semi-implicit", 1e-2, 1.6e4), "bench"))
    simulation.advance(0.05, lambda: None)
    rods, state, scheme = simulation.mechanics, simulation.state_now, stepping.SemiImplicit()
    fluid = simulation.fluid
    force, inner = rods.forces(state.shape, state.time)
    matrix = rods.definite_stiffness(state.shape, state.shape, inner, state.time)
    _system(matrix, fluid.drag, state.shape.e3, np.zeros_like(force), force, 100.0)  # type: ignore[attr-defined]
    width, diagonals = banded.lapack_form(matrix)
    room = np.zeros((3 * width + 1, diagonals.shape[1]), order="F")
    room[width:] = diagonals
    right = force.ravel().copy()
    gbsv = get_lapack_funcs("gbsv", (room, right))
    return against(
        f"RFT step, semi-implicit, N = {nodes}",
        lambda: scheme.step(rods, fluid, state, 1e-2),
        "LAPACK dgbsv of its matrix",
        lambda: gbsv(width, width, room, right),
        0.9,
    )


def nodes_and_forces(grid: Grid, kernel: str, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stencils of a wavy line of nodes, and forces on them."""
    x = np.linspace(-0.45, 0.45, count)
    r = np.stack([x, 0.05 * np.sin(14 * x), np.zeros(count)], axis=1)
    base, weights = KERNELS[kernel].stencil(grid.coordinates(r))
    return base, weights, np.random.default_rng(0).standard_normal((count, 3))


def evaluations(cells: int, bars: tuple[float, float]) -> list[Row]:
    """One velocity evaluation of 41 nodes by whole and by pruned FFTs, against the bare transforms."""
    grid = Grid([3.2] * 3, [cells] * 3)
    base, weights, force = nodes_and_forces(grid, "peskin4", 41)
    whole, pruned = StokesSolve(grid, 1.0), PrunedSolve(grid, 1.0)

    def bare() -> None:
        whole.transform.forward()
        whole.transform.backward()

    floor = f"3 r2c + 3 c2r at {cells}^3"
    return [
        against(f"IB velocity by FFT, {cells}^3", lambda: whole.velocity(base, weights, force), floor, bare, bars[0]),
        against(f"IB velocity, pruned, {cells}^3", lambda: pruned.velocity(base, weights, force), floor, bare, bars[1]),
    ]


def inertia(cells: int = 64, precision: str = "double", bar: float | None = 1.2) -> Row:
    """One step of the swimmer at rho = 10, advection and rods included, against the 15 components it would transform.

    Forces and coasting velocities go through slabs (slab.py), so that fewer are transformed in full: nine. What takes
    the time beside them is memory: a step reads five fields of the past and of forces and writes as many (past.py).
    """
    text = case_text(41, "navier-stokes", "auto", "implicit", 1e-2)
    changes = ["fluid.density=10", f"fluid.cells=[{cells}, {cells}, {cells}]", f"fluid.precision={precision}"]
    simulation = Simulation(parse_case(text, "bench", changes))
    simulation.advance(0.05, lambda: None)
    whole, dt = VectorTransform((cells, cells, cells), fields=6), 1e-2

    def step() -> None:
        simulation.accept(simulation.attempt(dt), simulation.time + dt)

    def bare() -> None:
        whole.forward()
        whole.backward(6)
        whole.forward()
        whole.backward()

    piece = f"Navier-Stokes step, 41 nodes, {cells}^3, {precision} precision"
    return against(piece, step, f"6 r2c + 9 c2r at {cells}^3, double", bare, bar)


def table_pair(kernel: str, bar: float, count: int = 41) -> Row:
    """One pair of the mobility table, against a microsecond."""
    grid = Grid([3.2] * 3, [64] * 3)
    base, weights, _ = nodes_and_forces(grid, kernel, count)
    table, slip = octant(point_response(grid, 1.0), weights.shape[2]), np.zeros(count)
    mobility(table, grid.cells, base, weights, slip)
    seconds = statistics.median(
        _seconds(lambda: mobility(table, grid.cells, base, weights, slip), 5) for _ in range(_TURNS)
    ) / (count * (count + 1) / 2)
    return Row(f"mobility table, a pair, {kernel}", seconds, "1 us", 1e-6, seconds / 1e-6, bar)


def start_up() -> Row:
    """`ibfil --help`, against an interpreter that does nothing."""
    return against(
        "ibfil --help",
        lambda: subprocess.run([sys.executable, "-m", "ibfil", "--help"], capture_output=True, check=True),
        "python -c pass",
        lambda: subprocess.run([sys.executable, "-c", "pass"], check=True),
        None,
    )


def swimmers(end: float = 1.2566370614359172) -> list[Row]:
    """The IB swimmer over two periods: the default scheme by table, against explicit Euler at its largest stable step.

    All four run to the end; the error is the rms node distance to a common reference of the default scheme with a
    sixtieth of its step, over the length. The step is the longest that keeps within 1e-3 of it. Times are the
    processor's, which on an idle machine are the wall's: a run of minutes meets more of what else goes on than one of
    a twentieth of a second, and ratios of wall times on a busy machine came out three times too good.
    """

    def run(method: str, scheme: str, step: float) -> tuple[float, np.ndarray]:
        simulation = Simulation(parse_case(case_text(41, "stokes", method, scheme, step), "bench"))
        simulation.advance(min(3 * step, end), lambda: None)  # compiled, planned
        times: list[float] = []
        while len(times) < 25 and sum(times) < 1.0:  # short runs meet more of what else the machine does
            simulation = Simulation(parse_case(case_text(41, "stokes", method, scheme, step), "bench"))
            began = time.process_time()
            simulation.advance(end, lambda: None)
            times.append(time.process_time() - began)
        return statistics.median(times), simulation.shape.r

    step = 0.05
    _, reference = run("table", "implicit", step / 60)
    limit = Simulation(parse_case(case_text(41, "stokes", "table", "explicit", 1.0), "bench")).explicit_limit()
    rows = []
    for method, bar in (("fft", 500), ("pruned", 150), ("table", 80)):
        implicit, r = run("table", "implicit", step)
        seconds, other = run(method, "explicit", 0.9 * limit)
        errors = ", ".join(f"{_distance(x, reference):.1e}" for x in (r, other))
        piece = f"swimmer, 2 periods: implicit / explicit {method} (errors {errors})"
        rows.append(Row(piece, implicit, f"explicit, {method}", seconds, implicit / seconds, 1 / bar, "s of processor"))
    return rows


def _distance(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1))))


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


def many(cells: tuple[int, ...] = (64, 128), steps: int = 4) -> list[Row]:
    """Time a node at 10,000 nodes against that at 1,000, and memory against 2 GiB and against what `check` tells."""
    rows, limit = [], 2.0 * 2**30
    for n in cells:
        for nodes, few, lots in bench_many.PAIRS:
            small, large = (bench_many.measured(count, nodes, n, steps) for count in (few, lots))
            a, b = (f"{count} x {nodes}, {n}^3" for count in (lots, few))
            how = ", ".join(f"{x['products']:.0f}" for x in (large, small))
            piece, ratio = (
                f"{a}: a node and step ({large['method']}, products {how})",
                large["seconds"] / small["seconds"],
            )
            rows.append(Row(piece, large["seconds"], b, small["seconds"], ratio, 3.0))
            peak, told = large["peak"], large["told"]
            rows.append(Row(f"{a}: peak memory", peak, "2 GiB", limit, peak / limit, 1.0, "B"))
            rows.append(Row(f"{a}: peak memory", peak, "told by check", told, peak / told, None, "B"))
    return rows


def threads() -> list[Row]:
    """Two threads against one on a busy machine."""
    return [Row(**row) for row in bench_threads.measured()]


PARTS: dict[str, Callable[[], list[Row]]] = {
    "pieces": lambda: [
        rft_step(),
        *evaluations(64, (1.15, 1 / 3.5)),
        *evaluations(128, (1.3, 1 / 5)),
        inertia(),
        inertia(precision="single", bar=None),
        table_pair("peskin4", 1.0),
        table_pair("bkp6", 4.5),
        start_up(),
    ],
    "swimmer": lambda: swimmers(),
    "large": lambda: [inertia(128), *evaluations(256, (1.3, 1 / 6))],
    "threads": threads,
    "many": lambda: many(),
}
USUAL = ("pieces", "swimmer")


def main(json: bool = False, parts: Sequence[str] = ()) -> int:
    """Measures the parts asked for and prints a table, or JSON. Returns 0: a busy machine is no failure.

    The usual ones, where none is named, take a minute or two; "large" needs 1 GiB, "many" some ten minutes and 2 GiB.
    Raises CaseError for a part there is not.
    """
    for part in set(parts) - set(PARTS):
        raise CaseError([f"bench: found {part}; allowed: {', '.join(PARTS)}"])
    parts = parts or USUAL
    rows = [row for part in parts for row in PARTS[part]()]
    print(json_format.dumps([asdict(row) for row in rows], indent=1) if json else table(rows))
    return 0
