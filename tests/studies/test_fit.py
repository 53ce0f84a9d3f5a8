"""`ibfil fit` on twins: runs whose parameters are known, made into data."""

from __future__ import annotations

import json

import numpy as np
import pytest
from helpers.swung import BOUNDS, SWUNG, TRUTH, table

import ibfil
from ibfil.commands import main
from ibfil.errors import CaseError, RunFailed
from ibfil.io.reader import RunFile
from ibfil.studies.fit.study import fit


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    path = tmp_path_factory.mktemp("fit") / "swung.toml"
    path.write_text(SWUNG)
    return path


@pytest.fixture(scope="module")
def track(case):
    """The twin's nodes (frames, nodes, 3), times and arclengths; its first output left out."""
    ibfil.run(case, case.with_suffix(".h5"), overrides=TRUTH)
    with RunFile(case.with_suffix(".h5")) as run:
        return np.asarray(run.position("rod"))[1:], run.time[1:], run.arclength("rod")


def test_without_noise_the_truth_comes_back_and_a_cut_fit_goes_on(case, track, tmp_path, capsys):
    data = tmp_path / "tracked.csv"
    data.write_text(table(track))
    words = ["fit", str(case), "-o", str(tmp_path / "out"), "--data", str(data)]
    words += [f"--vary={key}={low},{high}" for key, (low, high) in BOUNDS.items()]
    assert main.main(words) == 0
    out = capsys.readouterr().out
    found = json.loads((tmp_path / "out" / "fit.json").read_text())
    for one in found["parameters"]:
        assert one["value"] == pytest.approx(TRUTH[one["key"]], rel=1e-6)
    assert found["runs"] <= 37  # three a look of two parameters, two, and a finer step and more nodes
    assert "A=1 " in out
    assert {"fit.csv", "fit.png", "fit.pdf"} <= {path.name for path in (tmp_path / "out").iterdir()}
    runs = sorted((tmp_path / "out" / "runs").iterdir())
    runs[2].unlink()
    assert main.main(words) == 0  # what is there is kept, what is not is made again
    again = json.loads((tmp_path / "out" / "fit.json").read_text())
    assert again == found
    assert capsys.readouterr().out.count("finished in") == 1


def test_noise_has_intervals_and_a_turned_camera_is_turned_back(case, track, tmp_path):
    data = tmp_path / "tracked.csv"
    data.write_text(table(track, 0.005, seed=4, turn=0.3))
    result = fit(str(case), BOUNDS, tmp_path / "out", data, align="start", log=str)
    for one in result.parameters:
        low, high = one.interval
        assert low < TRUTH[one.parameter.key] < high
        assert 0.001 < one.half_width < 0.3
    assert result.rms == pytest.approx(0.005 * 2**0.5, rel=0.2)
    assert result.spread.blocks > 4
    assert result.notes == ()
    alone = {"parameters.amplitude": BOUNDS["parameters.amplitude"]}
    straight = fit(str(case), alone, tmp_path / "not_turned", data, log=str)
    assert straight.rms > 5 * result.rms


def test_what_shapes_do_not_tell_apart_is_said(case, track, tmp_path):
    """Shapes depend on A/zeta alone."""
    data = tmp_path / "tracked.csv"
    data.write_text(table(track, 0.002, seed=1))
    vary = {"parameters.A": (0.1, 10.0), "parameters.zeta": (1.0, 100.0)}
    result = fit(str(case), vary, tmp_path / "out", data, ["parameters.amplitude=0.2"], log=str)
    a, zeta = (one.value for one in result.parameters)
    assert a / zeta == pytest.approx(1 / 12, rel=0.05)
    assert all(one.word == "not determined by these data" for one in result.parameters)
    assert "A^0.71 parameters.zeta^0.71" in result.tied[0]
    assert "correlation +1.000" in result.tied[-1]


def test_a_measured_number_gives_a_parameter_its_own_error(tmp_path):
    """The pull on a towed rod is 2 pi eta V L exactly: 5 % of it are 5 % of eta."""
    pull = 2 * np.pi * 0.4 * 1.7
    result = fit("towed", {"fluid.viscosity": (0.1, 10.0)}, tmp_path, observe={"pull": (pull, 0.05 * pull)}, log=str)
    (one,) = result.parameters
    assert one.value == pytest.approx(1.7, rel=1e-4)
    assert np.log(np.array(one.interval) / 1.7) == pytest.approx([-0.098, 0.098], rel=2e-3)
    assert one.word == ""


