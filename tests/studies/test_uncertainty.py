"""`ibfil uncertainty`: sources of error, sums, what is no number, refusals, files."""

from __future__ import annotations

import csv
import json
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.calibration import CLAMPED, RFT, TIP, Z, cube, rod, seen, until

from ibfil.case.reading import parse_case
from ibfil.commands.main import main
from ibfil.errors import CaseError, RunFailed
from ibfil.simulation.simulation import Simulation
from ibfil.studies.estimates import estimate
from ibfil.studies.uncertainty import levels, place, sampling, study
from ibfil.studies.uncertainty.results import Source
from ibfil.studies.uncertainty.study import uncertainty

SWAY = (
    rod(17, 2e3, ends=CLAMPED + '[filament.rod.loads]\nforce = [0, 0, "4*cos(6*t)"]\n')
    + RFT
    + until(0.5, 0.02, 0.05)
    + seen("tip", "position", at=TIP, along=Z)
    + seen("aside", "position", at=TIP, along="[0, 1, 0]")
)
SINKING = (
    rod(17, 1e3, 'anchor = "middle"\nloads = { weight = [0, 0, -5.0] }')
    + cube(24)
    + until(0.1, 0.01, 0.02)
    + seen("fall", "drift", at='"middle"', along=Z, over="[0.02, 0.1]")
)


def bars(case, folder, *overrides, **options):
    found = uncertainty(case, folder, overrides, log=lambda line: None, **options)
    return {bar.name: bar for bar in found.bars}, found


def source(bar, name):
    return next(one for one in bar.sources if one.name == name)


def test_the_error_of_a_coarse_run_is_told_with_its_sign(tmp_path):
    """Against a run 8 times finer in both directions."""
    found, whole = bars(SWAY, tmp_path / "a")
    fine, _ = bars(SWAY, tmp_path / "b", "time.step=0.0025", "filament.rod.nodes=129")
    bar, true = found["tip"], fine["tip"].corrected[0]
    assert abs(bar.value - true) < bar.bar < 1.5 * abs(bar.value - true)
    assert abs(bar.corrected[0] - true) < 0.05 * abs(bar.value - true)
    assert source(bar, "nodes").estimate.word == "seen"
    assert whole.runs <= 7


def test_a_number_that_vanishes_has_a_bar_of_round_off(tmp_path):
    found, _ = bars(SWAY, tmp_path, observe=["aside"])
    assert set(found) == {"aside"}
    assert abs(found["aside"].value) <= found["aside"].bar < 1e-8


def test_a_grid_adds_the_place_in_a_cell_and_the_images_of_a_net_force(tmp_path):
    """A box half as wide again falls short of an open fluid by what L^-1 says."""
    found, _ = bars(SINKING, tmp_path, meant=True)
    bar = found["fall"]
    assert source(bar, "place in a cell").estimate is not None
    images = source(bar, "images")
    assert images.words.startswith("L^-1")
    assert not images.numerical
    here, wider = images.estimate.values
    assert images.estimate.error == pytest.approx((here - wider) * 3.0, rel=1e-9)
    assert abs(bar.meant[0]) > abs(bar.corrected[0])  # an open fluid lets it sink faster


def test_the_shell_of_a_body_on_a_grid_is_told_as_not_looked_at(tmp_path):
    """The cells stay as they are, and with them its markers: the bar is a lower bound."""
    short = ("filament.tail.nodes=9", "fluid.spacing=0.045", "time.end=1/16", "time.step=1/32", "output.every=1/32")
    bar = bars("sperm_free", tmp_path, *short, observe=["along"])[0]["along"]
    assert source(bar, "shells of bodies").estimate is None
    assert not bar.whole
    assert source(bar, "place in a cell").estimate is not None


