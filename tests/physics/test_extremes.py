"""Stability at the extremes: some cells of the map of extremes.py, and all of them."""

from __future__ import annotations

import pytest
from helpers.extremes import Cell, judge, tables

SWIMMERS = [
    Cell(eta=1e-3, stretching=1e6, nodes=400),
    Cell(eta=1e3, stretching=1e6, nodes=20),
    Cell(eta=1e3, nodes=400),
    Cell(eta=1e3, stretching=400.0, nodes=100),
    Cell(eta=10.0, stretching=50.0, nodes=20, step=0.03),
    # Whole corrections of Newton's iteration reverse tangents in these: it takes cut ones, from the extrapolation.
    Cell(eta=1e-3, stretching=50.0, nodes=100),
    Cell(eta=1.0, stretching=50.0, nodes=400),
    Cell(eta=0.1, stretching=50.0, nodes=400, step=0.1),
    Cell(eta=100.0, stretching=400.0, nodes=400),
]
IMMERSED = [
    Cell(fluid="stokes", eta=1e-3, nodes=20, apart=2.0),
    Cell(fluid="stokes", eta=1e3, stretching=1e6, nodes=20, apart=2.0),
    Cell(fluid="stokes", eta=1e-3, stretching=1e6, nodes=41, apart=0.5),
    Cell(fluid="stokes", eta=1.0, stretching=50.0, nodes=41, apart=0.5, step=0.1),
    Cell(fluid="stokes", eta=1.0, stretching=50.0, nodes=100, apart=0.25),
    Cell(fluid="stokes", eta=1.0, nodes=100, apart=0.1),
]
INERTIAL = [
    Cell(fluid="navier-stokes", step=0.25, re=re, eta=eta, nodes=20)
    for re, eta in ((1e-4, 1.0), (1.0, 0.01), (100.0, 0.01), (100.0, 1.0), (100.0, 100.0))
] + [Cell(fluid="navier-stokes", step=0.25, re=100.0, stretching=50.0, nodes=20)]
RIBBONS = [
    Cell("ribbon", eta=1e-3, flat=100.0),
    Cell("ribbon", eta=1e-3, flat=100.0, radius=0.1),
    Cell("ribbon", eta=1.0, flat=100.0, radius=1e-3),
    Cell("ribbon", eta=0.1, flat=10.0, radius=0.1, stretching=50.0),
    Cell("ribbon", eta=1e3, flat=10.0, radius=1e-3),
    # Where it kinks, a quarter of this step leads from the extrapolation to another solution, which collapses.
    Cell("ribbon", stretching=50.0, radius=1e-3, step=0.1),
    Cell("ribbon", "stokes", eta=1.0, flat=100.0, nodes=20),
    Cell("ribbon", "stokes", eta=1e3, radius=1e-3, nodes=20),
]


@pytest.mark.parametrize("cell", SWIMMERS + IMMERSED + INERTIAL + RIBBONS, ids=str)
def test_the_default_scheme_survives_and_solves_every_step_at_once(cell: Cell) -> None:
    assert judge(cell).mark == "."


@pytest.mark.parametrize(
    ("cell", "mark"),
    [
        (Cell(eta=1e3, stretching=50.0, nodes=20), "c"),
        (Cell("ribbon", eta=100.0, flat=100.0, radius=0.1), "t"),
    ],
)
def test_where_finer_steps_stop_too_it_is_told_how(cell: Cell, mark: str) -> None:
    assert judge(cell).mark == mark


@pytest.mark.parametrize(("nodes", "apart"), [(20, 1.0), (41, 0.5)])
def test_a_rod_that_tears_in_a_heavy_fluid_tears_at_the_same_time_with_finer_steps(nodes: int, apart: float) -> None:
    cell = Cell(fluid="navier-stokes", step=0.25, re=100.0, eta=100.0, stretching=50.0, nodes=nodes, apart=apart)
    verdict = judge(cell)
    assert verdict.mark == "c"
    assert verdict.place < 1e-3
    assert verdict.path.until == pytest.approx(verdict.finer.until, rel=0.05)


@pytest.mark.slow
def test_the_whole_map_fails_for_known_causes_only() -> None:
    """And with halved steps in one cell out of ten at the most."""
    marks = []
    for cell, verdict in tables():
        marks.append(verdict.mark)
        assert verdict.mark in ".hcst", cell
        if verdict.mark in "cs":
            assert cell.stretching <= 100
            assert cell.eta >= 100
        if verdict.mark == "t":
            assert cell.build == "ribbon"
    assert marks.count("h") < 0.1 * len(marks)
