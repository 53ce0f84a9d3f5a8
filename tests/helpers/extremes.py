"""Stability at the extremes: the default scheme, untuned, from the softest scenes to the stiffest.

Each cell of the map is one run over a period, judged against one with a four times finer step: it survives where it
is finite, Newton converged, each segment's stretch is within two percentage points of the finer run's, and the RMS
position within 5 % of L, at three times in the period. ``PYTHONPATH=.:tests python -m helpers.extremes`` prints the map
and the numbers of all cells; with ``stokes`` at its end those of one fluid. Lengths are in units of L, A1 = 1,
omega = 10 is the rate of the wave of preferred curvature, or of the clamp's spin.

    .  survives, every step solved at once
    h  survives, some steps were halved on the way (Newton's iteration failed)
    c  both runs stop where a segment has collapsed to a fifth of its length or grown to twice it (Simulation's own
       limits): no solution to follow. EA 50, Re 100, eta 100: at t = 0.63 with 20 nodes and 0.54 with 41, whether
       with 100 steps a period or 400, and 0.52 with 81; at 0.65 and 0.56 with 25
    s  differs from the finer run, which is soft: P = M1 O1 + M2 O2 comes above 0.3 EA. That number is read off this
       map, where nothing below it fails; many cells above it survive. A wave of curvature 8/L met half a period
       late, as at large eta, has P = 128 A/L^2. EA 50, Re 10, eta 100: stretched by 80 %, 2.9 and 3.9 points off
       with 25 steps a period, 1.0 and 1.1 with 50, 0.2 and 0.3 with 100
    t  refused, at finer steps too: the clamp winds the rod up to half a turn between nodes before the twist can
       spread; more nodes where that is meant
    !  fails otherwise
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from helpers.scenes import RFT, rms, scene
from ibfil.case.schema import Case
from ibfil.errors import RunFailed
from ibfil.simulation.simulation import Simulation

OMEGA = 10.0
UMAX = 0.8  # of the swimmer's fastest node, omega = 10, L = 1
PERIOD, LOOKS, FINER = 6.3, 3, 4  # radians, a multiple of 3 steps of 0.3, 0.1 and 0.03
STRETCH, PLACE = 0.02, 0.05
SOFT = 0.3  # of P/EA, see above
STOPS = {"half a turn": "t", "times its rest length": "c"}  # where both runs stop so


@dataclass(frozen=True)
class Cell:
    """One scene and its step."""

    build: str = "swimmer"  # or "ribbon": bent and spun at a clamp
    fluid: str = "rft"
    step: float = 0.3  # omega dt
    eta: float = 1.0  # eta omega L^4/A1 / 10
    stretching: float = 1.6e4  # EA L^2/A1
    nodes: int = 41
    apart: float = 1.0  # ds/h, on a grid
    flat: float = 1.0  # A1/A2; C = A2
    radius: float = 0.01  # a/L of the drag against spin
    re: float = 0.0  # rho umax L/eta, in navier-stokes; umax = 0.8 is the fastest node's


@dataclass
class Path:
    """What is kept of a run: positions and stretch at each look, and how it went."""

    looks: list[tuple[np.ndarray, np.ndarray]]
    halved: int
    iterations: int  # the most in a step
    pull: float  # the largest (M1 O1 + M2 O2)/EA
    words: str  # why it failed
    until: float = 0.0  # the time it came to


@dataclass(frozen=True)
class Verdict:
    """A cell's mark, largest differences from the finer run, and both runs."""

    mark: str
    place: float
    stretch: float
    path: Path
    finer: Path


def _rod(cell: Cell) -> dict[str, Any]:
    table = {"length": 1.0, "nodes": cell.nodes, "stretching": cell.stretching, "shape": {"kind": "relaxed"}}
    if cell.build == "swimmer":
        return {**table, "bending": 1.0, "curvature": [f"8*sin(4*pi*s - {OMEGA}*t)", 0]}
    return {
        **table,
        "bending": [1.0, 1.0 / cell.flat],
        "twisting": 1.0 / cell.flat,
        "radius": cell.radius,
        "curvature": [2.0, 1.0],
        "anchor": "start",
        "direction": [1, 0, 0],
        "normal": [0, 1, 0],
        "start": {"end": "clamped", "spin": OMEGA},
    }


