"""What a step costs, from counts: every method that a case may name has its number, and the scheme is counted in."""

from __future__ import annotations

import pytest

from ibfil.assembly.costs import seconds_a_step
from ibfil.case.reading import parse_case

SCENE = """
[filament.rod]
length = 1.0
nodes = 21
bending = 1.0
twisting = 1.0
radius = 0.02
stretching = 100.0
[fluid]
model = "{model}"
density = 1.0
viscosity = 1.0
box = [2.0, 2.0, 2.0]
cells = [64, 64, 64]
[time]
end = 1.0
scheme = "{scheme}"
[output]
every = 0.1
"""
METHODS = {
    ("stokes", 3): {"table", "fft", "pruned", "krylov"},
    ("stokes", 4): {"table", "fft", "krylov"},
    ("navier-stokes", 3): {"table", "fft", "krylov"},
    ("navier-stokes", 4): {"table", "fft", "krylov"},
}


@pytest.mark.parametrize("scheme", ["explicit", "semi-implicit", "implicit"])
@pytest.mark.parametrize(("model", "parts"), METHODS)
def test_every_method_that_may_be_asked_for_has_its_seconds(model, parts, scheme):
    """`check` reads the number of the method that the case names, whatever its scheme."""
    case = parse_case(SCENE.format(model=model, scheme=scheme), "costs.toml")
    found = seconds_a_step(case, [21], [64] * 3, [16] * 3, parts)
    assert set(found) == METHODS[model, parts]
    assert all(seconds > 0 for seconds in found.values())


@pytest.mark.parametrize(("model", "parts"), METHODS)
def test_an_explicit_step_costs_no_solve_and_torques_cost_more(model, parts):
    texts = (SCENE.format(model=model, scheme=scheme) for scheme in ("explicit", "implicit"))
    explicit, implicit = (parse_case(text, "costs.toml") for text in texts)
    for rods in ([21], [100] * 5):
        once, solved = (seconds_a_step(case, rods, [64] * 3, [16] * 3, parts) for case in (explicit, implicit))
        assert all(once[method] < solved[method] for method in once)
        if parts == 4:
            without = seconds_a_step(implicit, rods, [64] * 3, [16] * 3, 3)
            assert all(without[method] < solved[method] for method in solved)
