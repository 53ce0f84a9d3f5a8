"""The pieces of a step that `ibfil bench` times: evaluations, whole steps, the mobility table, runs of a swimmer."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time

import numpy as np
from scipy.linalg import get_lapack_funcs

from ..case.reading import parse_case, read_case
from ..fluids.mobility_table import mobility, octant, point_response
from ..fluids.resistive_force import _system
from ..fluids.stokes import StokesSolve
from ..grid.fft import VectorTransform
from ..grid.periodic_grid import Grid
from ..grid.pruned_fft import PrunedSolve
from ..linalg import banded
from ..simulation.simulation import Simulation
from ..timestepping import semi_implicit
from .timing import _TURNS, Row, against, case_text, nodes_and_forces, seconds_of


def rft_step(nodes: int = 128) -> Row:
    """One semi-implicit step in RFT, its preferred curvature evaluated, against one dgbsv of the same matrix."""
    simulation = Simulation(parse_case(case_text(nodes, "rft", "auto", "semi-implicit", 1e-2, 1.6e4), "bench"))
    simulation.advance(0.05, lambda: None)
    rods, state, scheme = simulation.system, simulation.state_now, semi_implicit.SemiImplicit()
    fluid = simulation.fluid
    force, inner = rods.forces(state.configuration, state.time)
    matrix = rods.definite_stiffness(state.configuration, state.configuration, inner, state.time).band
    _system(matrix, fluid.drag, state.configuration.e3, np.zeros_like(force), force, 100.0)  # type: ignore[attr-defined]
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


def inertia(cells: int = 64, precision: str = "double", bar: float | None = 1.1) -> Row:
    """One step of the swimmer at rho = 10, advection and rods included, against the 15 components it would transform.

    Forces and coasting velocities go through slabs (grid/slab_fft.py), so that fewer are transformed in full: nine.
    The rest of the time goes to memory: a step reads five fields of the past and of forces and writes as many
    (fluids/history.py). fluids/README.md has the parts of it, and all that was tried.
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


def a_cell(step: Row, cells: int = 64) -> Row:
    """The same step of Navier-Stokes flow, a cell, against those of others with one thread.

    WaterLily takes 125 to 165 ns in single precision, SophT 343 ns.
    """
    seconds, others = step.seconds / cells**3, 125e-9
    return Row(f"{step.piece}, a cell", seconds, "WaterLily, single precision", others, seconds / others, 1.0)


def table_pair(kernel: str, bar: float, count: int = 41) -> Row:
    """One pair of the mobility table, against a microsecond."""
    grid = Grid([3.2] * 3, [64] * 3)
    base, weights, _ = nodes_and_forces(grid, kernel, count)
    table, slip = octant(point_response(grid, 1.0), weights.shape[2]), np.zeros(count)
    mobility(table, base, weights, slip)
    seconds = statistics.median(seconds_of(lambda: mobility(table, base, weights, slip), 5) for _ in range(_TURNS)) / (
        count * (count + 1) / 2
    )
    return Row(f"mobility table, a pair, {kernel}", seconds, "1 us", 1e-6, seconds / 1e-6, bar)


def table_of_a_swimmer(count: int = 41) -> Row:
    """The whole mobility table, 861 pairs, against factors of as large a matrix: 0.35 us a pair is 6.5 of 46 us."""
    grid = Grid([3.2] * 3, [64] * 3)
    base, weights, _ = nodes_and_forces(grid, "peskin4", count)
    table, slip = octant(point_response(grid, 1.0), weights.shape[2]), np.full(count, 0.01)
    whole = mobility(table, base, weights, slip).reshape(3 * count, 3 * count)
    matrix = np.asfortranarray(whole + np.eye(3 * count))
    potrf = get_lapack_funcs("potrf", (matrix,))
    return against(
        f"mobility table, {count} nodes, peskin4",
        lambda: mobility(table, base, weights, slip),
        f"Cholesky, {3 * count} x {3 * count}",
        lambda: potrf(matrix, lower=True),
        6.5,
    )


def swimmer_step() -> Row:
    """A step of the shipped swimmer, 41 nodes by table, against factors of a matrix as large: 0.6 ms is 13 of 46 us."""
    simulation = Simulation(read_case("swimmer_stokes", {"time.end": 1e6, "output.every": 1e6}))
    length = simulation.step_length
    simulation.advance(20 * length, lambda: None)
    size = 3 * len(simulation.configuration.r)
    matrix = np.asfortranarray(np.eye(size) + 0.5 / size)
    potrf = get_lapack_funcs("potrf", (matrix,))
    return against(
        f"swimmer_stokes, a step of {size // 3} nodes",
        lambda: simulation.advance(simulation.time + length, lambda: None),
        f"Cholesky, {size} x {size}",
        lambda: potrf(matrix, lower=True),
        13.0,
    )


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
        return statistics.median(times), simulation.configuration.r

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