def _fluid(cell: Cell) -> dict[str, Any]:
    """On a grid, the smallest box of at least 1.4 L."""
    if cell.fluid == "rft":
        return dict(RFT)
    h = 1.0 / (cell.nodes - 1) / cell.apart
    cells = 2 * int(np.ceil(0.7 / h))
    grid = {"model": cell.fluid, "box": [cells * h] * 3, "cells": [cells] * 3, "slip": 0.01, "method": "table"}
    return grid | ({"density": cell.re * cell.eta / UMAX} if cell.re else {})


def _first(cell: Cell) -> int:
    """How many looks lie in the period that a fluid with inertia takes to come into motion."""
    return LOOKS if cell.re else 0


def case(cell: Cell, finer: int = 1) -> Case:
    """The cell's case, with a step so many times finer."""
    step, end = cell.step / OMEGA / finer, PERIOD / OMEGA * (2 if cell.re else 1)
    return scene({"rod": _rod(cell)}, _fluid(cell), viscosity=cell.eta, end=end, step=step)


def follow(cell: Cell, finer: int = 1) -> Path:
    """Runs a cell to its end, or to where it fails."""
    simulation = Simulation(case(cell, finer))
    rods, path = simulation.system, Path([], 0, 0, 0.0, "")

    def watch() -> None:
        shape = simulation.configuration
        pull = np.sum(rods.moment(shape, simulation.time).bend * shape.bend, axis=1) / cell.stretching
        path.pull = max(path.pull, float(np.max(pull)))
        path.iterations = max(path.iterations, int(simulation.snapshot().diagnostics["newton_iterations"]))

    count = LOOKS + _first(cell)
    try:
        for k in range(1, count + 1):
            simulation.advance(simulation.case.time.end * k / count, watch)
            path.looks.append((simulation.configuration.r, simulation.configuration.length[:-1] / rods.mesh.ds[:-1]))
    except RunFailed as failed:
        watch()
        path.words = str(failed)
    path.halved, path.until = simulation.shortened, simulation.time
    return path


def judge(cell: Cell) -> Verdict:
    """Runs a cell and its finer run, and compares."""
    path, finer = follow(cell), follow(cell, FINER)
    pairs = list(zip(path.looks, finer.looks, strict=False))
    place = max((rms(a[0] - b[0]) for a, b in pairs), default=np.nan)
    stretch = max((float(np.max(np.abs(a[1] - b[1]))) for a, b in pairs[_first(cell) :]), default=np.nan)
    if not path.words and not finer.words and place <= PLACE and stretch <= STRETCH:
        mark = "h" if path.halved else "."
    else:
        mark = next((mark for words, mark in STOPS.items() if words in path.words and words in finer.words), "")
        mark = mark or ("s" if finer.pull > SOFT else "!")
    return Verdict(mark, place, stretch, path, finer)


# The map: each table has a name, rows and columns; a square of it shows the marks of several steps.

STEPS = (0.3, 0.1, 0.03)
ETAS = (1e-3, 0.1, 1.0, 10.0, 100.0, 1e3)
GRIDS = [(20, 2.0), (20, 1.0), (41, 0.5), (100, 0.25), (200, 0.1), (400, 0.1)]  # N, ds/h
Table = tuple[str, list[dict[str, Any]], list[dict[str, Any]], tuple[float, ...], partial]


def _named(**axes: tuple) -> list[dict[str, Any]]:
    return [dict(zip(axes, values, strict=True)) for values in product(*axes.values())]


