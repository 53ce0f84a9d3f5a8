"""The part of `ibfil bench` about one run on two processes against one, and what its pieces foretell of 64.

Under mpiexec, two processes of one thread each take turns: process 0 alone, as a run of one process, while the other
naps; then both; of each the least of the turns. On a machine whose cores have other work two processes wait for each
other, and no least of turns is without that: share.py foretells from seconds of work of one by itself, with the
bandwidth and latency between these two, a copy in memory, and with 0.5 GB/s and 2 us, the part of one of many in a
network.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..errors import CaseError
from .share import BOX, Network, Seconds, Timed, least, of_step, share, timed
from .timing import Row

MANY, CELLS, TURNS = 64, 128, 10
BAR = 1.25  # two processes do at least 0.8 of two
NETWORK = Network(0.5e9, 2e-6)
STEP = 0.0125
INERTIAL = """
[filament.swimmer]
length = 1.0
nodes = 41
bending = 1.0
stretching = 400
curvature = ["8*sin(4*pi*s - 10*t)", 0]
shape = {{ kind = "relaxed" }}
[fluid]
model = "navier-stokes"
density = 10.0
viscosity = 1.0
box = [3.2, 3.2, 3.2]
cells = [{cells}, {cells}, {cells}]
[time]
end = 1.0
step = 0.0125
[output]
every = 1.0
"""


class Messages:
    """A part that measures what an exchange takes."""

    def __init__(self, comm: Any) -> None:
        self._comm = comm

    def least(self, numbers: int, turns: int) -> float:
        """Seconds of an exchange in which each process sends so many complex numbers to each."""
        each = [numbers] * self._comm.size
        sent, come = (np.zeros(sum(each), complex) for _ in range(2))

        def exchange() -> None:
            self._comm.barrier()
            self._comm.Alltoallv([sent, each], [come, each])

        return least(exchange, turns).wall


class Piece(NamedTuple):
    """A piece of a run by one process and by two: seconds; of the latter the work besides calls, and the calls."""

    name: str
    one: Seconds
    two: Seconds
    alone: float
    calls: Counter[str]


def _turns(name: str, ranks: Timed, one: Callable[[], object], two: Callable[[], object], turns: int) -> Piece:
    """Both in turn; the least of each."""
    ones, twos, alone, calls = [], [], math.inf, Counter[str]()
    for _ in range(turns):
        ones.append(timed(one))
        ranks.look()
        twos.append(timed(two))
        called, calls = ranks.look()
        alone = min(alone, twos[-1].work - called)
    one_best, two_best = (Seconds(*map(min, zip(*each, strict=True))) for each in (ones, twos))
    return Piece(name, one_best, two_best, alone, calls)


def pieces(ranks: Timed, cells: int, turns: int) -> list[Piece]:
    """Velocities of a swimmer's nodes, its step in a fluid with inertia, a step of many rods in Stokes flow."""
    from .many import scene

    many = scene(20, 50, cells).replace('model = "stokes"', 'model = "stokes"\nmethod = "krylov"')
    found = [_turns(f"velocities at 41 nodes, {cells}^3", ranks, *_velocities(ranks, cells), turns)]
    for name, text in (
        ("a Navier-Stokes step of 41", INERTIAL.format(cells=cells)),
        ("a Stokes step of 20 x 50", many),
    ):
        one = _stepper(text)
        with ranks.sharing():
            two = _stepper(text)
        found.append(_turns(f"{name} nodes, {cells}^3", ranks, one, two, turns))
    return found


def _velocities(ranks: Timed, cells: int) -> tuple[Callable[[], object], Callable[[], object]]:
    from ..fluids.stokes import StokesSolve
    from ..grid.periodic_grid import Grid
    from ..parallel.stokes import Placed, SharedStokesSolve
    from ..parallel.stokes import share as shared_grid
    from .timing import nodes_and_forces

    grid = Grid(BOX, [cells] * 3)
    given, shared = nodes_and_forces(grid, "peskin4", 41), shared_grid(ranks, grid, 1, 1)
    solves = StokesSolve(grid, 1.0), SharedStokesSolve(shared, Placed(shared), 1.0)
    one, two = (partial(solve.velocity, *given) for solve in solves)
    one()
    two()
    return one, two


