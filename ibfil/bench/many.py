"""The part of `ibfil bench` about many filaments: time a node and memory of 10,000 nodes against those of 1,000.

Each scene is a run of its own process, which prints what it measured as JSON: memory is the peak of the process.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time

SCENE = """
[filament.rod]
length = 1.0
nodes = {nodes}
bending = 1.0
stretching = 400
curvature = ["8*sin(4*pi*s - 10*t)", 0]
shape = {{ kind = "relaxed" }}
copies = {{ count = {count}, seed = 5, region = [[-1.2, -1.2, -1.2], [1.2, 1.2, 1.2]] }}
[fluid]
model = "stokes"
viscosity = 1.0
box = [3.2, 3.2, 3.2]
cells = [{cells}, {cells}, {cells}]
[time]
end = 1.0
step = {step}
[output]
every = 1.0
"""
STEP = 0.025  # 25 a period
FIRST = 2  # steps that are not counted: Euler's, and the one after
PAIRS = ((50, 20, 200), (500, 2, 20))  # nodes a filament, filaments of 1,000 nodes, of 10,000
LIBRARIES = 250 * 2**20  # bytes that `check` says libraries take


def scene(count: int, nodes: int, cells: int) -> str:
    """Swimmers thrown into a box, each the one of Sec. 7.1."""
    return SCENE.format(count=count, nodes=nodes, cells=cells, step=STEP)


def measure(count: int, nodes: int, cells: int, steps: int) -> dict[str, float | str]:
    """Seconds a node and step; the bytes that `check` tells beforehand, and the peak of this process."""
    import resource

    from ..case.reading import parse_case
    from ..check import budget
    from ..linalg import gmres
    from ..simulation.simulation import Simulation

    products, solve = 0, gmres.solve

    def counted(*given):
        nonlocal products
        found = solve(*given)
        products += found.products
        return found

    simulation = Simulation(parse_case(scene(count, nodes, cells), "bench"))
    told = sum(budget.memory(simulation).values()) + LIBRARIES
    simulation.advance(FIRST * STEP, lambda: None)
    gmres.solve = counted
    began = time.perf_counter()
    for step in range(FIRST, FIRST + steps):
        simulation.advance((step + 1) * STEP, lambda: None)
    seconds = (time.perf_counter() - began) / (steps * count * nodes)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0
    return {
        "seconds": seconds,
        "told": told,
        "peak": peak,
        "products": products / steps,
        "halved": simulation.shortened,
        "method": simulation.method,
    }


def measured(count: int, nodes: int, cells: int, steps: int) -> dict:
    """The same by a process of its own."""
    words = [sys.executable, "-m", "ibfil.bench.many", *map(str, (count, nodes, cells, steps))]
    return json.loads(subprocess.run(words, capture_output=True, check=True, text=True).stdout)


def main(words: list[str]) -> None:
    """COUNT NODES CELLS STEPS; prints the measurement."""
    from ..threads import set_threads

    set_threads(1)
    print(json.dumps(measure(*map(int, words))))


if __name__ == "__main__":
    main(sys.argv[1:])
