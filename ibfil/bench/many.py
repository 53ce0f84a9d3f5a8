"""The part of `ibfil bench` about many filaments: time a node and memory of 10,000 nodes against those of 1,000.

Each scene is a run of its own process, which prints what it measured as JSON: memory is the peak of the process.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..case.schema import Case

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
SPACING, APART = 0.04, 0.08  # of the grid of a suspension, and between its rods, which are as thick: two cells
SHARE = 0.01  # of a step's own error, to which a suspension's equations are solved
SUSPENSION = ((200, 56), (20_000, 256))  # filaments of 50 nodes, cells: 10^4 and 10^6 nodes at one density
LIBRARIES = 250 * 2**20  # bytes that `check` says libraries take


def scene(count: int, nodes: int, cells: int) -> str:
    """Swimmers thrown into a box, each the one of Sec. 7.1."""
    return SCENE.format(count=count, nodes=nodes, cells=cells, step=STEP)


def suspension(count: int, nodes: int, cells: int) -> Case:
    """The same in a box of as many cells a side, apart from each other as their thickness has it, at half the step."""
    from ..case.reading import parse_case

    side = SPACING * cells
    half, region = 0.5 * side, "filament.rod.copies.region"
    overrides = [
        f"fluid.box=[{side}, {side}, {side}]",
        f"{region}=[[-{half}, -{half}, -{half}], [{half}, {half}, {half}]]",
    ]
    overrides += [f"filament.rod.copies.apart={APART}", f"time.step={0.5 * STEP}", f"time.solver_error={SHARE}"]
    return parse_case(scene(count, nodes, cells), "bench", [*overrides, "output.copies_every=100"])


def measure(case: Case, steps: int) -> dict[str, float | str]:
    """Seconds of the processors a node and step; the bytes that `check` tells, and the peak of this process."""
    import resource

    from ..check import budget
    from ..linalg import gmres
    from ..simulation.simulation import Simulation

    products, solve = 0, gmres.solve

    def counted(*given):
        nonlocal products
        found = solve(*given)
        products += found.products
        return found

    simulation, step = Simulation(case), float(case.time.step)
    told = sum(budget.memory(simulation).values()) + LIBRARIES
    simulation.advance(FIRST * step, lambda: None)
    gmres.solve = counted
    began = time.process_time()
    for k in range(FIRST, FIRST + steps):
        simulation.advance((k + 1) * step, lambda: None)
    seconds = (time.process_time() - began) / (steps * simulation.rods.count)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0
    return {
        "seconds": seconds,
        "told": told,
        "peak": peak,
        "products": products / steps,
        "halved": simulation.shortened,
        "method": simulation.method,
    }


def measured(count: int, nodes: int, cells: int, steps: int, kind: str = "thrown") -> dict:
    """The same by a process of its own, of swimmers ``thrown`` into a box or of a ``suspension``."""
    words = [sys.executable, "-m", "ibfil.bench.many", *map(str, (count, nodes, cells, steps)), kind]
    return json.loads(subprocess.run(words, stdout=subprocess.PIPE, check=True, text=True).stdout)


def main(words: list[str]) -> None:
    """COUNT NODES CELLS STEPS [KIND]; prints the measurement."""
    from ..threads import set_threads

    set_threads(1)
    from ..case.reading import parse_case

    count, nodes, cells, steps = map(int, words[:4])
    apart = words[4:] == ["suspension"]
    case = suspension(count, nodes, cells) if apart else parse_case(scene(count, nodes, cells), "bench")
    print(json.dumps(measure(case, steps)))


if __name__ == "__main__":
    main(sys.argv[1:])