TABLES: list[Table] = [
    (
        "rft swimmer",
        _named(nodes=(20, 100, 400), eta=ETAS),
        _named(stretching=(50.0, 100.0, 400.0, 1.6e4, 1e6)),
        STEPS,
        partial(Cell),
    ),
    (
        "rft ribbon",
        _named(flat=(1.0, 10.0, 100.0), eta=ETAS),
        _named(radius=(1e-3, 0.01, 0.1), stretching=(50.0, 1.6e4, 1e6)),
        (0.3, 0.1),
        partial(Cell, "ribbon"),
    ),
    (
        "stokes swimmer",
        [{"nodes": n, "apart": apart, "eta": eta} for n, apart in GRIDS for eta in (1e-3, 1.0, 1e3)],
        _named(stretching=(50.0, 1.6e4, 1e6)),
        (0.3,),
        partial(Cell, fluid="stokes"),
    ),
    (
        "inertia swimmer",
        _named(re=(1e-4, 1e-2, 1.0, 10.0, 100.0), eta=(1e-2, 1.0, 100.0)),
        [{"nodes": n, "apart": apart, "stretching": ea} for n, apart in GRIDS[1:3] for ea in (50.0, 1.6e4, 1e6)],
        (0.25,),
        partial(Cell, fluid="navier-stokes"),
    ),
    (
        "stokes swimmer, fine steps",
        [{"nodes": n, "apart": apart, "eta": eta} for n, apart in GRIDS[:4] for eta in (1e-3, 1.0, 1e3)],
        _named(stretching=(50.0, 1.6e4, 1e6)),
        (0.03,),
        partial(Cell, fluid="stokes"),
    ),
    (
        "stokes ribbon",
        _named(flat=(1.0, 100.0), eta=(1e-3, 1.0, 1e3)),
        _named(radius=(1e-3, 0.1), stretching=(50.0, 1.6e4)),
        (0.3, 0.1),
        partial(Cell, "ribbon", fluid="stokes", nodes=20),
    ),
]


def _text(keys: dict[str, Any]) -> str:
    return " ".join(f"{key}={value:g}" for key, value in keys.items())


def tables(only: str = "") -> Iterator[tuple[Cell, Verdict]]:
    """Prints the map, a row as soon as it is known, and gives each cell with its verdict."""
    for name, rows, columns, steps, build in TABLES:
        if only not in name:
            continue
        print(f"\n{name}, omega dt = {', '.join(map(str, steps))}; columns: {', '.join(map(_text, columns))}")
        for row in rows:
            squares = []
            for column in columns:
                cells = [build(step=step, **row, **column) for step in steps]
                verdicts = [judge(cell) for cell in cells]
                squares.append("".join(verdict.mark for verdict in verdicts))
                yield from zip(cells, verdicts, strict=True)
            print(f"{_text(row):32} {'  '.join(squares)}", flush=True)


def line(cell: Cell, verdict: Verdict) -> str:
    """One line of the list of cells."""
    keys = (
        cell.build,
        cell.fluid,
        cell.step,
        cell.eta,
        cell.stretching,
        cell.nodes,
        cell.apart,
        cell.flat,
        cell.radius,
        cell.re,
    )
    a, b = verdict.path, verdict.finer
    numbers = f"{verdict.place:.1e},{verdict.stretch:.1e},{b.pull:.2g},{a.halved},{b.halved},{a.iterations}"
    numbers += f",{a.until:.3g},{b.until:.3g}"
    return f"{verdict.mark},{','.join(f'{k:g}' if isinstance(k, float) else str(k) for k in keys)},{numbers},{a.words}"


def main() -> None:
    """The map, then every cell, then how many of each mark."""
    found = list(tables(*sys.argv[1:2]))
    keys = "mark,build,fluid,omega dt,eta,EA,N,ds/h,A1/A2,a/L,Re"
    print(f"\n{keys},position,stretch,pull,halved,finer,iterations,until,finer,words")
    for cell, verdict in found:
        print(line(cell, verdict))
    print("\n" + ", ".join(f"{mark} {count}" for mark, count in Counter(v.mark for _, v in found).most_common()))


if __name__ == "__main__":
    main()
