"""The parts of `ibfil bench`, and the table or JSON they end in."""

from __future__ import annotations

import json as json_format
from collections.abc import Callable, Sequence
from dataclasses import asdict

from ..errors import CaseError
from . import first_step as bench_first_step
from . import linked as bench_linked
from . import many as bench_many
from . import members as bench_members
from . import pieces
from . import processes as bench_processes
from . import spaces as bench_spaces
from . import swimming as bench_swimming
from . import thermal as bench_thermal
from . import threads as bench_threads
from . import whole_studies as bench_studies
from .timing import Row, table


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


def million(steps: int = 2, scenes: tuple[tuple[int, int], ...] = bench_many.SUSPENSION) -> list[Row]:
    """10^6 nodes: a step against 10 s, time a node against that of 10^4 at the same density, memory against 4 GB."""
    few, lots = (bench_many.measured(count, 50, cells, steps, "suspension") for count, cells in scenes)
    (a, _), (b, cells) = scenes
    name, step = f"{b} x 50, {cells}^3, apart", lots["seconds"] * 50 * b
    how = f"products {lots['products']:.0f}, {few['products']:.0f}"
    ratio = lots["seconds"] / few["seconds"]
    return [
        Row(f"{name}: a step, processor", step, "10 s on two", 20.0, step / 20.0, 1.0),
        Row(f"{name}: a node and step ({how})", lots["seconds"], f"{a} x 50", few["seconds"], ratio, 1.0),
        Row(f"{name}: peak memory", lots["peak"], "4 GB", 4e9, lots["peak"] / 4e9, 1.0, "B"),
    ]


def threads() -> list[Row]:
    """Two threads against one on a busy machine."""
    return [Row(**row) for row in bench_threads.measured()]


def _inertia() -> list[Row]:
    """Steps of Navier-Stokes flow in double and single precision, and what they take a cell."""
    rows = [pieces.inertia(), pieces.inertia(precision="single", bar=None)]
    return [*rows, *(pieces.a_cell(row) for row in rows)]


PARTS: dict[str, Callable[[], list[Row]]] = {
    "pieces": lambda: [
        pieces.rft_step(),
        *pieces.evaluations(64, (1.15, 1 / 3.5)),
        *pieces.evaluations(128, (1.3, 1 / 5)),
        *_inertia(),
        pieces.table_pair("peskin4", 1.0),
        pieces.table_pair("bkp6", 4.5),
        pieces.table_of_a_swimmer(),
        pieces.swimmer_step(),
        pieces.start_up(),
    ],
    "spaces": lambda: [
        *bench_spaces.tables(),
        *bench_spaces.steps(),
        bench_spaces.wall_pairs("peskin4", 3.0),
        bench_spaces.wall_pairs("bkp6", 3.0),
        *bench_spaces.transforms(),
    ],
    "start": lambda: bench_first_step.first_step(),
    "thermal": lambda: bench_thermal.steps(),
    "swimmer": lambda: pieces.swimmers(),
    "large": lambda: [pieces.inertia(128), *pieces.evaluations(256, (1.3, 1 / 6))],
    "links": lambda: [*bench_linked.linked(6, (280.0, None)), *bench_linked.linked(2, (165.0, None))],
    "body": lambda: bench_swimming.heads(),
    "studies": lambda: bench_studies.costs(),
    "threads": threads,
    "many": lambda: many(),
    "million": lambda: million(),
    "members": lambda: bench_members.members(),
    "mpi": lambda: bench_processes.measured(),
}
USUAL = ("pieces", "swimmer")


def main(json: bool = False, parts: Sequence[str] = ()) -> int:
    """Measures the parts asked for and prints a table, or JSON. Returns 0: a busy machine is no failure.

    The usual ones, where none is named, take a minute or two; "large" needs 1 GiB, "many" some ten minutes and 2 GiB,
    "members" some three minutes. "million" was never run to its end (README.md): 8 GB or more, half an hour by counts.
    Raises CaseError for a part there is not.
    """
    for part in set(parts) - set(PARTS):
        raise CaseError([f"bench: found {part}; allowed: {', '.join(PARTS)}"])
    parts = parts or USUAL
    rows = [row for part in parts for row in PARTS[part]()]
    print(json_format.dumps([asdict(row) for row in rows], indent=1) if json else table(rows))
    return 0
