"""Steps with thermal forces against the semi-implicit steps of the same scene without."""

from __future__ import annotations

from collections.abc import Callable

from ..case.reading import parse_case
from ..simulation.simulation import Simulation
from .timing import Row, against, case_text

STEP = 1e-4
HEAT = ("thermal={energy=1e-3, seed=1, directions='xy'}",)


def _stepping(nodes: int, model: str, method: str, *changes: str) -> Callable[[], object]:
    simulation = Simulation(parse_case(case_text(nodes, model, method, "semi-implicit", STEP), "bench", changes))
    simulation.advance(10 * STEP, lambda: None)
    return lambda: simulation.attempt(STEP)


def steps(nodes: int = 41, short: int = 33) -> list[Row]:
    """Of the swimmer, by the table and in resistive-force theory; the correction is a second force and solve.

    Random numbers alone make the second 1.29; what was tried to do without the rest is in timestepping/README.md.
    """
    scenes = ((nodes, "stokes", "table", 2.3), (short, "rft", "auto", 1.3))
    return [
        against(
            f"step with thermal forces, {model}, N = {count}",
            _stepping(count, model, method, *HEAT),
            "without, semi-implicit",
            _stepping(count, model, method),
            bar,
        )
        for count, model, method, bar in scenes
    ]