def test_a_number_that_the_levels_do_not_agree_on_is_none():
    three = Source("step", True, estimate([1.0, -0.5, 0.75], [4.0, 2.0, 1.0], 2.0, 1), "")
    assert study.nothing(-0.5, [three], 1.0).startswith("no number: its levels (step) are 1, -0.5, 0.75")
    assert study.nothing(-0.5, [three], 100.0) == ""  # next to what its series does, it is near zero and fine
    assert study.nothing(float("nan"), [], 1.0) == "no number: the run gives none"


def test_a_window_that_is_not_settled_is_told(tmp_path, capsys):
    case = tmp_path / "falls.toml"
    fit = seen("fall", "drift", at=TIP, along=Z, over="[0, 0.5]")
    case.write_text(SWAY.replace('"4*cos(6*t)"', "-4") + fit)
    assert main(["uncertainty", str(case), "--observe", "fall", "-o", str(tmp_path / "out")]) == 0
    out = capsys.readouterr().out
    assert "not settled: over the two halves of its window" in out
    assert "fall = -" in out
    rows = list(csv.DictReader((tmp_path / "out" / "uncertainty.csv").open()))
    assert {row["source"] for row in rows} == {"step", "nodes", "outputs"}
    told = json.loads((tmp_path / "out" / "uncertainty.json").read_text())["numbers"][0]
    assert told["bar_is_whole"] is True
    assert (tmp_path / "out" / "uncertainty.png").stat().st_size > 10_000


def test_levels_that_fail_leave_at_least_the_others(tmp_path, monkeypatch, capsys):
    """A finer level without its result: the source tells why, and the bar is a lower bound."""
    case = tmp_path / "sway.toml"
    case.write_text(SWAY)
    with pytest.raises(RunFailed):
        uncertainty(SWAY, tmp_path / "none", ["filament.rod.loads.force=[0,0,'1/(0.3 - t)']"], log=lambda line: None)
    monkeypatch.setattr(levels, "nodes", _too_many)
    assert main(["uncertainty", str(case), "--observe", "tip", "-o", str(tmp_path / "out")]) == 0
    out = capsys.readouterr().out
    assert "+- at least" in out
    assert "not known" in out
    assert "nodes" in out[out.index("not known") - 40 :]


def _too_many(base, under):
    """A direction none of whose levels can be read."""
    there = NODES(base, under)
    return there._replace(overrides=lambda level: ("filament.rod.nodes=1",))


NODES = levels.nodes


def test_thermal_numbers_scatter_between_blocks_and_hide_the_rest(tmp_path):
    chance = SWAY + "[thermal]\nenergy = 1e-7\nseed = 1\n" + seen("reach", "end_to_end", summary='"mean"')
    found, whole = bars(chance, tmp_path, observe=["reach", "tip"])
    assert whole.runs == 1
    assert source(found["reach"], "seeds").estimate.doubt > 0
    assert source(found["tip"], "seeds").estimate is None
    assert not found["reach"].whole
    again, whole = bars(chance, tmp_path, observe=["tip"], fine=True)
    assert whole.runs == 8
    values = source(again["tip"], "seeds").estimate.values
    assert source(again["tip"], "seeds").estimate.doubt == pytest.approx(2.3646 * np.std(values, ddof=1) / np.sqrt(8))


@pytest.mark.parametrize(("memories", "covered"), [(16, 0.88), (64, 0.94)])
def test_bars_of_chance_cover_the_mean_of_what_forgets_within_the_window(memories, covered, monkeypatch):
    """An Ornstein-Uhlenbeck series of mean zero, ``memories`` times as long as its memory (README)."""
    monkeypatch.setattr(sampling, "average", lambda one: True)
    trials, outputs, chance = 800, 400, np.random.default_rng(3)
    keep, time = np.exp(-memories / outputs), np.linspace(0, 1, outputs)
    x = chance.standard_normal((outputs, trials))
    for k in range(1, outputs):
        x[k] = keep * x[k - 1] + np.sqrt(1 - keep**2) * x[k]
    inside = [abs(one.mean()) <= _doubt(time, one) for one in x.T]
    assert np.mean(inside) == pytest.approx(covered, abs=0.025)


