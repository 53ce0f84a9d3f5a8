"""Copies that differ: a row by formulas of i and phase, distances that are kept, observables of all of them."""

from __future__ import annotations

import csv

import numpy as np
import pytest

import ibfil
from ibfil import parse_case, run
from ibfil.analysis.summary import write_csv
from ibfil.case.formulas.evaluation import function_of
from ibfil.errors import CaseError
from ibfil.observables.factory import observers
from ibfil.simulation.simulation import Simulation

ROD = """
length = 1.0
nodes = 9
bending = {bending}
stretching = 100
curvature = ["1 + 2*cos(2*pi*s - 10*t + {phase})", 0]
direction = [0, 0, 1]
anchor = "start"
position = {position}
shape = {{ kind = "relaxed", perturb = [0, 0, 0] }}
start = {{ end = "clamped" }}
loads = {{ force = ["0.1*sin(3*t + {phase})", 0, 0] }}
"""
REST = """
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = 0.1
step = 0.02
[output]
every = 0.02
"""
ROW = "[filament.hair]" + ROD.format(bending='"1 + i"', phase="phase", position="[0, 0, 0]")
COPIES = 'copies = { count = 3, at = ["0.5*i", "-i", 0], phase = "0.7*i + x" }\n'
TIP = '[observe.tip]\nkind = "position"\nfilament = "hair"\nat = "finish"\ncopies = "{}"\n'


def row(copies: str = COPIES, more: str = "", **overrides):
    return parse_case(ROW + copies + REST + more, "row.toml", overrides)


def test_a_row_is_the_filaments_that_it_stands_for():
    apart = "".join(
        f"[filament.hair{i}]" + ROD.format(bending=1 + i, phase=0.7 * i + 0.5 * i, position=[0.5 * i, -i, 0])
        for i in range(3)
    )
    one, other = run(row()).snapshot.filaments, run(parse_case(apart + REST, "apart.toml")).snapshot.filaments
    for k in range(3):
        mine, its = one[f"hair_{k:03d}"], other[f"hair{k}"]
        assert np.abs(mine.position - its.position).max() < 1e-13
        assert np.abs(mine.velocity - its.velocity).max() < 1e-10
    still = one["hair_000"].position - one["hair_000"].position[0]
    assert np.abs(one["hair_001"].position - one["hair_001"].position[0] - still).max() > 0.01


def test_a_formula_is_compiled_once_for_all_copies():
    function_of.cache_clear()
    Simulation(row(COPIES.replace("count = 3", "count = 12")))
    many = function_of.cache_info().misses
    function_of.cache_clear()
    Simulation(row())
    assert many == function_of.cache_info().misses


def test_steps_follow_the_fastest_and_the_softest_copy():
    fast = row(more="").text.replace("10*t", "(10 + 50*i)*t")
    assert Simulation(parse_case(fast, "row.toml")).drivers.fastest > 3 * Simulation(row()).drivers.fastest


def test_phases_may_be_random_and_places_stay_as_they_were():
    region = "copies = { count = 20, seed = 3, region = [[0, 0, 0], [9, 9, 9]]%s }\n"
    plain = row(region % ", phase = 0")
    drawn = row(region % ', phase = "random"')
    a, b = Simulation(plain).rods, Simulation(drawn).rods
    phases = b.variation("hair", plain.filaments["hair"].curvature[0])["phase"]
    assert np.array_equal(a.start.r[::9], b.start.r[::9])
    assert 0 <= phases.min() < 1.2
    assert 5 < phases.max() < 2 * np.pi
    assert len(np.unique(phases)) == 20


def test_a_file_of_places_keeps_the_orientation(tmp_path):
    (tmp_path / "places.csv").write_text("x,y,z\n0,0,0\n3,0,0\n")
    text = ROW.replace('"1 + i"', "1") + 'copies = { file = "places.csv", phase = 0 }\n' + REST
    rods = Simulation(parse_case(text, str(tmp_path / "row.toml"))).rods
    first, second = (rods.start.r[where] for where in rods.nodes)
    assert np.array_equal(first + np.array([3.0, 0.0, 0.0]), second)


def _distance(one: np.ndarray, other: np.ndarray) -> float:
    """The least distance of two straight rods, by many points of each."""
    at = np.linspace(0, 1, 81)[:, None]
    p, q = (ends[0] + at * (ends[1] - ends[0]) for ends in (one, other))
    return float(np.min(np.linalg.norm(p[:, None] - q, axis=2)))


BOX = '[fluid]\nmodel = "stokes"\nviscosity = 1.0\nbox = [1.6, 1.6, 1.6]\ncells = [8, 8, 8]\n'