def _stepper(text: str) -> Callable[[], None]:
    """A step of a case, after two."""
    from ..case.reading import parse_case
    from ..simulation.simulation import Simulation

    simulation = Simulation(parse_case(text, "bench"))

    def one() -> None:
        simulation.accept(simulation.attempt(STEP), simulation.time + STEP)

    one()
    one()
    return one


def rows(found: list[Piece], cells: int, here: Network, copy: float, turns: int) -> list[Row]:
    """The numbers that were measured, and foretold of them; ``copy`` is the bandwidth of a copy in memory."""
    name, ratio = "all to all between two processes", here.bandwidth / copy
    out = [Row(name, here.bandwidth, "a copy in memory", copy, ratio, None, "B/s")]
    shares = {(many, size): share(size, many, turns) for many, size in ((2, cells), (MANY, cells), (MANY, 2 * cells))}
    for piece in found:
        text = f"{piece.name}: two processes, times two"
        out.append(
            Row(text, 2 * piece.two.wall, "one process", piece.one.wall, 2 * piece.two.wall / piece.one.wall, BAR)
        )
        for many, size, network, words in (
            (2, cells, here, "messages as here"),
            (MANY, cells, here, "messages as here"),
            (MANY, cells, NETWORK, "0.5 GB/s and 2 us a message"),
            (MANY, 2 * cells, NETWORK, "0.5 GB/s and 2 us a message"),
        ):
            more = (size / cells) ** 3 * math.log(size) / math.log(cells)
            one = piece.alone + more * (piece.one.work - piece.alone)
            all_of_them = many * of_step(piece.alone, piece.calls, shares[many, size], network, size, many)
            text = f"  foretold at {size}^3: {many} processes, times {many}; {words}"
            out.append(Row(text, all_of_them, "work of one process", one, all_of_them / one, None))
    return out


def measured(cells: int = CELLS, turns: int = TURNS) -> list[Row]:
    """The rows, measured by two processes. Raises CaseError where MPI is not installed."""
    import os
    from importlib.util import find_spec
    from pathlib import Path

    places = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    mpiexec = shutil.which("mpiexec", path=places)
    if mpiexec is None or find_spec("mpi4py") is None:
        raise CaseError(["bench mpi: found no mpiexec, or no mpi4py; install them: pip install 'ibfil[mpi]' mpich"])
    words = [mpiexec, "-n", "2", sys.executable, "-m", "ibfil.bench.processes", str(cells), str(turns)]
    answer = subprocess.run(words, stdout=subprocess.PIPE, check=True, text=True).stdout
    return [Row(**row) for row in json.loads(answer)]


def main(cells: int, turns: int) -> None:
    """The work of each of the two processes; process 0 prints the rows as JSON."""
    from ..parallel.ranks import join, serve
    from ..threads import one_thread_of_blas

    comm = join()
    if comm.rank:
        serve(comm)
        return
    ranks = Timed(comm)
    with one_thread_of_blas(), ranks:
        numbers = cells * cells * (cells // 2 + 1) // 4
        messages, room = ranks.make(Messages), np.zeros(numbers, complex)
        latency = messages.call("least", 1, 200)
        bandwidth = 16.0 * numbers / messages.call("least", numbers, turns)
        copy = 16.0 * numbers / least(partial(np.copyto, np.zeros_like(room), room), turns).wall
        found = pieces(ranks, cells, turns)
    print(json.dumps([asdict(row) for row in rows(found, cells, Network(bandwidth, latency), copy, turns)]))


if __name__ == "__main__":
    from ..threads import set_threads

    set_threads(1)
    main(*map(int, sys.argv[1:]))
