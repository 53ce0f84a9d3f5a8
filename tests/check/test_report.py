"""What `ibfil check` foretells: nothing that a run refuses, and as many steps as a run takes."""

from __future__ import annotations

import pytest
from helpers.made_run import BENT
from helpers.runs import real

from ibfil.case.reading import parse_case
from ibfil.check.report import foretold_steps, report
from ibfil.errors import CaseError
from ibfil.running.run import run
from ibfil.simulation.simulation import Simulation

GRID = ("fluid.model=stokes", "fluid.box=[2,2,2]", "fluid.cells=[16,16,16]")


@pytest.mark.parametrize(
    "keys",
    [
        [],
        ["time.step=0.0017"],
        ["time.step=0.1"],
        ["output={times=[0.001, 0.0011, 0.013]}"],
        [*GRID, "output={every=0.01, grid_every=0.003}", "time.step=0.002"],
        ["time.step=auto"],
    ],
)
def test_as_many_steps_are_foretold_as_are_taken(keys):
    case = parse_case(BENT, "bent.toml", keys)
    (fewest, most), taken = foretold_steps(Simulation(case)), run(case, build=real, progress=False, log=len).steps
    few = 4 if case.output.times else 0  # by which steps grow after short ones, between outputs that are close
    assert fewest <= taken <= most + few
    assert (fewest == most) == (not case.time.automatic)
    assert f"about {most} steps" in report(case) or (
        case.time.automatic and f"about {fewest} to {most} steps" in report(case)
    )


def test_fibres_that_settle_take_few_of_the_steps_that_are_foretold_at_most():
    """Four of the 64 that sink for ten units of time: 9960 steps were taken where some hundred do."""
    keys = ["length=1.0", "nodes=11", "bending=1", "stretching=1e3", "loads.weight=[0, 0, -1]"]
    keys += ["copies={count=4, seed=1, region=[[-1, -1, -1], [1, 1, 1]]}"]
    sinking = "\n".join(f"{key}" for key in keys)
    text = f"[filament.f]\n{sinking}\n[fluid]\nmodel = 'rft'\nviscosity = 1\n[time]\nend = 10\n[output]\nevery = 0.25"
    case = parse_case(text.replace("copies={", "copies = {"), "sinking.toml")
    fewest, most = foretold_steps(Simulation(case))
    taken = run(case, build=real, progress=False, log=len).steps
    assert most > 9000
    assert fewest <= taken < 5 * fewest


@pytest.mark.parametrize(
    "table",
    [
        'observe.f={kind="force", at="start"}',
        'observe.f={kind="radius", at="finish"}',
        'observe.f={kind="position", at=[0.2, 0.5]}',
        'stop=[{observe="p", above=1}]',
        'observe.f={kind="position", filament="rod", at=[0.2, 2.5]}',
    ],
)
def test_what_a_run_refuses_a_check_refuses(table):
    told = []
    for do in (report, lambda case: run(case, build=real, progress=False, log=len)):
        with pytest.raises(CaseError) as refused:
            do(parse_case(BENT, "bent.toml", ['observe.p={kind="position"}', table]))
        told.append(refused.value.faults)
    assert told[0] == told[1]


def test_a_looser_solution_of_steps_is_told():
    told, whole = (report(parse_case(BENT, "bent.toml", keys)) for keys in (["time.solver_error=0.01"], []))
    assert "solved to 0.01 of what extrapolation was off by (time.solver_error)" in told
    assert "solver_error" not in whole