@pytest.mark.parametrize("periodic", [False, True])
def test_random_places_keep_their_distance_also_across_the_faces_of_a_box(periodic):
    text = """[filament.rod]
length = 1.0
nodes = 9
bending = 1
stretching = 100
twisting = 1.0
radius = 0.1
copies = { count = 8, seed = 2, region = [[-0.8, -0.8, -0.8], [0.8, 0.8, 0.8]]%s }
"""
    rest = REST.replace(REST[: REST.index("[time]")], BOX) if periodic else REST
    images = [np.array(m) * 1.6 for m in np.ndindex(3, 3, 3)] if periodic else [np.zeros(3)]
    images = [m - 1.6 for m in images] if periodic else images

    def least(more: str) -> float:
        rods = Simulation(parse_case(text % more + rest, "rods.toml")).rods
        ends = [rods.start.r[where][[0, -1]] for where in rods.nodes]
        pairs = [(a, b) for k, a in enumerate(ends) for b in ends[:k]]
        return min(_distance(a, b + shift) for a, b in pairs for shift in images)

    assert least("") < 0.15 <= least(", apart = 0.15")


def test_no_room_and_places_that_are_too_near_are_told():
    region = 'region = [[0, 0, 0], [0.1, 0.1, 0.1]], orientation = "same"'
    crowded = f"copies = {{ count = 9, {region}, apart = 0.3, phase = 0 }}\n"
    with pytest.raises(CaseError, match=r"copies.apart: found no room for copy \d+ in 1000 draws"):
        Simulation(row(crowded))
    with pytest.raises(CaseError, match=r"copies.apart: found copies 0 and 1 within 0\.\d+; allowed: places 0.6 apart"):
        Simulation(row('copies = { count = 3, at = ["0.5*i", 0, 0], phase = 0, apart = 0.6 }\n'))


def test_the_mean_the_spread_and_each_of_the_copies(tmp_path):
    more = "".join(
        TIP.format(how).replace("tip", how) + 'along = [1, 0, 0]\nsummary = "mean"\n'
        for how in ("mean", "spread", "all")
    )
    result = run(row(more=more), tmp_path / "row.h5")
    file = ibfil.open(tmp_path / "row.h5")
    tips = np.stack([np.asarray(file.filaments[f"hair_{k:03d}"]["position"])[:, -1, 0] for k in range(3)], axis=1)
    over = np.trapezoid(tips, file.time, axis=0) / file.time[-1]
    assert np.allclose(np.asarray(file.observables["mean"]), tips.mean(axis=1), atol=1e-14)
    assert np.allclose(np.asarray(file.observables["spread"]), tips.std(axis=1, ddof=1), atol=1e-14)
    assert np.allclose(np.asarray(file.observables["all"]), tips, atol=1e-14)
    assert np.isclose(result.summaries["mean"].value, over.mean(), rtol=1e-12)
    assert np.allclose(result.summaries["all"].value, over, rtol=1e-12)
    for name, value in file.numbers.items():
        assert np.array_equal(value, result.summaries[name].value)
    write_csv(file, tmp_path / "row.csv")
    names = next(csv.reader((tmp_path / "row.csv").open()))
    assert sorted(names) == ["all_000", "all_001", "all_002", "mean", "spread", "time"]


def test_of_a_fit_the_mean_is_of_the_copies_numbers(tmp_path):
    one = "".join(f'[observe.v{k}]\nkind = "drift"\nfilament = "hair_00{k}"\nat = "finish"\n' for k in range(3))
    more = '[observe.v]\nkind = "drift"\nfilament = "hair"\nat = "finish"\ncopies = "mean"\n' + one
    found = {name: summary.value for name, summary in run(row(more=more), tmp_path / "row.h5").summaries.items()}
    assert np.allclose(found["v"], np.mean([found[f"v{k}"] for k in range(3)], axis=0), rtol=1e-12)
    assert np.array_equal(ibfil.open(tmp_path / "row.h5").numbers["v"], found["v"])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (ROW + REST, r"filament.hair.bending.0: found i, and no copies; allowed: them with filament.hair.copies"),
        (ROW + COPIES.replace(', phase = "0.7*i + x"', "") + REST, "found phase, and no filament.hair.copies.phase"),
        (ROW.replace("1 + i", "1 - i") + COPIES + REST, "bending.*> 0"),
        (ROW.replace("1 + i", "1 + phase") + COPIES + REST, "bending.0: found phase; allowed: s, i and"),
        ("[parameters]\nphase = 1\n" + ROW + COPIES + REST, "parameters.phase: found a parameter named like the phase"),
        (ROW + COPIES + REST + TIP.format("all"), '"all" of position, three numbers'),
        (ROW + COPIES + REST + TIP.format("none"), 'copies = "mean"'),
        (ROW + COPIES.replace("at =", "region = [[0,0,0],[1,1,1]], at =") + REST, "found region and at"),
        (ROW + COPIES + REST + '[observe.f]\nkind = "dissipation"\nfilament = "hair"\ncopies = "mean"\n', "together"),
    ],
)
def test_what_does_not_go_together_is_told(text, told):
    with pytest.raises(CaseError, match=told):
        observers(Simulation(parse_case(text, "row.toml")).case)


def test_a_parameter_named_phase_is_what_it_was():
    case = parse_case(
        "[parameters]\nphase = 0.5\n"
        + ROD.join(["[filament.hair]", ""]).format(bending=1, phase="phase", position=[0, 0, 0])
        + REST,
        "old.toml",
    )
    assert case.filaments["hair"].curvature[0].variables == {"s", "t"}
