"""The part of `ibfil bench` about threads: two of them on a machine whose other cores are busy, against one.

Libraries read their number of threads when they are loaded, so this is a process of its own; it prints its rows.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from functools import partial
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..simulation.simulation import Simulation


BAR = 1.3


def rows() -> list[dict]:
    """Velocity evaluations and a step of many filaments, by two threads against one."""
    from dataclasses import asdict

    from ..case.reading import parse_case
    from ..fluids.stokes import StokesSolve
    from ..grid.periodic_grid import Grid
    from ..grid.pruned_fft import PrunedSolve
    from ..simulation.simulation import Simulation
    from ..threads import one_thread_of_blas
    from .many import scene
    from .timing import against, nodes_and_forces

    found = []
    with one_thread_of_blas():  # as a run has it
        for cells in (64, 128):
            grid = Grid([3.2] * 3, [cells] * 3)
            given = nodes_and_forces(grid, "peskin4", 41)
            for name, kind in (("FFT", StokesSolve), ("pruned FFT", PrunedSolve)):
                two, one = (partial(kind(grid, 1.0, count).velocity, *given) for count in (2, 1))
                piece = f"IB velocity by {name}, {cells}^3, two threads on a busy machine"
                found.append(against(piece, two, "one thread", one, BAR))
        text = scene(20, 50, 64) + "[compute]\nthreads = "
        many, few = (Simulation(parse_case(f"{text}{count}", "bench")) for count in (2, 1))
        piece = "a step of 20 x 50 nodes, two threads on a busy machine"
        found.append(against(piece, partial(_step, many), "one thread", partial(_step, few), BAR))
    return [asdict(row) for row in found]


def _step(simulation: Simulation) -> None:
    simulation.accept(simulation.attempt(0.01), simulation.time + 0.01)


def measured() -> list[dict]:
    """The rows, while other processes keep all cores but one busy."""
    idle = "import os, time\nwhile os.getppid() == {}: sum(range(10**6))"
    busy = [sys.executable, "-c", idle.format(os.getpid())]
    others = [subprocess.Popen(busy) for _ in range(max(1, (os.cpu_count() or 2) - 1))]
    try:
        words = [sys.executable, "-m", "ibfil.bench.threads"]
        return json.loads(subprocess.run(words, stdout=subprocess.PIPE, check=True, text=True).stdout)
    finally:
        for process in others:
            process.kill()


if __name__ == "__main__":
    from ..threads import set_threads

    set_threads(2)
    print(json.dumps(rows()))