def _doubt(time, series):
    def over(name, start, end):
        return {"mean": float(series[(time >= start) & (time <= end)].mean())}

    observable = SimpleNamespace(over=None)
    run = SimpleNamespace(numbers=lambda: {"mean": 0.0}, observables={"mean": observable}, time=time, over=over)
    return sampling.blocks(run)["mean"].estimate.doubt


def test_rods_together_are_refined_together(tmp_path):
    """All filaments take the same level at once, those of other lengths too."""
    second = "[filament.two]\nlength = 0.5\nnodes = 9\nbending = 0.2\nstretching = 1e3\nposition = [0, 1, 0]\n"
    both = second + SWAY.replace('kind = "position"', 'kind = "position"\nfilament = "rod"')
    found, _ = bars(both + "", tmp_path, "filament.two.loads={weight=[0,0,-1]}", observe=["tip"])
    assert found["tip"].whole
    fine = tmp_path / "runs" / "nodes_fine.h5"
    from ibfil.io.reader import RunFile

    with RunFile(fine) as run:
        assert {name: f.nodes for name, f in run.case.filaments.items()} == {"two": 17, "rod": 33}


def test_refusals(tmp_path):
    bare = SWAY[: SWAY.index("[observe")]
    with pytest.raises(CaseError, match=r"\[observe\]: found none"):
        uncertainty(bare, tmp_path)
    with pytest.raises(CaseError, match="--observe: found top; allowed: tip, aside"):
        uncertainty(SWAY, tmp_path, observe=["top"])


def test_a_scene_moved_as_a_whole_feels_what_it_felt():
    """Springs to places in the lab, of ends and of links, go with it; left behind they would pull."""
    ends = "[filament.rod.start]\nspring = { stiffness = 3.0, to = [0.1, 0.2, 0.0] }\n"
    sites = '[{ filament = "rod", at = "finish" }, { point = [1.2, 0.1, 0.3] }]'
    tied = f"[link.tie]\nbetween = {sites}\nstiffness = 5.0\nrest = 0.1\n"
    simulation = Simulation(parse_case(rod(17, 1e3, ends=ends) + RFT + until(0.5, 0.02, 0.05) + tied, "tied.toml"))
    shift = np.array([0.3, -0.2, 0.7])
    there = Simulation(parse_case(simulation.case.text, "moved.toml", place.moved(simulation, shift)))
    here, moved = (one.snapshot().filaments["rod"] for one in (simulation, there))
    assert np.abs(here.force).max() > 0.1
    assert moved.position == pytest.approx(here.position + shift, abs=1e-12)
    assert moved.force == pytest.approx(here.force, abs=1e-9)


def test_a_cloud_of_markers_goes_with_a_scene_moved_as_a_whole(tmp_path):
    """Also one without a position, which is at the origin: left there it would be elsewhere in its filament's frame."""
    np.savetxt(tmp_path / "markers.csv", 0.1 * np.eye(4, 3), delimiter=",", header="x,y,z", comments="")
    ends = '[filament.rod.start]\nend = "body"\nbody = "head"\n'
    head = '[body.head]\nshape = { kind = "file", path = "markers.csv" }\n'
    head += "resistance = { translation = [1, 1, 1], rotation = [1, 1, 1] }\n"
    text, name = rod(17, 1e3, ends=ends) + RFT + until(0.5, 0.02, 0.05) + head, str(tmp_path / "cloud.toml")
    simulation, shift = Simulation(parse_case(text, name)), np.array([0.01, -0.02, 0.03])
    there = Simulation(parse_case(simulation.case.text, name, place.moved(simulation, shift)))
    here, moved = (one.snapshot() for one in (simulation, there))
    assert moved.filaments["rod"].position == pytest.approx(here.filaments["rod"].position + shift, abs=1e-12)
    assert moved.bodies["head"].position == pytest.approx(here.bodies["head"].position + shift, abs=1e-12)
