"""Only what the scene requires: what a case does not name is not built, not called, not allocated."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.made_run import BENT

from ibfil.case.reading import parse_case
from ibfil.check.budget import memory, shares, terms
from ibfil.check.report import report
from ibfil.fluids import fields
from ibfil.grid import fft
from ibfil.rods import system
from ibfil.rods.contact import Contact
from ibfil.running import loop
from ibfil.running.run import run
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping import brownian

BOX = ("fluid.box=[2.0, 2.0, 2.0]", "fluid.cells=[16, 16, 16]", "time.end=0.01", "output.every=0.002")
GRID = ("fluid.model=stokes",)
ALL = ("filament.rod.twisting=1.0", "filament.rod.radius=0.01", "thermal.energy=1e-9", "contact.action=warn")


def case(*overrides: str):
    return parse_case(BENT, "bent.toml", (*BOX, *overrides))


def ran(*overrides: str):
    return run(case(*overrides), progress=False, log=lambda line: None)


class Counter:
    """Counts the calls of a function that it stands in for."""

    def __init__(self, monkeypatch, place, name: str) -> None:
        self.calls = 0
        inner = getattr(place, name)

        def counted(*given, **named):
            self.calls += 1
            return inner(*given, **named)

        monkeypatch.setattr(place, name, counted)


def test_no_fft_plan_in_rft(monkeypatch):
    plans = Counter(monkeypatch, fft.VectorTransform, "__init__")
    ran()
    assert plans.calls == 0
    ran(*GRID, "fluid.method=fft")
    assert plans.calls > 0  # the same counter where there is one


def test_the_table_steps_without_a_transform_of_the_grid(monkeypatch):
    plans = Counter(monkeypatch, fft.VectorTransform, "__init__")
    ran(*GRID, "fluid.method=table")
    assert plans.calls == 0


def test_no_random_numbers_without_thermal_forces(monkeypatch):
    drawn = Counter(monkeypatch, np.random, "default_rng")
    noise = Counter(monkeypatch, brownian.Noise, "__init__")
    ran()
    ran(*GRID)
    assert drawn.calls == noise.calls == 0
    ran(*ALL)
    assert noise.calls == 1


def test_no_twist_unknowns_without_twisting():
    plain, twisted = Simulation(case()), Simulation(case(*ALL[:2]))
    assert plain.system.unknowns == 3
    assert plain.state()["velocity"].shape == (9, 3)
    assert twisted.system.unknowns == 4
    assert twisted.state()["velocity"].shape == (9, 4)


def test_no_fluid_around_the_fluid_where_rods_feel_nothing_of_their_velocity():
    plain, thick = Simulation(case()), Simulation(case("fluid.thick={aspect=9}"))
    assert plain.fluid is plain.model.inner
    assert thick.fluid is not thick.model.inner
    assert "forces by velocity" not in memory(plain)
    assert "forces by velocity" in memory(thick)


def test_no_jacobian_in_explicit_runs(monkeypatch):
    jacobians = Counter(monkeypatch, system.RodSystem, "stiffness")
    explicit = ("time.scheme=explicit", "time.step=1e-5")
    steps = ran(*explicit).steps + ran(*explicit, *GRID).steps
    assert jacobians.calls == 2 < steps / 500  # one a run, to warn of a step that will diverge; none a step
    result = ran()
    assert jacobians.calls >= result.steps


def test_no_field_between_outputs_and_none_where_none_is_put_out(monkeypatch):
    looks = Counter(monkeypatch, fields.GridFields, "evaluate")
    made = Counter(monkeypatch, fields.GridFields, "__init__")
    heat = Counter(monkeypatch, fields.GridFields, "dissipation")
    ran(*GRID, "fluid.method=table")
    assert looks.calls == made.calls == heat.calls == 0
    ran(*GRID, "fluid.method=table", "output.grid_every=0.005")
    assert looks.calls == 3  # t = 0, 0.005, 0.01; ten steps, six outputs
    assert made.calls == 1
    ran(*GRID, "observe.heat.kind=dissipation")
    assert heat.calls == 7  # one an output, and one frame before the first, for the warnings


def test_no_contact_search_without_contact(monkeypatch):
    looks = Counter(monkeypatch, Contact, "watch")
    ran()
    assert looks.calls == 0
    ran(*ALL[:2], ALL[3])
    assert looks.calls >= 10


def test_nothing_is_written_where_no_file_is_asked_for(monkeypatch):
    written = Counter(monkeypatch, loop.checkpoint, "write")
    ran()
    assert written.calls == 0


def test_check_lists_each_term_with_its_share_and_no_other():
    plain = shares(terms(Simulation(case()), memory(Simulation(case()))))
    assert [name for name, _, _ in plain] == ["bending and stretching", "drag of each node"]
    whole = Simulation(case(*ALL))
    named = [name for name, _, _ in shares(terms(whole, memory(whole)))]
    assert named == ["bending and stretching", "twisting", "contact", "thermal noise", "drag of each node"]
    for simulation in (Simulation(case()), whole, Simulation(case(*GRID, "output.grid_every=0.005"))):
        found = shares(terms(simulation, memory(simulation)))
        assert sum(time for _, time, _ in found) == pytest.approx(1.0)
        assert sum(size for _, _, size in found) == pytest.approx(1.0)
        assert all(time >= 0 and size >= 0 for _, time, size in found)
    text = report(case(*GRID))
    assert "flow between nodes (table)" in text
    assert "fields written" not in text
    inertia = Simulation(case("fluid.model=navier-stokes", "fluid.density=1"))
    assert "inertia and advection" in [term.name for term in terms(inertia, memory(inertia))]


def test_the_sizes_are_those_of_the_terms():
    """What `check` says of memory is shared out among them, all of it; the drag's three numbers a node come on top."""
    thick, inertia = ("fluid.thick={aspect=9}",), ("fluid.model=navier-stokes", "fluid.density=1")
    for overrides in ((), thick, GRID, (*GRID, "output.grid_every=0.005"), inertia):
        simulation = Simulation(case(*overrides))
        listed = memory(simulation)
        drag = 0 if simulation.grid is not None else 3 * 8 * 9
        found = sum(term.bytes for term in terms(simulation, listed))
        assert found == pytest.approx(sum(listed.values()) + drag, rel=1e-12)