def test_a_bound_in_the_way_is_told(tmp_path):
    result = fit("towed", {"fluid.viscosity": (0.5, 1.2)}, tmp_path, observe={"pull": (4.3, 0.1)}, log=str)
    assert result.parameters[0].interval is None
    assert "upper bound" in result.parameters[0].word
    assert result.values["fluid.viscosity"] == pytest.approx(1.2, rel=1e-4)


@pytest.mark.slow
def test_jobs_do_not_change_a_bit(case, track, tmp_path):
    data = tmp_path / "tracked.csv"
    data.write_text(table(track, 0.01, seed=2))
    one, two = (fit(str(case), BOUNDS, tmp_path / str(n), data, jobs=n, log=str) for n in (1, 2))
    assert one.values == two.values
    np.testing.assert_array_equal(one.spread.covariance, two.spread.covariance)


@pytest.mark.slow
def test_intervals_of_whole_fits_cover(case, track, tmp_path):
    inside = []
    for seed in range(20):
        data = tmp_path / f"{seed}.csv"
        data.write_text(table(track, 0.01, seed=100 + seed))
        result = fit(str(case), BOUNDS, tmp_path / str(seed), data, log=str)
        inside += [one.interval[0] < TRUTH[one.parameter.key] < one.interval[1] for one in result.parameters]
    assert np.mean(inside) >= 0.85  # of 40; at 0.95 fewer would be once in 250


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"data": None}, "found neither --data nor --observe"),
        ({"vary": {}}, "--vary: found none"),
        ({"vary": {"fluid.model": (1, 2)}}, r"--vary fluid\.model: found the word 'rft'"),
        ({"vary": {"parameters.A": (2, 1)}}, "the lower one first"),
        ({"vary": {"parameters.A": (2, 3)}}, r"the case has 1\.3; allowed: bounds around it"),
        ({"vary": {"parameters.B": (2, 3)}}, "B"),
        ({"vary": {"fluid.box": (2, 3)}}, "fluid.box"),
        ({"align": "all"}, "--align all: found no such; allowed: none, start, each"),
        ({"scale": -1.0}, "--scale -1"),
        ({"observe": {"tip_x": (1, 1)}}, "with --error"),
        ({"data": None, "observe": {"top": (1.0, 1.0)}}, "--observe top: found no such number; allowed: tip_x"),
        ({"data": None, "observe": {"tip_x": (1.0, 1.0)}}, "found 1 numbers in the data; allowed: at least 2"),
        ({"rate": 0.01}, r"found t = 100000; allowed: 0 to time\.end = 1"),
    ],
)
def test_what_cannot_be_fitted_is_one_line(case, tmp_path, changes, line):
    data = tmp_path / "tracked.csv"
    data.write_text("t,x,y\n1000,0,0\n1000,1,0\n")
    asked = {"vary": BOUNDS, "data": data, "rate": 1000.0, **changes}
    with pytest.raises(CaseError, match=line) as caught:
        fit(str(case), asked.pop("vary"), tmp_path / "out", asked.pop("data"), log=str, **asked)
    assert len(caught.value.faults) == 1


def test_a_run_that_fails_at_the_start_is_told_with_its_place(case, tmp_path):
    data = tmp_path / "tracked.csv"
    data.write_text("t,x,y\n1,0,0\n1,1,0\n")
    explicit = ["time.scheme=explicit", "time.step=0.1"]
    with pytest.raises((RunFailed, CaseError), match=r"fit: the run fails at parameters\.A = 1\.3"):
        fit(str(case), BOUNDS, tmp_path / "out", data, explicit, log=str)


@pytest.mark.parametrize("word", ["parameters.A", "parameters.A=1", "parameters.A=1,x", "=1,2"])
def test_bounds_are_two_numbers(case, word, capsys):
    assert main.main(["fit", str(case), "--vary", word, "--data", "x.csv"]) == 2
    assert "allowed" in capsys.readouterr().err
